# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Trajectories of the closed loop: interpolation, ends, refusals."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import BPoly

from stickslip_ros.errors import StickSlipError
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request, check_request
from stickslip_ros.instrument.reports import Event, Result
from stickslip_ros.interface.cdr import unpack
from stickslip_ros.interface.requests import pack_request
from stickslip_ros.lab.runs.replay import replay
from stickslip_ros.message_types import STRING
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.run import ReportingBench, RunWriter
from stickslip_ros.units import NANO

FREE = {'load_cell.contact': 'absent', 'runner.damping': 5.0}
STAND = Parameters().updated(FREE)
ROWS = (
    (0.0, 0.0, 0.0, 0.0),
    (0.1, 1e-6, 2e-5, 1e-4),
    (0.25, 4e-6, -1e-5, 0.0),
    (0.3, 3e-6, 0.0, 0.0),
)
ROUNDING_M = 1e-18
STROKES_BEHIND = 2.0
"""A set point that moves is followed within the step that is under way and the next."""


def trajectory(rows: Any = ROWS, **settings: Any) -> Request:
    values = tuple(float(number) for row in rows for number in row)
    return Request('trajectory', values, tuple(settings.items()), tag='mine')


def run(bench: Bench, request: Request, simulated_s: float = 1.0) -> list[Event]:
    """Carry out a request; return the events up to the first, or until a time."""
    block_ns = bench.parameters.block_ns
    events = [*bench.update(bench.time_ns + block_ns, [request]).events]
    end_ns = bench.time_ns + simulated_s / NANO
    while not events and bench.time_ns < end_ns:
        events += bench.update(bench.time_ns + block_ns).events
    return events


@pytest.mark.parametrize('degree', [1, 3, 5])
def test_between_points_lies_the_polynomial_of_hermite(degree: int):
    given = check_request(trajectory(degree=degree), STAND)
    times_s, heeded = np.array(ROWS)[:, 0], (degree + 1) // 2
    reference = BPoly.from_derivatives(times_s, np.array(ROWS)[:, 1 : 1 + heeded])
    for time_s in np.linspace(0.0, 0.2999, 101):
        _, position_m, velocity_m_per_s, _ = given.at(time_s)
        assert position_m == pytest.approx(reference(time_s), abs=ROUNDING_M)
        speed = reference.derivative()(time_s)
        assert velocity_m_per_s == pytest.approx(speed, rel=1e-9, abs=ROUNDING_M / 0.01)
    assert given.at(0.3) == (0.3, 3e-6, 0.0, 0.0)


def test_the_runner_follows_and_the_command_is_done_behind_the_last_point():
    bench, behind_m = Bench(STAND), []
    block_ns = STAND.block_ns
    bench.update(block_ns, [trajectory(degree=3)])
    events: list[Event] = []
    while not events:
        events += bench.update(bench.time_ns + block_ns).events
        followed = bench.motion.followed
        if followed.elapsed_s < 0.3:
            behind_m.append(followed.set_point.position_m - followed.position_m)
    stroke_m = STAND.actuator.gain * STAND.step.amplitude
    assert np.abs(behind_m).max() < STROKES_BEHIND * stroke_m
    [event] = events
    assert (event.result, event.tag) == (Result.DONE, 'mine')
    assert 0.3 < event.time_ns * NANO < 0.4
    assert bench.state['position_m'] == pytest.approx(3e-6, abs=STAND.closed_loop.tolerance)


def test_a_trajectory_that_has_begun_by_its_start_goes_on_from_the_present_place():
    bench = Bench(STAND)
    for _ in range(150):
        bench.update(bench.time_ns + STAND.block_ns)
    [event] = run(bench, trajectory(start=0.0))
    assert event.result is Result.DONE
    assert 0.3 < event.time_ns * NANO < 0.4


def test_a_single_point_without_time_is_a_target():
    [event] = run(Bench(STAND), trajectory([(0.0, 1e-6, 0.0, 0.0)]))
    assert event.result is Result.DONE


@pytest.mark.parametrize(
    ('settings', 'result', 'words'),
    [
        ({'path_tolerance': 1e-7}, Result.FOLLOWING_LIMIT_REACHED, 'path tolerance 1e-07 m'),
        ({'goal_time_tolerance': 1e-3}, Result.TIMEOUT, 'after the end, above the goal tolerance'),
    ],
)
def test_what_is_not_kept_ends_it_and_says_by_how_much(settings, result, words):
    bench = Bench(Parameters().updated({'limits.blocked_time': 10.0}))  # against the load cell
    [event] = run(bench, trajectory(**settings))
    assert event.result is result
    assert words in event.message


def test_a_tolerance_that_is_none_is_not_looked_at():
    bench = Bench(Parameters().updated({'limits.blocked_time': 10.0}))
    [event] = run(bench, trajectory(path_tolerance=-1.0, goal_tolerance=-1.0))
    assert event.result is Result.DONE


LIMITED = STAND.updated({'limits.soft_min': -0.5e-6, 'limits.soft_max': 5e-6})
BACK = ((0.0, 0.0, 0.0, 0.0), (0.1, 1e-6, -1e-4, 0.0), (0.2, 0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ('request_', 'words'),
    [
        (trajectory([]), 'trajectory [] is not 1 to 10000 points'),
        (trajectory([(0.0, 1.0)]), 'is not 1 to 10000 points'),
        (trajectory([(float('nan'), 0.0, 0.0, 0.0)]), 'trajectory number 1 nan is not a finite'),
        (trajectory([(-0.1, 0.0, 0.0, 0.0)]), 'time of point 1 -0.1 s is below 0 s'),
        (trajectory([*ROWS, ROWS[-1]]), 'time of point 5 0.3 s is not after that of point 4'),
        (trajectory(degree=2), 'degree 2 is not one of (1, 3, 5)'),
        (trajectory(ROWS[:2], degree=3), 'last trajectory velocity 2e-05 m/s is not 0 m/s'),
        (trajectory([ROWS[0], (0.001, 1e-6, 0, 0)]), '0.001 m/s is above the largest velocity'),
        (trajectory([ROWS[0], (0.1, 6e-6, 0, 0)]), 'x 6e-06 m is outside the soft limits'),
        (trajectory(BACK, degree=3), 'm is outside the soft limits'),
        (trajectory(goal_tolerance=-2.0), 'goal_tolerance -2 m is not above 0 m; raise it, or -1'),
        (trajectory(speed=1.0), "setting of a trajectory 'speed' is not known; use degree"),
    ],
)
def test_what_makes_no_sense_is_refused_with_value_limit_unit_and_remedy(request_, words):
    with pytest.raises(StickSlipError, match=re.escape(words)):
        check_request(request_, LIMITED)


def test_a_way_to_the_first_point_that_is_too_fast_is_refused():
    bench = Bench(STAND)
    [event] = run(bench, trajectory([(0.01, 1e-5, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)]))
    assert event.result is Result.INVALID_PARAMETER
    assert event.message.startswith('velocity to the next point 0.00')


def test_a_bench_that_is_restored_follows_to_the_bit():
    first = Bench(STAND)
    first.update(STAND.block_ns, [trajectory(degree=3)])
    for _ in range(100):
        first.update(first.time_ns + STAND.block_ns)
    second = Bench.restore(first.save())
    for _ in range(300):
        until_ns = first.time_ns + STAND.block_ns
        ours, theirs = first.update(until_ns), second.update(until_ns)
        assert (ours.readings.trace == theirs.readings.trace).all()
        assert ours.events == theirs.events


def test_it_is_noted_as_a_request_and_replayed(tmp_path: Path):
    request = trajectory(degree=3, path_tolerance=1e-6)
    note = json.loads(str(unpack(STRING, pack_request(request, 0).data)))
    assert (note['name'], note['tag']) == ('trajectory', 'mine')
    path = tmp_path / 'run.mcap'
    with RunWriter(path, STAND, wait=True) as writer:
        bench = ReportingBench(STAND, writer=writer)
        bench.update(STAND.block_ns, [request])
        for _ in range(400):
            bench.update(bench.bench.time_ns + STAND.block_ns)
    assert replay(path, tmp_path / 'again.mcap').identical
