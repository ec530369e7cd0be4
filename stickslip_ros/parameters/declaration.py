# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Declarations of parameters (kind, unit, bounds, source), and the check of their values."""

import dataclasses
import difflib
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

from stickslip_ros.errors import OutOfRange, UnknownName, WrongKind
from stickslip_ros.parameters.typed import to_si, unit_meant
from stickslip_ros.units import parse_quantity

Scalar = bool | int | float | str

ASSUMED = 'assumed'
TABLE_1 = 'Table 1'


class ReplaceableDefault(float):
    """A default that a better-informed source may replace, because no user has chosen it."""


@dataclass(frozen=True)
class Spec:
    """Declaration of one parameter."""

    kind: type  # ``float``, ``int``, ``bool`` or ``str``; of an array, the kind of its elements
    default: Any  # value if none is given, in ``unit``
    unit: str  # SI unit; empty for pure numbers, switches and names
    source: str  # source of the default: a place in the paper, or ``assumed``
    text: str  # description
    # inclusive bounds, in ``unit``; None for switches and names
    minimum: float | None = None
    maximum: float | None = None
    least: float = 0.0  # least value other than 0, which stands for a part that is off
    choices: tuple[str, ...] = ()  # accepted words of a choice; empty for other parameters
    fixed: bool = False  # true if the value is read once, at the start
    live: bool = False  # true if the value may change while the drive runs
    below: str = 'raise it'  # remedy of a value below the minimum
    # usual value, in ``unit``, of a part that is off by default; 0: a fit does not try the part
    typical: float = 0.0
    # true if 0 is the limit of small values; else 0 means "none" or "derived"
    from_zero: bool = False
    opposes: bool = False  # true if it opposes a motion, in proportion to a force
    cause: str = ''  # usual cause of another value: a twin reports it, and a fit tries the value
    substitute: str = ''  # parameter of nearly the same effect, which a fit tries instead
    assumed: float = 0.0  # relative standard error of the value in a fit that does not free it
    # true if a saved state does not depend on it; None: as the others of its group
    resumable: bool | None = None

    @property
    def is_array(self) -> bool:
        return isinstance(self.default, tuple)

    def check(self, name: str, value: object) -> Any:
        """
        Convert a value, or its text from a command line, to the declared kind, and check it.

        An array may be given as a tuple, a single element, or a text such as ``[2, 4]``.

        Raises WrongKind if the value is not of the declared kind, or not finite; OutOfRange if it
        is outside the bounds, or not among the choices.

        """
        if not self.is_array:
            return self._check_element(name, value)
        values = tuple(self._check_element(name, each) for each in _elements_of(value))
        if not values:
            raise WrongKind(name, value, 'an array of at least one', 'give one value or more')
        return values

    def _check_element(self, name: str, value: object) -> Scalar:
        converted: Scalar = CONVERTERS[self.kind](name, value, self.unit)
        if self.choices and converted not in self.choices:
            allowed = ', '.join(self.choices)
            raise OutOfRange(name, converted, '', 'not one of the choices', f'use {allowed}')
        if isinstance(converted, bool | str):
            return converted
        low, high = self.minimum, self.maximum
        if low is not None and converted < low:
            limit = f'below the minimum {low:g} {self.unit}'.rstrip()
            hint = self.below + unit_meant(converted, self.unit, low, high)
            raise OutOfRange(name, converted, self.unit, limit, hint)
        if high is not None and converted > high:
            limit = f'above the maximum {high:g} {self.unit}'.rstrip()
            hint = 'lower it' + unit_meant(converted, self.unit, low, high)
            raise OutOfRange(name, converted, self.unit, limit, hint)
        if 0.0 < converted < self.least:
            limit = f'between 0 and {self.least:g} {self.unit}'.rstrip()
            raise OutOfRange(name, converted, self.unit, limit, 'raise it, or set it to 0')
        return converted


def _elements_of(value: object) -> Iterable[object]:
    """Return the elements of an array, also of its text."""
    if isinstance(value, str):
        return value.strip().removeprefix('[').removesuffix(']').split(',')
    return value if isinstance(value, Iterable) else (value,)


def _to_float(name: str, value: object, unit: str) -> float:
    if isinstance(value, ReplaceableDefault):
        return value
    if isinstance(value, str):
        return to_si(name, value, unit)
    try:
        number = math.nan if isinstance(value, bool) else float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise WrongKind(name, value, 'a finite number', 'give a number such as 0.5 or 60e-9')
    return number


def to_int(name: str, value: object, unit: str) -> int:
    """Return a whole number, also of a text such as ``1e3``."""
    if isinstance(value, int) and not isinstance(value, bool):
        return value
    try:
        return int(str(value))
    except ValueError:
        amount = parse_quantity(str(value), unit) if unit or isinstance(value, str) else None
        if amount is not None and amount.is_integer():
            return int(amount)
        raise WrongKind(name, value, 'a whole number', 'give an integer such as 42') from None


def _to_bool(name: str, value: object, _: str) -> bool:
    words = {'true': True, 'false': False}
    if str(value).lower() not in words:
        raise WrongKind(name, value, 'true or false', 'write true or false')
    return words[str(value).lower()]


def _to_str(name: str, value: object, _: str) -> str:
    if not isinstance(value, str):
        raise WrongKind(name, value, 'a text', 'put it in quotes')
    return value


CONVERTERS: Mapping[type, Any] = {float: _to_float, int: to_int, bool: _to_bool, str: _to_str}


def quantity(
    default: float | tuple[float, ...],
    unit: str,
    text: str,
    bounds: tuple[float, float],
    source: str = ASSUMED,
    **others: Any,
) -> Any:
    """Declare a float in an SI unit, or an array, with inclusive bounds; others as in Spec."""
    return declare_field(Spec(float, default, unit, source, text, *bounds, **others))


opposing = partial(quantity, opposes=True)
"""Declare a quantity that opposes a motion, in proportion to a force."""


def count(
    default: int | tuple[int, ...],
    text: str,
    bounds: tuple[int, int],
    source: str = ASSUMED,
    unit: str = '',
    **others: Any,
) -> Any:
    """Declare a whole number, or an array, with inclusive bounds of each; others as in Spec."""
    return declare_field(Spec(int, default, unit, source, text, *bounds, **others))


def choice(
    default: str, choices: tuple[str, ...], text: str, source: str = ASSUMED, **others: Any
) -> Any:
    """Declare a choice among words; others as in Spec."""
    return declare_field(Spec(str, default, '', source, text, choices=choices, **others))


def words(default: str, text: str, **others: Any) -> Any:
    """Declare a free text, such as a path; others as in Spec."""
    return declare_field(Spec(str, default, '', ASSUMED, text, **others))


def switch(default: bool, text: str, **others: Any) -> Any:
    """Declare a switch; others as in Spec."""
    return declare_field(Spec(bool, default, '', ASSUMED, text, **others))


def declare_field(spec: Spec) -> Any:
    """Return the dataclass field of a declaration."""
    return dataclasses.field(default=spec.default, metadata={'spec': spec})


_Group = TypeVar('_Group', bound='Checked')
Class = TypeVar('Class', bound=type)


def with_fields(fields: Mapping[str, tuple[type, Any]], before: str) -> Callable[[Class], Class]:
    """Add the fields of a table that a class lacks, in front of its field ``before``."""

    def widen(group: Class) -> Class:
        names = list(group.__annotations__)
        own = [(name, group.__annotations__.pop(name)) for name in names[names.index(before) :]]
        for name, (kind, value) in fields.items():
            if name not in group.__annotations__:
                group.__annotations__[name] = kind
                setattr(group, name, value)
        group.__annotations__.update(own)
        return group

    return widen


class Checked:
    """Base of parameter groups: every instance holds allowed values only."""

    def __init_subclass__(cls, *, resumable: bool = False) -> None:
        """Set ``resumable`` for the parameters of a group that do not declare it."""
        cls.resumable = resumable  # type: ignore[attr-defined]

    def __post_init__(self) -> None:
        """Check the values that are not defaults, then the conditions between values."""
        for field in dataclasses.fields(self):  # type: ignore[arg-type]
            spec, value = field.metadata.get('spec'), getattr(self, field.name)
            if spec is not None and value is not spec.default:
                checked = spec.check(full_name(type(self), field.name), value)
                object.__setattr__(self, field.name, checked)
        self.check_together()

    def with_checked(self: _Group, values: Mapping[str, object]) -> _Group:
        """Return a copy with other values, which are already checked."""
        # Without `__init__`, because `__post_init__` would check every value again.
        changed = object.__new__(type(self))
        changed.__dict__.update(self.__dict__, **values)
        changed.check_together()
        return changed

    @classmethod
    def group(cls) -> str:
        """Name of the group: LoadCellParameters declares ``load_cell.*``."""
        stem = cls.__name__.removesuffix('Parameters')
        return ''.join(f'_{c.lower()}' if c.isupper() else c for c in stem).lstrip('_')

    def check_together(self) -> None:
        """Check conditions between values; groups override it."""


def full_name(group: type[Checked], field: str) -> str:
    """Return ``group.name``, or the bare name for a field of the root."""
    return f'{group.group()}.{field}' if group.group() else field


def declared_by(group: type[Checked]) -> dict[str, Spec]:
    """Return the declarations of a group and its subgroups, ``{'group.name': Spec}``."""
    found: dict[str, Spec] = {}
    for field in dataclasses.fields(group):  # type: ignore[arg-type]
        if 'spec' in field.metadata:
            spec = field.metadata['spec']
            if spec.resumable is None:
                spec = dataclasses.replace(spec, resumable=group.resumable)  # type: ignore[attr-defined]
            found[full_name(group, field.name)] = spec
        else:
            found |= declared_by(field.type)  # type: ignore[arg-type]
    return found


def find_spec(declared: Mapping[str, Spec], name: str, fallback: str) -> Spec:
    """
    Return the declaration of a name.

    Raises UnknownName if the name is not declared; the hint gives the nearest names, or else
    ``fallback``.

    """
    if name not in declared:
        near = difflib.get_close_matches(name, declared, n=3, cutoff=0.5)
        hint = f'did you mean {" or ".join(near)}?' if near else fallback
        raise UnknownName('parameter', name, hint)
    return declared[name]


STROKE_SPEC = Spec(float, 0.0, 'm', '', 'stroke of the feet', 0.0)
AMPLITUDE_SPEC = dataclasses.replace(STROKE_SPEC, maximum=1.0)
FREQUENCY_SPEC = Spec(float, 1000.0, 'Hz', '', 'steps per second', -1e9, 1e9)
"""Declarations of a run's options that are not parameters."""
