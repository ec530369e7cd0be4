# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A wave within its limits, what it does to the drive, and what that is worth."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import trapezoid

from stickslip_ros.arrays import Array
from stickslip_ros.drive.build import friction_limit_n
from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.design.objectives import COST_MAX, OBJECTIVES, WaveGoal, assess
from stickslip_ros.lab.design.search import WaveSearch
from stickslip_ros.lab.design.shapes import SHAPES
from stickslip_ros.lab.design.steady_cycle import CONTACT_SHARE, measure
from stickslip_ros.lab.design.waves import SPLINE, PeriodicWave, playable, write_wave
from stickslip_ros.lab.runs.courses import run_course
from stickslip_ros.lab.runs.replay import read_drive_input
from stickslip_ros.lab.runs.sawtooth_run import run_drive
from stickslip_ros.parameters import Parameters

pytestmark = pytest.mark.usefixtures('compiled_kernels')

STAND = Parameters()
FREE = STAND.updated({'load_cell.contact': 'absent'})
SLOW = STAND.updated({'amplifier.slew_rate': 2e6, 'amplifier.current_max': 5e-3})
SLOWEST_V_PER_S = 1e6
"""Slew rate of that stand: 5 mA into 5 nF."""
SAWTOOTH = [(0.0, 0.0), (1e-3, 300.0), (1e-3, 0.0)]


@pytest.mark.parametrize('shape', [*SHAPES, SPLINE])
@settings(max_examples=25)
@given(data=st.data())
def test_every_wave_of_a_space_keeps_range_slew_rate_and_current_and_closes(shape, data):
    search = WaveSearch(WaveGoal('speed'), SLOW, (200.0, 2000.0), (0.1, 1.0))
    share, size = st.floats(0.0, 1.0), len(search.start(shape))
    place = data.draw(st.lists(share, min_size=size, max_size=size))
    wave = search.wave(shape, np.array(place))
    time_s, volts = wave.rows(SLOW).T
    assert 200.0 <= wave.frequency_hz <= 2000.0 * (1.0 + 1e-12)
    assert 0.1 <= wave.preload_n <= 1.0 + 1e-12
    assert volts.min() >= 0.0
    assert volts.max() <= 300.0 * (1.0 + 1e-12)
    assert time_s[0] == 0.0
    assert time_s[-1] == pytest.approx(1.0 / wave.frequency_hz, rel=1e-12, abs=0.0)
    assert (np.diff(time_s) > 0.0).all()  # so that command/waveform takes it
    assert np.abs(np.diff(volts) / np.diff(time_s)).max() <= SLOWEST_V_PER_S * (1.0 + 1e-9)
    assert volts[0] == volts[-1]


def test_a_jump_takes_the_time_of_the_slew_rate_from_the_rest_of_the_cycle():
    rows = playable(SHAPES['sawtooth'].rows(), STAND, 300.0, 1000.0)
    assert rows[:, 1].tolist() == [0.0, 300.0, 0.0]
    assert rows[:, 0] == pytest.approx([0.0, 998e-6, 1e-3], rel=1e-8, abs=0.0)


@pytest.mark.parametrize(
    ('voltage_v', 'frequency_hz', 'message'),
    [
        (301.0, 1000.0, 'voltage of a wave 301 V is not above 0 V and up to 300 V'),
        (0.0, 1000.0, 'voltage of a wave 0 V is not above 0 V'),
        (300.0, 2e6, r'frequency 2e\+06 Hz is more than the slew rate of 1.5e\+08 V/s allows'),
    ],
)
def test_what_the_amplifier_cannot_play_is_refused(voltage_v, frequency_hz, message):
    with pytest.raises(StickSlipError, match=message):
        playable(SHAPES['cycloid'].rows(), STAND, voltage_v, frequency_hz)


def test_the_saw_tooth_as_a_table_does_what_the_saw_tooth_does():
    free = run_course(measure(FREE, np.array(SAWTOOTH)))
    assert free.step_m == pytest.approx(run_drive(FREE, 160e-9, 1000.0).step_length_m, rel=5e-3)
    fixed = run_course(measure(STAND, np.array(SAWTOOTH), change=1e-5))
    force_n = run_drive(STAND, 160e-9, 1000.0, 400).force_mean_n
    following_n = STAND.load_cell.stiffness * fixed.trace()[:, 2].mean()
    assert fixed.force_n + following_n == pytest.approx(force_n, rel=2e-3)


def test_feet_under_a_runner_that_is_held_lose_the_closed_form_whatever_the_wave():
    held = STAND.updated({'load_cell.stiffness': 1e9})
    u_m: Array = np.linspace(0.0, 0.5 * 160e-9, 4001, dtype=np.float64)
    force_n = np.sum([contact.tangential_force(u_m) for contact in contacts_of(held)], axis=0)
    loss_j = 8.0 * float(trapezoid(force_n, u_m) - 0.5 * force_n[-1] * u_m[-1])
    for shape in (SHAPES['cycloid'].rows(), SHAPES['trapezoid'].rows(fall=0.3)):
        rows = playable(shape, held, 300.0, 50.0)
        assert run_course(measure(held, rows)).work_j == pytest.approx(loss_j, rel=0.02)


@pytest.mark.parametrize('name', SHAPES)
def test_no_shape_beats_the_friction_limit(name):
    rows = playable(SHAPES[name].rows(), STAND, 300.0, 1000.0)
    limit_n = friction_limit_n(STAND)
    assert limit_n == pytest.approx(0.3 * 2.0 * np.sqrt(2.0) * 0.5, rel=1e-6)
    assert run_course(assess(WaveGoal('force'), STAND, rows)).value < limit_n
    energy = run_course(assess(WaveGoal('energy'), STAND, rows)).value
    assert np.isnan(energy) if name == 'cycloid' else energy > limit_n


def test_backwards_every_objective_has_the_value_of_forwards():
    wave = PeriodicWave('parabola', {}, 300.0, 1000.0, 0.5)
    for objective in OBJECTIVES:
        goal = WaveGoal(objective, speed_m_per_s=5e-5 if objective == 'vibration' else 0.0)
        there, back = (
            run_course(assess(each, STAND, wave.rows(STAND, backwards=each.backwards)))
            for each in (goal, dataclasses.replace(goal, backwards=True))
        )
        assert back.value == pytest.approx(there.value, rel=1e-3), objective


def test_constraints_cost_and_waves_that_do_not_advance_are_worthless():
    full = playable(SHAPES['sawtooth'].rows(), STAND, 300.0, 1000.0)
    weak = playable(SHAPES['sawtooth'].rows(), STAND, 60.0, 1000.0)
    for objective in ('speed', 'step', 'energy', 'flatness'):
        worth = run_course(assess(WaveGoal(objective), STAND, weak))
        assert worth.cost == COST_MAX or objective == 'speed'
    step = run_course(assess(WaveGoal('step'), STAND, full))
    assert (step.cost, step.meets) == (step.value, True)
    pushed = run_course(assess(WaveGoal('step', load_n=0.3), STAND, full))
    assert pushed.cost > 1.5 * pushed.value
    assert not pushed.meets
    loaded = run_course(assess(WaveGoal('speed', load_n=0.1), STAND, full))
    assert loaded.value < run_course(assess(WaveGoal('speed'), STAND, full)).value


@pytest.mark.parametrize('objective', ['vibration', 'energy', 'flatness', 'step'])
def test_a_speed_that_is_missed_costs_and_one_that_is_made_does_not(objective):
    full = playable(SHAPES['sawtooth'].rows(), STAND, 300.0, 1000.0)
    slow, fast = (
        run_course(assess(WaveGoal(objective, speed_m_per_s=v), STAND, full)) for v in (2e-4, 2e-5)
    )
    assert slow.cost == pytest.approx(slow.value * (2e-4 / slow.cycle.speed_m_per_s) ** 4)
    assert not slow.meets
    assert (fast.cost, fast.meets) == (slow.value, True)


def test_contacts_that_are_looked_at_slip_fully_once_a_cycle():
    rows = playable(SHAPES['sawtooth'].rows(), FREE, 300.0, 1000.0)
    cycle = run_course(measure(FREE, rows))
    looked, blind = cycle.trace(contacts=True), cycle.trace()
    assert looked[:, 2:CONTACT_SHARE] == pytest.approx(
        blind[:, 2:CONTACT_SHARE], rel=1e-6, abs=1e-15
    )
    shares = looked[:, CONTACT_SHARE]
    assert np.abs(shares).max() == pytest.approx(1.0, rel=1e-6)


def test_a_written_wave_is_what_the_commands_read(tmp_path):
    rows = playable(SHAPES['cycloid'].rows(), STAND, 300.0, 1000.0)
    write_wave(rows, tmp_path / 'wave.csv')
    read = read_drive_input(tmp_path / 'wave.csv', STAND)
    assert np.column_stack((read.time_s, read.voltage_v)).tolist() == rows.tolist()


@pytest.mark.parametrize(
    ('values', 'message'),
    [
        ({'objective': 'beauty'}, "objective 'beauty' is not known; known are speed, force"),
        ({'objective': 'speed', 'load_n': -1.0}, 'load -1 N is not a force from 0 N on'),
        ({'objective': 'speed', 'load_n': float('nan')}, 'load nan N is not a force'),
        ({'objective': 'vibration'}, 'speed 0 m/s is not a speed above 0 m/s'),
        ({'objective': 'force', 'speed_m_per_s': 1.0}, 'speed 1 m/s is of no use'),
        ({'objective': 'force', 'load_n': 0.05}, 'load 0.05 N is of no use'),
    ],
)
def test_goals_that_cannot_be_meant_are_refused(values, message):
    with pytest.raises(StickSlipError, match=message):
        WaveGoal(**values)
