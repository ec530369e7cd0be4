"""What a sweep goes through: lists and ranges as they are typed, and their product."""

import math
from dataclasses import dataclass

import numpy as np

from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.parameters import Scalar, Spec, parse_assignments, spec_of

RANGE_COUNT_MAX = 100_000
"""Values that one range may have."""
EXAMPLE = 'write values with commas, as 0.1,0.5, or start:stop:count, as 0:160e-9:33'


@dataclass(frozen=True)
class Axis:
    """A name and the values that it takes in turn."""

    name: str
    values: tuple[Scalar, ...]


def parse_axis(name: str, text: str, spec: Spec) -> Axis:
    """
    Return the axis of a text: values with commas, or ``start:stop:count``, both ends included.

    Parameters
    ----------
    name : str
        What varies, as the user wrote it.
    text : str
        Such as ``0.1,0.4``, ``0:160e-9:33`` or ``rough,smooth``.
    spec : Spec
        Kind, unit and bounds of the values.

    Raises
    ------
    WrongKind, OutOfRange
        If the text is neither, the range is none, or a value is not allowed.

    """
    if ':' in text and spec.kind in {float, int}:
        values: list[object] = list(_range(name, text, spec))
    else:
        values = [part.strip() for part in text.split(',')]
    return Axis(name, tuple(spec.check(name, value) for value in values))


def parse_varied(assignments: list[str]) -> list[Axis]:
    """
    Return the axes of texts such as ``contact.friction=0.2,0.3``.

    Raises
    ------
    UnknownName, WrongKind, OutOfRange
        If a parameter is not known, named twice, or a value is not allowed.

    """
    axes: list[Axis] = []
    for assignment in assignments:
        if '=' not in assignment:
            mend = 'write --vary group.name=VALUES'
            raise WrongKind('--vary', assignment, 'a parameter with values', mend)
        ((name, text),) = parse_assignments([assignment]).items()
        axes.append(parse_axis(name, text, spec_of(name)))
    return axes


def refuse_repeated(axes: list[Axis]) -> None:
    """Raise OutOfRange if two axes have the same name."""
    names = [axis.name for axis in axes]
    for name in names:
        if names.count(name) > 1:
            mend = 'put all its values into one list'
            raise OutOfRange('parameter', name, '', 'varied twice', mend)


def column_name(name: str) -> str:
    """Return the name of a varied parameter with its unit, ``load_cell.stiffness [N/m]``."""
    unit = spec_of(name).unit
    return f'{name} [{unit}]' if unit else name


def bare_name(column: str) -> str:
    """Return the name of a parameter of which this is the column."""
    return column.partition(' [')[0]


def _range(name: str, text: str, spec: Spec) -> list[Scalar]:
    parts = text.split(':')
    if len(parts) != 3:
        raise WrongKind(name, text, 'start:stop:count', EXAMPLE)
    start, stop = (_number(name, part) for part in parts[:2])
    count = _count(name, parts[2])
    if start == stop:
        limit = f'both start and stop of a range of {count}'
        raise OutOfRange(
            name, start, spec.unit, limit, 'move one of them, or give the value alone'
        )
    values = [float(value) for value in np.linspace(start, stop, count)]
    if spec.kind is float:
        return list(values)
    for value in values:
        if not value.is_integer():
            limit = 'not a whole number'
            raise OutOfRange(f'{name} in {text}', value, spec.unit, limit, 'change the count')
    return [int(value) for value in values]


def _number(name: str, text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise WrongKind(name, text, 'a finite number', EXAMPLE)
    return number


def _count(name: str, text: str) -> int:
    try:
        count = int(text)
    except ValueError:
        raise WrongKind(f'{name} count', text, 'a whole number', EXAMPLE) from None
    if count < 2:
        mend = 'raise it, or give the value alone'
        raise OutOfRange(f'{name} count', count, '', 'below the minimum 2', mend)
    if count > RANGE_COUNT_MAX:
        limit = f'above the maximum {RANGE_COUNT_MAX}'
        raise OutOfRange(f'{name} count', count, '', limit, 'lower it')
    return count
