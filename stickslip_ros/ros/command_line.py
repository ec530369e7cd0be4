"""Help and refusals of the executables, before anything is imported that takes long."""

import argparse
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import yaml

from stickslip_ros.errors import StickSlipError
from stickslip_ros.files import readable
from stickslip_ros.parameters import (
    ControllerParameters,
    Parameters,
    Spec,
    controller_parameters,
    declared_by,
    describe,
    format_value,
    specs,
)

REFUSED = 2
ROS_ARGS = '--ros-args'
FOREIGN = ('use_sim_time', 'start_type_description_service')
"""Parameters that every node of rclpy has."""
QOS_PREFIX = 'qos_overrides.'


class Program(NamedTuple):
    """An executable: its name, what it is, its parameters and how they are checked."""

    name: str
    text: str
    declared: Mapping[str, Spec]
    check: Callable[[Mapping[str, object]], object]


DRIVE = Program(
    'drive',
    'The virtual stick-slip microdrive, a lifecycle node that configures and activates itself.',
    specs(),
    Parameters().updated,
)
CONTROLLER = Program(
    'position_controller',
    'Brings the runner of a drive to the last ~/target and holds it there, over topics only.',
    declared_by(ControllerParameters),
    lambda given: controller_parameters({n: v for n, v in given.items() if n not in specs()}),
)
PROGRAMS = {program.name: program for program in (DRIVE, CONTROLLER)}
HELP = """\
usage: {name} [-h] [--ros-args [-p NAME:=VALUE] [--params-file FILE] [-r FROM:=TO] ...]

{text}
It runs until Ctrl-C or SIGTERM. Exit status: 0 ended so, 2 a parameter was refused, 3 closing
was cut short.

  -h, --help           print this and exit
  -p NAME:=VALUE       a parameter of the list below, in SI units
  --params-file FILE   a ROS parameter file, such as config/realistic.yaml
  -r FROM:=TO          another name, as in: -r __ns:=/left
  --log-level LEVEL    debug, info, warn, error

parameters, with their defaults:
"""


def help_or_refuse(program: Program, words: Sequence[str]) -> int | None:
    """
    Print help, or refuse a parameter, as far as that can be known without ROS.

    Return the exit status, or None if the node is to run, which checks its parameters itself.

    """
    own = words[: words.index(ROS_ARGS)] if ROS_ARGS in words else words
    if {'-h', '--help'} & set(own):
        sys.stdout.write(help_of(program))
        return 0
    try:
        program.check(dict(_given(program, words)))
    except StickSlipError as error:
        sys.stderr.write(f'{program.name}: {error}\n')
        return REFUSED
    return None


def help_of(program: Program) -> str:
    """Return the help of an executable."""
    lines = [
        f'  {name}:={format_value(spec.default)}\n      {describe(spec)}\n'
        for name, spec in program.declared.items()
    ]
    return HELP.format(name=program.name, text=program.text) + ''.join(lines)


def of_verb(words: Sequence[str]) -> list[str]:
    """Return what ``stickslip drive`` hands to ROS of its own arguments."""
    parser = argparse.ArgumentParser('stickslip drive', add_help=False)
    parser.add_argument('--params')
    parser.add_argument('--set', action='append', default=[])
    end = words.index(ROS_ARGS) if ROS_ARGS in words else len(words)
    known, _ = parser.parse_known_args(words[:end])
    files = ['--params-file', known.params] if known.params else []
    pairs = (text.replace('=', ':=', 1) for text in known.set)
    return [ROS_ARGS, *words[end:], *files, *(word for pair in pairs for word in ('-p', pair))]


def _given(program: Program, words: Sequence[str]) -> Iterator[tuple[str, object]]:
    """Give the parameters that are meant for the program whatever its node is called."""
    for option, word in pairwise(words):
        if option == '--params-file':
            yield from _own(_in_file(Path(word)))
        elif option in {'-p', '--param'} and ':' not in word.partition(':=')[0]:
            name, _, text = word.partition(':=')
            yield from _own({name: _read(program.declared.get(name), text)})


def _in_file(path: Path) -> dict[str, object]:
    """Return what a parameter file has for every node; of a bad file nothing: ROS says why."""
    try:
        document = yaml.safe_load(readable(path).read_text(encoding='utf-8'))
        return dict(_flat(document['/**']['ros__parameters']))
    except (OSError, ValueError, TypeError, LookupError, AttributeError, yaml.YAMLError):
        return {}


def _flat(section: Mapping[str, object], prefix: str = '') -> Iterator[tuple[str, object]]:
    for name, value in section.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f'{prefix}{name}.')
        else:
            yield f'{prefix}{name}', value


def _own(values: Mapping[str, object]) -> Iterator[tuple[str, object]]:
    """Give those of some parameters that do not belong to rclpy."""
    for name, value in values.items():
        if name not in FOREIGN and not name.startswith(QOS_PREFIX):
            yield name, value


def _read(spec: Spec | None, text: str) -> object:
    """Return a value as ROS reads it, as far as YAML of Python does; texts stay what they are."""
    try:
        value = yaml.safe_load(text)
    except yaml.YAMLError:
        return text
    is_text = spec is not None and spec.kind is str
    return text if is_text and not isinstance(value, str) else value
