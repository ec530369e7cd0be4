# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Definitions of messages, as recordings carry them, and the lengths of their fields in CDR.

A definition is the text of a .msg file and of those that it needs (``ros2msg``), its layout that
of the OMG's DDS-XTypes 1.3, Section 7.4.1 (plain CDR, version 1): each number is aligned to its
own size. The length of a field depends on its start, modulo eight. A table of these eight
lengths is a Width; the Widths of successive fields combine into one Width.

"""

import os
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import takewhile
from pathlib import Path
from typing import Final, TypeAlias

from stickslip_ros.errors import quoted
from stickslip_ros.interface.schemas import FIELDS

_NUMBERS: Final = {
    'bool': 'u1',
    'byte': 'u1',
    'char': 'u1',
    'float32': 'f4',
    'float64': 'f8',
    **{
        f'{sign}int{8 * size}': f'{kind}{size}'
        for sign, kind in (('', 'i'), ('u', 'u'))
        for size in (1, 2, 4, 8)
    },
}
"""Types of numbers, with numpy's names."""
_IDL_NUMBERS: Final = {
    'boolean': 'bool',
    'octet': 'byte',
    'float': 'float32',
    'double': 'float64',
    'short': 'int16',
    'unsigned short': 'uint16',
    'long': 'int32',
    'unsigned long': 'uint32',
    'long long': 'int64',
    'unsigned long long': 'uint64',
}
_COMMENT: Final = re.compile(r'//[^\n]*|/\*(?:.*?\*/|.*)', re.DOTALL)
_ANNOTATION: Final = re.compile(r'@\w+\s*(\((?:[^()"]|"(?:[^"\\]|\\.)*")*\))?')
_IDL_NAME: Final = re.compile(r'IDL:\s*(\S+)')
"""What a .idl file of ROS 2 consists of, and the names of its numbers."""
SEPARATOR: Final = re.compile(r'={3,}')
NAMED: Final = re.compile(r'MSG:\s*(\S+)')
FIELD: Final = re.compile(r'([\w/]+)(?:<=\d+)?(?:\[(<=)?(\d*)\])?\s+([^\W\d]\w*)\s*(=)?')
"""Type, whether the length of an array is a bound, the length, name, and whether a constant."""
DEPTH_MAX: Final = 64
ALIGNMENT: Final = 8

Width: TypeAlias = tuple[int, ...]
_NOTHING: Final[Width] = (0,) * ALIGNMENT


@dataclass(frozen=True)
class Kind:
    """The type of a field; Width is None if the length differs between messages."""

    width: Width | None


@dataclass(frozen=True)
class Number(Kind):
    """A number, by its type in numpy."""

    dtype: str


@dataclass(frozen=True)
class Text(Kind):
    """A string, whose length each message gives."""


@dataclass(frozen=True)
class ArrayOf(Kind):
    """An array of a kind; count None: each message gives the length."""

    element: Kind
    count: int | None


@dataclass(frozen=True)
class Struct(Kind):
    """A message within a message."""

    fields: tuple[tuple[str, Kind], ...]


def then(first: Width, second: Width) -> Width:
    """Return the Width of two successive fields."""
    return tuple(each + second[(at + each) % ALIGNMENT] for at, each in enumerate(first))


def repeated(width: Width, count: int) -> Width:
    """Return the Width of `count` equal successive fields; all but the first have one length."""
    firsts = enumerate(width) if count else ()
    lengths = (each + (count - 1) * width[(at + each) % ALIGNMENT] for at, each in firsts)
    return tuple(lengths) or _NOTHING


class Definitions:
    """The types of a text, which may be empty; those that it lacks are taken from ROS 2 here."""

    def __init__(self, name: str, text: str) -> None:
        self._lines: dict[str, list[str]] = {}
        self._known: dict[str, Struct] = {}
        self._add(_short(name), text or _installed_text(_short(name)))

    def _add(self, name: str, text: str) -> None:
        lines = self._lines[name] = []
        for line in map(str.strip, text.splitlines()):
            if SEPARATOR.fullmatch(line):
                lines = []
            elif named := NAMED.fullmatch(line):
                lines = self._lines[_short(named[1])] = []
            elif line and not line.startswith('#'):
                lines.append(line)

    def struct(self, name: str, depth: int = 0) -> Struct:
        """Return a type; ValueError if the text does not define it."""
        name = _short(name)
        if name not in self._known:
            if name not in self._lines:
                self._add(name, _installed_text(name))
            if depth > DEPTH_MAX:
                raise ValueError(f'its types are nested deeper than {DEPTH_MAX}')
            package = name.partition('/')[0]
            fields = [self._field(line, package, depth) for line in self._lines[name]]
            kinds = tuple(each for each in fields if each) or (PLACEHOLDER,)
            width: Width | None = _NOTHING
            for _, kind in kinds:
                width = None if width is None or kind.width is None else then(width, kind.width)
            self._known[name] = Struct(width, kinds)
        return self._known[name]

    def _field(self, line: str, package: str, depth: int) -> tuple[str, Kind] | None:
        """Return name and type of a field; None of a constant."""
        found = FIELD.match(line)
        if found is None:
            raise ValueError(f'{quoted(line)} is not a field')
        base, bound, count, name, constant = found.groups()
        if constant:
            return None
        kind: Kind
        if base in _NUMBERS:
            kind = number(_NUMBERS[base])
        elif base == 'string':
            kind = Text(None)
        elif base == 'wstring':
            raise ValueError('wstring is not supported: its length differs between writers')
        else:
            kind = self.struct(base if '/' in base else f'{package}/{base}', depth + 1)
        if count is not None:
            kind = array(kind, None if bound or not count else int(count))
        return name, kind


def text_of_idl(text: str) -> str:
    """Return the text of .msg files for that of .idl files, as ROS 2 makes these."""
    sections = SEPARATOR.split(_ANNOTATION.sub('', _COMMENT.sub('', text)))
    statements = [[each.strip() for each in re.split('[;{}]', section)] for section in sections]
    arrays = {
        name: (kind, size)
        for several in statements
        for each in several
        if each.startswith('typedef ')
        for kind, name, size in [_declared(each.removeprefix('typedef '))]
    }
    parts = []
    for section, several in zip(sections, statements, strict=True):
        begin = next((at for at, each in enumerate(several) if each.startswith('struct ')), None)
        if begin is None:
            continue
        named = _IDL_NAME.search(section)
        lines = [f'MSG: {named[1]}'] if named else []
        for each in takewhile(bool, several[begin + 1 :]):  # up to the empty one before its brace
            declared, name, size = _declared(each)
            kind, size = arrays.get(declared, (declared, size))
            bounds = f'[{size}]' if size else ''
            if kind.startswith('sequence<'):
                kind, bounds = kind[len('sequence<') :].rstrip('> ').partition(',')[0], '[]'
            kind = _IDL_NUMBERS.get(kind.strip(), kind).replace('::', '/')
            lines.append(f'{kind.partition("<")[0].strip()}{bounds} {name}')
        parts.append('\n'.join(lines))
    return '\n===\n'.join(parts)


def _declared(statement: str) -> tuple[str, str, str]:
    """Return kind, name and size of a declaration such as ``long x[3]``; no size of a number."""
    declared, _, size = statement.partition('[')
    *kind, name = declared.split() or ['']
    return ' '.join(kind), name, size.strip('] ')


def array(element: Kind, count: int | None) -> ArrayOf:
    """Return an array of a kind; count None: each message gives the length."""
    width = _NOTHING if count == 0 else None
    if count and element.width is not None:
        width = repeated(element.width, count)
    return ArrayOf(width, element, count)


@cache
def number(dtype: str) -> Number:
    """Return a number, by its type in numpy."""
    size = int(dtype[1:])
    return Number(tuple(-at % size + size for at in range(ALIGNMENT)), dtype)


PLACEHOLDER: Final = ('structure_needs_at_least_one_member', number('u1'))
"""The field that stands for none in an empty message."""


def _installed_text(name: str) -> str:
    """Return the definition of a type, built in or from an installed ROS 2; ValueError if none."""
    package, _, kind = name.partition('/')
    if package == 'std_msgs' and kind.lower() in _NUMBERS:
        return f'{kind.lower()} data'
    if name in FIELDS:
        return FIELDS[name]
    for prefix in (*os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep), sys.prefix):
        path = Path(prefix, 'share', package, 'msg', f'{kind}.msg')
        if re.fullmatch(r'\w+/\w+', name) and prefix and path.is_file():
            return path.read_text(encoding='utf-8')
    raise ValueError(f'it lacks {name}, which is not installed here')


def _short(name: str) -> str:
    """Return ``package/Name`` of a type, with or without ``msg`` between them."""
    package, _, rest = name.partition('/')
    return f'{package}/{rest.rpartition("/")[2]}'


def leaves(kind: Kind, name: str = '') -> Iterator[tuple[str, Kind]]:
    """Yield the paths of fields without parts; for an array, those of its first element."""
    if isinstance(kind, Struct):
        for each, inner in kind.fields:
            yield from leaves(inner, f'{name}.{each}' if name else each)
    elif isinstance(kind, ArrayOf) and kind.count != 0:
        yield from leaves(kind.element, f'{name}[0]')
    else:
        yield name, kind


def way_to(kind: Kind, path: Sequence[str | int]) -> tuple[list[Kind | int], str]:
    """
    Return the fields before a field, and its type in numpy; LookupError if it is no number.

    The fields before it are kinds, and indices of arrays whose length a message gives there.

    """
    before: list[Kind | int] = []
    for part in path:
        match kind:
            case Struct() if part in (names := [name for name, _ in kind.fields]):
                at = names.index(part)
                before += [each for _, each in kind.fields[:at]]
                _, kind = kind.fields[at]
            case ArrayOf() if isinstance(part, int) and (kind.count is None or part < kind.count):
                before += [part] if kind.count is None else []
                before.append(array(kind.element, part))
                kind = kind.element
            case _:
                raise LookupError
    match kind:
        case Number():
            return list(_joined(before)), kind.dtype
    raise LookupError


def array_at(kind: Kind, path: Sequence[str | int]) -> ArrayOf:
    """Return the array at the end of a path; LookupError if there is none."""
    for part in path:
        if isinstance(kind, Struct) and isinstance(part, str):
            kind = dict(kind.fields)[part]
        elif isinstance(kind, ArrayOf):
            kind = kind.element
    if not isinstance(kind, ArrayOf):
        raise LookupError  # noqa: TRY004 - as of a path without a field
    return kind


def _joined(before: Sequence[Kind | int]) -> Iterator[Kind | int]:
    """Yield the same fields, with neighbours of fixed length joined."""
    width = _NOTHING
    for each in before:
        if isinstance(each, Kind) and each.width is not None:
            width = then(width, each.width)
        else:
            yield from (Kind(width), each)
            width = _NOTHING
    yield Kind(width)
