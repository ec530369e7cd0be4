# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A drive with ageing friction against an independent slider, and the effect on its steps."""

import numpy as np
import pytest
from short_run import PLAIN, short_run

from stickslip_ros.drive.build import change_preload
from stickslip_ros.drive.waveform import sawtooth

AGES = {'contact__friction_rate': 0.01, 'contact__friction_ageing': 0.015}
RESIDUAL = 2e-4
"""Energy that the balance misses, relative to the work of the feet."""
APART = 5e-3
"""Share of the way by which feet that are moved one by one differ from all as one: each has a lag
and an age of its own."""


def test_without_coefficients_nothing_else_about_ageing_changes_a_bit():
    others = {'contact.rest_time': 1e3, 'contact.friction_cutoff': 1e-6}
    assert short_run({**PLAIN, **others}) == short_run(PLAIN)


@pytest.mark.parametrize('preload_n', [0.1, 1.0])
def test_the_balance_closes_while_friction_changes(drive, preload_n):
    machine = drive(**AGES, stand__preload=preload_n, load_cell__contact='absent')
    machine.start(sawtooth(0.0, 300.0, 1000.0, 0), [0.03])
    assert abs(machine.residual) < RESIDUAL


def test_the_first_step_after_a_pause_is_shorter_and_later_ones_forget_it(drive):
    def steps_m(rest_s):
        machine = drive(
            **AGES,
            contact__rest_time=rest_s,
            contact__friction_distance=1e-7,
            load_cell__contact='absent',
            runner__damping=20.0,
        )
        machine.start(sawtooth(0.0, 300.0, 500.0, 24), [0.049])
        return np.diff(machine.ramps[:24, 2])

    soon_m, late_m = steps_m(0.01), steps_m(10.0)
    assert late_m[0] < 0.95 * soon_m[0]
    assert late_m[-1] == pytest.approx(soon_m[-1], rel=5e-3)


def test_feet_that_are_moved_one_by_one_age_like_all_as_one(drive):
    ways_m = []
    for is_separate in (False, True):
        machine = drive(**AGES, load_cell__contact='absent', runner__damping=20.0)
        if is_separate:
            machine.separate()
        machine.start(sawtooth(0.0, 300.0, 500.0, 0), [0.02])
        assert np.all(machine.contacts['on_springs'])
        ways_m.append(machine.state.position_m)
    assert ways_m[1] == pytest.approx(ways_m[0], rel=APART)


def test_a_change_of_preload_goes_on_with_the_ages_and_new_springs_are_young(drive):
    machine = drive(**AGES, contact__rest_time=100.0)
    change_preload(machine.plants, machine.states, machine.parameters, 0.4)
    machine.start(sawtooth(0.0, 0.0, 1000.0, 0), [0.11])
    assert machine.state.preload_n == 0.4
    springs = machine.contacts[0].springs
    assert springs.ages_s[: springs.last[0] + 1] == pytest.approx(100.11)
    before = springs.last[0]
    change_preload(machine.plants, machine.states, machine.parameters, 0.8)
    machine.start(sawtooth(0.0, 0.0, 1000.0, 0), [0.5])
    assert np.all(springs.ages_s[before + 2 : springs.last[0] + 1] < 0.5)
