"""Parameters as a ROS parameter file: written with units and sources, read with refusals."""

import json
from collections.abc import Iterator
from pathlib import Path

from stickslip_ros.errors import RecordingError, UnknownName, WrongKind
from stickslip_ros.files import readable
from stickslip_ros.parameters.fields import Scalar, Spec
from stickslip_ros.parameters.strict_yaml import read_yaml
from stickslip_ros.parameters.tree import Parameters, specs

ROS_KEY = 'ros__parameters'
ANY_NODE = '/**'
CONTROLLER = 'position_controller'
"""Node whose section may stand in the file of a drive, and is passed over."""
MEND = 'compare it with config/test_stand.yaml'


def format_value(value: Scalar) -> str:
    """Return a value as YAML 1.1 and ROS both read it: a float keeps its point and its digits."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        mantissa, e, exponent = repr(value).partition('e')
        return (mantissa if '.' in mantissa else f'{mantissa}.0') + e + exponent
    return _quoted(value) if isinstance(value, str) else str(value)


def _quoted(text: str) -> str:
    """Return a text in quotes: single ones, double ones where it needs escapes."""
    if text.isprintable():
        return "'" + text.replace("'", "''") + "'"
    return json.dumps(text)


def describe(spec: Spec) -> str:
    """Return one line that says what a parameter is: text, unit, bounds or choices, source."""
    parts = [spec.text]
    if spec.unit:
        parts.append(f'[{spec.unit}]')
    if spec.minimum is not None and spec.maximum is not None:
        parts.append(f'{spec.minimum:g} to {spec.maximum:g}')
    if spec.choices:
        parts.append(' | '.join(spec.choices))
    return f'{" ".join(parts)} ({spec.source})'


def dump_yaml(parameters: Parameters, heading: str) -> str:
    """
    Return a ROS parameter file with every parameter, its unit and its source.

    Parameters
    ----------
    parameters : Parameters
        The values.
    heading : str
        Comment lines for the top, without ``#``.

    """
    return '\n'.join(_lines(parameters, heading)) + '\n'


def _lines(parameters: Parameters, heading: str) -> Iterator[str]:
    yield from (f'# {line}'.rstrip() for line in heading.splitlines())
    yield f'{ANY_NODE}:'
    yield f'  {ROS_KEY}:'
    flat = parameters.flat()
    current = ''
    for name, spec in specs().items():
        group, _, leaf = name.rpartition('.')
        if group != current:
            yield f'    {group}:'
            current = group
        indent = '      ' if group else '    '
        yield f'{indent}# {describe(spec)}'
        yield f'{indent}{leaf}: {format_value(flat[name])}'


def load_yaml(path: Path) -> Parameters:
    """
    Read a ROS parameter file; names that it leaves out keep their defaults.

    Raises
    ------
    RecordingError
        If the file cannot be read, is not YAML, or says something twice.
    UnknownName, WrongKind, OutOfRange
        If the file holds what the package does not know or allow.

    """
    return Parameters().updated(load_values(path))


def load_values(path: Path) -> dict[str, object]:
    """Return what a ROS parameter file gives, by name and unchecked; otherwise as above."""
    try:
        text = readable(path).read_text(encoding='utf-8')
    except OSError as error:
        problem = f'cannot be read ({error.strerror})'
        raise RecordingError(path, problem, 'check the path') from None
    except UnicodeDecodeError:
        raise RecordingError(path, 'is not text in UTF-8', 'give a ROS parameter file') from None
    return _values(read_yaml(text, str(path), MEND) or {}, str(path))


def parse_yaml(text: str, origin: str) -> Parameters:
    """
    Read the text of a ROS parameter file.

    Parameters
    ----------
    text : str
        YAML with ``/**:`` or a node name, then ``ros__parameters:``, then groups.
    origin : str
        Name of the source for messages.

    """
    return Parameters().updated(_values(read_yaml(text, origin, MEND) or {}, origin))


def _values(document: object, origin: str) -> dict[str, object]:
    """Return the parameters of the one drive of a file; what it says itself outweighs ``/**``."""
    sections: dict[str, dict[str, object]] = {}
    for node, body in _items(document, origin):
        if not isinstance(body, dict) or set(body) != {ROS_KEY}:
            mend = f'{origin} needs {ROS_KEY}: right below a node name'
            raise UnknownName('section', node, mend)
        if node.rpartition('/')[2] != CONTROLLER:
            sections[node] = _flat(body[ROS_KEY], origin)
    values = sections.pop(ANY_NODE, {})
    if len(sections) > 1:
        problem = f'is for several drives: {" and ".join(sections)}'
        raise RecordingError(origin, problem, f'keep one, or {ANY_NODE} for what all share')
    for own in sections.values():
        values |= own
    return values


def _flat(section: object, origin: str) -> dict[str, object]:
    values: dict[str, object] = {}
    for name, value in _flatten(section, '', origin):
        if name in values:
            raise RecordingError(origin, f'gives {name} twice', 'keep one of the two')
        values[name] = value
    return values


def _items(node: object, origin: str) -> Iterator[tuple[str, object]]:
    if not isinstance(node, dict):
        raise WrongKind(origin, node, 'a table of names', MEND)
    yield from ((str(key), value) for key, value in node.items())


def _flatten(node: object, prefix: str, origin: str) -> Iterator[tuple[str, object]]:
    for key, value in _items(node, origin):
        if isinstance(value, dict):
            yield from _flatten(value, f'{prefix}{key}.', origin)
        else:
            yield f'{prefix}{key}', value
