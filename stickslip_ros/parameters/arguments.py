# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Read the arguments of public functions as a shell reads options; refuse with the right call."""

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from difflib import get_close_matches
from functools import partial, wraps
from inspect import Signature, signature
from itertools import chain, cycle
from types import NoneType, UnionType
from typing import Any, TypeVar, Union, get_args, get_origin

from stickslip_ros.errors import WrongKind, WrongUse
from stickslip_ros.parameters.declaration import CONVERTERS, Checked
from stickslip_ros.units import unit_of

PARAMETER_NAMES: list[str] = []
"""Names of all parameters, once they are declared."""
Public = TypeVar('Public', bound=Callable[..., Any])


def checked_arguments(public: Public) -> Public:
    """Make a function, or the ``__init__`` of a class, read arguments by annotation and name."""
    if isinstance(public, type):
        public.__init__ = checked_arguments(public.__init__)  # type: ignore[misc]
        return public
    form, fitting = signature(public), set[tuple[Any, ...]]()
    readers = {name: _reader_of(each.annotation) for name, each in form.parameters.items()}
    units = {name: unit_of(name) for name in readers}
    places = [name for name, each in form.parameters.items() if each.kind < each.KEYWORD_ONLY]

    def read(name: str, value: Any) -> Any:
        reader = readers.get(name)
        if reader is None or value is form.parameters[name].default:
            return value
        return reader(name, value, units[name])

    @wraps(public)
    def call(*given: Any, **named: Any) -> Any:
        shape = len(given), *named
        if shape not in fitting:  # binding again takes longer than the rest of a command
            try:
                form.bind(*given, **named)
            except TypeError as error:
                name = public.__qualname__.removesuffix('.__init__')
                right = _suggestion(name, form, given, named)
                raise WrongUse(f'{name}: {error}; did you mean {right}?') from None
            fitting.add(shape)
        ordered = map(read, chain(places, cycle(places[-1:])), given)
        return public(*ordered, **{name: read(name, value) for name, value in named.items()})

    call.checks_arguments = True  # type: ignore[attr-defined]
    return call  # type: ignore[return-value]


def _suggestion(name: str, form: Signature, given: Sequence[Any], named: Mapping[str, Any]) -> str:
    """Suggest an argument or parameter in place of a wrong name, or list all arguments."""
    known = [each for each in form.parameters if each != 'self']
    stand, words = 'parameters', [*known, *PARAMETER_NAMES]
    if name == 'Parameters':
        stand, words = 'Parameters()', PARAMETER_NAMES
        named = {**named, **(given[1] if isinstance(given[-1], Mapping) else {})}
    for word in named.keys() - {*known}:
        bare = word.removesuffix(f'_{unit_of(word).lower()}')
        near = get_close_matches(bare, words, 1, 0.5)
        if near and '.' in near[0]:  # the first group that has the name
            last = near[0].rpartition('.')[2]
            near = [each for each in words if each.rpartition('.')[2] == last]
        if near and near[0] not in known and isinstance(named[word], str | int | float):
            return f'{stand}.updated({{{near[0]!r}: {named[word]!r}}})'
        if near and near[0] in known:
            return near[0]
    return f'one of {", ".join(known)}'


def _reader_of(annotation: Any) -> Any:
    """Return a function of name, value and unit that reads a value; None if every value passes."""
    kinds = _alternatives(annotation)
    loaded = sys.modules.get('numpy.typing')  # not loaded for completion
    if loaded and {*kinds} >= {*_alternatives(loaded.ArrayLike)}:
        return _to_numbers
    parts, is_one = get_args(kinds[0]), {*kinds[1:]} <= {NoneType}
    if is_one and kinds[0] in CONVERTERS:
        return CONVERTERS[kinds[0]]
    if is_one and (parts == (float, float) or get_origin(kinds[0]) is Sequence):
        return (read := _reader_of(parts[0])) and partial(_to_each, read, len(parts) - 1)
    kinds = tuple(get_origin(each) or each for each in kinds)
    is_any = any(each in {float, tuple, Any, Callable, Signature.empty} for each in kinds)
    is_class = all(isinstance(each, type) for each in kinds)
    return partial(_to_kind, kinds) if is_class and not is_any else None


def _alternatives(annotation: Any) -> tuple[Any, ...]:
    """Return the types of a union or of its alias: ArrayLike is either, by numpy's version."""
    opened = getattr(annotation, '__value__', annotation)
    is_union = get_origin(opened) in {Union, UnionType}
    return sum(map(_alternatives, get_args(opened)), ()) if is_union else (opened,)


def _to_kind(kinds: tuple[Any, ...], name: str, value: Any, _: str) -> Any:
    """Return a value of one of these classes; a mapping becomes Parameters."""
    if isinstance(value, kinds):
        return value
    if isinstance(value, Mapping) and hasattr(kinds[0], 'updated'):
        return kinds[0]().updated(value)
    expected = ' or '.join(each.__name__ for each in kinds if each is not NoneType)
    hint = "write Parameters().updated({'stand.preload': 0.25}); load_yaml reads files, fit tables"
    raise WrongKind(name, value, expected, hint if issubclass(kinds[0], Checked) else 'give one')


def _to_each(read: Any, is_span: int, name: str, value: Any, unit: str) -> tuple[Any, ...]:
    """Read several values or a single one; a span has a start and an end."""
    is_one = isinstance(value, str | Mapping) or not isinstance(value, Iterable)
    found = tuple(read(name, each, unit) for each in ([value] if is_one else value))
    if is_span and len(found) != 2:
        raise WrongKind(name, value, 'a start and an end', f"write {name}=('2ms', '4ms')")
    return found


def _to_numbers(name: str, value: Any, unit: str) -> Any:
    """Return finite numbers with the nesting of the argument."""
    value = value.tolist() if hasattr(value, 'tolist') else value
    if isinstance(value, str | Mapping) or not isinstance(value, Iterable):
        return CONVERTERS[float](name, value, unit)
    return [_to_numbers(name, each, unit) for each in value]
