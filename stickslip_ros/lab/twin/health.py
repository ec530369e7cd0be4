# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The health of a rig: current fits compared with the first fits."""

from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from stickslip_ros.arrays import Array
from stickslip_ros.lab.experiments.sensor_clock import LATE_MIN_S
from stickslip_ros.lab.fitting.report import Fit
from stickslip_ros.lab.fitting.result import FitResult
from stickslip_ros.lab.twin.settings import TwinParameters
from stickslip_ros.lab.twin.twin import Look, Twin
from stickslip_ros.lab.twin.watch import ELSE, LookEstimate, Watch
from stickslip_ros.parameters import spec_of

_SOMETHING_ELSE = (
    'the change is not that of a single parameter: check the preload, the load, each foot, the '
    'clock of the sensor, and lost messages'
)
_GREW = 1.5  # growth of chi-square per reading since the start that shows another motion
_MISSED_MOST = 1.5
"""Largest chi-square per reading, of noise and sensor alone, of a model that explains a motion."""
_MEANS_NOTHING = 5.0
"""Chi-square per reading above which changes are ignored: with travelling roughness it went from 2
to 85 between places, and the fitted mass changed by a fifth."""
_MORE_STARTS = 3  # searches of the first suspicious fit, as a changed parameter may be far off


class Health(NamedTuple):
    """Result of a fit."""

    stamp_ns: int  # end of its window
    names: tuple[str, ...]
    values: Array  # of the free parameters, SI
    errors: Array
    chi_per_reading: float
    words: str  # empty if healthy


class Doctor:
    """Fits windows of a twin and reports changes."""

    def __init__(self, twin: Twin, settings: TwinParameters) -> None:
        self._twin = twin
        self._watch = Watch(settings.period, settings.alarms_per_day)
        self._first: list[Array] = []  # values and errors at the start
        self._chi_at_start, self._was_odd = 0.0, False
        self._first_late_s: list[float] = []
        self._was_late = False

    def examine(self, look: Look) -> Health:
        """Return the health in a window; StickSlipError if the fit is impossible."""
        fit = self._twin.fit(look)
        is_odd = self._watch.has_begun and (
            self._watch.is_suspect(_estimate_of(fit)) or _chi(fit) > self._largest_chi(fit)
        )
        if is_odd and not self._was_odd:
            fit = min(fit, self._twin.fit(look, _MORE_STARTS), key=lambda one: one.chi_square)
        self._was_odd = is_odd
        values = np.array([one.value for one in fit.estimates])
        errors = np.array([one.standard_error for one in fit.estimates])
        names = tuple(one.name for one in fit.estimates)
        words = _misfit_text(fit) if _chi(fit) > _limit(fit) else ''
        if not self._watch.has_begun:
            self._first.append(np.array((values, errors)))
            self._first_late_s.append(look.late_s)
            self._chi_at_start = max(self._chi_at_start, _chi(fit))
        if not self._watch.has_begun or _chi(fit) <= self._largest_chi(fit):
            changed = self._watch.changed(_estimate_of(fit))
            if changed == ELSE:
                words = '; '.join(filter(None, [_SOMETHING_ELSE, words]))
            elif changed is not None:
                was = np.median(self._first, axis=0)[:, changed]
                name = names[changed]
                numbers = (values[changed], errors[changed], *was)
                words = '; '.join(filter(None, [_change_text(name, *map(float, numbers)), words]))
            self._twin.follow(fit)
        words = '; '.join(filter(None, [self._clock_text(look), words]))
        return Health(look.window.end_ns, names, values, errors, _chi(fit), words)

    def _clock_text(self, look: Look) -> str:
        """Return a message if a clock has moved since the start in two windows, or ''."""
        away_s = look.late_s - float(np.median(self._first_late_s))
        is_late = abs(away_s) > LATE_MIN_S + float(np.ptp(self._first_late_s))
        was_late, self._was_late = self._was_late, is_late
        if not (is_late and was_late):
            return ''
        text = f'the clock of {look.shown[0].quantity} is {1e3 * away_s:+.2g} ms late against that'
        return f'{text} at the start, or by periods of the drive more or less'

    def _largest_chi(self, fit: FitResult) -> float:
        """Return the largest chi-square per reading at which changes are reported."""
        return min(max(_limit(fit), _GREW * self._chi_at_start), _MEANS_NOTHING)


def _estimate_of(fit: Fit) -> LookEstimate:
    """Return the estimate of a fit, with errors widened by its misfit."""
    wider = max(1.0, fit.reduced_chi_square or 1.0)
    # Errors are not widened by missing effects, which were missing at the start, too.
    covariance = wider * fit.uncertainty.assumed_z
    known = np.isfinite(np.diag(covariance))  # false on a bound, or if undetermined
    covariance = np.where(np.outer(known, known), covariance, 0.0)
    covariance[~known, ~known] = 1.0 / np.finfo(np.float32).eps
    return LookEstimate(fit.found.place, covariance)


def _chi(fit: FitResult) -> float:
    """Return chi-square per reading, of noise and sensor alone where known."""
    if fit.missing:
        return fit.missing[0].chi_square / fit.readings
    return fit.reduced_chi_square or 0.0


def _limit(fit: FitResult) -> float:
    """Return the largest chi-square per reading of a model that explains the motion."""
    return max(_MISSED_MOST, float(chdtri(fit.readings, 1e-6)) / fit.readings)


def _misfit_text(fit: FitResult) -> str:
    text = f'the model does not explain the motion: chi-square per reading is {_chi(fit):.3g}'
    if not fit.missing:
        return f'{text}, and no tested parameter would lower it: check clocks and sensor'
    worst = fit.missing[0]
    return f'{text}, with {worst.name} free {worst.expected / fit.readings:.3g}'


def _change_text(name: str, value: float, error: float, was: float, was_error: float) -> str:
    text = f'{name} {value:.4g} +- {error:.2g}, was {was:.4g} +- {was_error:.2g} at the start'
    return ': '.join(filter(None, [text, spec_of(name).cause]))
