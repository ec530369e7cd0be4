# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The health of a rig: what the fits of its windows say beside those at the start."""

from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from stickslip_ros.arrays import Array
from stickslip_ros.lab.fitting.report import Fit
from stickslip_ros.lab.fitting.result import MISSED_MOST, FitResult
from stickslip_ros.lab.twin.settings import TwinParameters
from stickslip_ros.lab.twin.twin import Look, Twin
from stickslip_ros.lab.twin.watch import Watch, Watched

_CAUSES = {
    'contact.friction': 'dirt, moisture or wear',
    'contact.prefactor': 'wear, or another surface',
    'runner.mass': 'something was put on the runner, or taken off',
    'runner.damping': 'something touches the runner',
    'actuator.gain': 'the piezo or its amplifier',
}
"""What makes a parameter of a rig change, mostly."""
_GREW = 1.5
"""Factor by which chi-square per reading is above that at the start when a motion is another."""
_MEANS_NOTHING = 5.0
"""The same at which the parameters tell nothing, whatever it was at the start: beside drives whose
roughness travels it went from 2 to 85 from place to place, and the mass with it by a fifth."""
_MORE_STARTS = 3
"""Searches of a fit that is the first to say so: a parameter that has jumped is far away."""


class Health(NamedTuple):
    """What a fit says."""

    stamp_ns: int  # end of its window
    names: tuple[str, ...]
    values: Array  # of the free parameters, SI
    errors: Array
    chi_per_reading: float
    words: str  # empty where nothing is wrong


class Doctor:
    """Fits windows of a twin and says what has changed."""

    def __init__(self, twin: Twin, settings: TwinParameters) -> None:
        self._twin = twin
        self._watch = Watch(settings.period, settings.alarms_per_day)
        self._first: list[Array] = []  # values and errors at the start
        self._chi_at_start, self._was_odd = 0.0, False

    def examine(self, look: Look) -> Health:
        """Return what a window says; StickSlipError if it cannot be fitted."""
        fit = self._twin.fit(look)
        is_odd = self._watch.has_begun and (
            self._watch.is_suspect(_seen(fit)) or _chi(fit) > self._most(fit)
        )
        if is_odd and not self._was_odd:
            fit = min(fit, self._twin.fit(look, _MORE_STARTS), key=lambda one: one.chi_square)
        self._was_odd = is_odd
        values = np.array([one.value for one in fit.estimates])
        errors = np.array([one.standard_error for one in fit.estimates])
        names = tuple(one.name for one in fit.estimates)
        words = _lacking(fit) if _chi(fit) > _limit(fit) else ''
        if not self._watch.has_begun:
            self._first.append(np.array((values, errors)))
            self._chi_at_start = max(self._chi_at_start, _chi(fit))
        if not self._watch.has_begun or _chi(fit) <= self._most(fit):
            changed = self._watch.changed(_seen(fit))
            if changed is not None:
                was = np.median(self._first, axis=0)[:, changed]
                name = names[changed]
                told = (values[changed], errors[changed], *was)
                words = '; '.join(filter(None, [_changed(name, *map(float, told)), words]))
            self._twin.follow(fit)
        return Health(look.window.end_ns, names, values, errors, _chi(fit), words)

    def _most(self, fit: FitResult) -> float:
        """Return chi-square per reading above which the free parameters cannot tell the change."""
        return min(max(_limit(fit), _GREW * self._chi_at_start), _MEANS_NOTHING)


def _seen(fit: Fit) -> Watched:
    """Return what a fit says of the coordinates, its errors wider where it misses the readings."""
    wider = max(1.0, fit.reduced_chi_square or 1.0)
    covariance = wider * fit.uncertainty.covariance_z
    known = np.isfinite(np.diag(covariance))  # on a bound, or not determined, it tells nothing
    covariance = np.where(np.outer(known, known), covariance, 0.0)
    covariance[~known, ~known] = 1.0 / np.finfo(np.float32).eps
    return Watched(fit.found.place, covariance)


def _chi(fit: FitResult) -> float:
    """Return chi-square per reading, of noise and sensor alone where that is known."""
    if fit.missing:
        return fit.missing[0].chi_square / fit.readings
    return fit.reduced_chi_square or 0.0


def _limit(fit: FitResult) -> float:
    """Return chi-square per reading above which a model does not explain a motion."""
    return max(MISSED_MOST, float(chi2.isf(1e-6, fit.readings)) / fit.readings)


def _lacking(fit: FitResult) -> str:
    text = f'the model does not explain the motion: chi-square per reading is {_chi(fit):.3g}'
    if not fit.missing:
        return f'{text}, and no parameter that was tried would lower it'
    worst = fit.missing[0]
    return f'{text}, with {worst.name} free {worst.expected / fit.readings:.3g}'


def _changed(name: str, value: float, error: float, was: float, was_error: float) -> str:
    text = f'{name} {value:.4g} +- {error:.2g}, was {was:.4g} +- {was_error:.2g} at the start'
    return f'{text}: {_CAUSES[name]}' if name in _CAUSES else text
