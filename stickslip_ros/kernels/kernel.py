# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Compile the kernels of the package."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, wraps
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
from stickslip_ros.kernels.record import RecordKind

Function = TypeVar('Function', bound=Callable[..., Any])

OPTIONS: dict[str, Any] = {
    'nogil': True,
    'error_model': 'numpy',
    'forceinline': True,
    '_nrt': False,
}
"""No GIL; IEEE division; inlined calls; no memory runtime of numba, whose reference counts take
two thirds of the time."""

_TRIED = 0, 68
"""Newest numba whose private methods are tested; the oldest is 0.58."""
ALIGNED = 64
"""Alignment of a record on the stack, bytes: a line of the cache."""


class _Part(JITCodeLibrary):
    """
    Code of a kernel that only kernels call, optimised later, in entry points.

    Its machine code has only the variables in which numba keeps the data of exceptions.

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
"""numba's passes for a function without closures, contexts and array expressions, as kernels are;
the passes left out take a seventh of the time."""


class _PartCompiler(Compiler):
    def __init__(self, typing: Any, target: Any, _: Any, *rest: Any) -> None:
        library = _Part(target.codegen(), 'kernel')
        library.enable_object_caching()
        super().__init__(typing, target, library, *rest)

    def define_pipelines(self) -> list[PassManager]:
        """Return the passes of ``_PASSES``."""
        passes = PassManager('kernel')
        for each in _PASSES:
            passes.add_pass(each, each.__name__)
        passes.finalize()
        return [passes]


FOR_KERNELS: dict[str, Any] = dict.fromkeys(('no_cpython_wrapper', 'no_cfunc_wrapper'), True)
"""No wrapper for calls from Python: with a hundred fields of records it takes longer to compile
than the kernel."""
if numba.version_info.short <= _TRIED:  # optimising at every level takes half as long again
    FOR_KERNELS['pipeline_class'] = _PartCompiler


class EntryPoint(CPUDispatcher):
    """A kernel that Python calls."""

    def enable_caching(self) -> None:
        """Keep the machine code where the package keeps it."""
        self._cache = KernelCache(self.py_func, 'entry')

    def typeof_pyval(self, val: Any) -> Any:
        """Return the type of an argument; types of records are kept, for speed."""
        if type(val) is tuple:
            each = tuple(map(self.typeof_pyval, val))
            return types.BaseTuple.from_types(each)
        is_plain = isinstance(val, np.ndarray) and val.ndim == 1 and val.flags.carray
        return _type_of_records(val.dtype) if is_plain else super().typeof_pyval(val)


@cache
def _type_of_records(kind: Any) -> Any:
    return numba.typeof(np.empty(1, kind))


class InnerKernel(CPUDispatcher):
    """A kernel that only kernels can call; a call from Python would crash the process."""

    def enable_caching(self) -> None:
        """Keep the machine code where the package keeps it."""
        self._cache = KernelCache(self.py_func, 'kernel')

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Compile a kernel once for each type, not for each constant argument."""
        named = {name: types.unliteral(each) for name, each in kws.items()}
        return super().get_call_template(tuple(map(types.unliteral, args)), named)

    def __call__(self, *_arguments: Any, **_named: Any) -> Any:
        """Refuse a call from Python."""
        name = self.py_func.__name__
        raise TypeError(
            f'{name} is compiled for other kernels only; call entry_point({name}), or '
            f'in_python({name}) if it calls no other kernel'
        )


def kernel(function: Function) -> Function:
    """
    Compile a function that other kernels call.

    Kernels take SI floats, records, and NamedTuples of a few numbers, and never raise. They cannot
    allocate: without numba's memory runtime an allocation does not compile. Python calls an
    ``entry_point``.

    """
    return _compile(function, InnerKernel, OPTIONS | FOR_KERNELS)


def noinline_kernel(function: Function) -> Function:
    """
    Compile a kernel that is not inlined: for long code off the fast path.

    Its variables then take no registers from the loops of its callers.

    """
    return _compile(function, InnerKernel, OPTIONS | FOR_KERNELS | {'forceinline': False})


def entry_point(function: Function) -> Function:
    """Compile a function or a kernel for calls from Python and from kernels."""
    return _compile(in_python(function), EntryPoint, OPTIONS)


def with_types_kept(function: Function) -> Function:
    """
    Return an entry point that looks up the types of its arguments at the first call only.

    The look-up takes most of a short call. Use it only where no later argument differs in type.

    """
    if CONFIG.DISABLE_JIT:
        return function
    dispatcher: Any = function
    code: Callable[..., Any] | None = None

    @wraps(function)
    def call(*arguments: Any) -> Any:
        nonlocal code
        if code is None:
            code = dispatcher.compile(tuple(map(dispatcher.typeof_pyval, arguments)))
        return code(*arguments)

    return cast('Function', call)


def on_stack(of: RecordKind) -> Callable[[], Any]:
    """
    Return a function that gives a kernel a record of zeros on its stack.

    The compiler knows that nothing else writes to it, so it can keep fields in registers.

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
    """Return the Python function of a kernel."""
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
    """Call ``report`` before each compilation in the block, with the number of kernels so far."""
    with event.install_listener('numba:compile', _Counter(report)):
        yield


class _Counter(event.Listener):
    """Count compiled kernels; numba also compiles functions of its own."""

    def __init__(self, report: Callable[[int], None]) -> None:
        self._report = report
        self._done = 0

    def on_start(self, news: Any) -> None:
        """Report the next kernel."""
        if isinstance(news.data['dispatcher'], EntryPoint | InnerKernel):
            self._report(self._done)
            self._done += 1

    def on_end(self, news: Any) -> None:
        """Ignore the end of a compilation, which may lie within another."""
