# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Moves of every kind: start, course, end and limits."""

from dataclasses import replace

import numpy as np
import pytest
from bench_runs import MS, drive_bench, sawtooth, steps

from stickslip_ros.drive.advance import RAMP_END
from stickslip_ros.drive.records import POSITION, VOLTAGE
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.reports import Result, Status

FREE = {'load_cell.contact': 'absent', 'interferometer.noise_density': 0.0}
RINGING_M = 5e-9
"""How far from rest a runner swings after the last step."""
STEP_M = 160e-9
"""No step of 300 V is longer than the stroke of the feet."""


def jog(frequency_hz):
    return Request('jog', (float(frequency_hz),))


def waveform(*rows):
    return Request('waveform', tuple(float(value) for row in rows for value in row))


@pytest.fixture
def bench_with(stand):
    return lambda **values: Bench(
        stand.updated(FREE | {name.replace('__', '.'): v for name, v in values.items()})
    )


@pytest.mark.parametrize(('count', 'sign'), [(12, 1.0), (-12, -1.0)])
def test_steps_are_made_in_their_direction_and_counted(bench_with, count, sign):
    run = drive_bench(bench_with(), 20 * MS, {0: [steps(count)]})
    (event,) = run.events
    assert (event.command, event.result, event.steps) == ('steps', Result.DONE, 12)
    assert len(run.ramps) == 12
    assert 10 * 0.25 * STEP_M < sign * run.trace[-1, POSITION] < 12 * STEP_M


def test_steps_have_the_amplitude_and_the_frequency_of_the_parameters(bench_with):
    bench = bench_with(step__amplitude=120.0, step__frequency=250.0)
    run = drive_bench(bench, 20 * MS, {0: [steps(3)]})
    assert run.trace[:, VOLTAGE].max() == pytest.approx(120.0, rel=1e-2)
    assert run.events[0].time_ns == 13 * MS  # three periods of 4 ms, and the last fall


def test_no_step_at_all_is_done_at_once_and_replaces_nothing(bench_with):
    run = drive_bench(bench_with(), 10 * MS, {0: [steps(5)], 2 * MS: [steps(0)]})
    assert [(e.number, e.result, e.steps) for e in run.events] == [
        (2, Result.DONE, 0),
        (1, Result.DONE, 5),
    ]


def test_a_jog_runs_on_while_it_is_renewed_and_stops_when_it_is_not(bench_with):
    bench = bench_with(jog__timeout=0.01)
    renewed = {n * MS: [jog(1000.0)] for n in range(0, 30, 5)}
    run = drive_bench(bench, 50 * MS, renewed)
    (event,) = run.events
    assert (event.number, event.command, event.result) == (1, 'jog', Result.DONE)
    assert event.message == 'jog.timeout passed without a new command'
    assert event.time_ns == 35 * MS  # 10 ms after the last one
    assert event.steps == 35
    assert Status.MOVING not in run.status[-1]
    np.testing.assert_array_equal(run.trace[36 * 50 :, VOLTAGE], run.trace[-1, VOLTAGE])


def test_a_jog_goes_on_at_another_rate_counts_all_its_steps_and_ends_by_zero(bench_with):
    requests = {0: [jog(500.0)], 4 * MS: [jog(-1000.0)], 8 * MS: [jog(0.0)], 9 * MS: [jog(0.0)]}
    bench = bench_with()
    run = drive_bench(bench, 12 * MS, requests)
    assert [(e.number, e.result, e.message, e.steps) for e in run.events] == [
        (1, Result.DONE, 'ended by command 3', 2 + 4),
        (4, Result.DONE, 'no jog was running', 0),
    ]
    assert bench.replaced == 1


@pytest.mark.parametrize(
    ('request_of', 'values'),
    [
        (lambda value: Request('voltage', (value,)), (100.0, 200.0, 20.0)),
        (lambda value: Request('position', (value, 0.0, 0.0)), (50e-6, -50e-6, 50e-9)),
        (lambda value: Request('preload', (value,)), (0.6, 0.4, 0.52)),
    ],
    ids=['voltage', 'position', 'preload'],
)
def test_a_set_point_that_the_next_of_its_topic_replaces_is_counted_not_told(
    bench_with, request_of, values
):
    bench = bench_with(amplifier__bandwidth=300.0, stand__preload_rate=2.0)
    streamed = {n * MS: [request_of(value)] for n, value in enumerate(values)}
    run = drive_bench(bench, 300 * MS, streamed)
    assert [(e.number, e.result) for e in run.events] == [(3, Result.DONE)]
    assert bench.replaced == 2


@pytest.mark.parametrize(
    'move',
    [steps(100), Request('sawtooth', (300.0, 1000.0, 100.0)), waveform((0.0, 0.0), (1.0, 100.0))],
    ids=['steps', 'sawtooth', 'waveform'],
)
def test_a_move_of_a_given_extent_that_the_next_of_its_kind_cuts_off_is_told(bench_with, move):
    bench = bench_with()
    run = drive_bench(bench, 10 * MS, {0: [move], 5 * MS: [move]})
    [event] = run.events
    assert (event.number, event.result) == (1, Result.ABORTED)
    assert event.message == 'replaced by command 2'
    assert bench.replaced == 0


def test_a_waveform_is_played_once_with_straight_lines_and_then_held(bench_with):
    rows = ((0.0, 0.0), (2e-3, 100.0), (3e-3, 100.0), (5e-3, 20.0))
    run = drive_bench(bench_with(), 8 * MS, {0: [waveform(*rows)]})
    times_s = np.arange(1, len(run.trace) + 1) * 20e-6
    wanted_v = np.interp(times_s, *np.array(rows).T)
    np.testing.assert_allclose(run.trace[:, VOLTAGE], wanted_v, rtol=0.0, atol=1e-6)
    assert [bool(status & Status.STREAMING) for status in run.status] == [True] * 4 + [False] * 4
    (event,) = run.events
    assert (event.command, event.result) == ('waveform', Result.DONE)


HILL = ((0.0, 10.0), (0.9e-3, 90.0), (1.7371e-3, 10.0))
RIDGE = ((0.0, 20.0), (1.1e-3, 220.0), (1.3517e-3, 200.0), (2.20007e-3, 20.0))


def repeated(rows, cycles=0):
    return replace(waveform(*rows), cycles=cycles)


def expected_v(*stretches):
    """Give what waveforms played one after another come to, each (rows, times); the last holds."""
    points, start_s = [], 0.0
    for rows, times in stretches:
        for _ in range(times):
            points += [(start_s + time_s, voltage_v) for time_s, voltage_v in rows]
            start_s += rows[-1][0]
    return np.array(points)


def assert_played(run, *stretches):
    times_s = np.arange(1, len(run.trace) + 1) * 20e-6
    points = expected_v(*stretches)
    wanted_v = np.interp(times_s, *points.T)
    # A jump between two waveforms is slewed; it lasts two microseconds, a sample twenty.
    np.testing.assert_allclose(run.trace[:, VOLTAGE], wanted_v, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize('cycles', [2, 7])
def test_a_waveform_repeats_as_often_as_it_says_and_its_cycles_are_counted(bench_with, cycles):
    bench = bench_with(amplifier__voltage_initial=10.0)
    run = drive_bench(bench, 20 * MS, {0: [repeated(HILL, cycles)]})
    assert_played(run, (HILL, cycles))
    [event] = run.events
    assert (event.result, event.steps, len(run.ramps)) == (Result.DONE, cycles, cycles)


def test_the_next_waveform_waits_for_the_end_of_the_cycle_and_the_last_holds(bench_with):
    bench = bench_with(amplifier__voltage_initial=10.0)
    requests = {0: [repeated(HILL)], 5 * MS: [repeated(RIDGE)], 12 * MS: [waveform(*HILL)]}
    run = drive_bench(bench, 20 * MS, requests)
    assert_played(run, (HILL, 3), (RIDGE, 4), (HILL, 1))
    assert [(e.number, e.result, e.steps, e.message) for e in run.events] == [
        (1, Result.ABORTED, 2, 'replaced by command 2'),
        (2, Result.ABORTED, 3, 'replaced by command 3'),
        (3, Result.DONE, 0, ''),
    ]


def test_a_waveform_that_still_waits_gives_way_to_the_next_without_being_played(bench_with):
    bench = bench_with(amplifier__voltage_initial=10.0)
    both = [repeated(RIDGE), repeated(((0.0, 30.0), (2e-3, 50.0), (3e-3, 30.0)))]
    run = drive_bench(bench, 9 * MS, {0: [repeated(HILL)], 2 * MS: both, 3 * MS: both[:1]})
    assert_played(run, (HILL, 2), (RIDGE, 3))
    assert [(e.number, e.steps) for e in run.events] == [(1, 1), (2, 0), (3, 0)]


def test_phase_is_kept_over_ten_thousand_cycles_of_a_wave_that_came_after_another(bench_with):
    bench = bench_with(amplifier__voltage_initial=10.0, load_cell__contact='attached')
    drive_bench(bench, 3 * MS, {0: [repeated(HILL)], 2 * MS: [repeated(RIDGE)]})
    cycles = 10_000
    drive_bench(bench, int(cycles * 2.20007 * MS / 1e3) * 1000 // MS * MS, {})
    since_s = bench.time_ns * 1e-9 - 2 * HILL[-1][0]
    phase_s = since_s % RIDGE[-1][0]
    assert bench.state.voltage_v == pytest.approx(np.interp(phase_s, *np.array(RIDGE).T), abs=1e-6)


def test_what_the_amplifier_makes_of_a_saw_tooth_does_the_same_as_a_waveform(bench_with):
    slope_v_per_s, slew_v_per_s = 300.0 / 1e-3, 150e6
    fall_s = 300.0 / (slope_v_per_s + slew_v_per_s)
    rows = ((0.0, 300.0), (fall_s, slope_v_per_s * fall_s), (1e-3, 300.0))
    played = drive_bench(bench_with(), 45 * MS, {0: [repeated(rows, 40)]})
    stepped = drive_bench(bench_with(), 45 * MS, {0: [sawtooth(300.0, 1000.0, 40)]})
    played_m, stepped_m = (np.diff(run.ramps[-10:, RAMP_END]) for run in (played, stepped))
    np.testing.assert_allclose(played_m, stepped_m, rtol=1e-6)


@pytest.mark.parametrize(
    ('rows', 'cycles', 'message'),
    [
        (((0.0, 0.0), (1e-3, 5.0)), 0, 'last waveform voltage 5 V is not the first voltage, 0 V'),
        (((0.0, 0.0), (1e-5, 5.0), (2e-5, 0.0)), 3, 'below 1/amplifier.frequency_max, 5e-05 s'),
        (HILL, 2**31, 'not from 0 to 2147483647'),
    ],
)
def test_a_repetition_that_cannot_be_is_refused(bench_with, rows, cycles, message):
    run = drive_bench(bench_with(), 2 * MS, {0: [repeated(rows, cycles)]})
    [event] = run.events
    assert event.result is Result.INVALID_PARAMETER
    assert message in event.message


@pytest.mark.parametrize('sign', [1.0, -1.0])
@pytest.mark.parametrize('name', ['steps', 'sawtooth', 'jog'])
def test_steps_stop_at_a_soft_limit_and_may_go_back(bench_with, name, sign):
    request = {
        'steps': steps(sign * 100),
        'sawtooth': sawtooth(300.0, sign * 1000.0),
        'jog': jog(sign * 1000.0),
    }[name]
    bench = bench_with(limits__soft_min=-1e-6, limits__soft_max=1e-6)
    run = drive_bench(bench, 60 * MS, {0: [request]})
    (event,) = run.events
    assert (event.command, event.result) == (name, Result.RANGE_LIMIT_REACHED)
    assert f'limits.soft_{"max" if sign > 0 else "min"}' in event.message
    assert run.status[-1] & Status.RANGE_LIMIT_REACHED
    assert run.status[-1] & Status.MOVEMENT_FAILED
    assert 1e-6 < sign * run.trace[-1, POSITION] < 1e-6 + 2 * STEP_M
    back = drive_bench(bench, 10 * MS, {0: [steps(-sign * 5)]})
    assert back.events[-1].result is Result.DONE
    assert not back.status[-1] & (Status.RANGE_LIMIT_REACHED | Status.MOVEMENT_FAILED)


def test_a_direct_voltage_knows_no_soft_limits(bench_with):
    bench = bench_with(limits__soft_min=-1e-9, limits__soft_max=1e-9)
    run = drive_bench(bench, 5 * MS, {0: [Request('voltage', (300.0,))]})
    assert [e.result for e in run.events] == [Result.DONE]
    assert run.trace[-1, POSITION] > 1e-9


@pytest.mark.parametrize(
    ('off', 'on'),
    [
        (Request('enable_amplifier', (0.0,)), Request('enable_amplifier', (1.0,))),
        (Request('fault', settings=(('fault.amplifier_off', True),)), Request('clear_faults')),
    ],
    ids=['switched off', 'fault'],
)
def test_an_amplifier_without_power_aborts_the_move_and_refuses_the_next_one(bench_with, off, on):
    bench = bench_with()
    requests = {0: [steps(100)], 5 * MS: [off], 6 * MS: [steps(1)]}
    run = drive_bench(bench, 10 * MS, requests)
    assert [(e.number, e.command, e.result) for e in run.events] == [
        (1, 'steps', Result.AMPLIFIER_DISABLED),
        (2, off.name, Result.DONE),
        (3, 'steps', Result.AMPLIFIER_DISABLED),
    ]
    assert not run.status[-1] & Status.AMPLIFIER_ENABLED
    assert run.status[-1] & Status.REFUSED
    assert run.trace[-1, VOLTAGE] == 0.0
    again = drive_bench(bench, 10 * MS, {0: [on, steps(3)]})
    assert again.events[-1].result is Result.DONE
    assert again.status[-1] & Status.AMPLIFIER_ENABLED


def test_the_zero_of_position_and_force_can_be_set(stand):
    bench = Bench(stand)
    drive_bench(bench, 30 * MS, {0: [steps(20)]})
    before = bench.update(bench.time_ns + MS).readings
    zeroed = drive_bench(bench, MS, {0: [Request('zero_position'), Request('tare_force')]})
    readings = zeroed.outputs[-1].readings
    assert before.position_m > 100e-9
    assert before.force_n > 0.01
    assert abs(readings.position_m) < 2e-9
    assert abs(readings.force_n) < 2e-4
    assert zeroed.status[-1] & Status.IS_REFERENCED
    assert readings.truth_position_m > 100e-9
    assert readings.truth_force_n > 0.01


@pytest.mark.parametrize('sign', [1, -1])
def test_moves_that_begin_beyond_a_soft_limit_do_not_go_on_outwards(bench_with, sign):
    bench = bench_with(limits__soft_min=-1e-6, limits__soft_max=1e-6)
    requests = {n * MS: [jog(sign * 1000.0)] for n in range(60)}
    run = drive_bench(bench, 60 * MS, requests)
    assert abs(run.trace[-1, POSITION]) < 1e-6 + 2 * STEP_M
    later = [event for event in run.events if event.time_ns > run.events[0].time_ns]
    assert later
    assert {(e.result, e.steps) for e in later} == {(Result.RANGE_LIMIT_REACHED, 0)}
    assert run.status[-1] & Status.MOVEMENT_FAILED


@pytest.mark.parametrize(('frequency_hz', 'count'), [(1000.0, 10), (-1000.0, 10), (300.0, 1)])
def test_the_end_of_steps_tells_their_mean_length(bench_with, frequency_hz, count):
    run = drive_bench(bench_with(), 300 * MS, {5 * MS: [sawtooth(300.0, frequency_hz, count)]})
    way_m = run.outputs[-1].readings.position_m - run.outputs[4].readings.position_m
    settled_m = np.sign(frequency_hz) * way_m / count
    assert run.events[0].step_m == pytest.approx(settled_m, abs=RINGING_M / count)


@pytest.mark.parametrize(
    ('requests', 'ends'),
    [
        ([Request('waveform', (0.0, 0.0, 0.01, 100.0, 0.02, 0.0), cycles=0)], 1),
        ([jog(1000), jog(-1000)], 1),
        ([sawtooth(300.0, 1000.0), Request('zero_position')], 2),
        ([Request('voltage', (100.0,))], 1),
        ([Request('fault', settings=(('fault.interferometer', 'dropout'),)), steps(10)], 2),
    ],
)
def test_moves_whose_steps_have_no_one_length_tell_none(bench_with, requests, ends):
    due = {i * 20 * MS: [each] for i, each in enumerate(requests)}
    run = drive_bench(bench_with(), 60 * MS, {**due, 50 * MS: [Request('stop')]})
    events = [each for each in run.events if each.command != 'stop']
    assert len(events) == ends
    assert all(each.step_m is None for each in events)


def test_a_tag_comes_back_with_every_end_of_a_command(bench_with):
    begun, refused = (
        replace(sawtooth(300.0, frequency_hz), tag=tag)
        for frequency_hz, tag in ((1000.0, 'left'), (0.0, 'right'))
    )
    run = drive_bench(bench_with(), 20 * MS, {0: [begun], 5 * MS: [refused, Request('stop')]})
    assert [(e.tag, e.result) for e in run.events] == [
        ('right', Result.INVALID_PARAMETER),
        ('left', Result.ABORTED),
        ('', Result.DONE),
    ]
