# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""From command to output: range and slew rate, converter, current, low-pass, and arrival."""

import math

import numpy as np
import pytest

from stickslip_ros.drive.advance import RAMP_MEAN, RAMP_START, advance_stretch
from stickslip_ros.drive.amplifier import (
    ARRIVED_SHARE,
    FALL_SHARE,
    SETTLED_V,
    clamp,
    follow,
    has_arrived,
    low_pass,
    wanted,
)
from stickslip_ros.drive.build import plant_of
from stickslip_ros.drive.piezo import foot_displacement
from stickslip_ros.drive.records import CLOCK
from stickslip_ros.drive.waveform import level, sawtooth
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.kernels.record import record
from stickslip_ros.parameters import Parameters

clamp = entry_point(clamp)
follow = entry_point(follow)
foot_displacement = entry_point(foot_displacement)
advance_stretch = entry_point(advance_stretch)
low_pass = entry_point(low_pass)
wanted = entry_point(wanted)

SLEW = 150e6
ROUNDING = 1e-12
"""A few operations on doubles."""
WAVE = sawtooth(0.0, 300.0, 1000.0, 0)
REALISTIC = {
    'amplifier__bandwidth': 2e5, 'actuator__resonance': 1.5e5, 'actuator__damping_ratio': 0.1
}  # fmt: skip
BANDWIDTH_HZ = 5e4
TAU_S = 1.0 / (2.0 * math.pi * BANDWIDTH_HZ)


@pytest.fixture(scope='module')
def plant(stand):
    return plant_of(stand)[0]


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


def test_no_step_leaves_the_range_of_the_amplifier(drive):
    machine = drive()
    given = (machine.plants, machine.states, WAVE, 0.0, 0.0, machine.ramps, machine.ramps)
    advance_stretch((given,), 299.0, SLEW, 1e-6)
    assert machine.state.voltage_v == 300.0


@pytest.mark.parametrize(('current_a', 'slew'), [(0.25, 5e7), (10.0, SLEW)])
def test_a_limited_current_is_a_lower_slew_rate_and_nothing_else(current_a, slew, drive):
    limited = drive(amplifier__current_max=current_a).start(WAVE, [0.01])
    slower = drive(amplifier__slew_rate=slew).start(WAVE, [0.01])
    assert limited.plant.ideal
    assert limited.state == slower.state


@pytest.mark.parametrize('pieces', [1, 3, 50])
def test_the_low_pass_is_exact_along_a_straight_input_however_it_is_cut(pieces, stand):
    plant = plant_of(stand.updated({'amplifier.bandwidth': BANDWIDTH_HZ}))[0]
    rate, time_s, output_v = -3e6, 2e-5, 250.0
    share = -math.expm1(-time_s / pieces / TAU_S)
    for i in range(pieces):
        from_v, to_v = (100.0 + rate * time_s * k / pieces for k in (i, i + 1))
        output_v = low_pass(plant, output_v, from_v, to_v, time_s / pieces, share)
    lag_v = rate * TAU_S
    decayed_v = (250.0 - 100.0 + lag_v) * math.exp(-time_s / TAU_S)
    assert output_v == pytest.approx(100.0 + rate * time_s - lag_v + decayed_v, rel=1e-12, abs=0.0)


@pytest.mark.parametrize('step_v', [1.6, 5.0])
def test_the_converter_has_levels_on_a_grid_through_zero(step_v, drive):
    machine = drive(amplifier__resolution=step_v, amplifier__voltage_min=-100.0)
    machine.start(WAVE, [7e-5])
    for _ in range(100):
        machine.run(WAVE, [9.1e-6])
        clock, volt = machine.state.clock, machine.state.voltage_v
        on_grid = abs(volt / step_v - round(volt / step_v)) < 1e-9
        in_fall = clock.ramp_s < 3e-6
        target_v = 3e5 * clock.ramp_s
        near = abs(volt - target_v) <= 0.5 * step_v + 1e-9
        assert in_fall or (on_grid and near)


def test_a_staircase_finer_than_the_steps_of_the_drive_is_a_straight_line(stand):
    plant = plant_of(stand.updated({'amplifier.resolution': 0.01}))[0]
    assert wanted(plant, WAVE, record(CLOCK, ramp_s=1e-4))[:2] == pytest.approx((30.0, 3e5))
    assert wanted(plant, level(1.234), record(CLOCK))[0] == pytest.approx(1.23)


def test_the_converter_changes_level_half_way_between_two(stand):
    plant = plant_of(stand.updated({'amplifier.resolution': 6.0}))[0]
    for voltage_v, level_v, time_s in ((0.0, 0.0, 1e-5), (2.9, 0.0, 1 / 3e6), (4.5, 6.0, 1.5e-5)):
        found = wanted(plant, WAVE, record(CLOCK, ramp_s=voltage_v / 3e5))
        assert found[:2] == (level_v, 0.0)
        assert found[2] == pytest.approx(time_s, rel=1e-9, abs=0.0)


@pytest.mark.parametrize(
    ('volts', 'hertz', 'least'),
    [(200.0, 1000.0, 32), (300.0, 5000.0, 512), (60.0, 500.0, 32)],
)
def test_twice_as_many_levels_cost_at_most_three_times_as_much_or_as_little(
    volts, hertz, least, drive
):
    wave, passes = sawtooth(0.0, volts, hertz, 0), []
    for levels in least * 2 ** np.arange(8):
        machine = drive(load_cell__contact='absent', amplifier__resolution=300.0 / levels)
        # By pieces of a step: each step is a pass of every loop, on a line too.
        passes.append(machine.start(wave, [5e-6] * 400).state.passes_made)
    ratios = np.array(passes[1:]) / passes[:-1]
    assert ratios.max() < 3.0
    assert ratios.min() > 1.0 / 3.0


@pytest.mark.parametrize(
    ('changes', 'volts', 'levels', 'error'),
    [
        ({}, 200.0, 256, 1e-4),  # a staircase, as each level moves the feet by 0.6 nm
        ({'actuator__gain': 4e-9}, 50.0, 2048, 1e-4),  # the same in 3 us
        # Lines err about as much as a level moves the feet, per the presliding range.
        ({}, 200.0, 512, 3.3e-3),
        ({}, 200.0, 2048, 8e-4),
        (REALISTIC, 60.0, 512, 5e-4),
        (REALISTIC, 60.0, 2048, 5e-4),
        # Levels follow each other at the resonance: lines would err by 3.6e-2.
        ({'actuator__resonance': 4.1e5, 'actuator__damping_ratio': 0.02}, 60.0, 2048, 1e-3),
    ],
    ids=str,
)  # fmt: skip
def test_levels_of_the_converter_agree_with_those_of_a_finer_run(
    changes, volts, levels, error, drive
):
    wave, resolution_v = sawtooth(0.0, volts, 1000.0, 0), 300.0 / levels
    rough, fine = (
        drive(**changes, amplifier__resolution=resolution_v, sim__dt=dt_s).start(wave, [6e-3])
        for dt_s in (5e-6, 2e-7)
    )
    seen_m, right_m = rough.ramps[:5, 1:], fine.ramps[:5, 1:]
    assert abs(seen_m - right_m).max() <= error * abs(right_m).max()


@pytest.mark.parametrize(
    'changes',
    [{}, {'amplifier__bandwidth': 2e4}, {'amplifier__resolution': 0.7},
     {'amplifier__bandwidth': 2e4, 'amplifier__resolution': 0.7}],
    ids=str,
)  # fmt: skip
def test_a_wave_has_arrived_when_its_ramps_are_over_and_its_voltage_is_there(changes, drive):
    wave, machine = sawtooth(0.0, 300.0, 1000.0, 2), drive(**changes)
    machine.start(wave, [1e-3])
    assert not has_arrived(machine.plants, wave, machine.states)
    machine.run(wave, [1e-3 + 1e-6])
    assert machine.state.clock.cycle == 2
    assert not has_arrived(machine.plants, wave, machine.states)
    machine.run(wave, [2e-4])
    assert has_arrived(machine.plants, wave, machine.states)
    assert abs(machine.state.voltage_v) <= ARRIVED_SHARE * 300.0
    there = level(200.0)
    machine.start(there, [1e-7])
    assert not has_arrived(machine.plants, there, machine.states)
    machine.run(there, [2e-4])
    assert has_arrived(machine.plants, there, machine.states)


@pytest.mark.parametrize('bandwidth_hz', [2e4, 3e5])
def test_behind_a_low_pass_a_fall_ends_when_a_hundredth_of_it_is_left(bandwidth_hz, drive):
    machine = drive(amplifier__bandwidth=bandwidth_hz, runner__damping=80.0)
    tau_s = 1.0 / (2.0 * math.pi * bandwidth_hz)
    machine.start(WAVE, [5e-3])
    logged_m = [machine.state.clock.start_m]
    for _ in range(2000):
        machine.run(WAVE, [5e-8])
        logged_m.append(machine.state.clock.start_m)
    changed = np.nonzero(np.diff(logged_m[2:]))[0]
    assert len(changed) == 1
    # What the low-pass lags behind the slew rate in the end decays from there on.
    slewed_s = 2e-6
    top_v = SLEW * tau_s * -math.expm1(-slewed_s / tau_s)
    expected_s = slewed_s + tau_s * math.log(top_v / (FALL_SHARE * 300.0))
    assert (changed[0] + 3) * 5e-8 == pytest.approx(expected_s, rel=0.05, abs=1e-7)


def test_cuts_leave_the_start_of_a_ramp_behind_a_low_pass_as_it_is(drive):
    changes = {'amplifier__bandwidth': 1e5, 'runner__damping': 80.0}
    whole = drive(**changes).start(WAVE, [0.0101])
    cut = drive(**changes).start(WAVE, [1.01e-5] * 1000)
    np.testing.assert_allclose(cut.ramps[:10, RAMP_START], whole.ramps[:10, RAMP_START], rtol=1e-4)
    np.testing.assert_allclose(cut.ramps[1:10, RAMP_MEAN], whole.ramps[1:10, RAMP_MEAN], rtol=1e-5)


def test_the_voltage_stays_in_its_range_when_the_command_leaves_it(drive):
    machine = drive(actuator__resonance=1e5).start(sawtooth(0.0, 400.0, 1000.0, 2), [0.8e-3])
    assert machine.state.voltage_v == 300.0
    filtered = drive(amplifier__bandwidth=1e5).start(level(400.0), [1e-3])
    assert filtered.state.voltage_v == pytest.approx(300.0, rel=1e-12, abs=0.0)


def test_all_of_it_is_off_in_the_stand_of_the_paper():
    plant = plant_of(Parameters())[0]
    assert plant.ideal
    assert plant.amplifier.item() == (True, 0.0, 0.0)
    assert (plant.piezo.linear, plant.piezo.plays, plant.separate) == (1.0, 0, False)
