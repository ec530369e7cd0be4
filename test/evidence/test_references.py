# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The table of references is what their codes give, made anew."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from evidence.__main__ import GROUPS, has_moved, key_of, stored_by_key
from evidence.closed_forms import contact_of
from evidence.contact_groups import REACHES_M, ring_down
from evidence.group import printed
from evidence.page import PAGE, families_table, spheres_table, table_in
from evidence.springs import Springs, pull
from stickslip_ros.lab.validation.references import TABLES, case_of, read_references
from stickslip_ros.lab.validation.self_test import CheckedAnswer

ROOT = Path(__file__).parents[2]
SOME = 3
"""Cases of a slow group that are made anew here; `make evidence` makes all."""
STORED = stored_by_key()
WORDS = 2500
"""At most, on the page."""


def marks_of(group):
    """Return the mark of a group whose three cases take seconds: drives of springs."""
    return pytest.mark.slow if group.quantity.startswith('drive_') else ()


@pytest.mark.parametrize(
    'group', [pytest.param(group, id=str(group), marks=marks_of(group)) for group in GROUPS]
)
def test_a_reference_made_anew_is_the_stored_one(group):
    for row in group.rows(SOME if group.is_slow else None):
        stored = STORED[key_of(row)]
        assert not has_moved(stored, row)
        numbers = {'reference': row.reference, 'relative_to': row.relative_to}
        version = {'version': row.version}
        assert stored._replace(**numbers, **version) == row, 'type make evidence'


def test_the_table_has_the_rows_of_all_codes_once_and_no_others():
    told = [(g.quantity, case_of(case), g.source) for g in GROUPS for case in g.cases]
    assert list(STORED) == told
    assert max(Counter(map(key_of, read_references())).values()) == 1


def test_a_reference_moves_when_it_leaves_rounding_or_is_no_number():
    row = STORED[key_of(next(iter(STORED.values())))]
    assert not has_moved(row, row)
    assert has_moved(row, row._replace(reference=row.reference * (1.0 + 2e-9)))
    assert has_moved(row, row._replace(reference=float('nan')))


def test_answers_of_other_codes_are_those_of_the_pinned_versions():
    locks = (ROOT / 'requirements' / f'{name}.txt' for name in ('evidence', 'slippy'))
    pinned = ''.join(lock.read_text(encoding='utf-8') for lock in locks)
    for code in {(row.made_by.lower(), row.version) for row in read_references(TABLES[2:])}:
        assert '=='.join(code) in pinned


def test_a_printed_figure_allows_half_a_unit_of_its_last_digit():
    [depth] = printed('', 'depth_m', '81.5873', '', {}, 1e-9).rows()
    assert abs(81.58734e-9 - depth.reference) <= depth.tolerance * depth.relative_to
    assert abs(81.58736e-9 - depth.reference) > depth.tolerance * depth.relative_to
    [power] = printed('', 'depth_m', '4.4478e-4', '', {}).rows()
    assert power.tolerance == pytest.approx(0.00005 / 4.4478, rel=1e-5)


def test_a_spring_sticks_slips_and_turns():
    springs = Springs(stiffness_n_per_m=2.0, limits_n=np.array([1.0]))
    history = pull(springs, np.array([0.25, 1.5, 0.5, 0.0]))
    assert history.force_n.tolist() == [0.5, 1.0, -1.0, -1.0]
    assert history.stored_j.tolist() == [0.0625, 0.25, 0.25, 0.25]
    assert history.lost_j.tolist() == [0.0, 1.0, 1.0, 1.5]


@pytest.mark.parametrize('profile', REACHES_M)
def test_the_sum_of_a_ring_down_is_the_rule_of_masing_turn_by_turn(profile):
    reach_m, few = REACHES_M[profile], 12
    turns_m = [reach_m * (1.0 - k / few) * (-1) ** k for k in range(few)]
    contact = contact_of(profile, 0.18)
    for after in (1, 2, 7, 12):
        expected = contact.along(tuple(turns_m[:after]))
        assert ring_down(profile, 0.18, reach_m, few, after) == pytest.approx(
            expected, rel=1e-10, abs=0.0
        )


def test_the_page_has_the_tables_that_make_evidence_writes():
    page = PAGE.read_text(encoding='utf-8')
    assert table_in(page, 'spheres') == spheres_table()
    compared = [row for row in read_references() if row.is_compared]
    met: dict[str, list[CheckedAnswer]] = {}
    for row in compared:
        met.setdefault(row.family, []).append(CheckedAnswer(row, row.reference))
    # The last column depends on the machine; whether answers are right, test_self_test.py says.
    shown, made = (
        [line.rpartition(' | ')[0] for line in table.splitlines()]
        for table in (table_in(page, 'families'), families_table(met))
    )
    assert shown == made, 'type make evidence'
    assert len(page.split()) <= WORDS
