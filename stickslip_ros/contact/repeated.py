"""Kernels that are called block after block: their types are looked up once, not every time."""

from operator import is_not
from typing import Any, Final, TypeAlias

import numba
import numpy as np

from stickslip_ros.contact.kernel import InnerKernel, not_for_python
from stickslip_ros.contact.kernel_cache import CONFIG

STATE: Final = 2
"""Place of the state among the arguments of every repeated kernel."""

Code: TypeAlias = Any
"""Something to call: a kernel of numba, or what it compiled."""
Kinds = tuple[object, ...]
"""Types of the fields of one record."""


class Repeated:
    """
    A kernel that is called again and again, each time with the state that it returned last.

    numba looks at the types of all arguments in every call. For records of a hundred fields that
    takes many times as long as to hand them over. Here only those records are looked at that are
    not the very objects of the last call, nor the state that it returned.

    Parameters
    ----------
    compiled : entry point
        Its third argument is the state, and it returns the next one.
    records : int
        Number of its leading arguments that are NamedTuples. The others, numbers and arrays,
        must be of the same types in every call.

    Raises
    ------
    TypeError
        If only kernels can call it.

    """

    def __init__(self, compiled: Code, records: int) -> None:
        if isinstance(compiled, InnerKernel):
            raise TypeError(not_for_python(compiled))
        self._compiled = compiled
        self._records = records
        self._known: list[object] = [object()] * records
        self._kinds: list[Kinds] = [()] * records
        self._codes: dict[tuple[Kinds, ...], Code] = {}
        self._code = compiled

    def __call__(self, *arguments: Any) -> Any:
        """Call the kernel; return the next state."""
        if any(map(is_not, self._known, arguments)):
            self._look_at(arguments)
        state = self._code(*arguments)
        self._known[STATE] = state
        return state

    def _look_at(self, arguments: tuple[Any, ...]) -> None:
        """Find the machine code for these arguments, and remember what they are."""
        for place in range(self._records):
            if self._known[place] is not arguments[place]:
                self._known[place] = arguments[place]
                self._kinds[place] = kinds_of(arguments[place])
        kinds = tuple(self._kinds)
        if kinds not in self._codes:
            self._codes[kinds] = self._code_for(arguments)
        self._code = self._codes[kinds]

    def _code_for(self, arguments: tuple[Any, ...]) -> Code:
        """Return the machine code, or the kernel itself where the next state is of other types."""
        if CONFIG.DISABLE_JIT:
            return self._compiled
        types = tuple(map(numba.typeof, arguments))
        self._compiled.compile(types)
        returned = self._compiled.overloads[types].signature.return_type
        return self._compiled.get_overload(types) if returned == types[STATE] else self._compiled


def kinds_of(value: object) -> Any:
    """Return what decides about the types of a record: equal ones are of equal types."""
    if isinstance(value, tuple):
        return (type(value), *map(kinds_of, value))
    if isinstance(value, np.ndarray):
        return (value.dtype, value.ndim, value.flags.num)
    return type(value)
