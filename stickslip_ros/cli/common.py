"""What verbs share: parameters from the command line, tables, JSON."""

import argparse
import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from stickslip_ros.errors import RecordingError
from stickslip_ros.parameters import Parameters, load_values, parse_assignments


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


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add ``--json``, which every verb has."""
    parser.add_argument('--json', action='store_true', help='print one JSON object, SI units')


def add_folder(parser: argparse.ArgumentParser, default: str = 'runs') -> None:
    """Add the folder into which a verb writes."""
    parser.add_argument(
        '--out', type=to_path, default=Path(default), metavar='DIR', help='default: %(default)s'
    )


def add_workers(parser: argparse._ActionsContainer) -> None:
    """Add how many threads do the work."""
    parser.add_argument(
        '--workers', type=int, default=0, metavar='N', help='threads (default: one per core)'
    )


def add_parameters(parser: argparse.ArgumentParser) -> None:
    """Add the arguments that choose parameters."""
    parser.add_argument(
        '--params',
        type=to_path,
        metavar='FILE',
        help='ROS parameter file, as config/test_stand.yaml',
    )
    parser.add_argument(
        '--set',
        action='append',
        default=[],
        metavar='GROUP.NAME=VALUE',
        dest='assignments',
        help='set one parameter, in SI units; may be repeated; wins over --params',
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
    return {**values, **parse_assignments(arguments.assignments)}


def print_json(content: Any) -> None:
    """Print an object as JSON; dataclasses become objects."""
    if dataclasses.is_dataclass(content) and not isinstance(content, type):
        content = dataclasses.asdict(content)
    print(json.dumps(content, indent=2))


def print_table(title: str, rows: Sequence[tuple[str, ...]], header: tuple[str, ...] = ()) -> None:
    """Print rows as a table, the first column as names and the others right-aligned."""
    table = Table(title=title, title_justify='left', show_header=bool(header))
    for column in range(max(len(row) for row in [header, *rows])):
        name = header[column] if header else ''
        table.add_column(name, justify='right' if column else 'left', overflow='fold')
    for row in rows:
        table.add_row(*row)
    Console().print(table)
