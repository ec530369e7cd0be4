# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The generated tables of docs/evidence/validation.md, each behind a comment with its name."""

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from evidence.layouts import TABLE
from stickslip_ros.lab.validation.contacts import depth_m, normal_stiffness_n_per_m
from stickslip_ros.lab.validation.references import TABLES, arguments_of, read_references
from stickslip_ros.lab.validation.self_test import CheckedAnswer

PAGE = Path(__file__).parents[2] / 'docs' / 'evidence' / 'validation.md'
FAMILIES = ('family', 'references', 'against', 'tolerance', 'largest error/tolerance')
SPHERES = ('F_n (N)', 'depth d', 'stiffness dF_n/dd')
LAYOUT_COLUMNS = ('layout', 'steps or mean forces')
ANSWERED = {'depth_m': depth_m, 'normal_stiffness_n_per_m': normal_stiffness_n_per_m}


def markdown_row(cells: Iterable[str]) -> str:
    """Return a row; what Markdown would take for a mark-up is written otherwise."""
    plain = (cell.replace('|', '\\|').replace('*', '\\*') for cell in cells)
    return f'| {" | ".join(plain)} |'


def families_table(outcomes: Mapping[str, Sequence[CheckedAnswer]]) -> str:
    """Return what each family is compared with, and how close it comes."""
    lines = [markdown_row(FAMILIES), '|---' * len(FAMILIES) + '|']
    for family, found in outcomes.items():
        rows = [each.reference for each in found]
        words = (re.split('[:;] ', row.source)[0] for row in rows)
        sources = '; '.join(dict.fromkeys(words))
        least, most = (pick(row.tolerance for row in rows) for pick in (min, max))
        tolerance = f'{least:.1g}' if least == most else f'{least:.1g} to {most:.1g}'
        share = max(each.error / each.reference.tolerance for each in found)
        cells = (family, str(len(rows)), sources, tolerance, f'{share:.2g}')
        lines.append(markdown_row(cells))
    return '\n'.join(lines) + '\n'


def spheres_table() -> str:
    """Return random rough spheres over the body that stands for them: mean and scatter."""
    rows = [row for row in read_references(TABLES[2:]) if 'spheres' in row.source]
    lines = [markdown_row(SPHERES), '|---' * len(SPHERES) + '|']
    for case in dict.fromkeys(row.case for row in rows):
        load_n, told = float(case.rpartition('=')[2]), []
        for quantity, ours in ANSWERED.items():
            body = ours('rough', load_n)
            mean, scatter = (
                row.reference / body
                for row in rows
                if (row.case, row.quantity) == (case, quantity)
            )
            told.append(f'{mean:.2f} ± {scatter:.2f}')
        lines.append(markdown_row((f'{load_n:g}', *told)))
    return '\n'.join(lines) + '\n'


def layouts_table() -> str:
    """Return the steps and forces of layouts of feet."""
    lines = [markdown_row(LAYOUT_COLUMNS), '|---' * len(LAYOUT_COLUMNS) + '|']
    rows = [row for row in read_references((TABLE,)) if 'loss_factor' not in row.case]
    words: dict[str, list[str]] = {}
    for row in rows:
        shown = words.setdefault(str(arguments_of(row.case)['layout']), [])
        if row.quantity == 'layout_force_n':
            shown.append(f'{1e3 * row.reference:.3f} mN')
        elif row.quantity == 'layout_step_m':
            shown.append(f'{abs(1e9 * row.reference):.4f} nm')
    # Odd layouts have mean positions; these and rows with a loss are in the file alone.
    lines += [markdown_row((layout, ', '.join(each))) for layout, each in words.items() if each]
    return '\n'.join(lines) + '\n'


def table_in(page: str, name: str) -> str:
    """Return a table of the page."""
    return _pattern(name).search(page)[2]


def with_table(page: str, name: str, table: str) -> str:
    """Return the page with a table in its place."""
    return _pattern(name).sub(lambda found: found[1] + table, page)


def _pattern(name: str) -> re.Pattern[str]:
    return re.compile(rf'(<!-- {name}: written by make evidence -->\n\n)((?:\|.*\n)*)')
