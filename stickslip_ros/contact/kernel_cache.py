"""
Where machine code is kept, and which folders are trusted.

numba unpickles what it finds in a cache, so whoever can write there can run code as the user. Only
a folder that belongs to the user, and that nobody else can write, is written and read; one that
belongs to root, and that nobody else can write, is read too, so that a service image may bring its
kernels. Where there is no such folder, kernels are compiled anew in every process.

"""

import hashlib
import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numba
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    NullCache,
    _CacheLocator,
    _SourceFileBackedLocatorMixin,
)

from stickslip_ros.sources import sources_digest

CONFIG: Any = numba.config
"""Settings of numba; its attributes are made at run time."""
ALL_KEPT = 'all'
"""Name of the file that says so."""
ROOT = 0
PRIVATE, READABLE, FILE_MODE = 0o700, 0o755, 0o644
OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


class Folders(NamedTuple):
    """
    Folders of the compiled kernels.

    Attributes
    ----------
    read : tuple of Path
        Trusted ones, in the order in which they are asked.
    write : Path or None
        The one that takes new kernels; the last of those that are read.

    """

    read: tuple[Path, ...]
    write: Path | None


@lru_cache(maxsize=1)
def cache_folders() -> Folders:
    """
    Return the trusted folders: in the place asked for, in the package, in the user's cache.

    numba looks only at the file of a function to see whether its machine code is stale, not at
    the files of the kernels that it calls. So the folders are named after all of their sources.

    """
    read: list[Path] = []
    for place in _places():
        folder = place / _name()
        _make(folder)
        is_own = _is_trusted(folder, os.geteuid())
        if is_own or _is_trusted(folder, ROOT):
            read.append(folder)
        if is_own and os.access(folder, os.W_OK):
            return Folders(tuple(read), folder)
    return Folders(tuple(read), None)


def note_all_kept() -> None:
    """Note in the folder that takes new kernels that all kernels of the package are there."""
    folder = cache_folders().write
    if folder is not None and not are_all_kept():
        with suppress(OSError):
            (folder / ALL_KEPT).touch(FILE_MODE)


def are_all_kept() -> bool:
    """Return whether all kernels of the package have been compiled into a folder that is read."""
    return any((folder / ALL_KEPT).exists() for folder in cache_folders().read)


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
    return f'stickslip_ros-{_digest(_package())}'


_digest = lru_cache(maxsize=1)(sources_digest)
_digest(_package())  # now, and not at the first kernel: sources may change while a program runs


def _make(folder: Path) -> None:
    """Make a folder that only this user can write, if that can be done; root's can be read."""
    with suppress(OSError):
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(mode=READABLE if os.geteuid() == ROOT else PRIVATE)


def _is_trusted(folder: Path, owner: int) -> bool:
    """Return whether a folder and all in it belong to a user, and nobody else can write them."""
    try:
        entries = [folder.lstat(), *_entries(folder)]
    except OSError:
        return False
    if not stat.S_ISDIR(entries[0].st_mode):
        return False
    return all(each.st_uid == owner and not each.st_mode & OTHERS_WRITE for each in entries)


def _entries(folder: Path) -> Iterator[os.stat_result]:
    for entry in os.scandir(folder):
        with suppress(FileNotFoundError):  # of another process that has just renamed it
            yield entry.stat(follow_symlinks=False)


class KernelCache(NullCache):
    """
    What numba asks for the machine code of one kernel.

    Parameters
    ----------
    function : callable
        The kernel.
    kind : str
        Tells apart what is compiled of one function in several ways.

    """

    def __init__(self, function: Callable[..., Any], kind: str) -> None:
        self._function = function
        self._kind = kind

    @property
    def cache_path(self) -> str | None:
        """Folder that takes the machine code; None if there is none."""
        folder = cache_folders().write
        return str(folder) if folder else None

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what was compiled for a signature, None if nothing was."""
        for folder in cache_folders().read:
            found = _Store(self._function, self._kind, folder).load_overload(sig, target_context)
            if found is not None:
                return found
        return None

    def save_overload(self, sig: Any, compiled: Any) -> None:
        """Keep what was compiled for a signature; a full disk keeps nothing."""
        folder = cache_folders().write
        if folder is not None:
            with suppress(OSError):
                _Store(self._function, self._kind, folder).save_overload(sig, compiled)


class _Locator(_SourceFileBackedLocatorMixin, _CacheLocator):
    """Names of files; the folder comes from ``_Store``, which has looked at it."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        self._py_file = file
        self._lineno = function.__code__.co_firstlineno

    def get_cache_path(self) -> str:
        return ''

    def ensure_cache_path(self) -> None:
        pass

    def get_disambiguator(self) -> str:
        return f'{Path(self._py_file).parent.name}-{self._lineno}'


class _Form(CompileResultCacheImpl):
    def __init__(self, function: Callable[..., Any]) -> None:
        self._locator_classes = [_Locator]
        super().__init__(function)


class _Files(IndexDataCacheFile):
    """
    The files of one kernel: one for each signature, named after it.

    numba counts them and keeps an index: of two processes that compile at the same time, each for
    a signature of its own, one could find the machine code of the other, for ever.

    """

    def load(self, key: Any) -> Any:
        """Return what was kept under a key, None if nothing was."""
        with suppress(FileNotFoundError):
            return self._load_data(self._name_of(key))
        return None

    def save(self, key: Any, data: Any) -> None:
        """Keep something under a key."""
        self._save_data(self._name_of(key), data)

    def _name_of(self, key: Any) -> str:
        digest = hashlib.sha256(repr((numba.__version__, key)).encode()).hexdigest()
        return f'{Path(self._index_name).stem}-{digest[:16]}.nbc'

    @contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[Any]:
        """Open a file that nobody else can write, whatever the umask."""
        with super()._open_for_write(filepath) as file:
            os.fchmod(file.fileno(), FILE_MODE)
            yield file


class _Store(FunctionCache):
    """The files of one kernel in one folder."""

    _impl_class = _Form

    def __init__(self, function: Callable[..., Any], kind: str, folder: Path) -> None:
        super().__init__(function)
        self._cache_file = _Files(str(folder), f'{self._impl.filename_base}-{kind}', None)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """
        Return what was compiled, without ``target_context.refresh()`` before it.

        That imports and registers all that numba can compile, which takes most of the time to
        load all kernels; machine code needs none of it, and compiling refreshes by itself.

        """
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)
