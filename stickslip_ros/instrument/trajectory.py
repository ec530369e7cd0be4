# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A trajectory of the runner: positions and their times."""

import math
from bisect import bisect_right
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, UnknownName, WrongKind
from stickslip_ros.instrument.checks import check_position, check_velocity, fastest_steps_m_per_s
from stickslip_ros.parameters import Parameters, Scalar

POINTS_MAX = 10_000
NONE = -1.0
"""No tolerance, as in ``control_msgs/msg/JointTolerance``."""
_DEGREES = (1, 3, 5)
_SETTINGS = ('degree', 'start', 'path_tolerance', 'goal_tolerance', 'goal_time_tolerance')
_SHARES = np.linspace(0.0, 1.0, 33)[:, np.newaxis]
"""Shares of the time between two points at which positions and velocities are checked."""
_REST_SHARE = 1e-3
"""Share of the fastest velocity below which a runner is at rest."""


class Point(NamedTuple):
    """A set point of the runner; values that the degree of its trajectory does not use are 0."""

    time_s: float
    position_m: float
    velocity_m_per_s: float = 0.0
    acceleration_m_per_s2: float = 0.0


class Followed(NamedTuple):
    """Set point and reading of a trajectory at the end of a block."""

    elapsed_s: float  # since its start
    set_point: Point
    position_m: float  # reading


class Trajectory(NamedTuple):
    """Points, interpolation and tolerances."""

    # their times count from the start; after the start they are simulated times
    points: list[Point]
    # degree of the polynomial between two points: 1 (positions), 3 (and velocities) or 5 (and
    # accelerations)
    degree: int
    start_s: float  # simulated time of the start; NONE: the time at which it is accepted
    # largest distance of the reading from the set point before the end, m; or NONE
    path_tolerance_m: float
    # largest distance from the last point at which the trajectory is done, m; or NONE
    goal_tolerance_m: float
    goal_time_tolerance_s: float  # longest time after the end until it is done, s; or NONE

    @property
    def end(self) -> Point:
        return self.points[-1]

    def at(self, time_s: float) -> Point:
        """Return the set point at a time; after the end, the last point."""
        after = bisect_right(self.points, time_s, key=lambda point: point.time_s)
        if after == len(self.points):
            return Point(time_s, self.end.position_m)
        before = self.points[after - 1]
        return Point(time_s, *_between(before, self.points[after], self.degree, time_s))

    def begin(self, parameters: Parameters, now_s: float, position_m: float) -> 'Trajectory':
        """
        Return the rest of the trajectory, from the present position at rest.

        Raises OutOfRange if the way to the next point is faster than steps.

        """
        start_s = now_s if self.start_s == NONE else self.start_s
        points = [each._replace(time_s=start_s + each.time_s) for each in self.points]
        ahead = [each for each in points if each.time_s > now_s]
        here = Point(now_s, position_m)
        begun = self._replace(points=[here, *(ahead or [self.end._replace(time_s=now_s)])])
        if ahead and not math.isnan(position_m):
            _, speeds_m_per_s = _sampled(np.array(begun.points[:2]), self.degree)
            check_velocity(parameters, 'velocity to the next point', float(speeds_m_per_s.max()))
        return begun


def check_trajectory(
    parameters: Parameters, numbers: Array, settings: Mapping[str, Scalar]
) -> Trajectory:
    """
    Return the trajectory of rows of time, position, velocity and acceleration.

    Tolerances that are not set are `limits.following_error`, `closed_loop.tolerance` and
    `closed_loop.timeout`.

    Raises WrongKind if the numbers are not complete rows, or too many; UnknownName if a setting
    does not exist; OutOfRange if times do not rise, the runner does not rest at the end, or is too
    fast; BeyondSoftLimit if the way leaves the soft limits.

    """
    rows, rest = divmod(len(numbers), len(Point._fields))
    if rest or not 1 <= rows <= POINTS_MAX:
        expected = f'1 to {POINTS_MAX} points of time, position, velocity and acceleration'
        raise WrongKind(
            'trajectory', numbers[:8].tolist(), expected, 'send whole points, or fewer'
        )
    for name in settings.keys() - set(_SETTINGS):
        raise UnknownName('setting of a trajectory', name, f'use {", ".join(_SETTINGS)}')
    table = numbers.reshape(rows, len(Point._fields))
    _check_times(table[:, 0])
    trajectory = Trajectory(
        points=[Point(*row) for row in table.tolist()],
        degree=int(settings.get('degree', 1)),
        start_s=float(settings.get('start', NONE)),
        path_tolerance_m=_tolerance(
            settings, 'path_tolerance', parameters.limits.following_error or NONE
        ),
        goal_tolerance_m=_tolerance(settings, 'goal_tolerance', parameters.closed_loop.tolerance),
        goal_time_tolerance_s=_tolerance(
            settings, 'goal_time_tolerance', parameters.closed_loop.timeout
        ),
    )
    if trajectory.degree not in _DEGREES:
        limit = f'not one of {_DEGREES}'
        raise OutOfRange('trajectory degree', trajectory.degree, '', limit, 'take one of these')
    last_m_per_s = abs(trajectory.end.velocity_m_per_s)
    if trajectory.degree > 1 and last_m_per_s > _REST_SHARE * fastest_steps_m_per_s(parameters):
        hint = 'end the trajectory at rest'
        raise OutOfRange('last trajectory velocity', last_m_per_s, 'm/s', 'not 0 m/s', hint)
    places_m, speeds_m_per_s = _sampled(table, trajectory.degree)
    ways_m = np.append(places_m, table[:, 1])
    for place_m in (ways_m.min(), ways_m.max()):
        check_position(parameters, float(place_m))
    check_velocity(parameters, 'trajectory velocity', float(speeds_m_per_s.max(initial=0.0)))
    return trajectory


def _tolerance(settings: Mapping[str, Scalar], name: str, default: float) -> float:
    value = float(settings.get(name, default))
    if value <= 0.0 and value != NONE:
        unit = 's' if 'time' in name else 'm'
        limit = f'not above 0 {unit}'
        raise OutOfRange(
            f'trajectory {name}', value, unit, limit, f'raise it, or {NONE:g} for none'
        )
    return value


def _check_times(times_s: Array) -> None:
    """Refuse times that do not rise, or start before 0."""
    if times_s[0] < 0.0:
        hint = 'count times from the start'
        raise OutOfRange('trajectory time of point 1', times_s[0], 's', 'below 0 s', hint)
    falls = np.flatnonzero(np.diff(times_s) <= 0.0)
    if len(falls):
        row = int(falls[0]) + 1
        limit = f'not after that of point {row}, {times_s[row - 1]:g} s'
        name = f'trajectory time of point {row + 1}'
        raise OutOfRange(name, float(times_s[row]), 's', limit, 'use rising times')


def _sampled(table: Array, degree: int) -> tuple[Array, Array]:
    """Return positions and speeds between rows of points."""
    columns: Any = table.T
    before, after = Point(*columns[:, :-1]), Point(*columns[:, 1:])
    times_s = before.time_s + _SHARES * (after.time_s - before.time_s)
    places_m, velocities_m_per_s = _between(before, after, degree, times_s)
    return places_m, np.abs(velocities_m_per_s)


def _between(before: Point, after: Point, degree: int, time_s: Any) -> tuple[Any, Any]:
    """Return position and velocity between two points, or columns of points, by Hermite."""
    span_s = after.time_s - before.time_s
    share = (time_s - before.time_s) / span_s
    way = after.position_m - before.position_m
    # Derivatives with respect to the share of the time, so all are lengths.
    v0, v1 = before.velocity_m_per_s * span_s, after.velocity_m_per_s * span_s
    a0, a1 = (point.acceleration_m_per_s2 * span_s**2 for point in (before, after))
    factors: tuple[Any, ...] = (before.position_m, way)
    if degree == 3:
        factors = before.position_m, v0, 3.0 * way - 2.0 * v0 - v1, v0 + v1 - 2.0 * way
    elif degree == 5:
        factors = (
            before.position_m,
            v0,
            0.5 * a0,
            10.0 * way - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1,
            -15.0 * way + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1,
            6.0 * way - 3.0 * (v0 + v1) + 0.5 * (a1 - a0),
        )
    place = speed = 0.0 * share
    for factor in reversed(factors):
        speed = speed * share + place
        place = place * share + factor
    return place, speed / span_s
