"""The table of checks as texts and files: Markdown to read, CSV to compute with."""

import csv
import io
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from stickslip_ros.errors import WrongKind
from stickslip_ros.validation.checks import Check
from stickslip_ros.validation.figure import draw_page
from stickslip_ros.validation.findings import Findings, failed_checks

MARKDOWN, CSV, PNG = 'validation.md', 'validation.csv', 'validation.png'
DIGITS = 6
PREFIXES = {-4: 'p', -3: 'n', -2: 'u', -1: 'm', 0: '', 1: 'k', 2: 'M', 3: 'G'}
"""By powers of a thousand."""
PREFIXED_UNITS = ('m', 'N', 'J', 'Pa', 'N/m')
HEADER = ('check', 'reference', 'ours', 'error', 'tolerance', 'verdict')
LONG_HEADER = ('check', 'against', *HEADER[1:5], 'why this tolerance', 'verdict')
CSV_HEADER = (
    'family',
    'check',
    'against',
    'unit',
    'reference',
    'ours',
    'error',
    'error_of',
    'tolerance',
    'reason',
    'passed',
)


def value_text(value: float, unit: str) -> str:
    """Return a value for the eye, with a prefix where its unit takes one: ``81.5873 nm``."""
    if unit not in PREFIXED_UNITS or value == 0.0 or not math.isfinite(value):
        return f'{value:.{DIGITS}g} {unit}'.rstrip()
    power = math.floor(math.log10(abs(value)) / 3.0)
    power = min(max(power, min(PREFIXES)), max(PREFIXES))
    return f'{value / 1000.0**power:.{DIGITS}g} {PREFIXES[power]}{unit}'


def row_texts(check: Check) -> tuple[str, ...]:
    """Return a row of the short table, under HEADER."""
    return (
        check.name,
        value_text(check.reference, check.unit),
        value_text(check.ours, check.unit),
        f'{check.error:.1e}',
        f'{check.tolerance:.1e}',
        verdict(check),
    )


def verdict(check: Check) -> str:
    """Return ``pass`` or ``FAIL``."""
    return 'pass' if check.passed else 'FAIL'


def summary_text(findings: Sequence[Findings]) -> str:
    """Return how many checks were made and how many failed."""
    total = sum(len(found.checks) for found in findings)
    failed = len(failed_checks(findings))
    return f'{total} checks, {failed} failed' if failed else f'{total} checks, all passed'


def markdown_text(findings: Sequence[Findings]) -> str:
    """Return the table as Markdown, one section per family."""
    lines = [f'{summary_text(findings)}.', '', 'Errors are relative to the reference unless said.']
    for found in findings:
        lines += ['', f'### {found.family}', '']
        lines += [_markdown_row(LONG_HEADER), _markdown_row(['---'] * len(LONG_HEADER))]
        for check in found.checks:
            name, reference, ours, error, tolerance, word = row_texts(check)
            of = f' of {check.error_of}' if check.error_of else ''
            cells = (
                name,
                check.reference_text,
                reference,
                ours,
                error + of,
                tolerance,
                check.reason,
                word,
            )
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
    writer.writerow(CSV_HEADER)
    for found in findings:
        for c in found.checks:
            writer.writerow(
                (
                    found.family,
                    c.name,
                    c.reference_text,
                    c.unit,
                    repr(c.reference),
                    repr(c.ours),
                    repr(c.error),
                    c.error_of,
                    repr(c.tolerance),
                    c.reason,
                    c.passed,
                )
            )
    return text.getvalue()


def as_objects(findings: Sequence[Findings]) -> list[dict[str, Any]]:
    """Return the checks as objects for JSON, SI; what is not a finite number is None."""
    rows = []
    for found in findings:
        for check in found.checks:
            row = {'family': found.family, **vars(check), 'passed': check.passed}
            rows.append({key: _finite(value) for key, value in row.items()})
    return rows


def _finite(value: object) -> object:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_report(findings: Sequence[Findings], folder: Path) -> list[Path]:
    """
    Write the table as Markdown and CSV, and the page of plots.

    Parameters
    ----------
    findings : sequence of Findings
        What to report.
    folder : Path
        Made if need be; files of an earlier run are replaced.

    Returns
    -------
    list of Path
        The files.

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
        mend = f'{error.strerror or error}: choose another folder'
        raise WrongKind('--out', str(folder), 'a folder that can be written', mend) from None
    return files
