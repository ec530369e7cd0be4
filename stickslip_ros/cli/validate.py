"""``stickslip validate``: every check of the contact mechanics, in one table and one page."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from stickslip_ros.cli.common import add_json, print_json, to_path
from stickslip_ros.files import make_folder
from stickslip_ros.validation.checks import Findings, Outcome, failed_checks
from stickslip_ros.validation.evidence import validate
from stickslip_ros.validation.report import (
    HEADER,
    as_objects,
    row_texts,
    summary_text,
    write_report,
)

DEFAULT_FOLDER = Path('runs/validation')
FAILED = 1
STAR = '* error relative to a scale that the files name, not to the reference'
WIDTH = 120
"""Columns of the table where no terminal says how many it has."""


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'validate',
        description='Compare the contact mechanics with closed forms, springs stepped one by one, '
        'a 3-D half-space solution and published numbers. Writes validation.md, validation.csv '
        'and validation.png. Exit status 1 if a check fails.',
    )
    parser.add_argument(
        '--out',
        type=to_path,
        default=DEFAULT_FOLDER,
        metavar='DIR',
        help='folder for table and plots (default: %(default)s)',
    )
    add_json(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Check, write and print."""
    make_folder(arguments.out)
    findings = validate()
    files = write_report(findings, arguments.out)
    failed = failed_checks(findings)
    if arguments.json:
        print_json(
            {
                'passed': not failed,
                'checks': as_objects(findings),
                'files': [str(path) for path in files],
            }
        )
    else:
        _print(findings, files)
    return FAILED if failed else 0


def _print(findings: Sequence[Findings], files: Sequence[Path]) -> None:
    console = Console(width=None if sys.stdout.isatty() else WIDTH)
    console.print(_table(findings))
    for found in failed_checks(findings):
        console.print(failure_text(found), markup=False, highlight=False)
    summary = f'{summary_text(findings)}; {STAR}'
    console.print(summary, markup=False, highlight=False)
    for path in files:
        console.print(str(path), markup=False, highlight=False, soft_wrap=True)


def failure_text(found: Outcome) -> str:
    """Return what is wrong with a check that fails, and what error was to be expected."""
    check = found.check
    return (
        f'FAIL {check.name}: error {found.error:.2g} of {check.error_of or "the reference"} '
        f'({check.source}), above {check.tolerance.value:.2g}: {check.tolerance.reason}'
    )


def _table(findings: Sequence[Findings]) -> Table:
    table = Table(title='contact mechanics against references', title_justify='left')
    for column, name in enumerate(HEADER):
        table.add_column(name, justify='right' if column else 'left', overflow='fold')
    for found in findings:
        table.add_row(Text(found.family, style='bold'))
        for each in found.outcomes:
            name, reference, ours, error, *rest = row_texts(each)
            star = '*' if each.check.error_of else ' '
            cells = (f'  {name}', reference, ours, error + star, *rest)
            style = '' if each.passed else 'bold red'
            table.add_row(*(Text(cell) for cell in cells), style=style)
        table.add_section()
    return table
