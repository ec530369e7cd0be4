"""The self-test as texts and files: Markdown to read, CSV to compute with, and margins."""

import csv
import io
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from stickslip_ros.errors import WrongKind
from stickslip_ros.lab.runs.plotting import BLUE, VERMILION, new_figure, save_figure, styled
from stickslip_ros.lab.validation.self_test import CheckedAnswer, failed

_MARKDOWN, _CSV, _PNG = 'validation.md', 'validation.csv', 'validation.png'
_DIGITS = 6
_PREFIXES = {-4: 'p', -3: 'n', -2: 'u', -1: 'm', 0: '', 1: 'k', 2: 'M', 3: 'G'}
"""By powers of a thousand."""
PREFIXED_UNITS = ('m', 'N', 'J', 'Pa', 'N/m')
_HEADER = ('quantity', 'case', 'against', 'made by', 'reference', 'ours', 'error', 'tolerance')
LEAST_SHARE = 1e-6  # errors below that share of their tolerance are drawn there
Answers = Mapping[str, Sequence[CheckedAnswer]]


def value_text(value: float, unit: str) -> str:
    """Return a value for the eye, with a prefix where its unit takes one: ``81.5873 nm``."""
    if unit not in PREFIXED_UNITS or value == 0.0 or not math.isfinite(value):
        return f'{value:.{_DIGITS}g} {unit}'.rstrip()
    power = math.floor(math.log10(abs(value)) / 3.0)
    power = min(max(power, min(_PREFIXES)), max(_PREFIXES))
    return f'{value / 1000.0**power:.{_DIGITS}g} {_PREFIXES[power]}{unit}'


def summary_text(outcomes: Answers) -> str:
    """Return how many references there are and how many are missed."""
    total, wrong = sum(map(len, outcomes.values())), len(failed(outcomes))
    return f'{total} references, {wrong} failed' if wrong else f'{total} references, all passed'


def markdown_row(cells: Iterable[str]) -> str:
    """Return a row; what Markdown would take for a mark-up is written otherwise."""
    plain = (cell.replace('|', '\\|').replace('*', '\\*') for cell in cells)
    return f'| {" | ".join(plain)} |'


def markdown_text(outcomes: Answers) -> str:
    """Return every reference as Markdown, one section per family."""
    lines = [f'{summary_text(outcomes)}.', '', 'Errors are relative, to what validation.csv says.']
    for family, found in outcomes.items():
        lines += ['', f'### {family}', '']
        lines += [markdown_row(_HEADER), markdown_row(['---'] * len(_HEADER))]
        for each in found:
            row, word = each.reference, '' if each.passed else ' FAIL'
            values = (value_text(value, row.unit) for value in (row.reference, each.ours))
            errors = (f'{each.error:.1e}{word}', f'{row.tolerance:.1e}')
            cells = (row.quantity, row.case, row.source, row.made_by, *values, *errors)
            lines.append(markdown_row(cells))
    return '\n'.join(lines) + '\n'


def as_objects(outcomes: Answers) -> list[dict[str, Any]]:
    """Return a row of the table with our answer, SI, for each reference; None: not finite."""
    return [
        {
            key: None if isinstance(value, float) and not math.isfinite(value) else value
            for key, value in row.items()
        }
        for row in _rows(outcomes)
    ]


def _rows(outcomes: Answers) -> Iterator[dict[str, Any]]:
    for each in chain.from_iterable(outcomes.values()):
        ours = {'ours': each.ours, 'unit': each.reference.unit, 'error': each.error}
        yield {**each.reference._asdict(), **ours, 'passed': each.passed}


def csv_text(outcomes: Answers) -> str:
    """Return the same as CSV, with all digits."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator='\n')
    for number, row in enumerate(_rows(outcomes)):
        if not number:
            writer.writerow(row)
        writer.writerow(row.values())
    return text.getvalue()


@styled()
def draw_margins(outcomes: Answers, picture: Path) -> None:
    """Draw which share of its tolerance each error uses, a PNG file."""
    figure = new_figure(8.0, 5.0, f'stickslip validate: {summary_text(outcomes)}')
    axes = figure.subplots()
    for line, found in enumerate(outcomes.values()):
        shares = np.array([each.error / each.reference.tolerance for each in found])
        passed = np.array([each.passed for each in found], dtype=bool)
        drawn = np.clip(np.nan_to_num(shares, nan=np.inf), LEAST_SHARE, 1.0 / LEAST_SHARE)
        spread = line + np.linspace(-0.3, 0.3, len(drawn))
        axes.plot(drawn[passed], spread[passed], 'o', color=BLUE, markersize=4.0)
        axes.plot(drawn[~passed], spread[~passed], 'X', color=VERMILION, markersize=8.0)
    axes.axvline(1.0, color=VERMILION, linewidth=1.2)
    axes.set_xscale('log')
    axes.set_xlim(left=0.5 * LEAST_SHARE)
    axes.set_xlim(right=max(axes.get_xlim()[1], 4.0))
    axes.set_yticks(range(len(outcomes)), list(outcomes))
    axes.invert_yaxis()
    drawn_at_left = f'error/tolerance (at most {LEAST_SHARE:g} drawn at the left)'
    axes.set(xlabel=drawn_at_left, title='Every reference: right of the line it fails')
    save_figure(figure, picture)


def write_report(outcomes: Answers, folder: Path) -> list[Path]:
    """Write the table as Markdown and CSV, and the picture of margins; return the files."""
    files = [folder / name for name in (_MARKDOWN, _CSV, _PNG)]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        files[0].write_text(markdown_text(outcomes), encoding='utf-8')
        files[1].write_text(csv_text(outcomes), encoding='utf-8')
        draw_margins(outcomes, files[2])
    except OSError as error:
        hint = f'{error.strerror or error}: choose another folder'
        raise WrongKind('--output', str(folder), 'a folder that can be written', hint) from None
    return files
