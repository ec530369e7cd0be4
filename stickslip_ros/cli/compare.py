"""``stickslip compare``: sweeps, runs and experiments against each other, or the model."""

import argparse
import shlex
from pathlib import Path
from typing import Any

from stickslip_ros.cli.common import (
    add_json,
    add_parameters,
    add_workers,
    chosen_parameters,
    print_json,
    print_table,
    to_path,
)
from stickslip_ros.cli.progress import shown_progress
from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.files import make_room
from stickslip_ros.study.comparison.by_amplitude import MODEL, ModelSettings
from stickslip_ros.study.comparison.compare import compare
from stickslip_ros.study.comparison.report import write_report
from stickslip_ros.study.comparison.result import Comparison
from stickslip_ros.study.comparison.words import sections, sentences
from stickslip_ros.study.sweep import FREQUENCY

SUFFIXES = ('.html', '.htm')
SECONDS_MAX = 1e12


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'compare',
        description='Compare A with B, each a recording (MCAP), a table of a sweep (CSV, '
        'Parquet) or an experiment file (CSV, see docs/compare.md). Tables are compared by '
        'amplitude and preload, runs over time. The word model for B runs the drive at the '
        'points of A. Without B, a recording is compared with the experiment that it carries.',
    )
    parser.add_argument('a', metavar='A', help='recording, table or experiment file')
    parser.add_argument('b', metavar='B', nargs='?', help=f'another one, or the word {MODEL}')
    parser.add_argument(
        '--report', type=to_path, metavar='FILE', help='write a page of HTML, to read or to print'
    )
    moved = parser.add_mutually_exclusive_group()
    moved.add_argument('--shift', type=float, metavar='SECONDS', help='add this to the times of B')
    moved.add_argument(
        '--align', action='store_true', help='estimate that shift by cross-correlation'
    )
    model = parser.add_argument_group('for the model')
    model.add_argument(
        '--frequency',
        type=float,
        metavar='HZ',
        help=f'steps per second, where A has no frequency_hz (default: {FREQUENCY.default:g})',
    )
    model.add_argument(
        '--steps', type=int, metavar='N', help='steps of each run (default: until steady)'
    )
    add_workers(model)
    add_parameters(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Compare, write and print."""
    _check(arguments)
    comparison = _compare(arguments)
    if arguments.report is not None:
        write_report(comparison, arguments.report, command_line(arguments))
    if arguments.json:
        print_json(comparison.to_json())
    else:
        _print(comparison, arguments.report)
    return 0


def command_line(arguments: argparse.Namespace) -> str:
    """Return the words that ask for this comparison, as a shell takes them."""
    words = ['stickslip', 'compare', arguments.a, *([arguments.b] if arguments.b else [])]
    for name in ('shift', 'frequency', 'steps'):
        value = getattr(arguments, name)
        if value is not None:
            words.append(f'--{name}={value!r}')
    if arguments.align:
        words.append('--align')
    if arguments.params is not None:
        words += ['--params', str(arguments.params)]
    for assignment in arguments.assignments:
        words += ['--set', assignment]
    if arguments.report is not None:
        words += ['--report', str(arguments.report)]
    return shlex.join(words)


def _compare(arguments: argparse.Namespace) -> Comparison:
    frequency_hz = FREQUENCY.default if arguments.frequency is None else arguments.frequency
    settings = ModelSettings(
        chosen_parameters(arguments), float(frequency_hz), arguments.steps or 0, arguments.workers
    )
    with shown_progress('runs', quiet=arguments.json) as progress:
        return compare(
            arguments.a,
            arguments.b,
            model=settings,
            shift_s=arguments.shift,
            estimate_shift=arguments.align,
            progress=progress,
        )


def _check(arguments: argparse.Namespace) -> None:
    """Refuse what would be without effect, or fail after the work is done."""
    report, shift_s = arguments.report, arguments.shift
    if report is not None and report.suffix.lower() not in SUFFIXES:
        raise WrongKind('report', str(report), 'an .html file', 'end its name so')
    if shift_s is not None and not abs(shift_s) <= SECONDS_MAX:
        limit = f'not within {SECONDS_MAX:g} s'
        raise OutOfRange('shift', shift_s, 's', limit, 'give seconds that B lags behind')
    given = {
        '--set': ' '.join(arguments.assignments),
        '--params': arguments.params,
        '--frequency': arguments.frequency,
        '--steps': arguments.steps,
    }
    for name, value in given.items():
        if value and arguments.b != MODEL:
            mend = f'write the word {MODEL} for B, or leave it away'
            raise OutOfRange(name, str(value), '', 'without effect on files', mend)
    if report is not None:
        make_room(report)


def _print(comparison: Comparison, report: Path | None) -> None:
    for letter, side in (('A', comparison.a), ('B', comparison.b)):
        print(f'{letter}  {side.origin}: {side.kind}, {side.rows} rows')
    if comparison.differences:
        rows = [(each.name, str(each.a), str(each.b)) for each in comparison.differences]
        print_table('what they say of themselves differently', rows, ('name', 'A', 'B'))
    for title, header, rows_of in sections(comparison):
        print_table(title, rows_of, header)
    for sentence in sentences(comparison):
        print(sentence)
    if report is not None:
        print(f'report {report}')
