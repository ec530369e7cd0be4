# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The result of a fit: the best of many searches, and its quality."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from stickslip_ros.arrays import Array
from stickslip_ros.drive.build import friction_limit_n
from stickslip_ros.lab.experiments.experiment import Experiment, Seen, Voltage
from stickslip_ros.lab.fitting.assumed import APART_MAX, OF_FORCES, with_constant
from stickslip_ros.lab.fitting.draws import drawn
from stickslip_ros.lab.fitting.free import LOAD, is_property
from stickslip_ros.lab.fitting.missing import Missing
from stickslip_ros.lab.fitting.natural import Natural
from stickslip_ros.lab.fitting.problem import STEP, Predicted, Problem
from stickslip_ros.lab.fitting.search import Minimum, best_of
from stickslip_ros.lab.fitting.statistics import (
    EFFECT,
    UNDETERMINED,
    Estimate,
    Tension,
    Uncertainty,
    estimates_of,
)
from stickslip_ros.lab.tables.numbers import stage_hz
from stickslip_ros.parameters import Parameters
from stickslip_ros.units import unit_of

_SAME_CHANGE = 0.01
"""Largest difference of chi-square, per its scale, of two searches in the same minimum."""
_SAME_SHARE = 1e-10
"""The same as a share of the sum of squares of the data, for data without noise."""
RULED_OUT_BY = 3.84
"""Excess of chi-square, per its scale, that rules out a minimum at 95 %."""
P_VALUE_MIN = 0.01
"""Least chance of numbers with given errors; traces have an allowance instead."""
_FALL = 21.1
"""Fall of chi-square by three more free parameters with a chance of 1e-4."""
OWED_MOST = 0.03
"""Most that the model may owe in the shape of a cycle, as a share of the stroke of the feet."""
_DRIFT_M_PER_S, _DRIFT_SHARE = 1e-6, 0.5
"""Least drift of a position, and its share of the range of the readings, that no sensor has: it
replaces a motion that the model does not make."""


class Ratio(NamedTuple):
    """A ratio of forces and masses of a fitted stand, which a motion shows without a scale."""

    name: str
    unit: str
    value: float
    standard_error: float  # without those of assumed constants
    low: float
    high: float


_RATIOS: Mapping[str, tuple[str, Callable[[Parameters], float]]] = {
    'ringing, k/m': ('Hz', lambda on: stage_hz(on) if on.contact.law == 'mdr' else 0.0),
    'damping, c/m': ('1/s', lambda on: on.runner.damping / on.runner.mass),
    'friction, mu F/m': ('m/s^2', lambda on: friction_limit_n(on) / on.runner.mass),
    'gain': ('m/V', lambda on: on.actuator.gain),
}
_NOTHING = 1e-300  # a ratio of 0 in arithmetic
_SCALED = 'contact.', 'friction_law.', 'runner.', 'load_cell.', LOAD  # by the forces


@dataclass(frozen=True, eq=False, repr=False)
class FitResult:
    """The numbers of a ``Fit``, which describes them."""

    problem: Problem
    searches: tuple[Minimum, ...]
    refined: tuple[Minimum, ...]
    others: tuple[Minimum, ...]
    steady: bool
    uncertainty: Uncertainty
    predicted: Predicted
    missing: tuple[Missing, ...]
    wall_s: float
    notes: tuple[str, ...] = ()

    @property
    def found(self) -> Minimum:
        """The minimum."""
        return self.refined[-1] if self.refined else best_of(self.searches)

    @property
    def parameters(self) -> Parameters:
        """The fitted stand, with the common preload and load cell of the experiments."""
        return self.problem.stand(self.found.place).updated(self.problem.settings_of_all)

    @cached_property
    def estimates(self) -> tuple[Estimate, ...]:
        """The free parameters."""
        return estimates_of(self.problem, self.uncertainty)

    def draws(self, count: int, seed: int = 1) -> list[Parameters]:
        """
        Return stands from the distribution of the fitted parameters.

        Parameters
        ----------
        count, seed : int
            Number of stands, and seed of the random numbers.

        Returns
        -------
        list of Parameters
            From the normal distribution of the natural coordinates at the minimum; parameters
            without a finite error stay constant. They move as the recording shows: another scale
            of the assumed contact would move alike, with other forces.

        """
        vague = [one.name for one in self.estimates if one.undetermined]
        covariance = self.uncertainty.natural(self.uncertainty.recorded_z)
        natural = Natural(self.parameters, self.problem.free)
        return drawn(natural, self.found.place, covariance, vague, count, seed)

    @property
    def covariance(self) -> Array:
        """Covariance in the units of the parameters, shape (free, free); nan if unknown."""
        slopes = np.array(
            [np.nan if one.undetermined else one.slope(one.value) for one in self.estimates]
        )
        return np.asarray(self.uncertainty.covariance_z * np.outer(slopes, slopes))

    @property
    def has_forces(self) -> bool:
        """Whether a force or a mass was measured."""
        return any(unit_of(each.quantity) in OF_FORCES for _, each, _ in self.problem.seen)

    def scale_of(self, name: str) -> str:
        """Return in words where the scale of a parameter comes from."""
        known = self.problem.known
        if name in known:
            return 'weighed' if name == 'runner.mass' else 'known'
        if not name.startswith(_SCALED):
            return 'from the recording'
        if self.has_forces:
            return 'from the force'
        is_weighed = 'runner.mass' in known and name in {'contact.friction', 'runner.damping'}
        return f'from the {"weighed mass" if is_weighed else "assumed contact"}'

    @cached_property
    def ratios(self) -> tuple[Ratio, ...]:
        """The ratios that readings without a force show."""
        place, doubt, first = self.found.place, self.uncertainty, self.experiments[0]

        def logarithms(place: Array, constant: str = '', by: float = 0.0) -> Array:
            stand = self.problem.stand(place)
            one = with_constant(stand, first, constant, math.exp(by)) if constant else first
            there = stand.updated(dict(one.settings))
            return np.log([max(shown(there), _NOTHING) for _, shown in _RATIOS.values()])

        ends = [
            (logarithms(place + way), logarithms(place - way)) for way in STEP * np.eye(len(place))
        ]
        ends += [
            (logarithms(place, name, STEP), logarithms(place, name, -STEP))
            for name in doubt.shares
        ]
        columns = [(above - below) / (2.0 * STEP) for above, below in ends]
        slopes, of_constants = np.split(np.column_stack(columns), [len(place)], axis=1)
        covariance = doubt.natural(doubt.shown_z)
        errors = np.sqrt(np.sum(slopes @ covariance * slopes, axis=1))
        followed, pulled = np.split(doubt.pulled, [len(place)])
        moved = slopes @ np.linalg.solve(doubt.per_natural, followed) + of_constants @ pulled
        widths = doubt.quantile * errors + np.abs(moved)
        values = np.exp(logarithms(place))
        rows = values, values * errors, values * np.exp(-widths), values * np.exp(widths)
        return tuple(
            Ratio(name, unit, *row)
            for (name, (unit, _)), row, error in zip(
                _RATIOS.items(), np.transpose(rows).tolist(), errors, strict=True
            )
            if EFFECT < error < UNDETERMINED and row[0] > 2.0 * _NOTHING and not self.has_forces
        )

    @cached_property
    def tensions(self) -> tuple[Tension, ...]:
        """Known and assumed values beside those that the readings alone prefer."""
        return self.uncertainty.tensions(self.problem)

    @property
    def experiments(self) -> tuple[Experiment, ...]:
        """Fitted experiments, without outliers."""
        return self.problem.experiments

    @property
    def chi_square(self) -> float:
        """Sum of squared residuals; if no errors are known, per square of the largest number."""
        return self.uncertainty.chi_square

    @property
    def reduced_chi_square(self) -> float | None:
        """Chi-square per degree of freedom; None without one."""
        dof = self.uncertainty.dof
        return self.chi_square / dof if dof else None

    @property
    def p_value(self) -> float | None:
        """Chance of a larger chi-square of numbers with known errors; else None."""
        dof = self.uncertainty.dof
        if not self.problem.noise.known or not dof or self.problem.has_traces:
            return None
        return float(chi2.sf(self.chi_square, dof))

    @property
    def owed_m(self) -> float:
        """What the model owes in each moment of a cycle, m, rms; 0 of numbers."""
        allowance = self.problem.allowance
        return 0.0 if allowance is None else math.hypot(allowance.shape_m, allowance.slow_m)

    @property
    def stroke_m(self) -> float:
        """Largest stroke of the feet in the recordings, m."""
        swings_v = [
            np.ptp(one.drive.rows[:, 1])
            for one in self.experiments
            if isinstance(one.drive, Voltage)
        ]
        return float(max(swings_v, default=0.0)) * self.parameters.actuator.gain

    @property
    def culprits(self) -> tuple[Missing, ...]:
        """What is missing and would move a value beyond its error."""
        place, natural = self.found.place, self.problem.natural
        return tuple(
            each
            for each in self.missing
            if each.chi_square - each.expected > _FALL
            and self.uncertainty.is_beyond_errors(natural.back(place + np.array(each.moves)))
        )

    @cached_property
    def reasons(self) -> tuple[str, ...]:
        """Why the fit does not hold; empty if it holds."""
        return tuple(self._reasons())

    @property
    def holds(self) -> bool:
        """Whether the intervals are reliable: the search converged, and the model fits."""
        return not self.reasons

    def _reasons(self) -> Iterator[str]:
        if not self.found.converged:
            yield 'the search did not converge: raise --starts, or narrow --bounds'
        if self.p_value is not None and self.p_value < P_VALUE_MIN:
            yield (
                f'the numbers are missed by more than their errors (p-value {self.p_value:.2g})'
            )
        if self.owed_m > OWED_MOST * self.stroke_m:
            yield (
                f'the model misses the motion by {1e9 * self.owed_m:.3g} nm, more than '
                f'{100.0 * OWED_MOST:g} % of the stroke'
            )
        for each in self.culprits[:1]:
            free = ' free' * is_property(each.name)
            yield f'values move beyond their errors with {each.name}{free}'
        for one, beyond in zip(self.estimates, self.uncertainty.beyond.tolist(), strict=True):
            if one.at_bound and one.is_limit(one.value) and beyond > APART_MAX:
                limit = f'{one.value:.4g} {one.unit}'.rstrip()
                yield (
                    f'the readings pull {one.name} beyond {limit}, a limit of the model, by '
                    f'{beyond:.3g} standard errors: something else is lacking'
                )
        for tension in self.tensions:
            if tension.apart > APART_MAX:
                yield (
                    f'{tension.name} is {tension.value:.4g} +- {100.0 * tension.share:.3g} %, but '
                    f'the readings prefer {tension.preferred:.3g}, {tension.apart:.3g} standard '
                    'errors off'
                )
        for recording, seen, sensor in self.sensors:
            drift_m_per_s, range_m = sensor['drift_per_s'], float(np.ptp(seen.values))
            is_most = abs(drift_m_per_s) * float(np.ptp(seen.time_s)) > _DRIFT_SHARE * range_m
            if seen.unit == 'm' and is_most and abs(drift_m_per_s) > _DRIFT_M_PER_S:
                yield (
                    f'{recording.origin}: most of the motion would be a drift of the sensor, '
                    f'{1e6 * drift_m_per_s:.3g} um/s'
                )

    @property
    def noise_n(self) -> float | None:
        """Standard error of a force from the residuals; None if known."""
        noise = self.problem.noise
        if noise.known:
            return None
        return float(np.sqrt(self.uncertainty.variance_scale)) * noise.values[0]

    @property
    def rivals(self) -> int:
        """Searches of numbers that ended in other minima that are not ruled out."""
        if self.problem.has_traces:
            return 0
        scale, least = self.uncertainty.variance_scale, best_of(self.searches).chi_square
        same = _SAME_CHANGE * scale + _SAME_SHARE * self.problem.signal**2
        rises = [one.chi_square - least for one in self.searches]
        return sum(same < rise <= RULED_OUT_BY * scale for rise in rises)

    @property
    def evaluations(self) -> int:
        """Stands tried in all searches."""
        return sum(one.evaluations for one in (*self.searches, *self.refined))

    @cached_property
    def sensors(self) -> list[tuple[Experiment, Seen, dict[str, float]]]:
        """Each quantity over time, with noise, zero, drift and lateness of its sensor."""
        found, metrics = [], iter(self.problem.metrics)
        for (one, each, noise), model in zip(self.problem.seen, self.predicted, strict=True):
            if not each.is_trace:
                continue
            sizes, left = next(metrics).of_sensor(model.values - each.values)
            zero, drift, late_s, _ = sizes.tolist()
            sensor = {
                'noise': noise,
                'zero': -zero,
                'drift_per_s': -drift,
                'late_s': each.sensor.late_s + late_s,
                'rms': float(np.sqrt(np.mean(left**2))),
            }
            found.append((one, each, sensor))
        return found

    @property
    def readings(self) -> int:
        """Number of readings."""
        return sum(len(each.values) for _, each, _ in self.problem.seen)
