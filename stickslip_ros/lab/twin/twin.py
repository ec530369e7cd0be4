# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The twin of a rig: in each window what a stand would show, and now and then a fit of that window.

It is the experiment, the prediction and the fit of ``stickslip fit``, on windows that follow each
other. Each window is anchored for itself: zero, drift, delay and low-pass of a sensor are solved
for, as a fit does; what is left is the residual of what happened in it.

"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.experiments.experiment import OF_TRACES, Experiment, Seen, Voltage, noise_of
from stickslip_ros.lab.experiments.options import ReadingOptions
from stickslip_ros.lab.experiments.predict import predict
from stickslip_ros.lab.experiments.reading import (
    MOVES_MIN,
    experiment_over_time,
    without_outliers,
)
from stickslip_ros.lab.fitting.fit import FitOptions, fit_experiments
from stickslip_ros.lab.fitting.free import FROM_ZERO, choose_free
from stickslip_ros.lab.fitting.metric import metric_of, waves_of
from stickslip_ros.lab.fitting.problem import FINEST, shifted
from stickslip_ros.lab.fitting.report import Fit
from stickslip_ros.lab.twin.settings import TwinParameters
from stickslip_ros.lab.twin.window import Window
from stickslip_ros.parameters import Parameters, to_nanoseconds

_FITTED_MOST = 3000
"""Readings of a window that are fitted, the first: more take longer and tell little more."""
_SAMPLES_MIN = 32  # readings of a window below which a quantity is none


class RigRests(StickSlipError):
    """Nothing drives the rig in a window."""


class SeenBoth(NamedTuple):
    """A quantity in a window: what the rig showed, and what its twin shows there."""

    quantity: str
    time_s: Array  # since the start of the window, shape (n,)
    rig: Array
    twin: Array

    @property
    def rms(self) -> float:
        """Root of the mean square of the residual."""
        return float(np.sqrt(np.mean((self.rig - self.twin) ** 2)))


class Look(NamedTuple):
    """A window in which the rig moved."""

    window: Window
    experiment: Experiment
    shown: tuple[SeenBoth, ...]
    steps: int  # whole cycles that end in a fall
    step_rig_m: float  # mean motion in one of them; not a number without
    step_twin_m: float


class Twin:
    """
    A stand beside a rig.

    Parameters
    ----------
    stand : Parameters
        The stand, as it was fitted.
    settings : TwinParameters
        How it follows the rig.

    Raises
    ------
    StickSlipError
        If a parameter cannot be free.

    """

    def __init__(self, stand: Parameters, settings: TwinParameters) -> None:
        self.stand, self.settings = stand, settings
        self._fitted, free, self.notes = choose_free(stand, settings.free_names)
        own = stand.flat()
        self._free = tuple(
            replace(one, start=float(own[one.name]), lower=0.0) if one.name in FROM_ZERO else one
            for one in free
        )
        self._known = {one.name: (one.start, settings.prior) for one in free if own[one.name]}
        self._options = ReadingOptions(window_s=(0.0, settings.window))
        self._late_s, self._slow_s = 0.0, 0.0  # of the sensor that a fit looks at first
        self._noise: float | None = None
        self._due_ns: int | None = None

    def look(self, window: Window) -> Look:
        """
        Return rig and twin in a window.

        Raises
        ------
        RigRests
            If nothing drove the rig.
        StickSlipError
            If it cannot be said what drove it, or nothing was seen to move.

        """
        experiment = self.experiment(window)
        first, *others = experiment.seen
        seen = (replace(first, slow_s=self._slow_s), *others)
        there = replace(experiment, seen=seen)
        [found] = predict(self.stand, [there], shifts_s=(self._late_s,))
        assert isinstance(there.drive, Voltage)
        waves = waves_of(shifted(there.drive, self._late_s))
        begins_s, shown = there.drive.begins_s, list[SeenBoth]()
        for each, model in zip(seen, found, strict=True):
            still = replace(each, drift_per_s=0.0)  # else it would make up for the steps
            metric = metric_of(still, model, waves, max(each.noise, FINEST), None)
            _, left = metric.of_sensor(model.values - each.values)
            shown.append(
                SeenBoth(each.quantity, each.time_s + begins_s, each.values, each.values + left)
            )
        ends_s = [
            (cycle.start_s + begins_s, cycle.start_s + cycle.length_s + begins_s)
            for wave in waves
            for cycle in wave
            if cycle.falls
        ]
        whole = [each for each in ends_s if each[0] >= 0.0 and each[1] <= self.settings.window]
        if not whole or shown[0].quantity != 'position_m':
            return Look(window, experiment, tuple(shown), 0, math.nan, math.nan)
        moved_m = (
            np.diff(np.interp(whole, shown[0].time_s, each))
            for each in (shown[0].rig, shown[0].twin)
        )
        return Look(
            window, experiment, tuple(shown), len(whole), *(float(np.mean(x)) for x in moved_m)
        )

    def experiment(self, window: Window) -> Experiment:
        """Return a window as an experiment; see ``look``."""
        time_s, voltage_v = window.samples['voltage_v']
        if len(voltage_v) < _SAMPLES_MIN:
            raise StickSlipError(
                'the voltage was not heard; are messages lost, or twin.lag short?'
            )
        if np.std(voltage_v) <= MOVES_MIN * noise_of(voltage_v):
            raise RigRests('nothing drives the rig')
        seen = tuple(
            Seen(
                name,
                window.samples[name][1],
                window.samples[name][0],
                drift_per_s=math.inf if name == 'force_n' else self.settings.drift,
            )
            for name in OF_TRACES
            if name in window.samples and len(window.samples[name][0]) >= _SAMPLES_MIN
        )
        one = experiment_over_time(
            f'rig at {window.start_ns * 1e-9:.3f} s',
            (time_s, voltage_v),
            seen,
            self.stand,
            None,
            self._options,
            {},
        )
        return without_outliers(one, FitOptions().outliers)

    def is_due(self, look: Look) -> bool:
        """Return whether a window is the first of a period, and is to be fitted; ask once."""
        end_ns, period_ns = look.window.end_ns, to_nanoseconds(self.settings.period)
        if self._due_ns is not None and self._due_ns - period_ns < end_ns < self._due_ns:
            return False
        self._due_ns = end_ns + period_ns
        return True

    def fit(self, look: Look, starts: int = 1) -> Fit:
        """Return a fit of a window, which begins where the last good one ended."""
        one = look.experiment
        time_s = one.seen[0].time_s
        if len(time_s) > _FITTED_MOST:
            end_s = float(time_s[_FITTED_MOST])
            assert isinstance(one.drive, Voltage)
            rows = one.drive.rows[: np.searchsorted(one.drive.rows[:, 0], end_s) + 1]
            one = replace(one.within(time_s[0], end_s), drive=replace(one.drive, rows=rows))
        first, *others = one.seen
        seen = (replace(first, sigma=self._noise), *others)
        return fit_experiments(
            self._fitted,
            self._free,
            [replace(one, seen=seen)],
            known=self._known,
            options=FitOptions(starts=starts, workers=1),
            is_warm=True,
        )

    def follow(self, fitted: Fit) -> None:
        """Begin the next fit where a good one ended, and take the sensor as it found it."""
        values = fitted.problem.values(fitted.found.place)
        self._free = tuple(
            replace(one, start=min(max(value, one.lower), one.upper))
            for one, value in zip(self._free, values, strict=True)
        )
        self._late_s = fitted.problem.shifts_s[0]
        self._slow_s = fitted.experiments[0].seen[0].slow_s
        self._noise = self._noise or fitted.problem.noise.values[0][0]
