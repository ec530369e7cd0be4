"""What may be typed: a verb with its options, and the parameters that they choose."""

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stickslip_ros.cli.printing import Answer
from stickslip_ros.errors import RecordingError, WrongKind
from stickslip_ros.parameters import Parameters, load_values, parse_assignments

Option = Callable[[Any], object]
"""Adds itself to a parser of argparse, or to a group of one."""


@dataclass(frozen=True)
class Verb:
    """
    A verb of ``stickslip``.

    Attributes
    ----------
    run : callable
        Makes the answer to a command line.
    reports_compilation : bool
        Whether it reports itself that kernels are compiled.
    takes_ros_arguments : bool
        Whether ``--ros-args`` and what follows are for it.

    """

    run: Callable[[argparse.Namespace], Answer]
    description: str
    options: tuple[Option, ...]
    reports_compilation: bool = False
    takes_ros_arguments: bool = False

    def fill(self, parser: argparse.ArgumentParser) -> None:
        """Add description and options to its parser."""
        parser.description = self.description
        for add in (*self.options, switch('--json', 'print one JSON object, SI units')):
            add(parser)
        parser.set_defaults(verb=self)


def verb(description: str, *options: Option, **traits: bool) -> Callable[..., Verb]:
    """Make a verb of the function that answers it."""
    return lambda run: Verb(run, description, options, **traits)


def option(
    flags: str,
    text: str,
    kind: Callable[[str], Any] | None = None,
    metavar: str | None = None,
    **more: Any,
) -> Option:
    """
    Return an option, as ``-o --output``, or an argument, which has no dashes.

    The text becomes its help, with the default behind it unless it names one. Paths are shown as
    FILE and whole numbers as N unless a ``metavar`` says otherwise; ``more`` goes to argparse.

    """
    default = more.get('default')
    if default and 'default: ' not in text:
        text += ' (default: %(default)g)' if kind is float else ' (default: %(default)s)'
    if metavar is None and flags.startswith('-'):
        metavar = {to_path: 'FILE', int: 'N'}.get(kind)
    if kind is not None:
        more['type'] = kind
    return lambda to: to.add_argument(*flags.split(), metavar=metavar, help=text, **more)


def many(flags: str, text: str, metavar: str, kind: Any = str, **more: Any) -> Option:
    """Return an option that may be repeated."""
    return option(flags, text, kind, metavar, action='append', default=[], **more)


def switch(flag: str, text: str, **more: Any) -> Option:
    """Return an option without a value; with a ``const`` and a ``dest`` it stands for that."""
    action = 'store_const' if 'const' in more else 'store_true'
    return lambda to: to.add_argument(flag, action=action, help=text, **more)


def either(*options: Option, required: bool = False) -> Option:
    """Return options of which one at most, or exactly one, may be given."""

    def add(to: Any) -> None:
        group = to.add_mutually_exclusive_group(required=required)
        for each in options:
            each(group)

    return add


def titled(title: str, *options: Option) -> Option:
    """Return options under a title of their own."""

    def add(to: Any) -> None:
        group = to.add_argument_group(title)
        for each in options:
            each(group)

    return add


def to_path(text: str) -> Path:
    """
    Return a path as it is typed; of ``.`` and ``..``, which have no name, the whole one.

    Raises
    ------
    RecordingError
        If it is empty.

    """
    if not text:
        raise RecordingError("''", 'is empty', 'give a path')
    path = Path(text)
    return path if path.name not in {'', '..'} else path.resolve()


def to_numbers(name: str, text: str, hint: str) -> list[float]:
    """
    Return the numbers of a list with commas.

    Raises
    ------
    WrongKind
        If a part is not a number; the message ends in the hint.

    """
    try:
        return [float(part) for part in text.split(',')]
    except ValueError:
        raise WrongKind(name, text, 'a list of numbers', hint) from None


def folder(default: str = 'runs', text: str = 'default: %(default)s') -> Option:
    """Return the option that names the folder into which a verb writes."""
    return option('--out', text, to_path, 'DIR', default=Path(default))


WORKERS = option('--workers', 'threads (default: one per core)', int, default=0)
PARAMETERS = (
    option('--params', 'ROS parameter file, as config/test_stand.yaml', to_path),
    many(
        '--set',
        'set one parameter, in SI units; may be repeated; wins over --params',
        'GROUP.NAME=VALUE',
        dest='assignments',
    ),
)
"""What chooses a stand. An option whose ``dest`` is the name of a parameter does so too."""
PRELOAD = option('--preload', 'sets stand.preload, N', float, 'N', dest='stand.preload')
FREE = switch(
    '--free',
    'no load cell: sets load_cell.contact=absent',
    dest='load_cell.contact',
    const='absent',
)


def chosen_parameters(arguments: argparse.Namespace) -> Parameters:
    """
    Return the parameters that a command line asks for.

    Raises
    ------
    StickSlipError
        If a name or a value is refused.

    """
    return Parameters().updated(chosen_values(arguments))


def chosen_values(arguments: argparse.Namespace) -> dict[str, object]:
    """Return the parameters that a command line names, whether or not they are the defaults."""
    values = load_values(arguments.params) if arguments.params else {}
    named = {
        name: value for name, value in vars(arguments).items() if '.' in name and value is not None
    }
    return {**values, **parse_assignments(arguments.assignments), **named}
