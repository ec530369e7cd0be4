# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The problem of a fit: experiments, and the stand as a function of its free parameters."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain, islice
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.lab.experiments.experiment import (
    Experiment,
    Readout,
    SawtoothSteps,
    Voltage,
    VoltageStep,
)
from stickslip_ros.lab.experiments.predict import Prediction, predict_all
from stickslip_ros.lab.fitting.free import Coordinate, Natural
from stickslip_ros.lab.fitting.metric import TOO_FAR, Allowance, Metric, metric_of
from stickslip_ros.lab.measurements.numbers import SHEET_SHARE
from stickslip_ros.lab.runs.batch import Pool
from stickslip_ros.parameters import Parameters, Scalar

_GAIN = 'actuator.gain'
STEP, EFFECT = 3e-4, 1e-5
"""
Step of differences in a coordinate, 0.03 % of a value or of a range, and least relative effect.

The forces after a fixed number of cycles have a relative numerical noise of 8e-9, which gives a
slope a noise of 1e-5 of the force. If the force grows with the 13th power of a parameter, the
truncation error is 1e-5 of the slope for central and 2e-3 for one-sided differences.

"""
PRIOR = math.log(10.0)
"""Prior standard error of a coordinate: a factor of ten. Without it, a recording with 4.5 nm of
noise gave feet a thousand times as rough, and a mass of 80 mg instead of 3.2 g."""
BOUND = 1e-3  # distance from a bound below which a parameter is on it
_STEPS_MIN, _STEPS_MAX = 100, 6400
"""Fewest and most steps of a run; the number is doubled until all results are steady."""
STEADY_SHARE = 0.01  # change of a steady number with twice the steps, per standard error
FINEST = 5e-11
"""Least noise of a trace, m or N: no sensor resolves a sixth of an atom within microseconds."""
_APART = 16  # distance of the two readings from which the motion per volt is computed

Predicted: TypeAlias = list[Prediction]
"""Predictions of a stand, in the order of ``Problem.observed``."""


def silent() -> None:
    """Report no progress."""


@dataclass(frozen=True, eq=False)
class Problem:
    """The problem of a fit. Places are natural coordinates, shape (free,)."""

    parameters: Parameters
    free: tuple[Coordinate, ...]
    experiments: tuple[Experiment, ...]  # with a fixed number of steps, for smooth numbers
    noise: tuple[float, ...]  # standard errors of the readings, in the order of ``observed``
    allowance: Allowance | None = None  # errors of the model
    # values of free parameters from other measurements, and their relative standard errors
    known: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    metrics: tuple[Metric, ...] = ()  # of the traces, in order, see ``measured_at``
    pool: Pool | None = None
    tick: Callable[[], None] = silent  # called after each run

    @cached_property
    def natural(self) -> Natural:
        return Natural(self.parameters.updated(self.settings_of_all), self.free)

    @property
    def settings_of_all(self) -> dict[str, Scalar]:
        """Settings with the same value in all experiments."""
        first, *others = (one.settings.items() for one in self.experiments)
        return dict(set(first).intersection(*others))

    @property
    def start(self) -> Array:
        return self.place_of([one.start for one in self.free])

    @property
    def observed(self) -> list[tuple[Experiment, Readout, float]]:
        """All readings: experiment, quantity, standard error."""
        pairs = ((one, each) for one in self.experiments for each in one.observed)
        return [(*pair, noise) for pair, noise in zip(pairs, self.noise, strict=True)]

    @property
    def count(self) -> int:
        """Number of readings and of known parameters."""
        return sum(len(each.values) for _, each, _ in self.observed) + len(self.known)

    @property
    def has_traces(self) -> bool:
        """Whether there are readings over time."""
        return any(isinstance(one.drive, Voltage) for one in self.experiments)

    @property
    def is_estimated(self) -> bool:
        """Whether the residuals give the standard error of a reading."""
        return self.has_traces or any(each.is_bare for _, each, _ in self.observed)

    @property
    def is_bare(self) -> bool:
        """Whether no reading has a standard error of its own, so that only ratios count."""
        return all(each.is_bare for _, each, _ in self.observed)

    @property
    def steps(self) -> list[tuple[Experiment, SawtoothSteps]]:
        """Experiments of steps, each with its drive."""
        pairs = ((one, one.drive) for one in self.experiments)
        return [(one, drive) for one, drive in pairs if isinstance(drive, SawtoothSteps)]

    @property
    def signal(self) -> float:
        """Root of the sum of squares of all readings, per standard error."""
        squares = (
            np.sum(((each.values - each.is_trace * each.values.mean()) / noise) ** 2)
            for _, each, noise in self.observed
        )
        return float(np.sqrt(sum(squares)))

    def at_bound(self, place: Array) -> NDArray[np.bool_]:
        """Return a mask of the parameters on a bound, shape (free,)."""
        return (self.excess(place, BOUND) > 0.0) | (self.excess(place, -BOUND) < 0.0)

    def excess(self, place: Array, further: float = 0.0) -> Array:
        """Return the excess of coordinates plus ``further`` over their bounds, shape (free,)."""
        pairs = zip(self.free, self.natural.back(place).tolist(), strict=True)
        return np.array([one.excess(z + further) for one, z in pairs])

    def place_of(self, values: Sequence[float]) -> Array:
        """Return the place of values of the free parameters."""
        pairs = zip(self.free, values, strict=True)
        return self.natural.to(np.array([one.to_coordinate(value) for one, value in pairs]))

    def values(self, place: Array) -> list[float]:
        """Return the values of the free parameters at a place."""
        return list(self.natural.settings(place).values())

    def stand(self, place: Array) -> Parameters:
        return self.parameters.updated(self.natural.settings(place))

    def predicted(self, stands: Sequence[Parameters]) -> list[Predicted]:
        """Return the predictions of stands, from parallel runs."""
        if any(one.name == _GAIN for one in self.free):
            drives = (one.drive for one in self.experiments)
            made = [each for each in drives if isinstance(each, SawtoothSteps | VoltageStep)]
            stroke_m = max((each.amplitude_m for each in made), default=0.0)
            stands = [_with_room(stand, stroke_m) for stand in stands]
        found = predict_all(stands, self.experiments, pool=self.pool)
        for _ in range(len(stands) * len(self.experiments)):
            self.tick()
        return [list(chain.from_iterable(rows)) for rows in found]

    def predicted_at(self, place: Array) -> Predicted:
        """Return the prediction of the stand of a place."""
        return self.predicted([self.stand(place)])[0]

    def measured_at(self, predicted: Predicted) -> 'Problem':
        metrics = [
            metric_of(
                each,
                model,
                one.drive.rows,
                error,
                self.allowance,
                self.parameters.load_cell.stiffness if each.quantity == 'force_n' else 1.0,
            )
            for (one, each, error), model in zip(self.observed, predicted, strict=True)
            if isinstance(one.drive, Voltage)
        ]
        return replace(self, metrics=tuple(metrics))

    def with_observed(self, observed: Iterable[Readout]) -> 'Problem':
        """Return the problem with other readings of its quantities, and without metrics."""
        rest = iter(observed)
        experiments = [
            replace(one, observed=tuple(islice(rest, len(one.observed))))
            for one in self.experiments
        ]
        return replace(self, experiments=tuple(experiments), metrics=())

    def whitened(
        self, found: Predicted, less: Predicted | None = None, priors: Array | None = None
    ) -> Array:
        """
        Return whitened residuals, with the sum of squares chi-square, shape (values + unknowns,).

        They are those of a prediction less the readings, or less another prediction. ``priors``
        are the residuals of the parameters themselves, by default 0.

        """
        parts, metrics = list[Array](), iter(self.metrics)
        others = [each.values for _, each, _ in self.observed]
        if less is not None:
            others = [each.values for each in less]
        for (_, each, noise), model, values in zip(self.observed, found, others, strict=True):
            missed = model.values - values
            parts.append(next(metrics).whitened(missed) if each.is_trace else missed / noise)
        if priors is None:
            priors = np.zeros(len(self.known) + len(self.free))
        return np.concatenate((*parts, priors))

    def residuals(self, place: Array) -> Array:
        """Return model less measurement, whitened."""
        return self.whitened(self.predicted_at(place), None, self._priors(place))

    def _priors(self, place: Array) -> Array:
        """
        Return the residuals of known values, then of the prior of each free parameter.

        The prior is a factor of ten about the start, if the error of any reading is known. Beyond
        a bound, where the stand no longer changes, each e-fold costs a standard error.

        """
        known, usual = list[float](), list[float]()
        prior = 0.0 if self.is_bare else 1.0 / PRIOR
        for one, z in zip(self.free, self.natural.back(place).tolist(), strict=True):
            usual.append(prior * (z - one.to_coordinate(one.start)))
            if one.name in self.known:
                value, share = self.known[one.name]
                known.append((z - one.to_coordinate(value)) * one.slope(value) / (share * value))
        return np.append(known, self.excess(place) + usual)

    def slopes(self, place: Array, *, central: bool = False) -> Array:
        """
        Return the slopes of the residuals, shape (residuals, free), by differences within bounds.

        One-sided differences suffice for a search; the errors of a fit need central ones.

        """
        pairs = list[tuple[Array, Array]]()
        for way in STEP * np.eye(len(place)):
            above, below = place + way, place - way if central else place
            if self.excess(above).any():
                above, below = place, place - way
            elif central and self.excess(below).any():
                below = place
            pairs.append((below, above))
        found = self.predicted([self.stand(end) for pair in pairs for end in pair])
        columns = []
        for (below, above), low, high in zip(pairs, found[::2], found[1::2], strict=True):
            priors = self._priors(above) - self._priors(below)
            columns.append(self.whitened(high, low, priors) / float(np.sum(above - below)))
        return np.column_stack(columns)

    def steady_at(self, place: Array) -> tuple['Problem', bool]:
        """Return the problem with enough steps for a place, and whether all runs are steady."""
        problem, stand, short = self, [self.stand(place)], list[SawtoothSteps]()
        while problem.steps:
            twice = problem.with_twice_the_steps(lambda _: True)
            [now], [then] = problem.predicted(stand), twice.predicted(stand)
            short = [
                one.drive
                for (one, each, _), a, b in zip(problem.observed, now, then, strict=True)
                if isinstance(one.drive, SawtoothSteps)
                and abs(float(b.values[0] - a.values[0])) > problem.steady_by(each)
            ]
            if not any(drive.is_steady and drive.steps < _STEPS_MAX for drive in short):
                break
            problem = problem.with_twice_the_steps(lambda drive: drive.is_steady)
        return problem, not short

    def with_twice_the_steps(self, of: Callable[[SawtoothSteps], bool]) -> 'Problem':
        longer = {
            one: drive._replace(steps=2 * drive.steps) for one, drive in self.steps if of(drive)
        }
        experiments = (replace(one, drive=longer.get(one, one.drive)) for one in self.experiments)
        return replace(self, experiments=tuple(experiments))

    def steady_by(self, each: Readout) -> float:
        """Return the largest change of a steady number with twice as many steps."""
        largest = largest_of(self.experiments, each.quantity)
        return max(STEADY_SHARE * (each.sigma or 0.0), EFFECT * largest)


def _with_room(stand: Parameters, stroke_m: float) -> Parameters:
    """Return a stand whose amplifier reaches a measured stroke with any gain."""
    highest_v = stand.amplifier.voltage_min + (1.0 + 1e-6) * stroke_m / stand.actuator.gain
    if highest_v <= stand.amplifier.voltage_max:
        return stand
    return stand.updated({'amplifier.voltage_max': highest_v})


def largest_of(experiments: Sequence[Experiment], quantity: str) -> float:
    """Return the largest measured number of a quantity, in magnitude."""
    return max(
        abs(float(each.values[0]))
        for one in experiments
        for each in one.observed
        if each.quantity == quantity and not each.is_trace
    )


def _noise_at_first(experiments: Sequence[Experiment]) -> tuple[float, ...]:
    """Return standard errors: given, estimated, or for numbers a share of the largest."""
    return tuple(
        max(each.noise, FINEST)
        if each.is_trace
        else each.sigma or SHEET_SHARE * largest_of(experiments, each.quantity)
        for one in experiments
        for each in one.observed
    )


def _check_scale(one: Experiment, stand: Parameters) -> None:
    """Refuse a motion per volt too far from that of the feet, as a unit must be wrong."""
    for each in one.observed:
        if not isinstance(one.drive, Voltage) or each.unit != 'm':
            continue
        voltage_v = np.interp(each.time_s, *one.drive.rows.T)
        moves_m, volts = (np.abs(x[_APART:] - x[:-_APART]) for x in (each.values, voltage_v))
        if not np.any(driven := volts > 0.0):
            continue
        per_volt = float(np.median(moves_m[driven]) / np.median(volts[driven]))
        gain = stand.actuator.gain
        if not gain / TOO_FAR < per_volt < gain * TOO_FAR:
            problem = (
                f'has a {each.quantity} that moves {per_volt:.2g} m per volt, more than '
                f'{TOO_FAR:g} times off the {gain:.2g} m of the feet'
            )
            hint = f'check the units of position and voltage, or give --start {_GAIN}=VALUE'
            raise RecordingError(one.origin, problem, hint)


def pose(
    parameters: Parameters,
    free: tuple[Coordinate, ...],
    experiments: Sequence[Experiment],
    known: Mapping[str, tuple[float, float]] | None = None,
    tick: Callable[[], None] = silent,
) -> Problem:
    """Return the problem of a fit, with enough steps for its starting values."""
    begun = [
        replace(one, drive=one.drive._replace(steps=one.drive.steps or _STEPS_MIN))
        if isinstance(one.drive, SawtoothSteps)
        else one
        for one in experiments
    ]
    noise = _noise_at_first(begun)
    problem = Problem(parameters, free, tuple(begun), noise, known=known or {}, tick=tick)
    if problem.has_traces:
        problem = replace(problem, allowance=Allowance())
    least, what = len(free), 'one for each free parameter'
    if problem.is_bare:
        least, what = least + 1, f'{what} and one for the standard error of the points'
    if problem.count < least:
        hint = 'measure more, free fewer parameters, or state a tolerance in the tables'
        raise OutOfRange('number of points', problem.count, '', f'below {least}, {what}', hint)
    for one in begun:
        _check_scale(one, parameters)
        end_n = parameters.updated(dict(one.settings)).stand.preload_end
        if end_n:
            hint = 'set stand.preload_end=0: each point has one preload'
            raise OutOfRange('stand.preload_end', end_n, 'N', 'not 0 in a fit', hint)
    return problem.steady_at(problem.start)[0]
