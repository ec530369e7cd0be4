# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Where machine code is kept, and which folders are trusted.

What is found in a cache is unpickled, so whoever can write there can run code as the user. Only
a folder that belongs to the user, and that nobody else can write, is written and read; one that
belongs to root, and that nobody else can write, is read too, so that a service image may bring its
kernels. Where there is no such folder, kernels are compiled anew in every process; so is, once, a
kernel whose file is damaged, which its digest tells before anything of it is used.

A wheel brings the entry points, compiled for the processors of PORTABLE_CPU and for one version of
numba. They are trusted where nobody can write them who cannot write this module. Where there are
none for this Python, numba, processor and sources, nothing is different but the time it takes.

"""

import errno
import hashlib
import logging
import os
import pickle
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numba
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from stickslip_ros.sources import sources_digest

CONFIG: Any = numba.config
"""Settings of numba; its attributes are made at run time."""
ROOT_USER = 0
PRIVATE, READABLE, FILE_MODE = 0o700, 0o755, 0o644
OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
PORTABLE_CPU = 'x86-64-v3'
"""Processors for which a wheel brings entry points: those of x86-64 since 2015, nearly all."""
PORTABLE_FEATURES = frozenset(
    f'+{name}' for name in ('avx2', 'bmi', 'bmi2', 'f16c', 'fma', 'lzcnt', 'movbe', 'popcnt')
)
"""What these have, as LLVM names it; avx2 comes with all that is older."""
DIGEST_BYTES = hashlib.sha256().digest_size


class Folders(NamedTuple):
    """
    Folders of the compiled kernels.

    Attributes
    ----------
    read : tuple of Path
        Trusted ones, in the order in which they are asked.
    write : Path or None
        The one that takes new kernels; the last of those that are read.
    brought : Path or None
        The one that a wheel has brought.

    """

    read: tuple[Path, ...]
    write: Path | None
    brought: Path | None = None


@lru_cache(maxsize=1)
def cache_folders() -> Folders:
    """
    Return the trusted folders: in the place asked for, in the package, in the user's cache.

    numba looks only at the file of a function to see whether its machine code is stale, not at
    the files of the kernels that it calls. So the folders are named after all of their sources.

    """
    read: list[Path] = []
    folder, module = _package() / 'kernels' / _name(), Path(__file__).stat()
    is_closed = _is_trusted(folder, module.st_uid, OTHERS_WRITE & ~module.st_mode)
    brought = folder if is_closed else None
    for place in _places():
        folder = place / _name()
        with suppress(OSError):  # only this user can write it; root's can be read
            folder.parent.mkdir(parents=True, exist_ok=True)
            folder.mkdir(mode=READABLE if os.geteuid() == ROOT_USER else PRIVATE)
        is_own = _is_trusted(folder, os.geteuid())
        if is_own or _is_trusted(folder, ROOT_USER):
            read.append(folder)
        if is_own and os.access(folder, os.W_OK):
            return Folders(tuple(read), folder, brought)
    return Folders(tuple(read), None, brought)


def why_not_kept() -> str:
    """Return why kernels cannot be kept on the disk, and what to do; empty if they can."""
    if cache_folders().write is not None:
        return ''
    tried = ', '.join(str(place) for place in _places())
    return (
        'compiled kernels are kept for this process only: none of the folders '
        f'{_name()} in {tried} belongs to you and is closed to others; set NUMBA_CACHE_DIR'
    )


def _places() -> list[Path]:
    """Return the places that may have such a folder."""
    asked = [Path(CONFIG.CACHE_DIR)] if CONFIG.CACHE_DIR else []
    places = [*asked, _package() / '__pycache__']
    with suppress(RuntimeError):  # a user without a home
        places.append(Path(os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache'))
    return places


def _package() -> Path:
    return Path(__file__).resolve().parent.parent


def _name() -> str:
    return f'stickslip_ros-{sources_digest(_package())}'


# Now, and not at the first kernel: sources may change while a program runs.
sources_digest(_package())


def _is_trusted(folder: Path, owner: int, closed: int = OTHERS_WRITE) -> bool:
    """Return whether a folder and all in it belong to a user, and are closed to some others."""
    try:
        entries = [folder.lstat(), *_entries(folder)]
    except OSError:
        return False
    if not stat.S_ISDIR(entries[0].st_mode):
        return False
    return all(each.st_uid == owner and not each.st_mode & closed for each in entries)


def _entries(folder: Path) -> Iterator[os.stat_result]:
    for entry in os.scandir(folder):
        with suppress(FileNotFoundError):  # of another process that has just renamed it
            yield entry.stat(follow_symlinks=False)


class KernelCache(NullCache):
    """
    What numba asks for the machine code of one kernel: a file for each signature, named after it.

    numba counts them and keeps an index: of two processes that compile at the same time, each for
    a signature of its own, one could find the machine code of the other, for ever. And it has no
    means to tell a file that is not whole.

    Parameters
    ----------
    function : callable
        The kernel.
    kind : str
        Tells apart what is compiled of one function in several ways.

    """

    _has_warned = False

    def __init__(self, function: Callable[..., Any], kind: str) -> None:
        self._function = function
        self._kind = kind

    @property
    def cache_path(self) -> str | None:
        """Folder that takes the machine code; None if there is none."""
        folder = cache_folders().write
        return str(folder) if folder else None

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """
        Return what was compiled for a signature, None if nothing was or it is not whole.

        numba calls ``target_context.refresh()`` before it. That imports and registers all that
        numba can compile, which takes most of the time to load all kernels; machine code needs
        none of it, and compiling refreshes by itself.

        """
        broken: OSError | None = None
        folders, made_for = cache_folders(), target_context.codegen().magic_tuple()
        places = [(folder, made_for) for folder in folders.read]
        triple, _, features = made_for
        if folders.brought and PORTABLE_FEATURES.issubset(features.split(',')):
            places.append((folders.brought, (triple, PORTABLE_CPU, '')))
        for folder, processor in places:
            path = folder / self._name_of(sig, processor)
            try:
                kept = pickle.loads(load_whole(path))
                return CompileResult._rebuild(target_context, *kept)  # noqa: SLF001
            except FileNotFoundError:
                continue
            except OSError as error:
                broken = error
            except Exception:  # noqa: BLE001 - nobody lists what garbage may raise
                broken = OSError(errno.EBADMSG, 'damaged', str(path))
        if broken is not None and not KernelCache._has_warned:
            KernelCache._has_warned = True
            logging.getLogger(__name__).warning(
                'compiled kernel %s: %s; it is compiled anew, with others like it',
                broken.filename,
                broken.strerror,
            )
        return None

    def save_overload(self, sig: Any, compiled: Any) -> None:
        """Keep what was compiled for a signature; a full disk keeps nothing."""
        folder = cache_folders().write
        if folder is not None and not compiled.library.has_dynamic_globals:
            with suppress(OSError):
                data = dumps(compiled._reduce())  # noqa: SLF001
                save_whole(folder / self._name_of(sig, compiled.codegen.magic_tuple()), data)

    def _name_of(self, sig: Any, processor: tuple[str, str, str]) -> str:
        function = self._function
        cells = tuple(each.cell_contents for each in function.__closure__ or ())
        key = (numba.__version__, sig, processor, function.__code__.co_code)
        digest = hashlib.sha256(repr(key).encode() + (dumps(cells) if cells else b''))
        name = f'{function.__module__}.{function.__qualname__}-{function.__code__.co_firstlineno}'
        return f'{name}.{sys.implementation.cache_tag}-{self._kind}-{digest.hexdigest()[:16]}.nbc'


def load_whole(path: Path) -> bytes:
    """
    Return what ``save_whole`` has written.

    Raises
    ------
    OSError
        If there is no such file, or it cannot be read, or is damaged.

    """
    kept = path.read_bytes()
    if _digest(path, kept[DIGEST_BYTES:]) != kept[:DIGEST_BYTES]:
        raise OSError(errno.EBADMSG, 'damaged', str(path))
    return kept[DIGEST_BYTES:]


def _digest(path: Path, data: bytes) -> bytes:
    """Return a digest of data and name: under another one, machine code takes other arguments."""
    return hashlib.sha256(path.name.encode() + data).digest()


def save_whole(path: Path, data: bytes) -> None:
    """Write a file with its digest in front, which nobody else can write, whatever the umask."""
    with tempfile.NamedTemporaryFile(dir=path.parent, prefix=path.name, delete=False) as file:
        part = Path(file.name)
        try:
            file.write(_digest(path, data) + data)
            file.flush()
            os.fchmod(file.fileno(), FILE_MODE)
            os.fsync(file.fileno())
            if path.is_dir():
                shutil.rmtree(path)
            part.replace(path)
        except OSError:
            part.unlink()
            raise
