# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Two clocks laid onto each other by the voltage that both records hold."""

import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1] / 'waveform'))
from monitors import corners_of, hold, ramp, sampled, saw

from stickslip_ros.arrays import Array
from stickslip_ros.lab.comparison.clock_shift import clock_shift
from stickslip_ros.lab.experiments.sensor import lone_outliers
from stickslip_ros.recording.series import Series

COURSE = corners_of(
    [
        hold(0.005),
        ramp(60.0, 0.002),
        ramp(0.0, 0.002),
        saw(280.0, 300.0, 10),
        hold(0.004),
        saw(300.0, 600.0, 12),
        hold(0.004),
        saw(190.0, 200.0, 6),
        hold(0.004),
    ]
)
DEVIATIONS = 5.0
"""Of a shift from the true one, in its standard errors."""


def record(rate_hz: float, noise_v: float, seed: int, course: Array = COURSE) -> Series:
    """Return a monitor of the voltage."""
    return Series(*sampled(course, rate_hz, noise_v, seed=seed), 'V', 'monitor')


FINE = record(50_000.0, 0.1, 0)


def late(series: Series, by_s: float, values: Array | None = None) -> Series:
    value = series.value if values is None else values
    return replace(series, time_s=series.time_s - by_s, value=value)


@pytest.mark.parametrize('rate_hz', [2000.0, 5000.0, 50000.0])
@pytest.mark.parametrize('shift_s', [0.003, -0.0301234])
def test_a_monitor_is_laid_onto_another_within_microseconds(rate_hz, shift_s):
    found = clock_shift(FINE, late(record(rate_hz, 0.1, 1), shift_s), 'voltage_v')
    assert abs(found.shift_s - shift_s) < DEVIATIONS * found.error_s
    assert found.error_s < 2e-6
    assert found.correlation > 0.9999
    assert found.doubts == ()


@pytest.mark.parametrize('seed', range(2, 12))
def test_outliers_another_unit_and_another_zero_change_nothing(seed):
    monitor = record(2000.0, 0.3, seed)
    monitor.value[np.random.default_rng(seed).permutation(len(monitor))[:8]] = 4000.0
    found = clock_shift(FINE, late(monitor, 0.003, monitor.value / 15.0 + 0.2), 'voltage_v')
    assert abs(found.shift_s - 0.003) < DEVIATIONS * found.error_s < 1e-5
    assert found.doubts == ()


def test_errors_of_the_shift_are_what_they_say():
    deviations = []
    for seed in range(60):
        found = clock_shift(FINE, late(record(5000.0, 0.5, seed), 0.003), 'voltage_v')
        deviations.append((found.shift_s - 0.003) / found.error_s)
    # the mean square of 60 normal numbers is within 0.5 and 1.6, but once in 1000 times; the error
    # has a part for the lines between the samples of A
    assert 0.3 < np.mean(np.square(deviations)) < 1.6


def test_a_wave_without_an_end_has_rivals_and_they_are_told():
    wave = corners_of([saw(280.0, 300.0, 40)])
    [whole, part] = [record(5000.0, 0.1, seed, wave) for seed in (4, 5)]
    found = clock_shift(whole, part.window(0.05, 0.08), 'voltage_v')
    [rival_s] = re.findall('a shift of ([-0-9.]+) s is nearly as good', found.doubts[0])
    periods = abs(float(rival_s) - found.shift_s) * 300.0
    assert periods == pytest.approx(round(periods), abs=1e-2)


def test_lone_outliers_are_found_and_steps_and_ringing_are_none():
    random = np.random.default_rng(7)
    times_s = np.arange(20_000) * 2e-5
    after_s = times_s % 1e-3
    ringing = 30e-9 * np.exp(-after_s / 2e-4) * np.sin(2.0 * np.pi * 9e3 * after_s)
    place_m = 80e-9 * np.floor(times_s / 1e-3) + ringing
    place_m += 1.5e-9 * random.standard_normal(len(times_s))
    wrong = np.sort(random.permutation(len(times_s) - 20)[:13] + 10)
    place_m[wrong] += random.choice([-1e-6, 1e-6], 13)
    assert np.flatnonzero(lone_outliers(place_m)).tolist() == wrong.tolist()
