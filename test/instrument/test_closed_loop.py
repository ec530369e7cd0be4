# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The built-in closed loop: arrives, holds, steps again, and gives up with the right reason."""

import math
from dataclasses import replace

import numpy as np
import pytest
from bench_runs import MS, drive_bench, load
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.joints import Joints
from stickslip_ros.instrument.position_loop import Level, LoopSettings, PositionLoop, Steps
from stickslip_ros.instrument.reports import Result, Status

FREE = {'load_cell.contact': 'absent', 'runner.damping': 5.0}
TOLERANCE_M = 2e-9
"""closed_loop.tolerance of the stand."""
STAMP_NS = 1_800_000_000_123_456_789


def go_to(position_m):
    return Request('position', (position_m, 0.0, 0.0))


@pytest.fixture
def bench_with(stand):
    return lambda **values: Bench(
        stand.updated(FREE | {name.replace('__', '.'): v for name, v in values.items()})
    )


def errors_m(run, target_m):
    return np.array([output.readings.truth_position_m - target_m for output in run.outputs])


@pytest.mark.parametrize('target_m', [1e-9, 100e-9, -300e-9, 5e-6, -20e-6])
def test_a_target_is_reached_and_held(bench_with, target_m):
    run = drive_bench(bench_with(), 500 * MS, {0: [go_to(target_m)]})
    (event,) = run.events
    assert (event.command, event.result) == ('position', Result.DONE)
    assert np.abs(errors_m(run, target_m)[-100:]).max() < TOLERANCE_M
    held = run.status[-1]
    assert held & Status.CLOSED_LOOP
    assert held & Status.IN_POSITION
    assert not held & Status.MOVING
    assert run.status[0] & Status.MOVING
    assert run.status[0] & Status.CLOSED_LOOP


def test_a_target_is_held_under_a_step_of_load(bench_with):
    bench = bench_with()
    drive_bench(bench, 200 * MS, {0: [go_to(1e-6)]})
    run = drive_bench(bench, 300 * MS, {0: [load(0.1)]})
    errors = np.abs(errors_m(run, 1e-6))
    assert errors[0] > TOLERANCE_M  # the load does push the runner away
    assert errors[-100:].max() < TOLERANCE_M
    assert run.status[-1] & Status.IN_POSITION


def test_the_piezo_steps_again_when_it_comes_to_its_end_while_holding(bench_with):
    bench = bench_with(interferometer__drift=1e-7)  # the reading runs away, the runner follows
    drive_bench(bench, 100 * MS, {0: [go_to(500e-9)]})
    run = drive_bench(bench, 2500 * MS, {})
    volts = np.array([output.readings.voltage_v for output in run.outputs])
    readings = np.array([output.readings.position_m for output in run.outputs])
    assert np.abs(np.diff(volts)).max() > 100.0  # it ran back for another stroke
    assert np.median(np.abs(readings - 500e-9)) < TOLERANCE_M
    assert run.outputs[-1].readings.truth_position_m < 300e-9
    assert not run.events


def test_the_way_is_gone_with_the_velocity_that_is_asked_for(bench_with):
    bench = bench_with(closed_loop__velocity=5e-6)
    run = drive_bench(bench, 600 * MS, {0: [go_to(2.5e-6)]})
    (event,) = run.events
    assert event.result is Result.DONE
    assert 500 * MS < event.time_ns < 600 * MS  # the last nanometres take the loop's own time
    halfway_m = run.outputs[249].readings.truth_position_m
    assert halfway_m == pytest.approx(1.25e-6, abs=0.2e-6)


def test_without_hold_the_loop_opens_on_arrival(bench_with):
    run = drive_bench(bench_with(closed_loop__hold=False), 200 * MS, {0: [go_to(100e-9)]})
    assert [event.result for event in run.events] == [Result.DONE]
    assert not run.status[-1] & (Status.CLOSED_LOOP | Status.MOVING | Status.IN_POSITION)


def test_a_target_outside_the_soft_limits_is_refused_as_such(bench_with):
    bench = bench_with(limits__soft_min=-1e-6, limits__soft_max=1e-6)
    run = drive_bench(bench, 2 * MS, {0: [go_to(2e-6)]})
    (event,) = run.events
    assert event.result is Result.RANGE_LIMIT_REACHED
    assert 'outside the soft limits -1e-06 to 1e-06 m' in event.message
    assert run.status[-1] & Status.REFUSED


def test_a_set_point_that_runs_away_is_a_following_error(stand):
    limits = {'closed_loop.velocity': 1e-3, 'limits.following_error': 1e-6}
    bench = Bench(stand.updated(FREE | limits))  # 1 mm/s is more than 1000 steps per second make
    run = drive_bench(bench, 200 * MS, {0: [go_to(100e-6)]})
    (event,) = run.events
    assert event.result is Result.FOLLOWING_LIMIT_REACHED
    assert 'limits.following_error 1e-06 m' in event.message
    assert run.status[-1] & Status.FOLLOWING_LIMIT_REACHED


def test_a_hold_that_is_torn_away_ends_with_an_event_of_its_own(bench_with):
    bench = bench_with(limits__following_error=50e-9)
    drive_bench(bench, 100 * MS, {0: [go_to(300e-9)]})
    run = drive_bench(bench, 50 * MS, {0: [load(2.0)]})  # more than friction holds
    names = [(event.command, event.result) for event in run.events]
    assert ('hold', Result.FOLLOWING_LIMIT_REACHED) in names
    assert not run.status[-1] & Status.CLOSED_LOOP


def test_events_carry_the_stamps_of_their_commands_up_to_the_end_of_a_hold(bench_with):
    bench = bench_with(limits__following_error=50e-9)
    refused = replace(go_to(math.inf), stamp_ns=1)
    reached = replace(go_to(300e-9), stamp_ns=STAMP_NS)
    run = drive_bench(bench, 100 * MS, {0: [refused, reached]})
    assert [(e.result, e.sent_ns) for e in run.events] == [
        (Result.INVALID_PARAMETER, 1),
        (Result.DONE, STAMP_NS),
    ]
    torn = drive_bench(bench, 50 * MS, {0: [replace(load(2.0), stamp_ns=-2)]})
    stamps = {event.command: event.sent_ns for event in torn.events}
    assert stamps == {'load': -2, 'hold': STAMP_NS}


def test_a_move_that_takes_too_long_fails(bench_with):
    bench = bench_with(closed_loop__timeout=0.05)
    run = drive_bench(bench, 100 * MS, {0: [go_to(50e-6)]})
    (event,) = run.events
    assert event.result is Result.TIMEOUT
    assert event.time_ns == 51 * MS
    assert 'closed_loop.timeout, 0.05 s' in event.message
    assert run.status[-1] & Status.MOVEMENT_FAILED


def test_without_a_reading_the_loop_gives_up(bench_with):
    bench = bench_with()
    dropout = Request('fault', settings=(('fault.interferometer', 'dropout'),))
    run = drive_bench(bench, 50 * MS, {0: [go_to(50e-6)], 20 * MS: [dropout]})
    assert [(e.command, e.result) for e in run.events] == [
        ('fault', Result.DONE),
        ('position', Result.NO_SENSOR),
    ]
    assert not run.status[-1] & Status.SENSOR_PRESENT
    assert run.status[-1] & Status.FAULT


def test_zeroing_the_position_opens_the_loop(bench_with):
    bench = bench_with()
    run = drive_bench(bench, 30 * MS, {0: [go_to(50e-6)], 20 * MS: [Request('zero_position')]})
    assert [(e.command, e.result) for e in run.events] == [
        ('position', Result.ABORTED),
        ('zero_position', Result.DONE),
    ]


@pytest.mark.parametrize('velocity', [0.0, 50e-6])
def test_a_target_right_after_the_reading_came_back_is_reached(bench_with, velocity):
    bench = bench_with(closed_loop__velocity=velocity, fault__interferometer='dropout')
    requests = {2 * MS: [Request('clear_faults'), go_to(8e-6)]}
    run = drive_bench(bench, 400 * MS, requests)
    assert [event.result for event in run.events] == [Result.DONE, Result.DONE]


def test_a_runner_shall_stand_where_the_reading_that_came_back_finds_it(bench_with):
    bench = bench_with(fault__interferometer='dropout')
    stand_still = Request('joint', joints=Joints((), (), (0.0,)))
    requests = {2 * MS: [stand_still, Request('clear_faults')]}
    run = drive_bench(bench, 200 * MS, requests)
    assert [event.result for event in run.events] == [Result.DONE, Result.DONE]
    assert run.status[-1] & Status.IN_POSITION


def test_a_hold_that_was_pushed_far_away_steps_back(bench_with):
    bench = bench_with()
    drive_bench(bench, 100 * MS, {0: [go_to(300e-9)]})
    run = drive_bench(bench, 500 * MS, {0: [load(0.45)], 2 * MS: [load(0.0)]})
    errors = np.abs(errors_m(run, 300e-9))
    assert errors.max() > 5e-6  # more than blocked_time's worth of steps
    assert [event.command for event in run.events] == ['load', 'load']
    assert errors[-1] < TOLERANCE_M


def test_a_pass_through_the_target_is_no_arrival(bench_with):
    bench = bench_with(closed_loop__settle_time=0.0, closed_loop__tolerance=100e-9)
    run = drive_bench(bench, 200 * MS, {0: [go_to(5e-6)]})
    (event,) = run.events
    assert event.result is Result.DONE
    held = errors_m(run, 5e-6)[event.time_ns // MS :]
    assert np.abs(held).max() < 200e-9


GAIN_M_PER_V = 160e-9 / 300.0
LOOP = LoopSettings(GAIN_M_PER_V, 0.0, 300.0, 300.0, share=0.2, deadband_m=1e-9)


class SimpleStage:
    """
    A stage by book-keeping alone.

    A slow ramp takes the runner along; a jump takes it along by some presliding, the rest slips.

    """

    def __init__(self, presliding_m, start_m):
        self.presliding_m, self.position_m, self.voltage_v = presliding_m, start_m, 0.0

    def obey(self, action):
        if isinstance(action, Level):
            self._jump(action.voltage_v)
            return
        first_v, last_v = (0.0, 300.0) if action.count > 0 else (300.0, 0.0)
        for _ in range(abs(action.count)):
            self._jump(first_v)
            self.position_m += GAIN_M_PER_V * (last_v - first_v)
            self.voltage_v = last_v
        self._jump(first_v)

    def _jump(self, voltage_v):
        way_m = GAIN_M_PER_V * (voltage_v - self.voltage_v)
        self.position_m += float(np.clip(way_m, -self.presliding_m, self.presliding_m))
        self.voltage_v = voltage_v


@given(
    presliding_m=st.floats(5e-9, 120e-9),
    start_m=st.floats(-1e-4, 1e-4),
    target_m=st.floats(-1e-4, 1e-4),
)
@settings(deadline=None)
def test_the_loop_brings_any_stage_home_in_few_bursts(presliding_m, start_m, target_m):
    stage, loop, bursts = SimpleStage(presliding_m, start_m), PositionLoop(LOOP, 0.0), 0
    for _ in range(200):
        action = loop.update(target_m, stage.position_m)
        bursts += isinstance(action, Steps)
        stage.obey(action)
    assert abs(stage.position_m - target_m) < 1e-9
    assert bursts < 40
    assert 0.0 <= stage.voltage_v <= 300.0


@given(st.lists(st.floats(-1e-3, 1e-3), min_size=1, max_size=50))
def test_the_loop_never_asks_for_a_voltage_out_of_range_or_no_step(positions_m):
    loop = PositionLoop(LOOP, 150.0)
    for position_m in positions_m:
        match loop.update(0.0, position_m):
            case Level(voltage_v):
                assert 0.0 <= voltage_v <= 300.0
            case Steps(count):
                assert count != 0
                assert (count > 0) == (position_m < 0.0)


def test_no_burst_is_longer_than_a_message_can_carry():
    loop = PositionLoop(LOOP, 150.0)
    assert loop.update(-1e9, 0.0) == Steps(-(2**31 - 1))


def live(**settings):
    named = ((name.replace('__', '.'), value) for name, value in settings.items())
    return Request('parameters', settings=tuple(named))


def test_a_velocity_that_is_set_on_the_way_holds_from_then_on(bench_with):
    requests = {0: [go_to(3e-6)], 5 * MS: [live(closed_loop__velocity=10e-6)]}
    run = drive_bench(bench_with(), 400 * MS, requests)
    assert [(e.command, e.result) for e in run.events] == [
        ('parameters', Result.DONE),
        ('position', Result.DONE),
    ]
    first_m = run.outputs[4].readings.position_m
    assert run.events[1].time_ns >= 5 * MS + 0.9 * (3e-6 - first_m) / 10e-6 * 1e9


def test_a_target_that_new_soft_limits_exclude_is_given_up_on_the_way(bench_with):
    requests = {0: [go_to(5e-6)], 5 * MS: [live(limits__soft_max=2e-6)], 20 * MS: [go_to(1e-6)]}
    run = drive_bench(bench_with(), 300 * MS, requests)
    _, given_up, arrived = sorted(run.events, key=lambda event: (event.time_ns, -event.number))
    assert (given_up.number, given_up.result) == (1, Result.RANGE_LIMIT_REACHED)
    assert given_up.message == (
        'the target 5e-06 m is outside the soft limits, which have changed'
    )
    assert (arrived.number, arrived.result) == (3, Result.DONE)


def test_a_place_that_is_held_stays_so_under_soft_limits_that_exclude_it(bench_with):
    requests = {0: [go_to(1e-6)], 100 * MS: [live(limits__soft_min=2e-6, limits__soft_max=3e-6)]}
    run = drive_bench(bench_with(), 200 * MS, requests)
    assert [e.result for e in run.events] == [Result.DONE, Result.DONE]
    assert run.status[-1] & Status.IN_POSITION


def test_live_parameters_outlive_a_checkpoint(bench_with):
    bench = bench_with()
    drive_bench(bench, 5 * MS, {0: [go_to(3e-6), live(closed_loop__velocity=10e-6)]})
    again = Bench.restore(bench.save())
    assert again.parameters == bench.parameters
    for each in (bench, again):
        each.accept(live(limits__soft_max=1e-6))
    results = [each.update(each.time_ns + MS).events for each in (bench, again)]
    assert results[0] == results[1]
    assert results[0][0].result is Result.RANGE_LIMIT_REACHED


@pytest.mark.parametrize(
    ('name', 'value', 'why'),
    [
        ('stand.preload', 0.3, 'live parameter'),
        ('fault.runner_stuck', True, 'closed_loop.velocity, limits.soft_min, limits.soft_max'),
        ('limits.soft_min', 1.0, 'above limits.soft_max'),
        ('closed_loop.velocity', -1.0, 'below the minimum'),
    ],
)
def test_what_cannot_change_or_does_not_fit_is_refused(bench_with, name, value, why):
    bench = bench_with()
    run = drive_bench(bench, MS, {0: [Request('parameters', settings=((name, value),))]})
    assert run.events[0].result is Result.INVALID_PARAMETER
    assert why in run.events[0].message
    assert bench.parameters == bench_with().parameters


def test_the_end_tells_the_step_length_that_was_learned(bench_with):
    run = drive_bench(bench_with(), 300 * MS, {0: [go_to(5e-6)], 200 * MS: [go_to(5.01e-6)]})
    coarse, fine = run.events
    assert coarse.step_m == pytest.approx(97e-9, rel=0.05)
    assert fine.step_m is None


@pytest.mark.parametrize('name', ['position', 'joint'])
def test_a_target_that_another_sender_replaces_has_an_end(bench_with, name):
    requests = [
        replace(request, name=name, joints=Joints((), request.values[:1]))
        if name == 'joint'
        else request
        for request in (go_to(5e-6), go_to(4e-6), go_to(1e-6))
    ]
    if name == 'joint':
        requests = [replace(request, values=()) for request in requests]
    first, second, last = (
        replace(request, tag=tag)
        for request, tag in zip(requests, ('left', 'left', 'right'), strict=True)
    )
    bench = bench_with()
    run = drive_bench(bench, 300 * MS, {0: [first], 2 * MS: [second], 5 * MS: [last]})
    assert [(e.number, e.tag, e.result) for e in run.events] == [
        (2, 'left', Result.ABORTED),
        (3, 'right', Result.DONE),
    ]
    assert bench.replaced == 1
