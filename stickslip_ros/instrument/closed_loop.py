# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A closed-loop move: way, arrival, hold and failures."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from stickslip_ros.drive.records import Wave
from stickslip_ros.drive.waveform import level
from stickslip_ros.instrument.checks import steps_wave
from stickslip_ros.instrument.position_loop import Level, PositionLoop, Steps, loop_settings
from stickslip_ros.instrument.reports import Result
from stickslip_ros.instrument.state_tree import ANY_FLOAT
from stickslip_ros.instrument.trajectory import NONE, Followed, Trajectory
from stickslip_ros.parameters import Parameters, to_nanoseconds
from stickslip_ros.units import NANO

PROGRESS_SHARE = 0.1
"""Way that counts as progress, in strokes."""
PUSHED_STROKES = 2.0
"""Way back after which progress counts from the new position, in strokes."""
BLOCKED_STEPS = 5.0
"""Least number of steps without progress before a runner counts as blocked."""
LEAD_STROKES = 10.0
"""Largest lead of a moving set point over the runner, in strokes; then it waits."""


class Goal(NamedTuple):
    """Goal of a closed loop."""

    position_m: float | None  # target, m; None for a velocity
    velocity_m_per_s: float = 0.0  # velocity of the set point without a target; 0: rest
    trajectory: Trajectory | None = None  # trajectory of the set point to its target, if any

    @property
    def direction(self) -> int:
        """+1 or -1 for a velocity, else 0."""
        return (self.velocity_m_per_s > 0.0) - (self.velocity_m_per_s < 0.0)


class Observation(NamedTuple):
    """State of the stand for moves, at the end of a block."""

    time_ns: int  # simulated time
    position_m: float  # mean position reading of the block, m; NaN without a sensor
    reading_m: float | None  # last position reading of the block, m; None without a sensor
    voltage_v: float  # voltage at the piezo
    cycles: int  # finished ramps of the wave
    ramp_s: float  # time since the start of its present ramp
    arrived: bool  # whether the wave is over and the voltage has reached its final value


@dataclass(frozen=True)
class Outcome:
    """Result of a move, and its reason."""

    result: Result
    why: str = ''


class ClosedLoop:
    """A closed-loop move, from its start to the end of its hold."""

    REMEMBERED: ClassVar[Mapping[str, Any]] = {
        'goal': Goal,
        'holds': bool,
        'in_position': bool,
        '_set_point_m': ANY_FLOAT,
        '_target_m': ANY_FLOAT,
        '_is_redirected': bool,
        '_loop': PositionLoop,
        '_start_ns': int,
        '_outside_ns': int,
        '_progress_ns': int,
        '_last_ns': int,
        '_nearest_m': ANY_FLOAT,
    }

    def __init__(self, parameters: Parameters, goal: Goal, start: Observation) -> None:
        self.goal = goal
        self.holds = False  # whether the target was reached and is held
        self.in_position = False  # whether the reading is within the tolerance of the target
        self.followed: Followed | None = None  # set point and reading of a trajectory's last block
        self._parameters = parameters
        self._set_point_m = start.position_m
        self._target_m = self._target_of(goal)
        self._is_redirected = False
        self._loop = PositionLoop(loop_settings(parameters), start.voltage_v)
        self._start_ns = self._outside_ns = self._progress_ns = self._last_ns = start.time_ns
        self._nearest_m = math.inf
        self._scale_to_steps(parameters)

    def _scale_to_steps(self, parameters: Parameters) -> None:
        stroke_m = parameters.actuator.gain * parameters.step.amplitude
        self._progress_m = PROGRESS_SHARE * stroke_m
        self._pushed_m = PUSHED_STROKES * stroke_m
        self._lead_m = LEAD_STROKES * stroke_m
        blocked_s = max(parameters.limits.blocked_time, BLOCKED_STEPS / parameters.step.frequency)
        self._blocked_ns = to_nanoseconds(blocked_s)

    def recall(self, values: dict[str, Any]) -> None:
        self._loop.recall(values.pop('_loop'))
        vars(self).update(values)

    @property
    def step_m(self) -> float | None:
        """Step length learned from readings, m; None before."""
        return self._loop.learned_m

    def change_parameters(self, parameters: Parameters) -> None:
        if not (self._parameters.closed_loop.velocity or self.goal.direction or self.holds):
            self._set_point_m = math.nan  # restart from the runner, because it was at the target
        self._parameters = parameters
        self._loop.rescale(loop_settings(parameters))
        self._scale_to_steps(parameters)

    def pursue(self, goal: Goal, observation: Observation) -> bool:
        """
        Change the goal; return whether it differs from the present one.

        The learned step length stays, and steps towards the goal continue.

        """
        if goal == self.goal:
            return False
        if self.holds:
            self._loop.reset_attempts()
        self.goal = goal
        self.holds = False
        self._start_ns = self._outside_ns = observation.time_ns
        self._move_target(self._target_of(goal), observation.position_m)
        self._is_redirected = self._loop.overshoots(self._target_m)
        return True

    def _target_of(self, goal: Goal) -> float:
        return self._set_point_m if goal.position_m is None else goal.position_m

    def _move_target(self, target_m: float, position_m: float) -> None:
        """Move the target; the position from which progress counts does not move."""
        side = math.copysign(1.0, self._target_m - position_m)
        self._nearest_m += side * (target_m - self._target_m)
        if self._nearest_m < 0.0:
            self._nearest_m = math.inf
        self._target_m = target_m

    def update(self, observation: Observation) -> tuple[Wave | None, Outcome | None]:
        """Return the next wave, or None to keep the present one, and the outcome, or None."""
        self._move_set_point(observation)
        self._watch_position(observation)
        failure = self._failure(observation)
        if failure is not None:
            return None, failure
        if self._is_redirected:
            self._is_redirected = False
            self._loop.abort_burst(observation.voltage_v)
            return self._next_wave(observation), None
        acts = observation.arrived
        acts = acts or self._loop.has_overshot(self._set_point_m, observation.position_m)
        return self._next_wave(observation) if acts else None, self._arrival(observation)

    def _move_set_point(self, observation: Observation) -> None:
        """Move the set point along the trajectory, with the velocity, or towards the target."""
        velocity_m_per_s = self._parameters.closed_loop.velocity
        if math.isnan(self._set_point_m):
            self._set_point_m = observation.position_m
        if math.isnan(self._target_m):  # rest at a position that was unknown at the start
            self._target_m = self._set_point_m
        block_s = (observation.time_ns - self._last_ns) * NANO
        self._last_ns = observation.time_ns
        if self.goal.trajectory is not None:
            point = self.goal.trajectory.at(observation.time_ns * NANO)
            elapsed_s = point.time_s - self.goal.trajectory.points[0].time_s
            self.followed = Followed(elapsed_s, point, observation.position_m)
            self._set_point_m = point.position_m
            self._move_target(self._set_point_m, observation.position_m)
            return
        if self.goal.direction:
            next_m = self._set_point_m + self.goal.velocity_m_per_s * block_s
            if self.goal.direction * (next_m - observation.position_m) <= self._lead_m:
                self._set_point_m = next_m  # otherwise it waits for the runner
            self._move_target(self._set_point_m, observation.position_m)
            return
        way_m = self._target_m - self._set_point_m
        largest_m = velocity_m_per_s * block_s
        if velocity_m_per_s > 0.0 and abs(way_m) > largest_m:
            self._set_point_m += largest_m if way_m > 0.0 else -largest_m
        else:
            self._set_point_m = self._target_m

    def _watch_position(self, observation: Observation) -> None:
        error_m = abs(self._target_m - observation.position_m)
        trajectory = self.goal.trajectory
        tolerance_m = self._parameters.closed_loop.tolerance
        if trajectory is not None:
            tolerance_m = trajectory.goal_tolerance_m
        self.in_position = tolerance_m == NONE or error_m <= tolerance_m
        if not self.in_position or not observation.arrived:
            self._outside_ns = observation.time_ns
        # A scan moves less than counts as progress: only bursts of steps can be blocked.
        if error_m < self._nearest_m - self._progress_m or not self._loop.is_coarse:
            self._nearest_m = error_m
            self._progress_ns = observation.time_ns
        elif error_m > self._nearest_m + self._pushed_m:
            self._nearest_m = error_m

    def _next_wave(self, observation: Observation) -> Wave:
        action = self._loop.update(self._set_point_m, observation.position_m)
        match action:
            case Steps(count):
                return steps_wave(self._parameters, count)
            case Level(voltage_v):
                return level(voltage_v)

    def _arrival(self, observation: Observation) -> Outcome | None:
        trajectory = self.goal.trajectory
        if trajectory is not None and observation.time_ns * NANO < trajectory.end.time_s:
            return None
        settle_ns = to_nanoseconds(self._parameters.closed_loop.settle_time)
        rests = observation.time_ns - self._outside_ns >= settle_ns
        arrived = observation.arrived and self.in_position and self._set_point_m == self._target_m
        any_position = trajectory is not None and trajectory.goal_tolerance_m == NONE
        if self.goal.direction or self.holds or not (any_position or (arrived and rests)):
            return None
        self.holds = True
        return Outcome(Result.DONE)

    def _failure(self, observation: Observation) -> Outcome | None:
        if math.isnan(observation.position_m):
            return Outcome(Result.NO_SENSOR, 'the position reading is not a number')
        limit_m = self._parameters.limits.following_error
        lag_m = abs(self._set_point_m - observation.position_m)
        velocity_m_per_s = self._parameters.closed_loop.velocity
        trajectory = None if self.holds else self.goal.trajectory
        is_slow = velocity_m_per_s > 0.0 and trajectory is None
        follows = self.holds or self.goal.direction or is_slow
        if limit_m and follows and lag_m > limit_m:
            why = f'{lag_m:.4g} m from the set point, above limits.following_error {limit_m:g} m'
            return Outcome(Result.FOLLOWING_LIMIT_REACHED, why)
        if trajectory is not None and (late := _deviation(trajectory, observation, lag_m)):
            return late
        timeout_s = self._parameters.closed_loop.timeout
        is_timed = not (self.holds or self.goal.direction or trajectory)
        if is_timed and observation.time_ns - self._start_ns > to_nanoseconds(timeout_s):
            error_m = self._target_m - observation.position_m
            why = f'{error_m:.4g} m are left after closed_loop.timeout, {timeout_s:g} s'
            return Outcome(Result.TIMEOUT, why)
        return self._blockage(observation)

    def _blockage(self, observation: Observation) -> Outcome | None:
        """Return the failure of a runner that makes steps but no progress; or None."""
        time_ns = observation.time_ns - self._progress_ns
        if not self._loop.is_coarse or time_ns <= self._blocked_ns:
            return None
        why = f'no progress for {time_ns * NANO:.3g} s at {observation.position_m:.6g} m'
        if self._parameters.load_cell.contact != 'absent':
            why += '; the load cell may hold the runner: choose a nearer target, or remove it'
            why += ' (load_cell.contact absent)'
        return Outcome(Result.END_STOP_REACHED, why)


def _deviation(trajectory: Trajectory, observation: Observation, lag_m: float) -> Outcome | None:
    """Return the failure of a runner that is too far from its set point or too late; or None."""
    over_s = observation.time_ns * NANO - trajectory.end.time_s
    tolerance_m, patience_s = trajectory.path_tolerance_m, trajectory.goal_time_tolerance_s
    if over_s < 0.0 and tolerance_m != NONE and lag_m > tolerance_m:
        why = (
            f'{lag_m:.4g} m from the set point {-over_s:.3g} s before the end, above the path '
            f'tolerance {tolerance_m:g} m; move slower, or allow more'
        )
        return Outcome(Result.FOLLOWING_LIMIT_REACHED, why)
    if over_s > patience_s != NONE:
        why = (
            f'{lag_m:.4g} m are left {over_s:.3g} s after the end, above the goal tolerance '
            f'{trajectory.goal_tolerance_m:g} m; move slower, or allow more'
        )
        return Outcome(Result.TIMEOUT, why)
    return None
