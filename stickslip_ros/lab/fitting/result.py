# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The result of a fit: the best of many searches, and its quality."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from stickslip_ros.arrays import Array
from stickslip_ros.drive.build import friction_limit_n
from stickslip_ros.lab.experiments.experiment import Experiment, Seen, Voltage
from stickslip_ros.lab.fitting.assumed import APART_MAX, OF_FORCES, Assumed, Tension
from stickslip_ros.lab.fitting.draws import drawn
from stickslip_ros.lab.fitting.missing import Missing, Trial
from stickslip_ros.lab.fitting.problem import STEP, Predicted, Problem
from stickslip_ros.lab.fitting.statistics import (
    EFFECT,
    UNDETERMINED,
    Estimate,
    Uncertainty,
    estimates_of,
)
from stickslip_ros.lab.tables.numbers import stage_hz
from stickslip_ros.parameters import Parameters, Scalar
from stickslip_ros.units import unit_of

_SAME_CHANGE = 0.01
"""Largest difference of chi-square, per its scale, of two searches in the same minimum."""
_SAME_SHARE = 1e-10
"""The same as a share of the sum of squares of the data, for data without noise."""
RULED_OUT_BY = 3.84
"""Excess of chi-square, per its scale, that rules out a minimum at 95 %."""
P_VALUE_MIN = 0.01
_FALL = 21.1
"""Fall of chi-square by three more free parameters with a chance of 1e-4."""
MISSED_MOST = 1.5
"""Most chi-square per reading, of noise and sensor alone, that an allowance for errors of the
model covers."""

_DRIFT_M_PER_S, _DRIFT_SHARE = 1e-6, 0.5
"""Least drift of a position, and its share of the range of the readings, that no sensor has: it
replaces a motion that the model does not make."""


@dataclass(frozen=True)
class Minimum:
    """The end of a search."""

    coordinates: tuple[float, ...]  # none if the search met an impossible stand
    chi_square: float
    converged: bool
    evaluations: int  # stands tried

    @property
    def place(self) -> Array:
        """Coordinates of the minimum, shape (free,)."""
        return np.array(self.coordinates)


def best_of(searches: Sequence[Minimum]) -> Minimum:
    """Return the search that ended lowest."""
    return min(searches, key=lambda found: found.chi_square)


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
_NOTHING, _UNKNOWN = 1e-300, 1e9  # a ratio of 0, and an infinite variance, in arithmetic
_SCALED = 'contact.', 'friction_law.', 'runner.', 'load_cell.'  # by the forces


@dataclass(frozen=True, eq=False, repr=False)
class FitResult:
    """The numbers of a ``Fit``, which describes them."""

    problem: Problem
    searches: tuple[Minimum, ...]
    refined: tuple[Minimum, ...]
    others: tuple[Minimum, ...]
    steady: bool
    uncertainty: Uncertainty
    assumed: Assumed
    predicted: Predicted
    missing: tuple[Missing, ...]
    trial: Trial | None
    wall_s: float
    notes: tuple[str, ...] = ()

    @property
    def found(self) -> Minimum:
        """The minimum."""
        return self.refined[-1] if self.refined else best_of(self.searches)

    @property
    def parameters(self) -> Parameters:
        """The fitted stand, with the common preload and load cell of the experiments."""
        return self.problem.stand(self.found.place).updated(self.settings_of_all)

    @property
    def settings_of_all(self) -> dict[str, Scalar]:
        """Settings with the same value in all experiments."""
        first, *others = (one.settings.items() for one in self.experiments)
        return dict(set(first).intersection(*others))

    @cached_property
    def estimates(self) -> tuple[Estimate, ...]:
        """The free parameters."""
        return estimates_of(self.problem, self.found.place, self.uncertainty)

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
            From the normal distribution of the coordinates (mostly logarithms) at the minimum,
            with the errors of the assumed constants; parameters without a finite error stay
            constant.

        """
        free, place = self.problem.free, self.found.place
        return drawn(self.parameters, free, place, self.uncertainty.covariance_z, count, seed)

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
        return any(unit_of(each.quantity) in OF_FORCES for _, _, each, _ in self.problem.seen)

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
        place, settings = self.found.place, dict(self.experiments[0].settings)

        def logarithms(z: Array) -> Array:
            stand = self.problem.stand(z).updated(settings)
            return np.log([max(shown(stand), _NOTHING) for _, shown in _RATIOS.values()])

        slopes = np.column_stack(
            [
                (logarithms(place + way) - logarithms(place - way)) / (2.0 * STEP)
                for way in STEP * np.eye(len(place))
            ]
        )
        covariance_z = np.nan_to_num(self.assumed.recorded.covariance_z, nan=0.0, posinf=_UNKNOWN)
        errors = np.sqrt(np.sum(slopes @ covariance_z * slopes, axis=1))
        errors = np.where(errors < UNDETERMINED, errors, np.inf)
        strained = np.abs(slopes @ self.assumed.moves @ self.assumed.pulls)
        widths = self.uncertainty.quantile * errors + strained
        values = np.exp(logarithms(place))
        columns = values, values * errors, values * np.exp(-widths), values * np.exp(widths)
        rows = zip(_RATIOS.items(), np.transpose(columns).tolist(), strict=True)
        return tuple(
            Ratio(name, unit, *row)
            for (name, (unit, _)), row in rows
            if row[1] > EFFECT * row[0] and row[0] > 2.0 * _NOTHING and not self.has_forces
        )

    @cached_property
    def tensions(self) -> tuple[Tension, ...]:
        """Known and assumed values beside those that the readings alone prefer."""
        return self.assumed.tensions(self.problem, self.found.place)

    @property
    def experiments(self) -> tuple[Experiment, ...]:
        """Fitted experiments, without outliers."""
        return self.problem.experiments

    @property
    def chi_square(self) -> float:
        """Sum of squared residuals; if no errors are known, per square of the largest number."""
        return self.found.chi_square

    @property
    def reduced_chi_square(self) -> float | None:
        """Chi-square per degree of freedom; None without one."""
        dof = self.uncertainty.dof
        return self.chi_square / dof if dof else None

    @property
    def p_value(self) -> float | None:
        """Chance of a larger chi-square if model and known errors are right; else None."""
        dof = self.uncertainty.dof
        if not self.problem.noise.known or not dof:
            return None
        return float(chi2.sf(self.chi_square, dof))

    @property
    def is_missing_much(self) -> bool:
        """Whether a missing parameter explains more than an allowance covers."""
        return bool(self.missing and self.missing[0].chi_square > MISSED_MOST * self.readings)

    @property
    def is_trial_different(self) -> bool:
        """Whether the richer model fits better with different parameters."""
        trial, place = self.trial, self.found.place
        if trial is None or trial.found > min(
            trial.chi_square - _FALL, MISSED_MOST * self.readings
        ):
            return False
        there = self.problem.coordinates(trial.values)
        return self.assumed.recorded.is_beyond_errors(place, there)

    @property
    def is_biased(self) -> bool:
        """Whether a missing parameter would surely move others beyond their errors."""
        place = self.found.place
        return any(
            each.chi_square - each.expected > _FALL
            and self.assumed.recorded.is_beyond_errors(place, place + np.array(each.moves))
            for each in self.missing
        )

    @property
    def holds(self) -> bool:
        """Whether the intervals are reliable: the search converged, and the model fits."""
        is_unlikely = self.p_value is not None and self.p_value < P_VALUE_MIN
        is_doubtful = (
            is_unlikely or self.is_missing_much or self.is_trial_different or self.is_biased
        )
        is_doubtful |= any(each.apart > APART_MAX for each in self.tensions)
        is_cut = any(one.at_bound and not one.is_limited(one.value) for one in self.estimates)
        return self.found.converged and not (is_doubtful or is_cut or self.drifts)

    @property
    def noise_n(self) -> float | None:
        """Standard error of a force from the residuals; None if known."""
        noise = self.problem.noise
        if noise.known:
            return None
        return float(np.sqrt(self.uncertainty.variance_scale)) * noise.values[0][0]

    @property
    def same(self) -> int:
        """Searches that ended in this minimum."""
        rounding = _SAME_SHARE * self.problem.signal**2
        return self._searches_within(_SAME_CHANGE * self.uncertainty.variance_scale + rounding)

    @property
    def rivals(self) -> int:
        """Other minima, or searches that ended in them, that are not ruled out."""
        if self.problem.has_traces:
            return len(self.others)
        not_out = self._searches_within(RULED_OUT_BY * self.uncertainty.variance_scale)
        return max(not_out - self.same, 0)

    @property
    def evaluations(self) -> int:
        """Stands tried in all searches."""
        return sum(one.evaluations for one in (*self.searches, *self.refined))

    @cached_property
    def sensors(self) -> list[tuple[Experiment, Seen, dict[str, float]]]:
        """Each quantity over time, with noise, zero, drift and lateness of its sensor."""
        found, metrics = [], iter(self.problem.metrics)
        for number, one, each, noise in self.problem.seen:
            if not isinstance(one.drive, Voltage):
                continue
            model = self.predicted[number][one.seen.index(each)]
            sizes, left = next(metrics).of_sensor(model.values - each.values)
            zero, drift, late_s, _ = sizes.tolist()
            sensor = {
                'noise': noise,
                'zero': -zero,
                'drift_per_s': -drift,
                'late_s': self.problem.shift_s(number) + late_s,
                'rms': float(np.sqrt(np.mean(left**2))),
            }
            found.append((one, each, sensor))
        return found

    @cached_property
    def drifts(self) -> list[tuple[Experiment, float]]:
        """Recordings with most of the motion explained as drift of the sensor, m/s."""
        found = []
        for one, each, sensor in self.sensors:
            drift_m_per_s = abs(sensor['drift_per_s'])
            drifted_m = drift_m_per_s * float(np.ptp(each.time_s))
            is_most = drifted_m > _DRIFT_SHARE * float(np.ptp(each.values))
            if each.unit == 'm' and is_most and drift_m_per_s > _DRIFT_M_PER_S:
                found.append((one, sensor['drift_per_s']))
        return found

    @property
    def readings(self) -> int:
        """Number of readings."""
        return sum(len(each.values) for _, _, each, _ in self.problem.seen)

    def _searches_within(self, most: float) -> int:
        least = best_of(self.searches).chi_square
        return sum(one.chi_square - least <= most for one in self.searches)
