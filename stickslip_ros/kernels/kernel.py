# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""How every kernel of the package is compiled."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any, TypeVar, cast

import numba
import numpy as np
from llvmlite.binding import parse_assembly
from numba.core import cgutils, event, typed_passes, types, untyped_passes
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import PassManager
from numba.core.registry import CPUDispatcher
from numba.extending import intrinsic
from numba.np.numpy_support import from_dtype

from stickslip_ros.kernels.cache import CONFIG, KernelCache
from stickslip_ros.kernels.record import Kind

Function = TypeVar('Function', bound=Callable[..., Any])

OPTIONS: dict[str, Any] = {
    'nogil': True,
    'error_model': 'numpy',
    'forceinline': True,
    '_nrt': False,
}
"""Without the GIL; IEEE division; calls folded into the loop; without numba's memory runtime,
which spends two thirds of the time on counting references."""

_TRIED = 0, 68
"""The newest numba of which the private methods below are known; so are those of 0.58."""
ALIGNED = 64
"""Bytes between which a record on the stack begins: a line of the cache."""


class _Part(JITCodeLibrary):
    """
    The code of a kernel that only kernels call: it is optimised in entry points, not before.

    Of machine code it has only the places in which numba keeps what exceptions need.

    """

    def _optimize_final_module(self) -> None: ...

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True
        whole = self._get_module_for_linking().global_variables
        places = [str(each) for each in whole if each.name.startswith('_ZN08NumbaEnv')]
        self._final_module = parse_assembly('\n'.join(places))
        super()._finalize_final_module()


_PASSES = (
    untyped_passes.TranslateByteCode,
    untyped_passes.FixupArgs,
    untyped_passes.IRProcessing,
    untyped_passes.GenericRewrites,
    untyped_passes.ReconstructSSA,
    typed_passes.NopythonTypeInference,
    typed_passes.PreLowerStripPhis,
    typed_passes.NoPythonSupportedFeatureValidation,
    typed_passes.IRLegalization,
    typed_passes.NativeLowering,
    typed_passes.NoPythonBackend,
)
"""Those of numba's passes that change anything of a kernel, which has no closure, context or
array expression; the others, which look for such, take a seventh of the time."""


class _PartCompiler(Compiler):
    def __init__(self, typing: Any, target: Any, _: Any, *rest: Any) -> None:
        library = _Part(target.codegen(), 'kernel')
        library.enable_object_caching()
        super().__init__(typing, target, library, *rest)

    def define_pipelines(self) -> list[PassManager]:
        """Return the passes in their order."""
        passes = PassManager('kernel')
        for each in _PASSES:
            passes.add_pass(each, each.__name__)
        passes.finalize()
        return [passes]


FOR_KERNELS: dict[str, Any] = dict.fromkeys(('no_cpython_wrapper', 'no_cfunc_wrapper'), True)
"""Without the code that takes arguments from Python: for a hundred fields of records it takes
longer to compile than the kernel."""
if numba.version_info.short <= _TRIED:  # optimised on each level all take half as long again
    FOR_KERNELS['pipeline_class'] = _PartCompiler


class EntryPoint(CPUDispatcher):
    """A kernel that Python calls."""

    def enable_caching(self) -> None:
        """Keep the machine code where the package keeps it."""
        self._cache = KernelCache(self.py_func, 'entry')

    def typeof_pyval(self, val: Any) -> Any:
        """Return the type of an argument; to make that of a drive takes numba long."""
        if type(val) is tuple:
            each = tuple(map(self.typeof_pyval, val))
            return types.BaseTuple.from_types(each)
        is_plain = isinstance(val, np.ndarray) and val.ndim == 1 and val.flags.carray
        return _type_of_records(val.dtype) if is_plain else super().typeof_pyval(val)


@cache
def _type_of_records(kind: Any) -> Any:
    return numba.typeof(np.empty(1, kind))


class InnerKernel(CPUDispatcher):
    """A kernel that only kernels can call: a call from Python would end the process."""

    def enable_caching(self) -> None:
        """Keep the machine code where the package keeps it."""
        self._cache = KernelCache(self.py_func, 'kernel')

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Compile a kernel once for a type, not for each constant that it is called with."""
        named = {name: types.unliteral(each) for name, each in kws.items()}
        return super().get_call_template(tuple(map(types.unliteral, args)), named)

    def __call__(self, *_arguments: Any, **_named: Any) -> Any:
        """Refuse a call from Python."""
        raise TypeError(not_for_python(self))


def not_for_python(inner: Any) -> str:
    """Return why Python does not call a kernel, and what to do."""
    name = inner.py_func.__name__
    return (
        f'{name} is compiled for other kernels only; call entry_point({name}), or '
        f'in_python({name}) if it calls no other kernel'
    )


def kernel(function: Function) -> Function:
    """
    Compile a function for other kernels, with the same options everywhere.

    Kernels take SI floats, records, and NamedTuples of a few numbers, and never raise. They cannot
    allocate: without the memory runtime a kernel that tries to does not compile. Python calls an
    ``entry_point``.

    """
    return _compile(function, InnerKernel, OPTIONS | FOR_KERNELS)


def kernel_apart(function: Function) -> Function:
    """
    Compile a kernel that is called, not inlined: for long code off the fast path.

    What it keeps in registers is not taken from the loops of its callers.

    """
    return _compile(function, InnerKernel, OPTIONS | FOR_KERNELS | {'forceinline': False})


def entry_point(function: Function) -> Function:
    """Compile a function, or another time a kernel, for Python as well as for kernels."""
    return _compile(in_python(function), EntryPoint, OPTIONS)


def on_stack(of: Kind) -> Callable[[], Any]:
    """
    Return a function by which a kernel gets a record of zeros that ends with it.

    The compiler knows that nothing else writes to it, and keeps in registers what fits there.

    """
    if CONFIG.DISABLE_JIT:
        return lambda: np.zeros(1, of)[0]
    record = from_dtype(of)

    @intrinsic
    def zeros(_: Any) -> Any:
        def make(context: Any, builder: Any, *_: Any) -> Any:
            room = cgutils.alloca_once(builder, context.get_data_type(record))
            room.align = ALIGNED
            cgutils.memset(builder, room, context.get_constant(types.intp, of.itemsize), 0)
            return room

        return record(), make

    return cast('Callable[[], Any]', zeros)


def in_python(function: Function) -> Function:
    """Return a kernel as it was written, for Python to interpret."""
    plain: Function = getattr(function, 'py_func', function)
    return plain


def _compile(
    function: Function, kind: type[EntryPoint | InnerKernel], options: dict[str, Any]
) -> Function:
    compiled: Any = numba.njit(**options)(function)
    if not CONFIG.DISABLE_JIT:
        compiled.__class__ = kind
        compiled.enable_caching()
    return cast('Function', compiled)


@contextmanager
def compilation_reported(report: Callable[[int], None]) -> Iterator[None]:
    """Call a function before each kernel that is compiled meanwhile, with how many were before."""
    with event.install_listener('numba:compile', _Counter(report)):
        yield


class _Counter(event.Listener):
    """Counts kernels; numba compiles functions of its own beside them."""

    def __init__(self, report: Callable[[int], None]) -> None:
        self._report = report
        self._done = 0

    def on_start(self, news: Any) -> None:
        """Report the next kernel."""
        if isinstance(news.data['dispatcher'], EntryPoint | InnerKernel):
            self._report(self._done)
            self._done += 1

    def on_end(self, news: Any) -> None:
        """Say nothing: kernels end within others."""
