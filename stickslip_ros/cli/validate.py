"""``stickslip validate``: every check of contact and drive, in one table and one page."""

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

from rich.table import Table
from rich.text import Text

from stickslip_ros.cli.printing import CHECK_FAILED, Answer, table
from stickslip_ros.files import make_folder
from stickslip_ros.progress import shown_progress
from stickslip_ros.validation.checks import Findings, Outcome, failed_checks
from stickslip_ros.validation.evidence import validate
from stickslip_ros.validation.report import (
    HEADER,
    as_objects,
    row_texts,
    summary_text,
    write_report,
)

STAR = '* error relative to a scale that the files name, not to the reference'


def validate_verb(arguments: argparse.Namespace) -> Answer:
    """Check and write."""
    make_folder(arguments.output)
    with shown_progress('families', quiet=arguments.json) as progress:
        findings = validate(progress=progress)
        files = write_report(findings, arguments.output)
    is_well = not failed_checks(findings)
    content = {
        'passed': is_well,
        'checks': as_objects(findings),
        'files': [str(path) for path in files],
    }
    return Answer(content, _parts(findings, files), 0 if is_well else CHECK_FAILED)


def _parts(findings: Sequence[Findings], files: Sequence[Path]) -> Iterator[str | Table]:
    yield _table(findings)
    for found in failed_checks(findings):
        yield failure_text(found)
    yield f'{summary_text(findings)}; {STAR}'
    yield from map(str, files)


def failure_text(found: Outcome) -> str:
    """Return what is wrong with a check that fails, and what error was to be expected."""
    check = found.check
    return (
        f'FAIL {check.name}: error {found.error:.2g} of {check.error_of or "the reference"} '
        f'({check.source}), above {check.tolerance.value:.2g}: {check.tolerance.reason}'
    )


def _table(findings: Sequence[Findings]) -> Table:
    shown = table('contact mechanics and drive against references', (), HEADER[:-1])
    for found in findings:
        shown.add_row(Text(found.family, style='bold'))
        for each in found.outcomes:
            name, reference, ours, error, tolerance, verdict = row_texts(each)
            star = '*' if each.check.error_of else ' '
            name = name if each.passed else f'{verdict} {name}'
            cells = (name, reference, ours, error + star, tolerance)
            style = '' if each.passed else 'bold red'
            shown.add_row(*(Text(cell) for cell in cells), style=style)
        shown.add_section()
    return shown
