"""The table of checks as texts and files: Markdown to read, CSV to compute with."""

import csv
import io
import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from stickslip_ros.errors import WrongKind
from stickslip_ros.validation.checks import Findings, Outcome, failed_checks
from stickslip_ros.validation.figure import draw_page

MARKDOWN, CSV, PNG = 'validation.md', 'validation.csv', 'validation.png'
DIGITS = 6
PREFIXES = {-4: 'p', -3: 'n', -2: 'u', -1: 'm', 0: '', 1: 'k', 2: 'M', 3: 'G'}
"""By powers of a thousand."""
PREFIXED_UNITS = ('m', 'N', 'J', 'Pa', 'N/m')
HEADER = ('check', 'reference', 'ours', 'error', 'tolerance', 'verdict')
LONG_HEADER = ('check', 'against', *HEADER[1:5], 'why this tolerance', 'verdict')
CSV_COLUMNS = {
    'family': 'family',
    'name': 'check',
    'reference_text': 'against',
    'unit': 'unit',
    'reference': 'reference',
    'ours': 'ours',
    'error': 'error',
    'error_of': 'error_of',
    'tolerance': 'tolerance',
    'reason': 'reason',
    'passed': 'passed',
}
"""Headings by the keys of JSON."""


def value_text(value: float, unit: str) -> str:
    """Return a value for the eye, with a prefix where its unit takes one: ``81.5873 nm``."""
    if unit not in PREFIXED_UNITS or value == 0.0 or not math.isfinite(value):
        return f'{value:.{DIGITS}g} {unit}'.rstrip()
    power = math.floor(math.log10(abs(value)) / 3.0)
    power = min(max(power, min(PREFIXES)), max(PREFIXES))
    return f'{value / 1000.0**power:.{DIGITS}g} {PREFIXES[power]}{unit}'


def row_texts(found: Outcome) -> tuple[str, ...]:
    """Return a row of the short table, under HEADER."""
    check = found.check
    return (
        check.name,
        value_text(found.reference, check.unit),
        value_text(found.ours, check.unit),
        f'{found.error:.1e}',
        f'{check.tolerance.value:.1e}',
        'pass' if found.passed else 'FAIL',
    )


def summary_text(findings: Sequence[Findings]) -> str:
    """Return how many checks were made and how many failed."""
    total = sum(len(found.outcomes) for found in findings)
    failed = len(failed_checks(findings))
    return f'{total} checks, {failed} failed' if failed else f'{total} checks, all passed'


def markdown_text(findings: Sequence[Findings]) -> str:
    """Return the table as Markdown, one section per family."""
    lines = [f'{summary_text(findings)}.', '', 'Errors are relative to the reference unless said.']
    for found in findings:
        lines += ['', f'### {found.family}', '']
        lines += [_markdown_row(LONG_HEADER), _markdown_row(['---'] * len(LONG_HEADER))]
        for each in found.outcomes:
            check, (name, reference, ours, error, tolerance, word) = each.check, row_texts(each)
            error += f' of {check.error_of}' if check.error_of else ''
            reason = check.tolerance.reason
            cells = (name, check.source, reference, ours, error, tolerance, reason, word)
            lines.append(_markdown_row(cells))
    return '\n'.join(lines) + '\n'


def _markdown_row(cells: Iterable[str]) -> str:
    """Return a row; what Markdown would take for a mark-up is written otherwise."""
    plain = (cell.replace('|', '\\|').replace('*', '\\*') for cell in cells)
    return f'| {" | ".join(plain)} |'


def csv_text(findings: Sequence[Findings]) -> str:
    """Return the table as CSV with all digits, SI."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator='\n')
    writer.writerow(CSV_COLUMNS.values())
    for row in _rows(findings):
        writer.writerow(row[key] for key in CSV_COLUMNS)
    return text.getvalue()


def as_objects(findings: Sequence[Findings]) -> list[dict[str, Any]]:
    """Return the checks as objects for JSON, SI; what is not a finite number is None."""
    return [{key: _finite(value) for key, value in row.items()} for row in _rows(findings)]


def _rows(findings: Sequence[Findings]) -> Iterator[dict[str, Any]]:
    for found in findings:
        for each in found.outcomes:
            check = each.check
            yield {
                'family': found.family,
                'name': check.name,
                'reference_text': check.source,
                'reference': each.reference,
                'ours': each.ours,
                'unit': check.unit,
                'error': each.error,
                'tolerance': check.tolerance.value,
                'reason': check.tolerance.reason,
                'error_of': check.error_of,
                'passed': each.passed,
            }


def _finite(value: object) -> object:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_report(findings: Sequence[Findings], folder: Path) -> list[Path]:
    """
    Write the table as Markdown and CSV, and the page of plots; return the files.

    The folder is made if need be, and files of an earlier run are replaced.

    Raises
    ------
    WrongKind
        If the folder cannot be written.

    """
    files = [folder / name for name in (MARKDOWN, CSV, PNG)]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        files[0].write_text(markdown_text(findings), encoding='utf-8')
        files[1].write_text(csv_text(findings), encoding='utf-8')
        draw_page(findings, files[2], summary_text(findings))
    except OSError as error:
        hint = f'{error.strerror or error}: choose another folder'
        raise WrongKind('--output', str(folder), 'a folder that can be written', hint) from None
    return files
