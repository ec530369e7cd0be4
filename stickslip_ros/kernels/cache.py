# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Cache of machine code in trusted folders.

Files of a cache are unpickled, so write access to it means running code as the user. A folder is
read and written only if it belongs to the user, if others cannot write to it, and if others cannot
exchange a folder above it; a folder that only root can write is read too, so a service image can
include its kernels. On a system without owners of files the folder must lie below the user's home.
Without a trusted folder every process compiles its kernels. A digest detects damaged files; their
kernels are compiled again.

A wheel bundles the entry points, compiled for the processors of PORTABLE_CPU and one version of
numba. Without entry points for this Python, numba, processor and sources, the first start takes
longer.

"""

import errno
import hashlib
import logging
import os
import pickle
import stat
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from contextvars import ContextVar
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numba
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from stickslip_ros.sources import sources_digest

CONFIG: Any = numba.config
"""Settings of numba, whose attributes exist only at run time."""
ROOT_USER = 0
PRIVATE, READABLE, FILE_MODE = 0o700, 0o755, 0o644
OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
PORTABLE_CPU = 'x86-64-v3'
"""Processors of a wheel's entry points: nearly all of x86-64 since 2015."""
PORTABLE_FEATURES = frozenset(
    f'+{name}' for name in ('avx2', 'bmi', 'bmi2', 'f16c', 'fma', 'lzcnt', 'movbe', 'popcnt')
)
"""Their features in LLVM's names; avx2 implies all older ones."""
DIGEST_BYTES = hashlib.sha256().digest_size


def _user() -> int | None:
    """Return the number of this user; None on a system whose files have no owners."""
    return os.geteuid() if hasattr(os, 'geteuid') else None


class Folders(NamedTuple):
    """Folders of the compiled kernels."""

    read: tuple[Path, ...]  # trusted folders, in the order of look-up
    write: Path | None  # folder of new kernels; the last of ``read``
    bundled: Path | None = None  # folder of the kernels in a wheel


def _is_closed(folder: Path, *others: int) -> bool:
    """Return whether this user or one of ``others`` owns a folder, no link, as its only writer."""
    try:
        found = folder.lstat()
    except OSError:
        return False
    is_trusted = found.st_uid in (_user(), *others) and not found.st_mode & OTHERS_WRITE
    return stat.S_ISDIR(found.st_mode) and (_user() is None or is_trusted)


@lru_cache(maxsize=1)
def cache_folders() -> Folders:
    """
    Return the trusted folders in NUMBA_CACHE_DIR, in the package, and in the user's cache.

    Their name has a digest of all sources, because numba checks a function's own file for changes
    but not the files of the kernels that it calls.

    """
    read: list[Path] = []
    folder = _package() / 'kernels' / _name()
    bundled = folder if folder.is_dir() else None
    for place in map(Path, map(os.path.realpath, _places())):
        folder = place / _name()
        with suppress(OSError):
            place.mkdir(parents=True, exist_ok=True)
        if not _is_fixed(place):
            continue
        with suppress(OSError):  # closed to others, but readable if it is root's
            folder.mkdir(mode=READABLE if _user() == ROOT_USER else PRIVATE)
        if _is_closed(folder, ROOT_USER):
            read.append(folder)
        if _is_closed(folder) and os.access(folder, os.W_OK):
            return Folders(tuple(read), folder, bundled)
    return Folders(tuple(read), None, bundled)


def _is_fixed(place: Path) -> bool:
    """
    Return whether a folder and its content are safe from exchange by other users.

    Folders above this module are left out: whoever can exchange them can exchange the module. A
    group with the user's number is taken for this user alone, as with a umask of 002.

    """
    me, shared = _user(), Path(__file__).resolve().parents
    if me is None:
        return place.is_relative_to(Path.home().resolve())
    for each in (place, *place.parents):
        try:
            found = each.lstat()
        except OSError:
            return False
        closed = stat.S_IWOTH if found.st_gid == me else OTHERS_WRITE
        is_open = found.st_mode & closed and not found.st_mode & stat.S_ISVTX
        if each not in shared and (is_open or found.st_uid not in (me, ROOT_USER)):
            return False
    return True


def cache_problem() -> str:
    """Return why kernels cannot be kept on the disk and a remedy; empty if they can."""
    if cache_folders().write is not None:
        return ''
    tried = ', '.join(str(place) for place in _places())
    return (
        'compiled kernels are kept for this process only: '
        f'no folder {_name()} in {tried} is yours alone, below folders that others cannot write; '
        'set NUMBA_CACHE_DIR'
    )


def _places() -> list[Path]:
    """Return the parents of the cache folders."""
    places = [Path(CONFIG.CACHE_DIR)] if CONFIG.CACHE_DIR else []
    places.append(_package() / '__pycache__')
    with suppress(RuntimeError):  # a user without a home
        places.append(Path(os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache'))
    return places


def _package() -> Path:
    return Path(__file__).resolve().parent.parent


def _name() -> str:
    return f'stickslip_ros-{sources_digest(_package())}'


# At the import, because sources may change before the first kernel is used.
sources_digest(_package())


class NotKept(Exception):
    """A kernel is not on the disk."""


only_loads: ContextVar[bool] = ContextVar('only_loads', default=False)
"""Whether the present thread raises NotKept instead of compiling a kernel."""


class KernelCache(NullCache):
    """
    Cache of a kernel's machine code for numba: one file for each signature.

    numba's own cache numbers the files in an index. If two processes compile different signatures
    at the same time, one may load the machine code of the other; damage is not detected. ``kind``
    names the way in which the function is compiled: ``kernel`` or ``entry``.

    """

    _has_warned = False

    def __init__(self, function: Callable[..., Any], kind: str) -> None:
        self._function = function
        self._kind = kind

    @property
    def cache_path(self) -> str | None:
        """Folder of new machine code; None if no folder is trusted."""
        folder = cache_folders().write
        return str(folder) if folder else None

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """
        Return the compiled code of a signature; None if it is missing or damaged.

        Unlike numba's cache, this one does not call ``target_context.refresh()``, which would take
        most of the loading time: machine code does not need it, and compiling calls it anyway.

        """
        broken: tuple[Path, str] | None = None
        folders, made_for = cache_folders(), target_context.codegen().magic_tuple()
        places = [(folder, made_for) for folder in folders.read]
        triple, _, features = made_for
        if folders.bundled and PORTABLE_FEATURES.issubset(features.split(',')):
            places.append((folders.bundled, (triple, PORTABLE_CPU, '')))
        for folder, processor in places:
            path = folder / self._name_of(sig, processor)
            try:
                kept = pickle.loads(load_whole(path))
                return CompileResult._rebuild(target_context, *kept)  # noqa: SLF001
            except FileNotFoundError:
                continue
            except OSError as error:
                broken = path, str(error.strerror)
            except Exception:  # noqa: BLE001 - damaged data may raise anything
                broken = path, 'damaged'
        if broken is not None and not KernelCache._has_warned:
            KernelCache._has_warned = True
            logging.getLogger(__name__).warning(
                'compiled kernel %s: %s; it is compiled anew, with others like it', *broken
            )
        if only_loads.get():
            raise NotKept
        return None

    def save_overload(self, sig: Any, compiled: Any) -> None:
        """Save the compiled code of a signature; a full disk is no error."""
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
        name = name.replace('<', '(').replace('>', ')')  # as Windows wants it
        return f'{name}.{sys.implementation.cache_tag}-{self._kind}-{digest.hexdigest()[:16]}.nbc'


def load_whole(path: Path) -> bytes:
    """
    Return the data that ``save_whole`` has written.

    Raises OSError if the file is missing, unreadable or damaged.

    """
    kept = path.read_bytes()
    if _digest(path, kept[DIGEST_BYTES:]) != kept[:DIGEST_BYTES]:
        raise OSError(errno.EBADMSG, 'damaged', str(path))
    return kept[DIGEST_BYTES:]


def _digest(path: Path, data: bytes) -> bytes:
    """Return a digest of data and file name, because the name has the types of the arguments."""
    return hashlib.sha256(path.name.encode() + data).digest()


def save_whole(path: Path, data: bytes) -> None:
    """Write a file that starts with its digest and that only its owner can write."""
    number, name = tempfile.mkstemp(dir=path.parent, prefix=path.name)
    part = Path(name)
    try:
        with os.fdopen(number, 'wb') as file:
            file.write(_digest(path, data) + data)
        part.chmod(FILE_MODE)
        part.replace(path)
    except OSError:
        part.unlink()
        raise
