# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Read the arguments of public functions as a shell reads options; refuse with the right call."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import is_dataclass
from difflib import get_close_matches
from functools import partial, wraps
from inspect import Signature, signature
from os import PathLike
from types import FunctionType, NoneType, UnionType
from typing import Any, get_args, get_origin

from stickslip_ros.errors import WrongKind, WrongUse
from stickslip_ros.parameters.declaration import CONVERTERS, Checked
from stickslip_ros.parameters.tree import Parameters, names_meant
from stickslip_ros.parameters.typed import example
from stickslip_ros.units import unit_of


def reading(public: Any, *, is_made: bool = False) -> Any:
    """
    Return a function, or a class with methods, that reads arguments by annotation and name.

    ``is_made``: users make instances of the class, so that its ``__init__`` reads too.

    """
    if isinstance(public, type):
        found = [(each, *item) for each in public.__mro__ for item in vars(each).items()]
        for owner, name, method in found:
            is_ours = isinstance(method, FunctionType) and not hasattr(method, '__wrapped__')
            if is_ours and (name[0] != '_' or (is_made and name == '__init__')):
                setattr(owner, name, reading(method))
        return public
    form, readers = signature(public), list[tuple[str, Any, str, Any]]()
    for each in form.parameters.values():
        if (read := _reader_of(each.annotation)) is not None:
            read = partial(_to_each, read, False) if each.kind is each.VAR_POSITIONAL else read
            passes = each.default, None if NoneType in get_args(each.annotation) else each.default
            readers.append((each.name, read, unit_of(each.name), passes))

    @wraps(public)
    def call(*given: Any, **named: Any) -> Any:
        try:
            bound = form.bind(*given, **named)
        except TypeError:
            raise WrongUse(_meant(public.__qualname__, form, given, named)) from None
        for name, read, unit, passes in readers:
            value = bound.arguments.get(name, passes[0])
            if value is not passes[0] and value is not passes[1]:
                bound.arguments[name] = read(name, value, unit)
        return public(*bound.args, **bound.kwargs)

    return call


def _meant(name: str, form: Signature, given: Sequence[Any], named: Mapping[str, Any]) -> str:
    """Return what is wrong with a call, and the call that is meant."""
    name, known = name.removesuffix('.__init__'), dict(form.parameters)
    given = given[1:] if known.pop('self', None) else given
    count = sum(each.kind is not each.KEYWORD_ONLY for each in known.values())
    meant, settings = dict(zip(known, given[: count + 1], strict=False)), dict[str, Any]()
    others = ''
    wrong = [word for word in named if word not in known]
    if name.startswith('Parameters') and len(given) > count:
        settings = {**given[0]} if isinstance(given[0], Mapping) else {given[0]: given[-1]}
    for word, value in named.items():
        names = [] if word in known or name == 'sweep' else names_meant(word)
        near = get_close_matches(word, known, n=1, cutoff=0.75 if names else 0.6)
        if names and (not near or name.startswith('Parameters')):
            settings[names[0]], others = value, ''.join(f', or {each}' for each in names[1:3])
        others += f', out of {", ".join(known)}' * (not names and not near)
        meant |= dict.fromkeys(near, value)
    needed = [
        word
        for word, each in known.items()
        if word not in meant
        and each.default is each.empty
        and each.kind is not each.VAR_POSITIONAL
    ]
    problem = f'has no argument {wrong[0]}' if wrong else f'needs {" and ".join(needed)}'
    if len(given) > count:
        problem = f'takes {count} of these {len(given)} arguments without a name'
    for word in needed:  # values are those of a sweep
        typed = example(unit_of(word)).partition(' ')[0] if unit_of(word) else None
        meant[word] = {each: named[each] for each in wrong} if word == 'values' else typed
    shown = list[str]()
    for word in (word for word in known if word in meant):
        is_typed = isinstance(value := meant[word], str | int | float | dict)
        text = (str if isinstance(value, float) else repr)(value) if is_typed else word
        shown.append(word if word == text and not shown else f'{word}={text}')
    right = f'{name}({", ".join(shown)})'
    if settings:
        right = f'{"Parameters()" if name == "Parameters" else "parameters"}.updated({settings!r})'
    else:
        others += ''.join(f', {word} in {unit_of(word)}' for word in meant if unit_of(word))
    return f'{name} {problem}; did you mean {right}{others}?'


def _reader_of(annotation: Any) -> Any:
    """Return a function of name, value and unit that reads a value; None if every value passes."""
    if 'numpy' in str(annotation):
        return _to_numbers
    kinds = get_args(annotation) if isinstance(annotation, UnionType) else (annotation,)
    kinds = tuple(each for each in kinds if each is not NoneType)
    origin, parts = get_origin(kinds[0]), get_args(kinds[0])
    is_many = parts == (float, float) if origin is tuple else origin in {Sequence, Iterable}
    if len(kinds) == 1 and is_many and (read := _reader_of(parts[0])):
        return partial(_to_each, read, origin is tuple)
    if origin is not Mapping and not all(type(each) is type for each in kinds):
        return None
    return (
        None
        if annotation is Signature.empty
        else partial(_to_kind, (origin or kinds[0], *kinds[1:]))
    )


def _to_kind(kinds: tuple[Any, ...], name: str, value: Any, unit: str) -> Any:
    """Return a value of one of these classes, or as the first that can read it."""
    if len(kinds) > 1 and isinstance(value, kinds):
        return value
    for kind in kinds:
        if kind is float or (kind in CONVERTERS and len(kinds) == 1):
            return CONVERTERS[kind](name, value, unit)
        if isinstance(value, kind):
            return value
        if isinstance(value, Mapping) and issubclass(kind, Checked):
            prefix = '' if kind is Parameters else f'{name}.'
            stand = Parameters().updated({f'{prefix}{each}': value[each] for each in value})
            return getattr(stand, name) if prefix else stand
        if isinstance(value, Mapping) and is_dataclass(kind):
            return kind(**value)  # type: ignore[operator]
    hint = 'give one'
    if Parameters in kinds:
        hint = "give Parameters() or {'stand.preload': 0.25}; compare and fit take tables"
        hint = f'write load_yaml({str(value)!r})' if isinstance(value, str | PathLike) else hint
    raise WrongKind(name, value, ' or '.join(each.__name__ for each in kinds), hint)


def _to_each(read: Any, is_span: bool, name: str, value: Any, unit: str) -> tuple[Any, ...]:
    """Return values, or the only one, each of which is read; a span has a start and an end."""
    is_one = isinstance(value, str | Mapping) or not isinstance(value, Iterable)
    found = tuple(read(name, each, unit) for each in ((value,) if is_one else value))
    if is_span and not (len(found) == 2 and found[0] <= found[1]):
        raise WrongKind(name, value, 'a start and an end', f"write {name}=('2ms', '4ms')")
    return found


def _to_numbers(name: str, value: Any, unit: str) -> Any:
    """Return finite numbers as an array of any shape."""
    import numpy as np  # noqa: PLC0415 - slow import

    if isinstance(value, np.ndarray) and value.dtype == float and np.isfinite(value).all():
        return value
    read = np.vectorize(CONVERTERS[float], otypes=[float])
    return read(name, np.asarray(value, dtype=object), unit)[()]
