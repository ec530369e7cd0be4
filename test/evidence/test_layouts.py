# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Layouts of feet: the drive against springs one by one, and slow walkers against their law."""

from typing import Any

import numpy as np
import pytest

from evidence import layouts, odd_layouts
from evidence.__main__ import has_moved, key_of, stored_by_key
from evidence.closed_forms import FRICTION, contact_of
from evidence.layouts import LAYOUTS, M_PER_V, MESHES, PRELOAD_N, Case, Mesh, zero_amplitude_m
from evidence.odd_layouts import ODD
from evidence.page import PAGE, layouts_table, table_in
from stickslip_ros.lab.validation.layouts import cycles
from stickslip_ros.lab.validation.references import arguments_of

STORED = stored_by_key(layouts.TABLE)
REFERENCES_ERROR = 1e-4
"""Half the steps and twice the springs moved no reference by more, so 3e-4 is the drive's."""
FEET, FOOT_N = 6, PRELOAD_N * LAYOUTS['walker'].shares[0]
SLOW_HZ, SLOW_V_PER_S, SLOW_DAMPING, SLOW_CYCLES = 20.0, 1e5, 2.0, 6
SLOW_MESH = Mesh(300, 2e-7, 2e-7)
RINGS_ON = 1.1
"""The runner still rings when the next foot falls: 1.08 seen."""
SLOW = 1e-3
"""Of the stroke: a fall takes 3 ms, nine periods of the contacts at 3 kHz. Readout: 3e-4."""


def case_in(text: str) -> Case:
    """Return the case of a row, which leaves out defaults."""
    arguments: dict[str, Any] = arguments_of(text)
    case = Case(**arguments)
    return case._replace(cycles=round(case.cycles), last=round(case.last))


def test_the_table_has_the_rows_of_all_cases_and_their_errors_are_small():
    of_springs = dict.fromkeys(key[1] for key in STORED)
    odd = [text for text in of_springs if arguments_of(text)['layout'] in ODD]
    assert [case_in(text) for text in of_springs if text not in odd] == [*layouts.CASES]
    assert [arguments_of(text)['layout'] for text in odd] == [*ODD]
    assert max(float(row.why.split()[-1]) for row in STORED.values()) <= REFERENCES_ERROR


@pytest.mark.slow  # drives of springs
def test_a_clamp_and_a_button_made_anew_are_the_stored_ones():
    [case] = [each for each in layouts.CASES if each.layout == 'clamp' and each.cell_n_per_m]
    for row in (*layouts.references(case), *odd_layouts.references('button')):
        assert not has_moved(STORED[key_of(row)], row)


def test_the_page_has_the_table_of_layouts():
    assert table_in(PAGE.read_text(encoding='utf-8'), 'layouts') == layouts_table()


@pytest.mark.parametrize('feet', [3, 6, 40])
def test_the_zero_amplitude_of_a_walker_is_below_that_of_springs_of_one_length(feet):
    limit_m = float(contact_of('rough', FOOT_N).displacement(0.0))
    assert zero_amplitude_m(feet, FOOT_N) < 2.0 * limit_m * feet / (feet - 1)
    assert zero_amplitude_m(feet + 1, FOOT_N) < zero_amplitude_m(feet, FOOT_N)


def test_a_walker_holds_all_loads_below_the_limits_of_all_but_two_feet():
    limit_n, limit_m = FRICTION * FOOT_N, float(contact_of('rough', FOOT_N).displacement(0.0))
    most_n = (FEET - 2) * limit_n
    # Under the largest load every foot but the one that fell slips at the first fall: d/2 = u_max.
    assert zero_amplitude_m(FEET, FOOT_N, -0.999999 * most_n) == pytest.approx(
        FEET * 2.0 * limit_m, rel=0.01
    )


WALKS = [(300.0, 0.0), (240.0, 0.0), (300.0, -0.05), (150.0, 0.0)]


def slow_walk(voltage_v: float, load_n: float) -> tuple[Case, float]:
    """Return a slow walk, and its step by the law, m; damping brakes as a load."""
    case = Case(
        'walker', voltage_v, SLOW_HZ, SLOW_DAMPING, 0.0, SLOW_CYCLES, 1, load_n, SLOW_V_PER_S
    )
    stroke_m = voltage_v * M_PER_V
    load_n -= SLOW_DAMPING * stroke_m * SLOW_HZ
    return case, max(stroke_m - zero_amplitude_m(FEET, FOOT_N, load_n), 0.0)


@pytest.mark.parametrize(('voltage_v', 'load_n'), WALKS)
def test_a_slow_walker_of_the_drive_steps_by_the_law(voltage_v, load_n):
    case, step_m = slow_walk(voltage_v, load_n)
    error_m = abs(cycles(**case._asdict())['layout_step_m'] - step_m)
    assert error_m <= SLOW * voltage_v * M_PER_V


def test_a_fast_fall_unloads_its_own_foot_too_and_falls_of_30_us_lie_between():
    slow_m, fast_m = (zero_amplitude_m(FEET, FOOT_N, is_fast=fast) for fast in (False, True))
    case = slow_walk(300.0, 0.0)[0]
    found_m = {
        slew: 300.0 * M_PER_V
        - cycles(**case._replace(slew_v_per_s=slew)._asdict())['layout_step_m']
        for slew in (150e6, 10e6)
    }
    assert (fast_m, slow_m) == pytest.approx((71.13e-9, 105.5e-9), rel=1e-3)
    assert 1.0 < found_m[150e6] / fast_m < RINGS_ON
    assert 0.25 < (found_m[10e6] - fast_m) / (slow_m - fast_m) < 0.75


@pytest.mark.slow  # a drive of springs
def test_a_slow_walker_of_springs_steps_by_the_law():
    case, step_m = slow_walk(*WALKS[0])
    rows = layouts.run(case, LAYOUTS['walker'], SLOW_MESH)
    error_m = abs(layouts.numbers(case, rows)['layout_step_m'] - step_m)
    assert error_m <= SLOW * case.voltage_v * M_PER_V


def test_a_foot_of_springs_carries_its_load_with_any_number_of_springs():
    for mesh in MESHES:
        stiffnesses, limits_n = layouts.springs_of(FOOT_N, mesh.springs)
        contact = contact_of('rough', FOOT_N)
        assert limits_n.sum() == pytest.approx(FRICTION * FOOT_N, rel=1e-12)
        for share in (0.1, 0.5, 0.9):
            pulled_m = share * float(contact.displacement(0.0))
            force_n = np.minimum(stiffnesses * pulled_m, limits_n).sum()
            assert force_n == pytest.approx(contact.pull(pulled_m), rel=1e-5)
