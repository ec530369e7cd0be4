# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Two clocks laid onto each other by the voltage that both records hold."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1] / 'waveform'))
from monitors import corners_of, hold, ramp, sampled, saw

from stickslip_ros.errors import OutOfRange
from stickslip_ros.lab.comparison.clock_shift import clock_shift
from stickslip_ros.lab.experiments.sensor import lone_outliers

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


@pytest.mark.parametrize('rate_hz', [2000.0, 5000.0, 50000.0])
@pytest.mark.parametrize('shift_s', [0.003, -0.0301234])
def test_a_monitor_is_laid_onto_the_commands_within_microseconds(rate_hz, shift_s):
    times_s, volts_v = sampled(COURSE, rate_hz, 0.1, seed=1)
    found = clock_shift(COURSE[:, 0], COURSE[:, 1], times_s - shift_s, volts_v)
    assert abs(found.shift_s - shift_s) < DEVIATIONS * found.error_s
    assert found.error_s < 1e-6
    assert found.coefficient > 0.9999
    assert found.doubts() == []


@pytest.mark.parametrize('seed', range(2, 12))
def test_outliers_another_unit_and_another_zero_change_nothing(seed):
    times_s, volts_v = sampled(COURSE, 2000.0, 0.3, seed=seed)
    volts_v[np.random.default_rng(seed).permutation(len(volts_v))[:8]] = 4000.0
    found = clock_shift(COURSE[:, 0], COURSE[:, 1], times_s - 0.003, volts_v / 15.0 + 0.2)
    assert abs(found.shift_s - 0.003) < DEVIATIONS * found.error_s < 5e-6
    assert found.outliers == 8
    assert found.doubts() == []


def test_two_monitors_are_laid_onto_each_other():
    fine = sampled(COURSE, 50000.0, 0.1, seed=3)
    times_s, volts_v = sampled(COURSE, 5000.0, 0.1, seed=4)
    found = clock_shift(fine[0], fine[1], times_s - 0.003, volts_v)
    assert found.shift_s == pytest.approx(0.003, abs=1e-6)


def test_errors_of_the_shift_are_what_they_say():
    deviations = []
    for seed in range(60):
        times_s, volts_v = sampled(COURSE, 5000.0, 0.5, seed=seed)
        found = clock_shift(COURSE[:, 0], COURSE[:, 1], times_s - 0.003, volts_v)
        deviations.append((found.shift_s - 0.003) / found.error_s)
    # the mean square of 60 normal numbers is within 0.5 and 1.6, but once in 1000 times
    assert 0.5 < np.mean(np.square(deviations)) < 1.6


def test_a_wave_without_an_end_has_rivals_and_they_are_told():
    wave = corners_of([saw(280.0, 300.0, 40)])
    times_s, volts_v = sampled(wave, 5000.0, 0.1, seed=5)
    middle = (times_s > 0.05) & (times_s < 0.08)
    found = clock_shift(wave[:, 0], wave[:, 1], times_s[middle], volts_v[middle])
    periods = abs(found.rival_s - found.shift_s) * 300.0
    assert periods == pytest.approx(round(periods), abs=1e-3)
    assert 'nearly as good' in found.doubts()[0]


def test_records_that_do_not_look_alike_are_told():
    random = np.random.default_rng(6)
    times_s = np.arange(0.0, 0.12, 2e-4)
    found = clock_shift(
        COURSE[:, 0], COURSE[:, 1], times_s, 150.0 + 40.0 * random.standard_normal(len(times_s))
    )
    assert 'below 0.8; give the shift' in found.doubts()[0]


def test_a_record_without_change_is_refused():
    with pytest.raises(OutOfRange, match='record B'):
        clock_shift(COURSE[:, 0], COURSE[:, 1], np.arange(100.0), np.full(100, 3.0))


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
