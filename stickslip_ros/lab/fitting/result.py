# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The result of a fit: the best of many searches, its quality, and draws, also from its file."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy import optimize
from scipy.special import chdtrc, ndtr

from stickslip_ros.arrays import Array
from stickslip_ros.budget import load_json
from stickslip_ros.drive.build import friction_limit_n
from stickslip_ros.errors import OutOfRange, RecordingError, StickSlipError
from stickslip_ros.files import read_bytes
from stickslip_ros.lab.experiments.experiment import Experiment, Readout, Voltage
from stickslip_ros.lab.fitting.assumed import OF_FORCES, TENSION_MAX, with_constant
from stickslip_ros.lab.fitting.free import LOAD, TINY, Coordinate, Natural, is_property
from stickslip_ros.lab.fitting.metric import Allowance
from stickslip_ros.lab.fitting.missing import Missing
from stickslip_ros.lab.fitting.problem import EFFECT, Predicted, Problem, largest_of
from stickslip_ros.lab.fitting.search import Minimum, distinct
from stickslip_ros.lab.fitting.statistics import (
    QUANTILE_95,
    UNDETERMINED,
    Estimate,
    Tension,
    Uncertainty,
    estimates_of,
    is_assumed,
)
from stickslip_ros.lab.measurements.numbers import SHEET_SHARE, stage_hz
from stickslip_ros.parameters import Parameters
from stickslip_ros.units import unit_of

P_VALUE_MIN = 0.01
"""Least p-value of numbers with given errors; traces have an allowance instead."""
MODEL_ERROR_MAX = 0.03
"""Largest error of the model in the shape of a cycle, as a share of the stroke of the feet."""
DRAWS_MAX = 10_000


class Ratio(NamedTuple):
    """A ratio of forces and masses of a fitted stand, known from the motion alone."""

    name: str
    unit: str
    value: float
    standard_error: float  # without errors of assumed constants
    low: float
    high: float


_RATIOS: Mapping[str, tuple[str, Callable[[Parameters], float]]] = {
    'ringing, k/m': ('Hz', lambda on: stage_hz(on) if on.contact.law == 'mdr' else 0.0),
    'damping, c/m': ('1/s', lambda on: on.runner.damping / on.runner.mass),
    'friction, mu F/m': ('m/s^2', lambda on: friction_limit_n(on) / on.runner.mass),
    'gain': ('m/V', lambda on: on.actuator.gain),
}
_SCALED = 'contact.', 'friction_law.', 'runner.', 'load_cell.', LOAD  # scale with the forces


@dataclass(frozen=True, eq=False, repr=False)
class FitResult:
    """The numbers of a ``Fit``."""

    problem: Problem  # with the steps of each run, noise, sensors, and allowed errors
    searches: tuple[Minimum, ...]  # ends of the searches
    refined: tuple[Minimum, ...]  # ends of searches continued from the best
    steady: bool  # whether all runs had enough steps
    uncertainty: Uncertainty  # errors of the parameters and of the constants
    predicted: Predicted  # by the fitted stand, in the order of ``problem.observed``
    missing: tuple[Missing, ...]  # explanations of the misfit, the likeliest first
    wall_s: float
    notes: tuple[str, ...] = ()  # changes of the stand, and properties of the sensors

    @property
    def found(self) -> Minimum:
        return self.refined[-1] if self.refined else distinct(self.searches)[0]

    @property
    def parameters(self) -> Parameters:
        """The fitted stand, with the common preload and load cell of the experiments."""
        return self.problem.stand(self.found.place).updated(self.problem.settings_of_all)

    @cached_property
    def estimates(self) -> tuple[Estimate, ...]:
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
            without a finite error stay constant. The spread is that of the motions: another scale
            of the assumed contact would give the same motions with other forces.

        """
        vague = [one.name for one in self.estimates if one.undetermined]
        natural = Natural(self.parameters, self.problem.free)
        return drawn(natural, self.found.place, self.motion_covariance, vague, count, seed)

    @property
    def motion_covariance(self) -> Array:
        """Covariance of natural coordinates; the model's error of a step counts as one of gain."""
        share = self.problem.allowance.step_share if self.problem.allowance else 0.0
        is_gain = np.array([one.name == 'actuator.gain' for one in self.problem.free])
        recorded = self.uncertainty.natural(self.uncertainty.recorded_z)
        return np.asarray(recorded + np.diag(is_gain * share**2))

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
        return any(unit_of(each.quantity) in OF_FORCES for _, each, _ in self.problem.observed)

    def scale_of(self, name: str) -> str:
        """Return the source of the scale of a parameter, as text."""
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
        if self.has_forces:
            return ()
        place, doubt, free = self.found.place, self.uncertainty, len(self.problem.free)

        def logarithms(where: Array) -> Array:
            stand, one = self.problem.stand(where[:free]), self.experiments[0]
            for name, by in zip(doubt.shares, where[free:].tolist(), strict=True):
                one = with_constant(stand, one, name, math.exp(by))
            there = stand.updated(dict(one.settings))
            return np.log([max(shown(there), TINY) for _, shown in _RATIOS.values()])

        here = np.append(place, np.zeros(len(doubt.shares)))
        jacobian = optimize.approx_fprime(here, logarithms)
        slopes, of_constants = np.split(jacobian, [free], axis=1)
        errors = np.sqrt(np.sum(slopes @ doubt.natural(doubt.shown_z) * slopes, axis=1))
        by_z = slopes @ np.linalg.inv(doubt.per_natural)
        errors *= doubt.widening(errors, doubt.moves_z @ by_z.T)
        followed, pulled = np.split(doubt.pulled, [free])
        moved = by_z @ followed + of_constants @ pulled
        widths = np.exp(doubt.quantile * errors + np.abs(moved))
        values = np.exp(logarithms(here))
        rows = np.transpose([values, values * errors, values / widths, values * widths]).tolist()
        return tuple(
            Ratio(name, unit, *row)
            for (name, (unit, _)), row, error in zip(_RATIOS.items(), rows, errors, strict=True)
            if EFFECT < error < UNDETERMINED
        )

    @cached_property
    def tensions(self) -> tuple[Tension, ...]:
        """Known and assumed values, each with the value that the readings alone prefer."""
        return self.uncertainty.tensions(self.problem)

    @property
    def experiments(self) -> tuple[Experiment, ...]:
        """Fitted experiments, without outliers."""
        return self.problem.experiments

    @property
    def chi_square(self) -> float:
        """Sum of squared residuals, per noise."""
        return self.uncertainty.chi_square

    @property
    def reduced_chi_square(self) -> float | None:
        """Chi-square per degree of freedom; None without one."""
        dof = self.uncertainty.dof
        return self.chi_square / dof if dof else None

    @property
    def p_value(self) -> float | None:
        """Chance of a larger chi-square; None unless all numbers have known errors."""
        dof = self.uncertainty.dof
        if self.problem.is_estimated or not dof:
            return None
        return float(chdtrc(dof, self.chi_square))

    @cached_property
    def reasons(self) -> tuple[str, ...]:
        """Reasons why the fit does not hold; empty if it holds."""
        return tuple(self._reasons())

    @property
    def holds(self) -> bool:
        """Whether the intervals are reliable: the search converged, and the model fits."""
        return not self.reasons

    def _reasons(self) -> Iterator[str]:
        if not self.found.converged:
            yield 'the search did not converge: raise --starts, or narrow --bounds'
        yield from self._missed_numbers()
        drives = (one.drive for one in self.experiments)
        swings_v = [np.ptp(each.rows[:, 1]) for each in drives if isinstance(each, Voltage)]
        stroke_m = max(swings_v, default=0.0) * self.parameters.actuator.gain
        model_error = self.problem.allowance or Allowance(0.0, 0.0, 0.0)
        error_m = math.hypot(model_error.shape_m, model_error.slow_m)
        if error_m > MODEL_ERROR_MAX * stroke_m:
            yield (
                f'the model misses the motion by {1e9 * error_m:.3g} nm, more than '
                f'{100.0 * MODEL_ERROR_MAX:g} % of the stroke'
            )
        if self.culprit is not None:
            free = ' free' * is_property(self.culprit.name)
            name, errors = self._moved(self.culprit)
            text = f'values move beyond their errors with {self.culprit.name}{free}'
            yield f'{text}: {name} by {errors:.2g} standard errors'
        for one, excess in zip(self.estimates, self.uncertainty.excess.tolist(), strict=True):
            if one.at_bound and one.is_limit(one.value) and excess > TENSION_MAX:
                limit = f'{one.value:.4g} {one.unit}'.rstrip()
                yield (
                    f'the readings pull {one.name} beyond {limit}, a limit of the model, by '
                    f'{excess:.3g} standard errors: another effect is missing'
                )
        for tension in self.tensions:
            if tension.apart > TENSION_MAX:
                yield (
                    f'{tension.name} is {tension.value:.4g} +- {100.0 * tension.share:.3g} %, but '
                    f'the readings prefer {tension.preferred:.3g}, {tension.apart:.3g} standard '
                    'errors off'
                )

    @cached_property
    def culprit(self) -> Missing | None:
        """
        The likeliest explanation that moves a value, if an interval probably misses the truth.

        An interval misses in half of the cases if its centre moves by its half width.

        """
        moves = [self._moved(each)[1] for each in self.missing]
        pairs = list(zip(self.missing, moves, strict=True))
        missing = sum(each.chance * ndtr(by - QUANTILE_95) for each, by in pairs)
        return next((each for each, by in pairs if by > 1.0), None) if missing > 0.5 else None

    def _moved(self, one: Missing) -> tuple[str, float]:
        """Return the parameter that an explanation moves most, and the move in its errors."""
        doubt = self.uncertainty
        covariance_z = doubt.recorded_z
        if is_assumed(one.name, doubt.shares):
            covariance_z = doubt.assumed_z
        z = self.problem.natural.back(self.found.place + one.moves)
        apart = np.abs(z - doubt.z) / np.sqrt(np.diag(covariance_z))
        return self.problem.free[int(np.argmax(apart))].name, float(np.max(apart))

    def _missed_numbers(self) -> Iterator[str]:
        if self.p_value is not None and self.p_value < P_VALUE_MIN:
            yield f'the numbers are missed by more than their errors (p-value {self.p_value:.2g})'
        for quantity, noise in self.noise_of_numbers.items():
            if noise > SHEET_SHARE * largest_of(self.experiments, quantity):
                yield (
                    f'{quantity} is missed by {noise:.3g} {unit_of(quantity)}, more than '
                    f'{100.0 * SHEET_SHARE:g} % of its largest number: check its unit, its sign, '
                    'and that all rows are of one stand'
                )

    @property
    def noise_of_numbers(self) -> dict[str, float]:
        """Standard error, from residuals, of quantities without a given one, SI."""
        return {each.quantity: noise for _, each, noise in self.problem.observed if each.is_bare}

    @property
    def evaluations(self) -> int:
        """Stands tried in all searches."""
        return sum(one.evaluations for one in (*self.searches, *self.refined))

    @cached_property
    def sensors(self) -> list[tuple[Experiment, Readout, dict[str, float]]]:
        """Each quantity over time, with noise, zero, drift and lateness of its sensor."""
        found, metrics = [], iter(self.problem.metrics)
        for (one, each, noise), model in zip(self.problem.observed, self.predicted, strict=True):
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
        return sum(len(each.values) for _, each, _ in self.problem.observed)


def drawn(
    natural: Natural, place: Array, covariance: Array, vague: Sequence[str], count: int, seed: int
) -> list[Parameters]:
    """
    Return stands from a normal distribution of natural coordinates, shapes (free,), (free, free).

    ``vague`` parameters have an error above a factor of e. Raises OutOfRange for these, or for an
    impossible number.

    """
    if not 1 <= count <= DRAWS_MAX:
        limit = f'not from 1 to {DRAWS_MAX}'
        raise OutOfRange('number of draws', count, '', limit, 'take 100')
    for name in vague:
        limit = f'above {UNDETERMINED:g}: the parameter is not determined, and has no draws'
        hint = 'fit a recording under another preload too'
        raise OutOfRange(f'standard error of ln({name})', '', '', limit, hint)
    chance = np.random.default_rng(seed)
    places = chance.multivariate_normal(place, covariance, count, method='eigh')
    return [natural.stand.updated(natural.settings(each)) for each in places]


def read_stand(path: Path) -> Parameters:
    """Return the fitted stand of a file of ``stickslip fit -o fitted.json``."""
    return _read(path)[0].stand


def read_draws(path: Path, count: int = 100, seed: int = 1) -> list[Parameters]:
    """
    Return draws of the fit in a file of ``stickslip fit -o fitted.json``.

    Parameters without a finite error stay constant. Raises RecordingError for another file or a
    fit that failed its checks; OutOfRange for an impossible number, or a parameter with an error
    above a factor of e.

    """
    natural, place, covariance, vague, holds = _read(path)
    if not holds:
        hint = 'free the missing parameters and fit again, or use --params fitted.yaml alone'
        raise RecordingError(path, 'is of a fit that failed its checks', hint)
    return drawn(natural, place, covariance, vague, count, seed)


def read_note(path: Path) -> str:
    """Return the note on bands in the file of a fit."""
    return str(load_json(read_bytes(path, '')).get('bands', ''))


def _read(path: Path) -> tuple[Natural, Array, Array, list[str], bool]:
    """Return coordinates, minimum, its covariance, vague parameters, and whether the fit holds."""
    hint = 'give the .json of stickslip fit -o, of this version'
    data = read_bytes(path, hint)
    try:
        content = load_json(data)
        rows = content['estimates']
        tops = [math.inf if each['upper'] is None else each['upper'] for each in rows]
        free = tuple(
            Coordinate(each['name'], each['unit'], each['start'], each['lower'], top)
            for each, top in zip(rows, tops, strict=True)
        )
        vague = [each['name'] for each in rows if each['undetermined']]
        stand = Parameters().updated(content['parameters'])
        place = np.array(content['natural_coordinates'], dtype=np.float64)
        covariance = np.array(content['covariance_of_natural_coordinates'], dtype=np.float64)
        holds = bool(content['holds'])
        fits = place.shape == (len(free),) and covariance.shape == (len(free), len(free))
    except StickSlipError as error:
        raise RecordingError(path, f'holds no stand: {error}', hint) from None
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError) as error:
        raise RecordingError(path, f'is no fit ({type(error).__name__})', hint) from None
    if not fits:
        raise RecordingError(path, 'is no fit: its covariance has another shape', hint)
    return Natural(stand, free), place, covariance, vague, holds
