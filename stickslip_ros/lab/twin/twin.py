# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The twin of a rig: the simulated stand in each window, and a fit of some windows.

Experiment, prediction and fit are those of ``stickslip fit``. Each window has its own zero, drift,
delay and low-pass of a sensor, solved for as in a fit; the rest is the residual.

"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.experiments.experiment import OF_TRACES, Experiment, Readout, Voltage
from stickslip_ros.lab.experiments.options import ReadingOptions
from stickslip_ros.lab.experiments.predict import SAMPLE_S, predict
from stickslip_ros.lab.experiments.reading import MOVES_MIN, experiment_over_time
from stickslip_ros.lab.experiments.sensor import KnownSensor, noise_of
from stickslip_ros.lab.experiments.sensor_clock import LATE_MIN_S, LEAD_S
from stickslip_ros.lab.fitting.fit import FitOptions, fit_experiments
from stickslip_ros.lab.fitting.free import FROM_ZERO, choose_free
from stickslip_ros.lab.fitting.metric import metric_of, waves_of
from stickslip_ros.lab.fitting.problem import FINEST
from stickslip_ros.lab.fitting.report import Fit
from stickslip_ros.lab.fitting.search import CERTAIN_FACTOR
from stickslip_ros.lab.twin.settings import TwinParameters
from stickslip_ros.lab.twin.window import Window
from stickslip_ros.parameters import Parameters, to_nanoseconds

_FITTED_MOST = 3000  # readings of a window used in a fit, the first ones; more add little
_SAMPLES_MIN = 32  # fewest readings per window; with fewer, the quantity is ignored
_REACHED = 0.9  # least share of a window that the voltage covers
_LAG_S, _LAGS = 2e-5, 250  # steps of the search for a delay, and their number on either side
_COMPARED = 1000  # approximate number of readings in the search for a delay


class RigAtRest(StickSlipError):
    """The rig has no input in a window."""


class ComparedQuantity(NamedTuple):
    """A quantity in a window, of rig and twin."""

    quantity: str
    time_s: Array  # since the start of the window, shape (n,)
    rig: Array
    twin: Array

    @property
    def rms(self) -> float:
        return float(np.sqrt(np.mean((self.rig - self.twin) ** 2)))


class Look(NamedTuple):
    """A window in which the rig moved."""

    window: Window
    experiment: Experiment
    shown: tuple[ComparedQuantity, ...]
    steps: int  # whole cycles that end in a fall
    step_rig_m: float  # mean motion per cycle; NaN without cycles
    step_twin_m: float
    late_s: float  # delay of the clock of the first quantity


class Twin:
    """A fitted stand that follows a rig."""

    def __init__(self, stand: Parameters, settings: TwinParameters) -> None:
        self.stand, self.settings = stand, settings
        self._fitted, free, self.notes = choose_free(stand, settings.free_names)
        self._free = tuple(
            replace(one, start=float(stand.value(one.name))) if one.name in FROM_ZERO else one
            for one in free
        )
        self._known = {
            one.name: (one.start, settings.prior) for one in free if stand.value(one.name)
        }
        self._options = ReadingOptions(window_s=(0.0, settings.window))
        self._sensor = KnownSensor()  # of the first quantity
        self._noise: float | None = None
        self._late_s = 0.0  # of the last window
        self._due_ns: int | None = None

    def look(self, window: Window) -> Look:
        """Return rig and twin in a window; RigAtRest without input, else StickSlipError."""
        experiment = self.experiment(window)
        self._late_s = self._lateness(experiment)
        late_s = self._late_s if abs(self._late_s) > LATE_MIN_S else 0.0  # a fit solves the rest
        on_time = tuple(replace(each, time_s=each.time_s - late_s) for each in experiment.observed)
        experiment = replace(experiment, observed=on_time)
        first, *others = experiment.sensed(late_s=self._sensor.late_s).observed
        observed = (first.sensed(slow_s=self._sensor.slow_s), *others)
        there = replace(experiment, observed=observed)
        [found] = predict(self.stand, [there])
        assert isinstance(there.drive, Voltage)
        late = np.array((self._sensor.late_s, 0.0))
        waves = waves_of(there.drive.rows + late)
        begins_s, shown = there.drive.begins_s + late_s, list[ComparedQuantity]()
        for each, model in zip(observed, found, strict=True):
            still = each.sensed(drift_per_s=0.0)  # a drift would absorb the steps
            metric = metric_of(still, model, there.drive.rows, max(each.noise, FINEST), None)
            _, left = metric.of_sensor(model.values - each.values)
            time_s, twin = each.time_s + begins_s, each.values + left
            shown.append(ComparedQuantity(each.quantity, time_s, each.values, twin))
        falling = (cycle for wave in waves for cycle in wave if cycle.falls)
        starts_s = ((cycle.start_s + begins_s, cycle.length_s) for cycle in falling)
        ends_s = ((start_s, start_s + length_s) for start_s, length_s in starts_s)
        whole = [each for each in ends_s if each[0] >= 0.0 and each[1] <= self.settings.window]
        if not whole or shown[0].quantity != 'position_m':
            return Look(window, experiment, tuple(shown), 0, math.nan, math.nan, self._late_s)
        rig_m, twin_m = (
            float(np.mean(np.diff(np.interp(whole, shown[0].time_s, each))))
            for each in (shown[0].rig, shown[0].twin)
        )
        return Look(window, experiment, tuple(shown), len(whole), rig_m, twin_m, self._late_s)

    def _lateness(self, one: Experiment) -> float:
        """Return the delay, s, nearest to the last one among those that fit about equally well."""
        first = one.observed[0]
        time_s, reach_s = first.time_s, min(_LAG_S * _LAGS, 0.25 * float(np.ptp(first.time_s)))
        even_s = np.arange(0.0, time_s[-1], SAMPLE_S)
        even = Readout(first.quantity, even_s, even_s)
        # the readings make the run equal to that of ``look``, so that it is made only once
        [[model, *_]] = predict(self.stand, [replace(one, observed=(even, *one.observed))])
        inside = np.flatnonzero((time_s > time_s[0] + reach_s) & (time_s < time_s[-1] - reach_s))
        some = inside[:: 1 + len(inside) // _COMPARED]
        time_s, values = time_s[some], first.values[some]
        lags_s = _LAG_S * np.arange(-_LAGS, _LAGS + 1) + self._late_s
        lags_s = lags_s[np.abs(lags_s) < LEAD_S]
        places = np.rint((time_s - lags_s[:, np.newaxis]) / SAMPLE_S).astype(np.intp)
        moved = model.values[places.clip(0, len(even_s) - 1)] - values
        missed = np.sum(np.diff(moved) ** 2, axis=1)
        good_s = lags_s[missed <= CERTAIN_FACTOR * missed.min() + len(values) * first.noise**2]
        return float(good_s[np.argmin(np.abs(good_s - self._late_s))])

    def experiment(self, window: Window) -> Experiment:
        """Return a window as an experiment; RigAtRest without input, else StickSlipError."""
        time_s, voltage_v = window.samples['voltage_v']
        hint = 'check the topic for lost messages, set its clock, or raise twin.lag'
        is_short = time_s[-1:] < _REACHED * self.settings.window
        if len(voltage_v) < _SAMPLES_MIN or is_short:
            raise StickSlipError(f'no voltage arrived, or not up to the end of a window; {hint}')
        if np.std(voltage_v) <= MOVES_MIN * noise_of(voltage_v):
            raise RigAtRest('nothing drives the rig')
        drift = {'force_n': math.inf}
        observed = tuple(
            Readout(
                name,
                values,
                times_s,
                sensor=KnownSensor(drift_per_s=drift.get(name, self.settings.drift)),
            )
            for name in OF_TRACES
            for times_s, values in [window.samples.get(name, (np.empty(0), np.empty(0)))]
            if np.count_nonzero(times_s >= 0.0) >= _SAMPLES_MIN
        )
        if not observed:
            raise StickSlipError(f'no readings arrived, or fewer than {_SAMPLES_MIN}; {hint}')
        name, drive = f'rig at {window.start_ns * 1e-9:.3f} s', (time_s, voltage_v)
        return experiment_over_time(name, drive, observed, self.stand, None, self._options, {})

    def is_due(self, look: Look) -> bool:
        """Return whether a window is the first of a fit period; call once per window."""
        end_ns, period_ns = look.window.end_ns, to_nanoseconds(self.settings.period)
        if self._due_ns is not None and self._due_ns - period_ns < end_ns < self._due_ns:
            return False
        self._due_ns = end_ns + period_ns
        return True

    def fit(self, look: Look, starts: int = 1) -> Fit:
        """Fit a window, starting from the last good fit."""
        one = look.experiment
        time_s = one.observed[0].time_s
        if len(time_s) > _FITTED_MOST:
            end_s = float(time_s[_FITTED_MOST])
            assert isinstance(one.drive, Voltage)
            rows = one.drive.rows[: np.searchsorted(one.drive.rows[:, 0], end_s) + 1]
            one = replace(one.within(time_s[0], end_s), drive=replace(one.drive, rows=rows))
        first, *others = one.observed
        observed = (replace(first, sigma=self._noise), *others)
        return fit_experiments(
            self._fitted,
            self._free,
            [replace(one, observed=observed)],
            known=self._known,
            options=FitOptions(starts=starts, workers=1),
        )

    def follow(self, fitted: Fit) -> None:
        """Start the next fits from this one, with its sensor."""
        values = fitted.problem.values(fitted.found.place)
        self._free = tuple(
            replace(one, start=min(max(value, one.lower), one.upper))
            for one, value in zip(self._free, values, strict=True)
        )
        self._sensor = fitted.experiments[0].observed[0].sensor
        self._noise = self._noise or fitted.problem.noise[0]
