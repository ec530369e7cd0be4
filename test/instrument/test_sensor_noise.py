# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Noise of the sensors: its density, its Allan deviation, and what the filters make of it."""

import math

import numpy as np
import pytest
from scipy import signal
from sensor_setups import HEALTHY, RATE_HZ, ROUNDING, SENSORS, SIGMAS, Sensor, sensor_with

from stickslip_ros.instrument.sensors.reader import Noise
from stickslip_ros.parameters import Parameters

SAMPLES = 2**18
SEGMENT = 1024
AHEAD = 700  # random numbers taken after a place
DENSITY = {'interferometer': 1e-12, 'load_cell': 1e-6}
AVERAGES = 2 ** np.arange(0, 13, 2)
"""Samples that are averaged for the Allan deviation; 64 averages are left of the longest."""


def _at_rest(name, settings, samples=SAMPLES):
    full = {f'{name}.{k}': v for k, v in settings.items()}
    return sensor_with(name, full).readings(np.zeros(samples), HEALTHY)


def _density(readings):
    """Return frequencies and one-sided density of the power, without both ends."""
    frequency_hz, density = signal.welch(readings, RATE_HZ, nperseg=SEGMENT, noverlap=0)
    return frequency_hz[2:-1], density[2:-1]


def _assert_density(readings, expected_of):
    frequency_hz, density = _density(readings)
    share = density / expected_of(frequency_hz)
    segments = SAMPLES // SEGMENT
    # A bin is the mean of as many exponentially distributed powers as there are segments; a
    # Hann window correlates it with its neighbours, so that the mean of all counts for half.
    assert np.max(np.abs(share - 1.0)) < SIGMAS / math.sqrt(segments)
    assert abs(np.mean(share) - 1.0) < SIGMAS / math.sqrt(segments * share.size / 2.0)


def _allan_variance(readings, averaged):
    means = readings[: len(readings) // averaged * averaged].reshape(-1, averaged).mean(axis=1)
    return 0.5 * np.mean(np.diff(means) ** 2), len(means) - 1


def _assert_allan(readings, expected_of, scatter, slope):
    """Check values and slope; a variance from M differences is off by sqrt(scatter/M)."""
    found, errors = [], []
    for averaged in AVERAGES:
        variance, differences = _allan_variance(readings, averaged)
        errors.append(math.sqrt(scatter / differences))
        assert abs(variance / expected_of(averaged) - 1.0) < SIGMAS * errors[-1]
        found.append(math.sqrt(variance))
    # One sample of a random walk is not yet a walk; sixteen averaged ones are, within 0.2 %.
    times, deviations, weights = np.log(AVERAGES[2:]), np.log(found[2:]), 2.0 / np.array(errors)
    fit, covariance = np.polyfit(times, deviations, 1, w=weights[2:], cov='unscaled')
    assert abs(fit[0] - slope) < SIGMAS * math.sqrt(covariance[0, 0])


@pytest.mark.parametrize('name', SENSORS)
def test_white_noise_has_its_density_at_every_frequency(name):
    density = DENSITY[name]
    readings = _at_rest(name, {'noise_density': density})
    _assert_density(readings, lambda _: density**2)


def test_the_mechanics_of_the_load_cell_do_not_see_the_noise_of_its_electronics():
    density = DENSITY['load_cell']
    settings = {'noise_density': density, 'resonance': 1500.0, 'damping_ratio': 0.1}
    _assert_density(_at_rest('load_cell', settings), lambda _: density**2)


@pytest.mark.parametrize('name', SENSORS)
def test_the_allan_deviation_of_white_noise_falls_with_the_root_of_the_time(name):
    density = DENSITY[name]
    readings = _at_rest(name, {'noise_density': density})
    # Neighbouring differences have one mean in common: correlation 1/2, 3/M instead of 2/M.
    _assert_allan(readings, lambda m: density**2 * RATE_HZ / (2.0 * m), 3.0, -0.5)


def test_the_allan_deviation_of_a_random_walk_grows_with_the_root_of_the_time():
    walk = 1e-9
    readings = _at_rest('interferometer', {'random_walk': walk})
    # K^2 tau/3, summed over steps; neighbouring differences have the correlation 1/4.
    _assert_allan(
        readings, lambda m: walk**2 / RATE_HZ * (2.0 * m**2 + 1.0) / (6.0 * m), 2.25, 0.5
    )


def test_a_random_walk_leaves_the_white_noise_alone():
    noise, walk = {'noise_density': 1e-12}, {'random_walk': 1e-9}
    both = _at_rest('interferometer', noise | walk, 1000)
    parts = _at_rest('interferometer', noise, 1000) + _at_rest('interferometer', walk, 1000)
    np.testing.assert_allclose(both, parts, rtol=0.0, atol=ROUNDING * np.max(np.abs(both)))


def _correlation(streams):
    return np.max(np.abs(np.corrcoef(streams) - np.eye(len(streams))))


def test_no_two_random_streams_have_anything_in_common():
    steps = np.diff(_at_rest('interferometer', {'random_walk': 1e-9}), prepend=0.0)
    streams = [_at_rest(name, {'noise_density': DENSITY[name]}) for name in SENSORS]
    for seed in (0, 2):
        for name in SENSORS:
            settings = {f'{name}.noise_density': DENSITY[name], 'sim.seed': seed}
            streams.append(sensor_with(name, settings).readings(np.zeros(SAMPLES), HEALTHY))
    assert _correlation([steps, *streams]) < SIGMAS / math.sqrt(SAMPLES)


def _old_readings(parameters, name, stream, truth):
    """Return white noise, low-pass and quantisation as the first version had them, in numpy."""
    setting, rate_hz = getattr(parameters, name), parameters.trace.sample_rate
    unit = np.random.default_rng((parameters.sim.seed, stream)).standard_normal(len(truth))
    noise = setting.noise_density * math.sqrt(rate_hz / 2.0)
    decay = math.exp(-2.0 * math.pi * setting.bandwidth / rate_hz)
    gain = 1.0 - decay if setting.bandwidth > 0.0 else 1.0
    level, readings = 0.0, np.empty(len(truth))
    for i, true in enumerate(truth):
        level += gain * (true + noise * unit[i] - level)
        readings[i] = level
    if setting.resolution > 0.0:
        readings = np.rint(readings / setting.resolution) * setting.resolution
    return readings


@pytest.mark.parametrize(('name', 'stream'), [('interferometer', 1), ('load_cell', 2)])
@pytest.mark.parametrize(
    'changes',
    [
        {},
        {'bandwidth': 0.0},
        {'resolution': 0.0},
        {'noise_density': 0.0},
        {'noise_density': 1e-9, 'bandwidth': 333.0, 'resolution': 1e-12},
    ],
)
def test_without_further_errors_the_bytes_are_those_of_the_first_version(name, stream, changes):
    parameters = Parameters().updated({f'{name}.{k}': v for k, v in changes.items()})
    truth = {'interferometer': 1e-6, 'load_cell': 0.2}[name] * np.sin(np.arange(3000) / 70.0)
    expected = _old_readings(parameters, name, stream, truth)
    assert Sensor(name, parameters).readings(truth, HEALTHY).tobytes() == expected.tobytes()


@pytest.mark.parametrize('counts', [[1], [512, 1], [200] * 60, [3000, 7, 5000]])
def test_random_numbers_go_on_from_a_place_however_they_were_taken(counts):
    noise, again = Noise((7, 1)), Noise((7, 1))
    expected = np.random.default_rng((7, 1)).standard_normal(sum(counts) + AHEAD)
    taken = np.concatenate([noise.take(count) for count in counts])
    again.recall({'place': noise.place})
    for each in (noise, again):
        assert np.array_equal(np.concatenate((taken, each.take(AHEAD))), expected)
