"""How every kernel of the package is compiled, and where the machine code is kept."""

import hashlib
import os
import tempfile
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numba

Function = TypeVar('Function', bound=Callable[..., Any])

CONFIG: Any = numba.config
"""Settings of numba; its attributes are made at run time."""

OPTIONS: dict[str, Any] = {
    'cache': True,
    'nogil': True,
    'error_model': 'numpy',
    'forceinline': True,
    '_nrt': False,
}
"""Compiled once and kept on disk; without the GIL; IEEE division; calls folded into the loop;
without numba's memory runtime, which spends two thirds of the time on counting references."""

KERNEL_FOLDERS = ('contact', 'drive', 'instrument')
"""Sub-packages whose sources a compiled kernel may depend on."""


def kernel(function: Function) -> Function:
    """
    Compile a function to machine code, with the same options everywhere.

    Kernels take SI floats and NamedTuples and never raise. They cannot allocate: without the
    memory runtime a kernel that tries to does not compile.

    """
    return _compile(function, OPTIONS)


def kernel_apart(function: Function) -> Function:
    """
    Compile a kernel that is called, not folded into its callers: long ways off the fast path.

    What it keeps in registers is not taken from the loops of its callers.

    """
    return _compile(function, OPTIONS | {'forceinline': False})


def _compile(function: Function, options: dict[str, Any]) -> Function:
    usual_dir = CONFIG.CACHE_DIR
    CONFIG.CACHE_DIR = str(cache_dir())
    try:
        compiled: Function = numba.njit(**options)(function)
    finally:
        CONFIG.CACHE_DIR = usual_dir
    return compiled


@lru_cache(maxsize=1)
def cache_dir() -> Path:
    """
    Return the folder of the compiled kernels.

    numba looks only at the file of a function to see whether its machine code is stale, not at
    the files of the kernels that it calls. So the folder is named after all of their sources.

    """
    package = Path(__file__).resolve().parent.parent
    digest = hashlib.sha256()
    for folder in KERNEL_FOLDERS:
        for source in sorted((package / folder).glob('*.py')):
            digest.update(source.read_bytes())
    name = f'stickslip_ros-{digest.hexdigest()[:16]}'
    return _writable(package) / name


def _writable(package: Path) -> Path:
    """Return the first place that can be written: asked for, package, user cache, temporary."""
    asked = [Path(CONFIG.CACHE_DIR)] if CONFIG.CACHE_DIR else []
    user = Path(os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache')
    for place in (*asked, package / '__pycache__', user):
        try:
            place.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(place, os.W_OK):
            return place
    return Path(tempfile.gettempdir())
