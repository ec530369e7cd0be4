"""Measured forces, and the drive as a function of its free parameters that is fitted to them."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.contact.profile import Array
from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.fitting.free import Free
from stickslip_ros.parameters import Parameters
from stickslip_ros.runs.courses import Course, together
from stickslip_ros.runs.sawtooth_run import drive_course
from stickslip_ros.tables.experiment import AS_IT_IS, Reading, listed_tables, read_joined

if TYPE_CHECKING:
    from stickslip_ros.tables.formats import Table

FORCE, FREQUENCY, SIGMA = 'force_n', 'frequency_hz', 'force_sigma_n'
STEP = 3e-4
"""Step of differences in a coordinate: 0.03 % of a value, or of a range. The forces of a fixed
number of cycles are smooth in every parameter but for 8e-9 of themselves, so that a slope has a
noise of 1e-5 of them; the truncation is 1e-5 of a slope for central differences and 2e-3 for
one-sided ones, where the force goes with the 13th power of a parameter, the steepest found."""
BOUND_SHARE = 1e-3
"""Share of the range, in coordinates, within which a parameter sits on its bound."""
STEPS_MIN, STEPS_MAX = 100, 6400
"""Cycles of a run; doubled from the one up to the other, until the force is steady."""
STEADY_SHARE = 0.01  # share of a standard error by which twice as many cycles may change a force
STEADY_FORCE = 1e-5
"""The same as a share of the largest force, where standard errors are not known."""
SMALLEST_SHARE = 1e-7  # share of the largest force below which no change of a force counts
RUNS_KEPT = 4096
"""Runs kept: differences to one side need the forces that the search has just asked for, and all
synthetic data sets start at the same place."""


def silent() -> None:
    """Tell nobody."""


@dataclass(frozen=True, eq=False)
class Points:
    """
    Mean forces on the load cell that were read where preload, stroke and frequency were set.

    All are arrays of shape (points,); sigma_n are the standard errors of the forces, None if they
    are not known; steps are the cycles that the drive had made from rest, the force being the mean
    over the last of them, None if it was steady.

    """

    preload_n: Array
    amplitude_m: Array
    frequency_hz: Array
    force_n: Array
    sigma_n: Array | None = None
    steps: NDArray[np.int_] | None = None

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.force_n)

    @property
    def largest_n(self) -> float:
        """Largest measured force, N."""
        return float(np.max(np.abs(self.force_n)))

    @property
    def scale_n(self) -> Array:
        """What residuals are divided by, N: the standard errors, or one force for all points."""
        if self.sigma_n is not None:
            return self.sigma_n
        return np.full(len(self), self.largest_n)


@dataclass(frozen=True, eq=False)
class Problem:
    """
    A fit to be made: which parameters of a stand are free, and the points.

    The cycles of each point's run are fixed, so that the force is a smooth function.

    """

    parameters: Parameters
    free: tuple[Free, ...]
    points: Points
    cycles: tuple[int, ...]
    tick: Callable[[], None] = silent  # called whenever a force is known

    @property
    def start(self) -> Array:
        """Coordinates of the starting values."""
        return self.coordinates([one.start for one in self.free])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the coordinates."""
        lower, upper = zip(*(one.coordinates for one in self.free), strict=True)
        return np.array(lower), np.array(upper)

    def at_bound(self, coordinates: Array) -> NDArray[np.bool_]:
        """Return which parameters sit on one of their bounds, shape (free,)."""
        lower, upper = self.bounds
        near = BOUND_SHARE * (upper - lower)
        return np.asarray((coordinates - lower <= near) | (upper - coordinates <= near))

    def widened(self, values: Sequence[float]) -> 'Problem':
        """Return the problem with those bounds moved on which parameters sit, if they may be."""
        pairs = zip(self.free, values, strict=True)
        free = tuple(one.widened(value, BOUND_SHARE) for one, value in pairs)
        return dataclasses.replace(self, free=free)

    def coordinates(self, values: Sequence[float]) -> Array:
        """Return the coordinates of some values of the free parameters."""
        pairs = zip(self.free, values, strict=True)
        return np.array([one.to_coordinate(value) for one, value in pairs])

    def values(self, coordinates: Array) -> list[float]:
        """Return the values of the free parameters at some coordinates."""
        pairs = zip(self.free, coordinates.tolist(), strict=True)
        return [one.to_value(z) for one, z in pairs]

    def stand(self, coordinates: Array) -> Parameters:
        """Return the stand with the values of some coordinates."""
        names = (one.name for one in self.free)
        return self.parameters.updated(dict(zip(names, self.values(coordinates), strict=True)))

    def forces_n(self, coordinates: Array, cycles: Sequence[int] | None = None) -> Array:
        """Return the forces of the model at the measured points, N."""
        [force_n] = self._all_forces_n([coordinates], cycles)
        return force_n

    def _all_forces_n(
        self, coordinates: Sequence[Array], cycles: Sequence[int] | None = None
    ) -> list[Array]:
        """Return those of several coordinates; all their runs go together."""
        points = self.points
        where = (points.preload_n, points.amplitude_m, points.frequency_hz)
        rows = list(zip(*(each.tolist() for each in where), cycles or self.cycles, strict=True))
        runs = [(there, *row) for there in map(self.stand, coordinates) for row in rows]
        kept = {run: kept_force(*run) for run in runs}  # measured again: computed once
        new = [run for run, force_n in kept.items() if not force_n]
        for run, force_n in zip(new, together(force_course(*run) for run in new), strict=True):
            kept[run].append(force_n)
        for _ in kept:
            self.tick()
        return np.split(np.array([kept[run][0] for run in runs]), len(coordinates))

    def residuals(self, coordinates: Array) -> Array:
        """Return model less measurement, per standard error."""
        points = self.points
        return (self.forces_n(coordinates) - points.force_n) / points.scale_n

    def slopes(self, coordinates: Array, *, central: bool = False) -> Array:
        """
        Return the slopes of the residuals, shape (points, free), by differences.

        A search does with steps to one side; central ones are for the errors of a fit.

        """
        ends = list[Array]()
        for index, (lower, upper) in enumerate(zip(*self.bounds, strict=True)):
            below, above = coordinates.copy(), coordinates.copy()
            above[index] = min(coordinates[index] + STEP, upper)
            if central or above[index] < coordinates[index] + STEP:
                below[index] = max(coordinates[index] - STEP, lower)
            ends += below, above
        changes_n = np.diff(self._all_forces_n(ends), axis=0)[::2]
        ways = np.diff(ends, axis=0)[::2].sum(axis=1)
        return np.column_stack(list(changes_n / ways[:, np.newaxis] / self.points.scale_n))

    def steady_at(self, coordinates: Array) -> tuple['Problem', bool]:
        """Return the problem with as many cycles as a stand needs, and whether they suffice."""
        points = self.points
        most = STEPS_MAX if points.steps is None else 0
        tolerance_n: Array = np.full(len(points), STEADY_FORCE * points.largest_n)
        if points.sigma_n is not None:
            least_n = SMALLEST_SHARE * points.largest_n
            tolerance_n = np.maximum(STEADY_SHARE * points.sigma_n, least_n)
        settings = np.column_stack((points.preload_n, points.amplitude_m, points.frequency_hz))
        group = np.unique(settings, axis=0, return_inverse=True)[1].ravel()
        cycles = np.array(self.cycles)
        forces_n = self.forces_n(coordinates, tuple(cycles.tolist()))
        while True:
            longer_n = self.forces_n(coordinates, tuple((2 * cycles).tolist()))
            short = np.abs(longer_n - forces_n) > tolerance_n
            more = np.isin(group, group[short]) & (cycles < most)
            if not more.any():
                found = dataclasses.replace(self, cycles=tuple(cycles.tolist()))
                return found, not short.any()
            cycles[more] *= 2
            forces_n = np.where(more, longer_n, forces_n)


def read_points(
    tables: 'Table | Sequence[Table]',
    frequency_hz: float = 1000.0,
    reading: Reading = AS_IT_IS,
    steps: int = 0,
) -> Points:
    """Read an experiment by amplitude; forces were read after so many ``steps``, 0: steady."""
    if steps < 0:
        raise OutOfRange('steps', steps, '', 'below 0', 'give a number, or 0 for steady forces')
    given = listed_tables(tables)
    reading.check_count(len(given))
    experiment = read_joined(given, reading, (FORCE,))
    columns = experiment.columns
    points = Points(
        preload_n=columns['preload_n'],
        amplitude_m=columns['amplitude_m'],
        frequency_hz=columns.get(FREQUENCY, np.full(len(columns['force_n']), frequency_hz)),
        force_n=columns['force_n'],
        sigma_n=columns.get(SIGMA),
        steps=np.full(len(columns['force_n']), steps) if steps else None,
    )
    if points.largest_n == 0.0:
        raise RecordingError(
            experiment.origin, 'has no force other than 0', 'check the column force_n'
        )
    return points


def pose(
    parameters: Parameters,
    free: tuple[Free, ...],
    points: Points,
    tick: Callable[[], None] = silent,
) -> Problem:
    """Return the problem of a fit, with cycles enough for its starting values."""
    least, what = len(free), 'one for each free parameter'
    if points.sigma_n is None:
        least, what = least + 1, f'{what} and one for the standard error of the points'
    if len(points) < least:
        limit = f'below {least}, {what}'
        raise OutOfRange('number of points', len(points), '', limit, 'measure more, or free less')
    if parameters.load_cell.contact == 'absent':
        hint = 'set load_cell.contact=attached'
        raise OutOfRange('load_cell.contact', 'absent', '', 'without a force to fit', hint)
    if parameters.stand.preload_end:
        end_n = parameters.stand.preload_end
        hint = 'set stand.preload_end=0: each point has one preload'
        raise OutOfRange('stand.preload_end', end_n, 'N', 'not 0 in a fit', hint)
    counts = points.steps
    cycles = (STEPS_MIN,) * len(points) if counts is None else tuple(counts.tolist())
    problem = Problem(parameters, free, points, cycles, tick)
    return problem.steady_at(problem.start)[0]


@lru_cache(maxsize=RUNS_KEPT)
def kept_force(*_asked: Parameters | float) -> list[float]:
    """Return where the force of a run is kept: an empty list before it has been made."""
    return []


def force_course(
    parameters: Parameters, preload_n: float, amplitude_m: float, frequency_hz: float, cycles: int
) -> Course[float]:
    """Return the mean force of the last cycle of a run, N."""
    there = parameters.updated({'stand.preload': preload_n})
    run = yield from drive_course(there, amplitude_m, frequency_hz, cycles)
    return run.force_mean_n
