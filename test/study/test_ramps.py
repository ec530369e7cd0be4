"""What is read off the log of ramps: force, step length, and whether they are steady."""

import numpy as np
import pytest

from stickslip_ros.drive.build import plant_of
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.drive_run import run_drive
from stickslip_ros.study.ramps import (
    STEADY_STEPS_MIN,
    is_steady,
    mean_force_n,
    start_force_n,
    step_length_m,
)
from stickslip_ros.study.sawtooth_run import run_sawtooth

STIFFNESS_N_PER_M, GAP_M = 1e5, 2e-7
PRESSED = {'load_cell.contact': 'one_sided', 'load_cell.gap': GAP_M}
HELD = plant_of(Parameters())[0]
FREE = plant_of(Parameters().updated({'load_cell.contact': 'absent'}))[0]
BEHIND_GAP = plant_of(Parameters().updated(PRESSED))[0]
ROUNDING = 1e-12
SAME_FORCE = 2e-3
"""A one-sided load cell is met in short steps, a fixed one in long ones."""


def _ramps(values, column=1):
    ramps = np.zeros((len(values), 3))
    ramps[:, column] = values
    return ramps


def test_a_run_on_the_load_cell_is_steady_when_its_mean_position_is():
    flat = np.ones(STEADY_STEPS_MIN)
    assert is_steady(HELD, _ramps(flat))
    assert not is_steady(HELD, _ramps(flat[1:]))
    for rest, steady in ((0.9e-3, True), (1.1e-3, False)):
        late = flat.copy()
        late[-21] = 1.0 - rest
        assert is_steady(HELD, _ramps(late)) is steady
    late = flat.copy()
    late[:-21] = 0.0
    assert is_steady(HELD, _ramps(late))
    assert is_steady(HELD, _ramps(-flat))


def test_a_free_run_is_steady_when_its_step_length_is():
    count = np.arange(STEADY_STEPS_MIN + 50)
    assert is_steady(FREE, _ramps(1e-9 * count, column=2))
    assert not is_steady(FREE, _ramps(1e-9 * count**1.1, column=2))
    assert not is_steady(FREE, _ramps(1e-9 * count[:100], column=2))


def test_the_step_length_is_the_mean_of_the_last_ten():
    ends = np.concatenate((np.zeros(50), np.arange(1.0, 11.0)))
    assert step_length_m(_ramps(ends, column=2)) == 1.0
    assert step_length_m(_ramps([3.0, 8.0], column=2)) == 4.0


def test_forces_are_those_of_the_load_cell_that_there_is():
    ramps = np.array([[0.0, 0.0, 0.0], [5e-7, 3e-7, 6e-7]])
    stiff = STIFFNESS_N_PER_M
    for plant, mean_n, start_n in (
        (HELD, stiff * 3e-7, stiff * 5e-7),
        (FREE, 0.0, 0.0),
        (BEHIND_GAP, stiff * (3e-7 - GAP_M), stiff * (5e-7 - GAP_M)),
    ):
        assert mean_force_n(plant, ramps) == pytest.approx(mean_n, rel=ROUNDING)
        assert start_force_n(plant, ramps) == pytest.approx(start_n, rel=ROUNDING)
        assert mean_force_n(plant, ramps[:1]) == 0.0


def test_a_run_that_has_not_come_to_the_load_cell_is_not_steady():
    assert not is_steady(BEHIND_GAP, _ramps(np.full(STEADY_STEPS_MIN, 0.5 * GAP_M)))
    assert is_steady(BEHIND_GAP, _ramps(np.full(STEADY_STEPS_MIN, 2.0 * GAP_M)))


@pytest.mark.parametrize('run', ['drive', 'bench'])
def test_behind_a_gap_the_drive_presses_as_hard_as_when_it_is_fixed(run, stand):
    pressed = stand.updated(PRESSED)
    if run == 'drive':
        fixed, behind = (run_drive(each, 160e-9, 1000.0) for each in (stand, pressed))
    else:
        fixed, behind = (run_sawtooth(each, 300.0, 1000.0) for each in (stand, pressed))
    assert behind.steady
    assert behind.force_mean_n == pytest.approx(fixed.force_mean_n, rel=SAME_FORCE)
    assert behind.force_ramp_start_n == pytest.approx(fixed.force_ramp_start_n, rel=SAME_FORCE)
