# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Shapes of a cycle, waves within their limits, what they do to the drive, and their worth."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import trapezoid
from scipy.interpolate import PchipInterpolator

from stickslip_ros.arrays import Array
from stickslip_ros.drive.build import friction_limit_n
from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.design.objectives import COST_MAX, WaveGoal, assess
from stickslip_ros.lab.design.search import WaveSearch
from stickslip_ros.lab.design.shapes import SHAPES, spline
from stickslip_ros.lab.design.steady_cycle import measure
from stickslip_ros.lab.design.waves import (
    KNOTS_MAX,
    KNOTS_MIN,
    SPLINE,
    playable,
    write_wave,
)
from stickslip_ros.lab.runs.courses import run_course
from stickslip_ros.lab.runs.replay import read_drive_input
from stickslip_ros.lab.runs.sawtooth_run import run_drive
from stickslip_ros.parameters import Parameters

KNOTS = [0.0, 0.2, 0.4, 0.6, 0.8, 0.9, 1.0]
HEIGHTS = [0.0, 0.1, 0.5, 1.0, 0.6, 0.2, 0.0]


def assert_closed_with_one_rise(rows):
    time, height = rows.T
    top = int(np.argmax(height))
    assert (tuple(rows[0]), tuple(rows[-1]), height[top]) == ((0.0, 0.0), (1.0, 0.0), 1.0)
    assert (np.diff(time) >= 0.0).all()
    assert (np.diff(height[: top + 1]) >= 0.0).all()
    assert (np.diff(height[top:]) <= 0.0).all()


@pytest.mark.parametrize('name', SHAPES)
@given(data=st.data())
def test_a_named_shape_is_closed_whatever_its_parameters(name, data):
    shape = SHAPES[name]
    values = {
        trait: data.draw(st.floats(bounds.low, bounds.high))
        for trait, bounds in shape.traits.items()
    }
    assert_closed_with_one_rise(shape.rows(**values))


@given(data=st.data())
def test_a_spline_is_closed_and_monotone_on_either_side_whatever_its_knots(data):
    count = data.draw(st.integers(KNOTS_MIN, KNOTS_MAX))
    positive = st.floats(1e-4, 1.0)
    steps = np.array(data.draw(st.lists(positive, min_size=count, max_size=count)))
    rise = data.draw(st.integers(1, count - 1))
    times = np.concatenate(([0.0], np.cumsum(steps)[:-1] / steps.sum(), [1.0]))
    up, down = np.cumsum(steps[:rise]), np.cumsum(steps[rise:])
    heights = [0.0, *(up[:-1] / up[-1]), 1.0, *(1.0 - down[:-1] / down[-1]), 0.0]
    rows = spline(times, heights)
    assert_closed_with_one_rise(rows)
    for part in (np.s_[: rise + 1], np.s_[rise:]):
        first_s, last_s = times[part][[0, -1]]
        of_part = rows[(rows[:, 0] >= first_s) & (rows[:, 0] < last_s)]
        joined = PchipInterpolator(times[part], heights[part])(of_part[:, 0])
        assert of_part[:, 1].tolist() == np.clip(joined, 0.0, 1.0).tolist()
    for knot in zip(times, heights, strict=True):
        assert np.abs(rows - knot).max(axis=1).min() < 1e-12  # every knot is a corner


def test_the_usual_parameters_are_the_published_forms():
    assert SHAPES['sawtooth'].rows().tolist() == [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0]]
    time, height = SHAPES['parabola'].rows()[:-1].T
    assert height[time < 1.0] == pytest.approx(time[time < 1.0] ** 2)
    time, height = SHAPES['cycloid'].rows().T
    assert height == pytest.approx(height[::-1])
    assert np.interp(0.25, time, height) < 0.25  # a cusp on top is steep beside it
    time, height = SHAPES['sine-compensated'].rows()[:-1].T
    assert height == pytest.approx(time - np.sin(2.0 * np.pi * time) / (2.0 * np.pi))
    kick = SHAPES['freeze-and-kick'].rows(rise=0.5, freeze=0.5)
    assert kick[1:4].tolist() == [[0.5, 1.0], [0.75, 1.0], [0.75, 0.0]]
    trapezoid = SHAPES['trapezoid'].rows(rise=0.25, fall=0.25, hold=0.5)
    assert trapezoid[:, 0].tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]


def test_more_rows_follow_the_same_curve():
    few, many = spline(KNOTS, HEIGHTS), spline(KNOTS, HEIGHTS, rows=192)
    assert len(many) > 3 * len(few)
    assert np.interp(few[:, 0], *many.T) == pytest.approx(few[:, 1], rel=0.0, abs=1e-3)


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


@pytest.mark.parametrize('load_n', [0.0, 0.05])
def test_flatness_is_that_of_four_speeds_from_no_load_to_the_whole_load(load_n):
    free = STAND.updated({'load_cell.contact': 'absent'})
    whole_n = load_n or 0.25 * friction_limit_n(STAND)
    steps_m = [
        run_drive(free, 160e-9, 1000.0, load_n=-share * whole_n / 3.0).step_length_m
        for share in range(4)
    ]
    flatness = (max(steps_m) - min(steps_m)) / float(np.mean(steps_m))
    worth = run_course(assess(WaveGoal('flatness', load_n), STAND, np.array(SAWTOOTH)))
    assert worth.value == pytest.approx(flatness, rel=1e-4, abs=0.0)
