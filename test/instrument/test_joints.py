# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Joints: precedence of numbers, refusals, and a set point moved by a stream."""

import math

import numpy as np
import pytest
from bench_runs import MS, drive_bench

from stickslip_ros.errors import OutOfRange, StickSlipError, UnknownName, WrongKind
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.closed_loop import Goal
from stickslip_ros.instrument.commands import Request, check_request
from stickslip_ros.instrument.joints import Joints
from stickslip_ros.instrument.reports import Result, Status

NAN, INF = math.nan, math.inf
OWN = ('runner_joint',)
FREE = {'load_cell.contact': 'absent', 'runner.damping': 5.0}
PERIOD_NS = 10 * MS
"""Of a stream at 100 Hz."""
STROKE_M = 160e-9
TOLERANCE_M = 2e-9
"""closed_loop.tolerance of the stand."""
BEHIND_M = 300e-9
"""How far the runner may be from its set point under way: two strokes; the worst seen is one."""


def joint(positions=(), velocities=(), efforts=(), names=OWN):
    return Request('joint', joints=Joints(names, positions, velocities, efforts))


def to(position_m):
    return joint((position_m,))


def at(velocity_m_per_s):
    return joint((), (velocity_m_per_s,))


def stream(end_ns, request_of, start_ns=0):
    """Return a request every 10 ms, made from its time."""
    return {t: [request_of(t)] for t in range(start_ns, end_ns, PERIOD_NS)}


@pytest.fixture
def bench_with(stand):
    return lambda **values: Bench(
        stand.updated(FREE | {name.replace('__', '.'): v for name, v in values.items()})
    )


@pytest.mark.parametrize(
    ('request_', 'goal'),
    [
        (to(1e-6), Goal(1e-6)),
        (at(-1e-5), Goal(None, -1e-5)),
        (joint((1e-6,), (1e-5,)), Goal(1e-6)),
        (joint((NAN,), (1e-5,), (NAN,)), Goal(None, 1e-5)),
        (joint((NAN,), (0.0,)), Goal(None, 0.0)),
        (joint((2e-6,), names=()), Goal(2e-6)),
        (joint((7.0, 3e-6), (), (NAN, NAN), names=('arm', *OWN)), Goal(3e-6)),
        (joint((7.0, NAN), names=('arm', *OWN)), None),
        (joint((NAN,), (NAN,), (NAN,)), None),
        (joint(), None),
        (joint(names=()), None),
    ],
    ids=[
        'position', 'velocity', 'position wins', 'not a number', 'standstill', 'no name',
        'among others', 'others alone', 'no numbers', 'empty', 'nothing at all',
    ],
)  # fmt: skip
def test_a_position_wins_and_what_is_empty_or_no_number_is_not_commanded(request_, goal, stand):
    assert check_request(request_, stand) == goal


@pytest.mark.parametrize(
    ('request_', 'kind', 'message'),
    [
        (
            joint((0.0, 1.0)),
            WrongKind,
            'joint position [0.0, 1.0] is not a list of 1 numbers; give a number for each name',
        ),
        (
            joint((), (0.0,), names=('arm', *OWN)),
            WrongKind,
            'joint velocity [0.0] is not a list of 2 numbers; give a number for each name, or',
        ),
        (joint((), (), (0.0, 0.0, 0.0), names=()), WrongKind, 'is not a list of 1 numbers'),
        (
            joint((0.0, 0.0), names=('arm', 'hand')),
            UnknownName,
            "joint 'arm, hand' is not known; that of this drive is runner_joint, sim.joint_name",
        ),
        (
            joint((), (), (2.0,)),
            OutOfRange,
            'joint effort 2 N is not supported; command a position or a velocity',
        ),
        (
            joint((0.0, 1e-7), names=OWN * 2),
            WrongKind,
            "('runner_joint', 'runner_joint') is not a list of different names; name each joint",
        ),
        (joint((0.0,) * 3, names=('arm', *OWN, 'arm')), WrongKind, 'name each joint once'),
        (to(-INF), WrongKind, 'joint position -inf is not a finite number; send a number'),
        (at(INF), WrongKind, 'joint velocity inf is not a finite number; send a number'),
        (
            at(1.61e-4),
            OutOfRange,
            (
                'joint velocity 0.000161 m/s is above the largest velocity of steps, 0.00016 m/s; '
                'lower it or raise step.frequency'
            ),
        ),
        (Request('joint', (1e-6,)), WrongKind, 'joint [1e-06] is not without numbers; give names'),
    ],
)
def test_what_makes_no_sense_is_refused_with_a_reason(request_, kind, message, stand):
    with pytest.raises(kind) as caught:
        check_request(request_, stand)
    assert message in str(caught.value)


def test_without_possible_steps_a_velocity_is_refused(stand):
    slow = stand.updated({'amplifier.slew_rate': 1e5})
    with pytest.raises(StickSlipError, match='slew_rate'):
        check_request(at(1e-6), slow)


def test_a_stream_of_one_target_is_as_good_as_one_message(bench_with):
    once = drive_bench(bench_with(), 300 * MS, {0: [to(5e-6)]})
    often = drive_bench(bench_with(), 300 * MS, stream(300 * MS, lambda _: to(5e-6)))
    assert once.trace.tobytes() == often.trace.tobytes()
    assert once.events == often.events
    assert len(once.events) == 1


def test_a_stream_of_targets_moves_one_set_point_and_tells_of_the_last(bench_with):
    bench = bench_with()
    speed_m_per_s, end_ns = 4e-5, 200 * MS
    targets = stream(end_ns, lambda t: to(speed_m_per_s * t * 1e-9))
    run = drive_bench(bench, 400 * MS, targets)
    [event] = run.events
    assert (event.number, event.result) == (len(targets), Result.DONE)
    assert bench.replaced == len(targets) - 1
    way = [output.readings.truth_position_m for output in run.outputs[:200]]
    wanted_m = speed_m_per_s * 1e-3 * np.arange(1, 201)
    lag_m = wanted_m[20:] - np.array(way)[20:]
    assert np.abs(lag_m).max() < speed_m_per_s * PERIOD_NS * 1e-9 + BEHIND_M


def test_a_reported_target_is_not_counted_as_replaced(bench_with):
    bench = bench_with()
    run = drive_bench(bench, 400 * MS, {0: [to(1e-6)], 200 * MS: [to(1.05e-6)]})
    assert [(e.number, e.result) for e in run.events] == [(1, Result.DONE), (2, Result.DONE)]
    assert bench.replaced == 0


def test_steps_that_lead_beyond_another_target_are_broken_off(bench_with):
    bench = bench_with()
    drive_bench(bench, 100 * MS, {0: [to(100e-6)]})
    target_m = bench.sensing.position_m + 3e-6
    run = drive_bench(bench, 300 * MS, {0: [to(target_m)]})
    way_m = np.array([output.readings.truth_position_m for output in run.outputs])
    assert way_m.max() < target_m + 0.5 * STROKE_M
    assert abs(way_m[-1] - target_m) < TOLERANCE_M


@pytest.mark.parametrize('velocity_m_per_s', [1e-7, -1e-5, 5e-5])
def test_a_velocity_is_followed(bench_with, velocity_m_per_s):
    requests = stream(400 * MS, lambda _: at(velocity_m_per_s))
    run = drive_bench(bench_with(), 400 * MS, requests)
    way_m = np.array([output.readings.truth_position_m for output in run.outputs])
    wanted_m = velocity_m_per_s * 1e-3 * np.arange(1, 401)
    assert np.abs(way_m - wanted_m).max() < 3.0 * BEHIND_M
    assert run.events == []
    assert run.status[-1] & Status.MOVING
    assert run.status[-1] & Status.CLOSED_LOOP


def test_a_velocity_that_the_steps_do_not_reach_is_not_made_up_for(bench_with):
    bench = bench_with()
    drive_bench(bench, 400 * MS, stream(400 * MS, lambda _: at(1.6e-4)))
    there_m = bench.sensing.position_m
    run = drive_bench(bench, 200 * MS, {0: [at(0.0)]})
    assert [event.result for event in run.events] == [Result.DONE]
    assert 0.0 < bench.sensing.position_m - there_m < 11.0 * STROKE_M


def test_velocities_add_up_to_their_way_and_0_holds_the_end_of_it(bench_with):
    bench = bench_with()
    forth = stream(100 * MS, lambda _: at(3e-5))
    back = stream(200 * MS, lambda _: at(-1e-5), 100 * MS)
    run = drive_bench(bench, 500 * MS, {**forth, **back, 200 * MS: [at(0.0)]})
    [event] = run.events
    assert (event.number, event.command, event.result) == (21, 'joint', Result.DONE)
    assert abs(bench.sensing.position_m - 2e-6) < TOLERANCE_M
    assert bench.replaced == 2
    assert run.status[-1] & Status.IN_POSITION


def test_the_watchdog_ends_a_velocity_that_nobody_renews(bench_with):
    bench = bench_with(jog__timeout=0.05)
    nothing = {t: [joint((NAN,), (NAN,))] for t in range(35 * MS, 200 * MS, PERIOD_NS)}
    run = drive_bench(bench, 200 * MS, {**stream(31 * MS, lambda _: at(2e-5)), **nothing})
    [event] = run.events
    assert (event.number, event.result, event.time_ns) == (1, Result.DONE, 80 * MS)
    assert event.message == 'jog.timeout passed without a new command'
    assert not run.status[-1] & (Status.MOVING | Status.CLOSED_LOOP)


def test_an_empty_command_has_no_event_and_no_effect(bench_with):
    run = drive_bench(bench_with(), 20 * MS, {0: [joint((NAN,), (NAN,))], 10 * MS: [joint()]})
    assert run.events == []
    assert not run.status[-1] & (Status.MOVING | Status.CLOSED_LOOP | Status.REFUSED)


def test_a_velocity_ends_at_a_soft_limit_and_may_lead_back(bench_with):
    bench = bench_with(limits__soft_min=-1e-6, limits__soft_max=1e-6)
    run = drive_bench(bench, 100 * MS, {0: [at(5e-5)]})
    [event] = run.events
    assert event.result is Result.RANGE_LIMIT_REACHED
    assert 'above limits.soft_max 1e-06 m' in event.message
    assert run.status[-1] & Status.MOVEMENT_FAILED
    run = drive_bench(bench, 20 * MS, {0: [at(-5e-5)]})
    assert run.events == []
    assert bench.sensing.position_m < 1e-6


@pytest.mark.parametrize(
    'request_',
    [to(20e-6), at(5e-5), Request('position', (20e-6, 0.0, 0.0))],
    ids=['target', 'velocity', 'position'],
)
def test_a_runner_that_comes_no_nearer_is_at_an_end_stop(stand, request_):
    # The load cell stops the runner after 4 um at most: mu F_n = k x.
    run = drive_bench(Bench(stand), 300 * MS, {0: [request_]})
    [event] = run.events
    assert (event.command, event.result) == (request_.name, Result.END_STOP_REACHED)
    assert 'no progress' in event.message
    failed = run.status[-1]
    assert failed & Status.END_STOP_REACHED
    assert failed & Status.MOVEMENT_FAILED
    assert not failed & (Status.CLOSED_LOOP | Status.MOVING)


def test_without_a_reading_a_velocity_fails(bench_with):
    run = drive_bench(bench_with(fault__interferometer='dropout'), 5 * MS, {2 * MS: [at(1e-5)]})
    assert [event.result for event in run.events] == [Result.NO_SENSOR]


def test_another_kind_of_move_aborts_a_joint_and_a_joint_another_move(bench_with):
    position = Request('position', (50e-6, 0.0, 0.0))
    requests = {0: [at(1e-5)], 10 * MS: [position], 20 * MS: [to(1e-6)]}
    run = drive_bench(bench_with(), 30 * MS, requests)
    assert [(e.command, e.result, e.message) for e in run.events] == [
        ('joint', Result.ABORTED, 'replaced by command 2'),
        ('position', Result.ABORTED, 'replaced by command 3'),
    ]
