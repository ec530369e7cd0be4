# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Time goes on: every stretch moves the clock, and loops that stand still end."""

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from stickslip_ros.drive.advance import PASSES_MIN, check_motion
from stickslip_ros.drive.amplifier import follow, low_pass, time_to_settle, wanted
from stickslip_ros.drive.build import plant_of
from stickslip_ros.drive.records import ALL, CLOCK
from stickslip_ros.drive.waveform import level, sawtooth, table
from stickslip_ros.errors import StickSlipError
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.kernels.record import record
from stickslip_ros.parameters import Parameters

follow = entry_point(follow)
low_pass = entry_point(low_pass)
time_to_settle = entry_point(time_to_settle)
wanted = entry_point(wanted)

WAVE = sawtooth(0.0, 300.0, 1000.0, 0)
VOLTS = st.floats(0.0, 300.0)
CLOCKS_S = st.floats(1e-9, 900.0)


@given(
    clock_s=CLOCKS_S,
    voltage_v=VOLTS,
    gap_v=st.floats(-1e-4, 1e-4),
    slope_v_per_s=st.floats(-1e16, 1e16),
)
def test_a_voltage_is_caught_at_once_or_after_a_time_that_moves_the_clock(
    clock_s, voltage_v, gap_v, slope_v_per_s, stand
):
    caught_s = follow(plant_of(stand)[0], voltage_v, voltage_v + gap_v, slope_v_per_s, clock_s)[2]
    assert clock_s + caught_s > clock_s


@given(
    resolution_v=st.floats(-9.0, 1.0).map(lambda power: 10.0**power),
    end_s=st.floats(-3.0, 3.0).map(lambda power: 10.0**power),
    share=st.floats(0.0, 1.0),
    end_v=VOLTS,
)
def test_the_next_level_of_a_converter_comes_after_a_time_that_moves_the_clock(
    resolution_v, end_s, share, end_v
):
    plant = plant_of(Parameters().updated({'amplifier.resolution': resolution_v}))[0]
    clock_s = share * end_s * (1.0 - 1e-12)
    wave = table([[0.0, 113.76725643485543], [end_s, end_v]])
    level_v, _, next_s = wanted(plant, wave, record(CLOCK, ramp_s=clock_s))
    assert clock_s + next_s > clock_s
    command_v = 113.76725643485543 + (end_v - 113.76725643485543) * clock_s / end_s
    assert abs(level_v - command_v) <= 1.5 * resolution_v + 1e-9


@given(excess=st.floats(0.0, 1e-6), input_v=VOLTS)
def test_a_low_pass_has_settled_or_takes_a_time_that_changes_its_output(excess, input_v):
    plant = plant_of(Parameters().updated({'amplifier.bandwidth': 2e5}))[0]
    aim_v = 0.999 * 0.01 * 300.0
    settled_s = time_to_settle(plant, WAVE, input_v + aim_v * (1.0 + excess), input_v, 0.0)
    assert settled_s == math.inf or settled_s > 1e-10 * plant.amplifier.tau_s


@given(
    resolution_v=st.floats(-12.0, 1.0).map(lambda power: 10.0**power),
    excess=st.floats(0.0, 1e-3),
    input_v=VOLTS,
)
@example(resolution_v=3.9736276651942805e-08, excess=1e-6, input_v=189.34856083100485)
def test_behind_a_fine_converter_too(resolution_v, excess, input_v):
    values = {'amplifier.bandwidth': 99442.54981051518, 'amplifier.resolution': resolution_v}
    plant = plant_of(Parameters().updated(values))[0]
    output_v = input_v + 0.5 * resolution_v * (1.0 + excess)
    settled_s = time_to_settle(plant, level(input_v), output_v, input_v, 0.0)
    share = -math.expm1(-settled_s / plant.amplifier.tau_s)
    next_v = low_pass(plant, output_v, input_v, input_v, settled_s, share)
    assert settled_s == math.inf or abs(next_v - output_v) > 0.5e-9


def test_a_drive_whose_loops_stand_still_gives_up_and_says_where(drive):
    machine = drive()
    machine.plant.presliding_m = machine.plant.contacts[ALL].curve.limit_m = 1e-40
    resting = machine.start(level(0.0), [1e-9])
    assert 1e7 < resting.state.passes_left < 2e8  # 11 s of a processor
    machine.plant.dt_s = 1e40  # allows no passes for crossings
    with pytest.raises(StickSlipError, match='time stands still'):
        machine.start(WAVE, [1e-4])
    assert machine.state.passes_left < 0
    assert machine.state.passes_made > PASSES_MIN
    assert machine.state.clock.ramp_s < 1e-6
    with pytest.raises(StickSlipError, match=r'time stands still after \d+ passes, at .* V, foot'):
        check_motion(machine.states, 0.25)


def test_a_drive_that_has_given_up_makes_no_more_passes_until_it_rests_again(drive):
    machine = drive()
    machine.state.passes_left = -1
    before = machine.state.copy()
    for _ in range(2):
        with pytest.raises(StickSlipError, match='time stands still'):
            machine.start(WAVE, [1e-4])
    assert machine.state.passes_left < 0
    for name in ('clock', 'passes_left', 'passes_made'):
        machine.state[name] = before[name]
    assert machine.state == before
    again = drive().start(level(0.0), [1e-4])
    check_motion(again.states, 0.0)


def test_a_sample_of_four_longest_steps_takes_four_whatever_the_rounding(drive):
    machine = drive()
    assert machine.plant.dt_s == 5e-6
    assert 20e-6 - 5e-6 - 5e-6 - 5e-6 > 5e-6  # the rounding that made five of them
    machine.start(level(0.0), [20e-6])
    stretches = 1
    assert machine.state.passes_made == stretches + 4
