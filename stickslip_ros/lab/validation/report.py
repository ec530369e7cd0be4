# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Results of the self-test as sections, page and CSV."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

from pandas import DataFrame

from stickslip_ros.errors import WrongKind
from stickslip_ros.lab.figures.page import page_of
from stickslip_ros.lab.validation.self_test import CheckedAnswer, failed
from stickslip_ros.sections import Section
from stickslip_ros.units import with_unit

_PAGE, _CSV = 'validation.html', 'validation.csv'
_HEADER = ('quantity', 'case', 'against', 'made by', 'reference', 'ours', 'error', 'tolerance')
Answers = Mapping[str, Sequence[CheckedAnswer]]


def summary_text(outcomes: Answers) -> str:
    """Return the numbers of references and of failures."""
    total, wrong = sum(map(len, outcomes.values())), len(failed(outcomes))
    return f'{total} references, {wrong} failed' if wrong else f'{total} references, all passed'


def failure_text(found: CheckedAnswer) -> str:
    """Return a line on a failed answer: both values, the error and its tolerance."""
    row = found.reference
    return (
        f'FAIL {row.quantity} of {row.case or "the default"}: {with_unit(found.ours, row.unit)}, '
        f'not {with_unit(row.reference, row.unit)} ({row.source}, {row.made_by}); '
        f'error {found.error:.2g} above {row.tolerance:.2g}: {row.why}'
    )


def report_sections(outcomes: Answers) -> Iterator[Section]:
    """Yield a summary with failures, then a section for each family."""
    rows = []
    for family, found in outcomes.items():
        wrong = sum(not each.passed for each in found)
        largest = max(each.error / each.reference.tolerance for each in found)
        rows.append((family, len(found), wrong or '', f'{largest:.2g}'))
    header = ('family', 'references', 'failed', 'largest error, of its tolerance')
    notes = [*map(failure_text, failed(outcomes)), summary_text(outcomes)]
    title = 'contact mechanics and drive against references'
    yield Section(title, rows, header, notes)
    for family, found in outcomes.items():
        rows_of_family = []
        for each in found:
            row, word = each.reference, '' if each.passed else ' FAIL'
            values = (with_unit(value, row.unit) for value in (row.reference, each.ours))
            errors = (f'{each.error:.1e}{word}', f'{row.tolerance:.1e}')
            cells = (row.quantity, row.case, row.source, row.made_by, *values, *errors)
            rows_of_family.append(cells)
        yield Section(family, rows_of_family, _HEADER)


def as_objects(outcomes: Answers) -> list[dict[str, Any]]:
    """Return each reference with our answer, SI."""
    rows = []
    for each in chain.from_iterable(outcomes.values()):
        ours = {'ours': each.ours, 'unit': each.reference.unit, 'error': each.error}
        rows.append({**each.reference._asdict(), **ours, 'passed': each.passed})
    return rows


def write_report(outcomes: Answers, folder: Path) -> list[Path]:
    """Write all references as page and CSV; return the files."""
    page, table = files = [folder / name for name in (_PAGE, _CSV)]
    try:
        page.write_text(page_of(report_sections(outcomes), 'stickslip validate'), encoding='utf-8')
        DataFrame(as_objects(outcomes)).to_csv(table, index=False)
    except OSError as error:
        hint = f'{error.strerror or error}: choose another folder'
        raise WrongKind('--output', str(folder), 'a folder that can be written', hint) from None
    return files
