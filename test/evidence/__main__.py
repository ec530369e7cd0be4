# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
``make evidence``: make every reference anew, compare with the table, write table and page.

Exit status 1: a reference moved by more than rounding. The table then has the new value.
"""

import itertools
import sys
import time
from collections.abc import Iterable
from pathlib import Path

from evidence import (
    ageing,
    contact_groups,
    half_space,
    laws,
    layouts,
    odd_layouts,
    published,
    roughness,
    spring_bank,
    spring_drive,
    springs,
    travelling,
)
from evidence.group import Group, csv_text
from evidence.page import PAGE, families_table, layouts_table, spheres_table, with_table
from stickslip_ros.lab.validation.references import TABLES, Reference, read_references
from stickslip_ros.lab.validation.self_test import validate

MODULES = (
    contact_groups,
    published,
    springs,
    half_space,
    roughness,
    spring_bank,
    laws,
    spring_drive,
    travelling,
    ageing,
)
FAMILIES = (
    'Normal load', 'Roughness', 'Own specification', 'Tangential load', 'Hysteresis', 'Energy',
    'Springs one by one', '3-D half-space', 'CONTACT, 3-D', 'Spectra', 'Ring-down', 'Spring bank',
    'Friction laws', 'Drive', 'Travelling roughness', 'Friction that ages',
)  # fmt: skip
"""In the order of the table, in which the codes of others come last."""
GROUPS: tuple[Group, ...] = tuple(
    sorted(
        (group for module in MODULES for group in module.GROUPS),
        key=lambda group: FAMILIES.index(group.family),
    )
)
REPEATABLE = 1e-9
"""Largest difference of a reference made anew, of its scale: rounding on another processor."""


def main() -> int:
    """Make all references, and say which moved."""
    moved = write(TABLES[0], ((str(group), group.rows()) for group in GROUPS))
    runs = ((' '.join(map(str, case)), layouts.references(case)) for case in layouts.CASES)
    odd = ((name, odd_layouts.references(name)) for name in odd_layouts.ODD)
    moved += write(layouts.TABLE, itertools.chain(runs, odd))
    page = with_table(PAGE.read_text(encoding='utf-8'), 'families', families_table(validate()))
    page = with_table(page, 'layouts', layouts_table())
    PAGE.write_text(with_table(page, 'spheres', spheres_table()), encoding='utf-8')
    return 1 if moved else 0


def write(path: Path, made: Iterable[tuple[str, Iterable[Reference]]]) -> int:
    """Make the rows of a table, by names of their codes; return how many moved."""
    stored, table, moved = stored_by_key(path), [], 0
    for name, rows in made:
        begin_s = time.process_time()
        for row in rows:
            before = stored.pop(key_of(row), None)
            if before is None:
                print(f'new: {row.quantity} of {row.case}: {row.reference:.9g}')
            elif has_moved(before, row):
                moved += 1
                print(
                    f'moved: {row.quantity} of {row.case} ({row.source}): '
                    f'{before.reference:.12g} is now {row.reference:.12g}'
                )
            else:  # what differs by rounding keeps its digits
                row = row._replace(  # noqa: PLW2901
                    reference=before.reference, relative_to=before.relative_to
                )
            table.append(row)
        took_s = time.process_time() - begin_s
        if took_s > 1.0:
            print(f'{name}: {took_s:.1f} s')
    for row in stored.values():
        print(f'gone: {row.quantity} of {row.case} ({row.source})')
    path.write_text(csv_text(table), encoding='utf-8')
    print(f'{len(table)} references in {path}; moved: {moved}')
    return moved


def stored_by_key(path: Path = TABLES[0]) -> dict[tuple[str, str, str], Reference]:
    """Return the rows of a table; none if it is not there."""
    return {key_of(row): row for row in read_references((path,) if path.exists() else ())}


def key_of(row: Reference) -> tuple[str, str, str]:
    """Return what tells a row from all others."""
    return row.quantity, row.case, row.source


def has_moved(before: Reference, now: Reference) -> bool:
    """Return whether a reference made anew differs by more than rounding."""
    allowed = min(REPEATABLE, 0.5 * before.tolerance) * before.relative_to
    return not abs(now.reference - before.reference) <= allowed


if __name__ == '__main__':
    sys.exit(main())
