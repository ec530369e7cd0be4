# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Write parameters as a ROS parameter file with units and sources, and read them back.

YAML that can be misunderstood is refused: repeated keys, numbers of base 60, aliases.

"""

import json
import re
from collections.abc import Collection, Iterable, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from stickslip_ros import budget
from stickslip_ros.errors import RecordingError, StickSlipError, UnknownName, WrongKind, quoted
from stickslip_ros.files import read_text
from stickslip_ros.parameters.arguments import checked_arguments
from stickslip_ros.parameters.declaration import CONVERTERS, Scalar, Spec
from stickslip_ros.parameters.tree import Parameters, Range, spec_of, specs

NODE_NAME = 'stickslip_drive'
ROS_KEY = 'ros__parameters'
ANY_NODE = '/**'
RANGES = 'ranges'
_NUMBERS = ('tag:yaml.org,2002:int', 'tag:yaml.org,2002:float')
_HINT = 'compare it with config/test_stand.yaml'
_BASE: Any = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
"""Loader of libyaml, ten times faster, where PyYAML has it."""


def format_value(value: Scalar | tuple[Scalar, ...]) -> str:
    """Format a value for YAML 1.1 and ROS: a float keeps its decimal point and all digits."""
    if isinstance(value, float):  # most values
        if 'e' not in (text := repr(value)):
            return text
        mantissa, e, exponent = text.partition('e')
        return (mantissa if '.' in mantissa else f'{mantissa}.0') + e + exponent
    if isinstance(value, tuple):
        return f'[{", ".join(map(format_value, value))}]'
    if isinstance(value, int):  # or a bool
        return str(value).lower()
    if value.isprintable():
        return "'" + value.replace("'", "''") + "'"
    return json.dumps(value)  # in double quotes, with escapes


def describe(spec: Spec, *, limits: bool = True) -> str:
    """Describe a parameter in a line: text, unit, bounds or choices, source."""
    line = f'{spec.text} [{spec.unit}]' if spec.unit else spec.text
    if limits and spec.minimum is not None and spec.maximum is not None:
        line += f'; {"each " if spec.is_array else ""}{spec.minimum:g} to {spec.maximum:g}'
    if limits and spec.choices:
        line += f'; {" | ".join(spec.choices)}'
    return f'{line} ({spec.source})'


def dump_yaml(parameters: Parameters, heading: str, *, without: Collection[str] = ()) -> str:
    """
    Return a ROS parameter file; ``heading`` is the comment at its top, without ``#``.

    For the parameters ``without`` a value only the comment is written.

    """
    lines = [f'# {line}'.rstrip() for line in heading.splitlines()]
    lines += [f'{ANY_NODE}:', f'  {ROS_KEY}:']
    flat = parameters.flat()
    lines += [
        before.rpartition('\n')[0] if name in without else before + format_value(flat[name])
        for name, before in _before_values().items()
    ]
    return '\n'.join(lines) + '\n'


@cache
def _before_values() -> dict[str, str]:
    """Return the text before the value of each parameter: group, comment, name."""
    found: dict[str, str] = {}
    current = ''
    for name, spec in specs().items():
        group, _, leaf = name.rpartition('.')
        indent, head = ('      ', f'    {group}:\n') if group else ('    ', '')
        text = f'{indent}# {describe(spec)}\n{indent}{leaf}: '
        found[name], current = (text if group == current else head + text), group
    return found


@checked_arguments
def load_yaml(*paths: str | Path) -> Parameters:
    """
    Read ROS parameter files; later files override earlier ones, and the rest keeps its defaults.

    Raises
    ------
    RecordingError
        If a file cannot be read, is not YAML, or repeats a key.
    UnknownName, WrongKind, OutOfRange
        If a file has an unknown parameter or a value that is not allowed.

    """
    read = _read(paths)
    values = {k: value for each, origin in read for k, value in _values(each, origin).items()}
    return Parameters().updated(values).with_ranges(_ranges(read))


def load_values(path: Path) -> dict[str, object]:
    """Return the values of a ROS parameter file by name, unchecked; refuses like ``load_yaml``."""
    return _values(_document(path), str(path))


def load_ranges(*paths: str | Path) -> dict[str, Range]:
    """
    Return the ranges of assumed values, from a section that ROS takes for another node's.

    A value in a later file removes the range in an earlier one.

    """
    return _ranges(_read(paths))


def _read(paths: Iterable[str | Path]) -> list[tuple[object, str]]:
    """Return the document and the name of each file."""
    return [(_document(Path(path)), str(path)) for path in paths]


def _ranges(read: Iterable[tuple[object, str]]) -> dict[str, Range]:
    found = dict[str, Range]()
    for document, origin in read:
        given = {name.partition('[')[0] for name in _values(document, origin)}
        found = {k: each for k, each in found.items() if k.partition('[')[0] not in given}
        for name, body in _sections(document, '', origin):
            if name == f'/{RANGES}':
                found |= {k: _range(k, each) for k, each in _flat(body, origin).items()}
    return found


def _range(name: str, value: object) -> Range:
    spec = spec_of(name)
    ends = value if isinstance(value, list) else []
    numbers = [CONVERTERS[spec.kind](name, each, spec.unit) for each in ends]
    if len(numbers) != 2 or not numbers[0] < numbers[1]:
        hint = f'write {name}: [LOW, HIGH]'
        raise WrongKind(f'{RANGES} of {name}', value, 'a low and a high number', hint)
    return float(numbers[0]), float(numbers[1])


def _document(path: Path) -> object:
    text = read_text(path, 'check the path', 'give a ROS parameter file')
    document = read_yaml(text, str(path), _HINT, budget.PARAMETER_VALUES)
    if document is None:
        raise RecordingError(path, 'names no parameter', _HINT)
    return document


def parse_yaml(text: str, origin: str) -> Parameters:
    """Read the text of a ROS parameter file; messages name its ``origin``."""
    return Parameters().updated(_values(read_yaml(text, origin, _HINT) or {}, origin))


def _values(document: object, origin: str) -> dict[str, object]:
    """Return the parameters of the only drive in a file; as in ROS, later sections override."""
    sections = list(_sections(document, '', origin))
    names = list(dict.fromkeys(name for name, _ in sections))
    drives = [name for name in names if name.endswith(f'/{NODE_NAME}') and '*' not in name]
    if len(drives) > 1:
        problem = f'is for several drives: {" and ".join(drives)}'
        raise RecordingError(origin, problem, f'keep one, or {ANY_NODE} for what all share')
    taken = [body for name, body in sections if _matches(name, *drives)]
    if sections and not taken:
        problem = f'has no section of a drive, only of {" and ".join(names)}'
        raise RecordingError(origin, problem, f'name it /{NODE_NAME}, or {ANY_NODE} for any node')
    return {name: value for body in taken for name, value in _flat(body, origin).items()}


def _sections(node: object, place: str, origin: str) -> Iterator[tuple[str, object]]:
    """Yield the full name and the content of each section; namespaces may be nested."""
    for key, below in _items(node, origin):
        name = f'{place}/{key.strip("/")}'
        if not isinstance(below, dict) or not below or (ROS_KEY in below and len(below) > 1):
            hint = f'{origin} needs {ROS_KEY}: right below a node name'
            raise UnknownName('section', key, hint)
        if ROS_KEY in below:
            yield name, below[ROS_KEY]
        else:
            yield from _sections(below, name, origin)


def _matches(section: str, drive: str = '') -> bool:
    """Return whether a section applies to a drive, or to some drive if no name is given."""
    if not drive:
        return section.rpartition('/')[2] in (NODE_NAME, '*', '**')
    wildcards = {'*': r'/\w+', '**': r'(/\w+)*'}
    words = section.split('/')[1:]
    pattern = ''.join(wildcards.get(each, f'/{re.escape(each)}') for each in words)
    return re.fullmatch(pattern, drive) is not None


def _flat(node: object, origin: str, prefix: str = '') -> dict[str, object]:
    values: dict[str, object] = {}
    for key, value in _items(node, origin):
        name = f'{prefix}{key}'
        below = _flat(value, origin, f'{name}.') if isinstance(value, dict) else {name: value}
        if twice := values.keys() & below.keys():  # as a: {b: 1} and a.b: 2
            raise RecordingError(origin, f'gives {min(twice)} twice', 'keep one of the two')
        values |= below
    return values


def _items(node: object, origin: str) -> Iterator[tuple[str, object]]:
    if not isinstance(node, dict):
        raise WrongKind(origin, node, 'a table of names', _HINT)
    yield from ((str(key), value) for key, value in node.items())


def read_yaml(text: str, origin: str, hint: str, limit: Any = budget.YAML_VALUES) -> object:
    """
    Read a YAML document; messages name its ``origin`` and give the ``hint``.

    Raises RecordingError if it is not YAML, exceeds its limits, or has a repeated key, a number
    such as ``1:30`` or an alias; the message names the line.

    """
    try:
        budget.YAML_CHARACTERS.check(len(text), origin)
        _check_events(text, origin, limit)
        loader = _Loader(text)
        loader.origin = origin
        return loader.get_single_data()
    except yaml.YAMLError as error:
        raise RecordingError(
            origin, f'is not YAML ({" ".join(str(error).split())})', hint
        ) from None


def check_parameter_file(path: Path) -> None:
    """Refuse a file that would keep ROS 2 busy for minutes; ROS 2 checks the rest."""
    text = read_text(path, 'check the path', _HINT)
    with suppress(yaml.YAMLError):
        _check_events(text, str(path), budget.PARAMETER_VALUES)


def _check_events(text: str, origin: str, limit: budget.Limit) -> None:
    """Refuse an alias, many values, deep ones and long numbers, before anything is built."""
    values = depth = 0
    for event in yaml.parse(text, _BASE):
        if isinstance(event, yaml.AliasEvent):
            problem = f'has the alias *{event.anchor}'
            _refuse(origin, event, problem, 'write out what it stands for')
        values += isinstance(event, yaml.NodeEvent)
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        limit.check(values, origin)
        budget.YAML_DEPTH.check(depth, origin)


def _refuse(origin: str, place: Any, problem: str, hint: str) -> None:
    raise RecordingError(f'{origin}: line {place.start_mark.line + 1}', problem, hint)


class _Loader(_BASE):  # type: ignore[misc]
    """A strict YAML loader; ``origin`` names the document in messages."""

    origin = ''

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        first: dict[str, Any] = {}
        pairs = node.value if isinstance(node, yaml.MappingNode) else ()
        for key in (key for key, _ in pairs if isinstance(key, yaml.ScalarNode)):
            same = first.setdefault(key.value, key)
            if same is not key:
                problem = f'{quoted(key.value)} is already in line {same.start_mark.line + 1}'
                _refuse(self.origin, key, problem, 'keep one of the two')
        return super().construct_mapping(node, deep)

    def construct_object(self, node: Any, deep: bool = False) -> Any:
        try:
            return super().construct_object(node, deep)
        except (ValueError, TypeError, LookupError, AttributeError) as error:
            if isinstance(error, StickSlipError):
                raise
            problem = f'{quoted(node.value)} is not of its kind, {node.tag.rpartition(":")[2]}'
            _refuse(self.origin, node, problem, 'correct it')

    def construct_number(self, node: Any) -> Any:
        budget.NUMBER_CHARACTERS.check(len(node.value), self.origin)
        number = super().yaml_constructors[node.tag](self, node)
        if ':' in node.value:
            problem = f'YAML reads {node.value} as {number}, in base 60'
            _refuse(self.origin, node, problem, f"write {number}, or '{node.value}' for a text")
        return number


for tag in _NUMBERS:
    _Loader.add_constructor(tag, _Loader.construct_number)
