"""The commanded voltage, and how the amplifier follows it within its range and slew rate."""

import math

import numpy as np
import pytest

from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.record import record
from stickslip_ros.drive.advance import advance_stretch
from stickslip_ros.drive.amplifier import SETTLED_V, clamp, follow
from stickslip_ros.drive.build import plant_of
from stickslip_ros.drive.piezo import foot_displacement
from stickslip_ros.drive.records import CLOCK, ENDLESS
from stickslip_ros.drive.waveform import CORNER_S, level, ramp_is_over, sawtooth, target

clamp = entry_point(clamp)
follow = entry_point(follow)
foot_displacement = entry_point(foot_displacement)
ramp_is_over = entry_point(ramp_is_over)
advance_stretch = entry_point(advance_stretch)
target = entry_point(target)

SLEW = 150e6
ROUNDING = 1e-12
"""A few operations on doubles."""


@pytest.fixture(scope='module')
def plant(stand):
    return plant_of(stand)[0]


def _clock(ramp_s, cycle=0):
    return record(CLOCK, ramp_s=ramp_s, cycle=cycle)


def test_a_level_is_held_for_ever():
    wave = level(120.0)
    for clock in (_clock(0.0), _clock(3.0), _clock(1e6, 7)):
        assert target(wave, clock) == (120.0, 0.0, math.inf)
        assert not ramp_is_over(wave, clock)


def test_a_sawtooth_forwards_rises_from_its_lower_end():
    wave = sawtooth(10.0, 200.0, 500.0, 3)
    assert (wave.start_v, wave.rise_v, wave.period_s, wave.cycles) == (10.0, 200.0, 2e-3, 3)
    voltage_v, slope, corner_s = target(wave, _clock(0.5e-3))
    assert voltage_v == pytest.approx(60.0, rel=ROUNDING, abs=0.0)
    assert slope == pytest.approx(1e5, rel=ROUNDING, abs=0.0)
    assert corner_s == pytest.approx(1.5e-3, rel=ROUNDING, abs=0.0)


def test_a_sawtooth_backwards_falls_from_its_upper_end():
    wave = sawtooth(10.0, 200.0, -500.0, 3)
    assert (wave.start_v, wave.rise_v, wave.period_s) == (210.0, -200.0, 2e-3)
    voltage_v, slope, _ = target(wave, _clock(0.5e-3))
    assert voltage_v == pytest.approx(160.0, rel=ROUNDING, abs=0.0)
    assert slope == pytest.approx(-1e5, rel=ROUNDING, abs=0.0)


def test_after_its_ramps_a_sawtooth_is_held_where_it_started():
    wave = sawtooth(10.0, 200.0, -500.0, 3)
    assert target(wave, _clock(1e-3, 3)) == (210.0, 0.0, math.inf)
    assert not ramp_is_over(wave, _clock(1.0, 3))


def test_a_sawtooth_without_a_number_of_steps_is_endless():
    assert sawtooth(0.0, 300.0, 1.0, 0).cycles == ENDLESS


def test_a_ramp_is_over_at_its_corner():
    wave = sawtooth(0.0, 300.0, 1000.0, 1)
    assert not ramp_is_over(wave, _clock(1e-3 - 1e-9))
    assert ramp_is_over(wave, _clock(1e-3 - 0.5 * CORNER_S))
    assert ramp_is_over(wave, _clock(1e-3))


def test_the_foot_follows_the_voltage_in_proportion(plant):
    assert foot_displacement(plant, 0.0) == 0.0
    assert foot_displacement(plant, 300.0) == pytest.approx(160e-9, rel=ROUNDING, abs=0.0)
    resting = plant.copy()
    resting.rest_v = 100.0
    assert foot_displacement(resting, 100.0) == 0.0
    assert foot_displacement(resting, 0.0) == pytest.approx(-160e-9 / 3.0, rel=ROUNDING, abs=0.0)


def test_the_amplifier_stays_in_its_range(plant):
    assert [clamp(plant, volt) for volt in (-1.0, 0.0, 150.0, 300.0, 301.0)] == [
        0.0, 0.0, 150.0, 300.0, 300.0,
    ]  # fmt: skip
    assert follow(plant, 300.0, 500.0, 0.0, 0.0) == (300.0, 0.0, math.inf)


def test_a_settled_amplifier_takes_the_slope_of_the_command(plant):
    assert follow(plant, 50.0, 50.0 + 0.5 * SETTLED_V, 3e5, 0.0) == (
        50.0 + 0.5 * SETTLED_V,
        3e5,
        math.inf,
    )
    assert follow(plant, 50.0, 50.0, 2.0 * SLEW, 0.0)[1] == SLEW
    assert follow(plant, 50.0, 50.0, -2.0 * SLEW, 0.0)[1] == -SLEW


@pytest.mark.parametrize('slope', [0.0, 3e5, -3e5])
@pytest.mark.parametrize(('voltage_v', 'target_v'), [(300.0, 0.0), (0.0, 300.0), (20.0, 21.0)])
def test_the_amplifier_catches_up_exactly_when_it_says(voltage_v, target_v, slope, plant):
    now_v, rate, caught_s = follow(plant, voltage_v, target_v, slope, 0.0)
    assert now_v == voltage_v
    assert rate == math.copysign(SLEW, target_v - voltage_v)
    reached_v = now_v + rate * caught_s
    assert reached_v == pytest.approx(target_v + slope * caught_s, rel=0.0, abs=300.0 * ROUNDING)
    assert caught_s > 0.0


def test_the_full_fall_takes_two_microseconds(plant):
    assert follow(plant, 300.0, 0.0, 0.0, 0.0)[2] == pytest.approx(2e-6, rel=ROUNDING, abs=0.0)


@pytest.mark.parametrize('slope', [SLEW, 2.0 * SLEW])
def test_a_command_that_runs_away_is_never_caught(slope, plant):
    assert follow(plant, 0.0, 100.0, slope, 0.0) == (0.0, SLEW, math.inf)


def test_the_voltage_of_a_drive_is_the_sawtooth_with_finite_falls(drive):
    machine = drive()
    wave = sawtooth(0.0, 300.0, 1000.0, 4)
    pieces_s = np.diff(np.concatenate(([0.0], np.linspace(1.7e-5, 6e-3, 353))))
    machine.start(wave, ())
    time_s, fall_s = 0.0, 300.0 / (SLEW + 300e3)
    for piece_s in pieces_s:
        machine.run(wave, [piece_s])
        time_s += piece_s
        cycle, ramp_s = divmod(time_s, 1e-3)
        slope = 300e3 if cycle < 4 else 0.0
        expected_v = slope * ramp_s
        if cycle in range(1, 5):
            expected_v = max(300.0 - SLEW * ramp_s, expected_v)
        # Next to a corner the cycle depends on rounding; the slew rate makes 1e-15 s harmless.
        near_corner = min(ramp_s, 1e-3 - ramp_s) < 1e-12
        assert near_corner or machine.state.voltage_v == pytest.approx(
            expected_v, rel=0.0, abs=1e-6
        )
    assert fall_s < 2e-6
    assert machine.state.voltage_v == 0.0
    assert machine.state.clock.cycle == 4


def test_a_level_is_reached_at_the_slew_rate(drive):
    machine = drive(amplifier__slew_rate=1e6)
    machine.start(level(300.0), [1e-4])
    assert machine.state.voltage_v == pytest.approx(100.0, rel=1e-9, abs=0.0)
    machine.run(level(300.0), [1e-3])
    assert machine.state.voltage_v == 300.0


def test_no_step_leaves_the_range_of_the_amplifier(plant, drive):
    machine = drive()
    advance_stretch(plant, machine.state, 299.0, SLEW, 0.0, 1e-6)
    assert machine.state.voltage_v == 300.0
