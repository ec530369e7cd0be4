# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Convert the state of an object to a tree of numbers and texts, and back with every value checked.

REMEMBERED of a class lists the attributes of its state, each with its form:

- ``bool``, ``str``, ``int``, or a ``range`` of whole numbers; an enumeration;
- ``float``: a finite number; any number at all in ``Annotated[..., UNCHECKED]``;
- ``(kind, shape)``: an array of records or numbers of ``kernels.record``; -1 is any length;
- ``X | None``, ``tuple[X, Y]``, ``list[X]``, ``deque[X]``; a table of forms by name;
- a NamedTuple or a dataclass, by the types of its fields; a class with its own REMEMBERED.

Reading creates only these; for a class with REMEMBERED it gives the table for its ``recall``.

"""

import base64
import dataclasses
from array import array
from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import suppress
from enum import Enum
from functools import cache
from types import NoneType, UnionType
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.contact.memory import CAPACITY
from stickslip_ros.contact.springs import SPRINGS_IN_ALL
from stickslip_ros.drive.records import CORNERS
from stickslip_ros.errors import WrongKind
from stickslip_ros.kernels.record import COUNT, FLAG, FLOAT

UNCHECKED = 'unchecked'
ANY_FLOAT = Annotated[float, UNCHECKED]
LARGEST = 1e15
"""Largest quantity of the drive, in SI units."""
WHOLE = range(-(1 << 62), (1 << 62) + 1)
"""Whole numbers from which kernels can count without overflow."""
COUNTS = {
    'corner': CORNERS - 1,
    'cycle': 1 << 61,
    'depth': CAPACITY - 1,
    'last': SPRINGS_IN_ALL - 1,
    'newest': CORNERS - 1,
    'passes_left': 1 << 53,
    'passes_made': 1 << 61,
    'samples': 1 << 53,
}
"""Largest value of each count in a record; many counts are indices."""
HINT = 'give one that a bench has saved'


def to_tree(value: Any) -> Any:
    """Convert a value to numbers, texts, lists, tables; arrays become base64 of their bytes."""
    if isinstance(value, np.ndarray | array):
        values = np.asarray(value)
        return base64.b64encode(values.astype(without_gaps(values.dtype)).tobytes()).decode()
    if isinstance(value, Enum):
        return int(value) if isinstance(value, int) else value.name
    for names in ('REMEMBERED', '_fields', '__dataclass_fields__'):
        if hasattr(value, names):
            return {name: to_tree(getattr(value, name)) for name in getattr(value, names)}
    if isinstance(value, Mapping):
        return {name: to_tree(each) for name, each in value.items()}
    if isinstance(value, list | tuple | deque):
        return [to_tree(each) for each in value]
    return value.item() if isinstance(value, np.generic) else value


@cache
def without_gaps(kind: Any) -> Any:
    """Return a kind of record without the padding between its fields."""
    if kind.subdtype is not None:
        base, shape = kind.subdtype
        return np.dtype((without_gaps(base), shape))
    if kind.names is None:
        return kind
    return np.dtype([(name, without_gaps(kind.fields[name][0])) for name in kind.names])


def read_tree(form: Any, tree: Any, place: str, *, is_checked: bool = True) -> Any:
    """
    Return the value of a form from a tree; for a class with REMEMBERED, a table by name.

    Raises WrongKind if a value has another form or is out of its range, or names are missing or
    unknown.

    """
    if form == Array:  # table of a waveform
        form = (FLOAT, (-1, 2))
    if isinstance(form, tuple):
        kind, shape = form
        return _read_array(kind, shape, tree, place)
    if get_origin(form) is not None:
        forms = get_args(form)
        return _read_composite(get_origin(form), forms, tree, place, is_checked=is_checked)
    if hasattr(form, '_fields') or dataclasses.is_dataclass(form):
        return form(**read_tree(get_type_hints(form), tree, place, is_checked=is_checked))
    forms = getattr(form, 'REMEMBERED', form)
    if not isinstance(forms, Mapping):
        return _read_scalar(form, tree, place, is_checked=is_checked)
    if not isinstance(tree, dict) or tree.keys() != forms.keys():
        raise refusal(place, tree, f'a table of {", ".join(forms)}')
    return {
        name: read_tree(each, tree[name], f'{place}.{name}', is_checked=is_checked)
        for name, each in forms.items()
    }


def _read_composite(origin: Any, forms: Any, tree: Any, place: str, *, is_checked: bool) -> Any:
    """Return a value of alternative forms, or one that consists of several values."""
    if origin is Annotated:
        return read_tree(forms[0], tree, place, is_checked=False)
    if origin is UnionType:
        return _read_alternative(forms, tree, place, is_checked=is_checked)
    if origin is Sequence and isinstance(tree, str):
        return array('d', _read_array(FLOAT, (-1,), tree, place, is_checked=is_checked).tobytes())
    is_fixed = origin is tuple and forms[-1] is not Ellipsis
    if not isinstance(tree, list) or (is_fixed and len(tree) != len(forms)):
        raise refusal(place, tree, f'a list of {len(forms)}' if is_fixed else 'a list')
    each = forms if is_fixed else [forms[0]] * len(tree)
    values = [
        read_tree(form, value, f'{place}[{i}]', is_checked=is_checked)
        for i, (form, value) in enumerate(zip(each, tree, strict=True))
    ]
    return (tuple if origin is Sequence else origin)(values)


def _read_alternative(forms: Any, tree: Any, place: str, *, is_checked: bool) -> Any:
    """Return a value of the first form that fits; the refusal is that of the last."""
    if tree is None and NoneType in forms:
        return None
    *others, last = (form for form in forms if form is not NoneType)
    for form in others:
        with suppress(WrongKind):
            return read_tree(form, tree, place, is_checked=is_checked)
    return read_tree(last, tree, place, is_checked=is_checked)


def _read_scalar(form: Any, tree: Any, place: str, *, is_checked: bool) -> Any:
    """Return a number, a text or a member of an enumeration."""
    limits = WHOLE if form is int else form
    if isinstance(limits, range):
        steps = f' in steps of {limits.step}' if limits.step > 1 else ''
        found = tree if type(tree) is int and tree in limits else None
        expected = f'from {limits[0]} to {limits[-1]}{steps}'
    elif form is float:
        found = _float_of(tree, is_checked=is_checked)
        expected = 'a finite number' if is_checked else 'a number'
    elif issubclass(form, Enum):
        found, expected = _member_of(form, tree)
    else:
        found, expected = tree if type(tree) is form else None, f'a {form.__name__}'
    if found is None:
        raise refusal(place, tree, expected)
    return found


def _float_of(tree: Any, *, is_checked: bool) -> Any:
    """Return a number as a float, an unchecked one as it is; None of anything else."""
    if type(tree) is int and tree in WHOLE:
        return float(tree) if is_checked else tree
    is_right = type(tree) is float and (not is_checked or abs(tree) <= LARGEST)
    return tree if is_right else None


def _member_of(form: type[Enum], tree: Any) -> tuple[Any, str]:
    """Return the member of an enumeration, by name or by bits, or None; and what is expected."""
    if issubclass(form, int):
        known = sum(int(each) for each in form)
        is_right = type(tree) is int and tree & known == tree
        return form(tree) if is_right else None, f'bits of {known}'
    is_right = isinstance(tree, str) and tree in form.__members__
    return form[tree] if is_right else None, f'a {form.__name__}'


def _read_array(kind: Any, shape: Any, text: Any, place: str, *, is_checked: bool = True) -> Any:
    """Return a writable array from base64."""
    kind = np.dtype(kind)
    try:
        values = np.frombuffer(base64.b64decode(text, validate=True), without_gaps(kind))
        values = values.reshape(shape)
    except (TypeError, ValueError):
        raise refusal(place, text, f'the bytes of an array of shape {shape}') from None
    if is_checked:
        _check(values, '', place)
    return values.astype(kind)


def _check(values: Any, name: str, place: str) -> None:
    """Refuse records with a field out of its range."""
    kind = values.dtype
    if kind.names is not None:
        for each in kind.names:
            _check(values[each], each, f'{place}.{each}')
        return
    if kind == FLAG:
        # As bytes: numpy shows a 2 of a file as true, and a kernel would compute with it.
        values, expected = values.view(np.uint8), '0 or 1'
        is_right = values <= 1
    elif kind == COUNT:
        is_right, expected = (values >= 0) & (values <= COUNTS[name]), f'from 0 to {COUNTS[name]}'
    elif name == 'sense':
        is_right, expected = abs(values) == 1.0, '1 or -1'
    elif name == 'ages_s':
        is_right, expected = (values >= 0.0) & (values <= LARGEST), 'a finite number from 0'
    else:
        is_right, expected = abs(values) <= LARGEST, 'a finite number'
        if name == 'truth_m':  # NaN before the first sample
            is_right |= np.isnan(values)
    if not np.all(is_right):
        raise refusal(place, values[~is_right][0].item(), expected)


def refusal(place: str, value: Any, expected: str) -> WrongKind:
    """Return the refusal of a value; for a table or a list the message gives only its length."""
    is_many = isinstance(value, dict | list)
    shown = f'a {type(value).__name__} of {len(value)}' if is_many else value
    return WrongKind(place, shown, expected, HINT)
