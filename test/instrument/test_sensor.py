"""Sensors: white noise of a known density, a first-order low-pass, a grid of readings."""

import math

import numpy as np
import pytest

from stickslip_ros.instrument.sensor import Sensor, interferometer, load_cell

RATE_HZ = 50e3
SAMPLES = 200_000
SIGMAS = 5.0
"""Standard errors by which an estimate from noise may be off; the seed is fixed."""
ROUNDING = 1e-12


def _sensor(noise=0.0, bandwidth_hz=0.0, resolution=0.0, seed=(1, 2)):
    return Sensor(noise, bandwidth_hz, resolution, RATE_HZ, seed)


def test_a_sensor_without_faults_reads_the_truth():
    truth = np.random.default_rng(0).normal(0.0, 1e-7, 1000)
    # The way from the last reading to the truth and back rounds by a bit of the larger one.
    within = 2.0**-52 * np.max(np.abs(truth))
    np.testing.assert_allclose(_sensor().read(truth), truth, rtol=0.0, atol=within)


def test_the_truth_itself_is_left_alone():
    truth = np.full(100, 1e-7)
    _sensor(noise=1e-9, bandwidth_hz=1e3, resolution=1e-9).read(truth)
    assert set(truth) == {1e-7}


def test_white_noise_has_the_variance_of_its_density_up_to_half_the_rate():
    density = 1e-12
    readings = _sensor(noise=density).read(np.full(SAMPLES, 3e-8))
    variance = density**2 * RATE_HZ / 2.0
    assert abs(np.mean(readings) - 3e-8) < SIGMAS * math.sqrt(variance / SAMPLES)
    assert abs(np.var(readings) / variance - 1.0) < SIGMAS * math.sqrt(2.0 / SAMPLES)


def test_the_noise_is_white():
    density, bins = 1e-6, 500
    readings = _sensor(noise=density).read(np.zeros(SAMPLES)).reshape(-1, 2 * bins)
    spectra = 2.0 * np.abs(np.fft.rfft(readings, axis=1)) ** 2 / (RATE_HZ * 2 * bins)
    # Without the ends, each bin is an average of exponentially distributed squares.
    inner = np.mean(spectra, axis=0)[1:-1] / density**2
    assert np.max(np.abs(inner - 1.0)) < SIGMAS / math.sqrt(len(readings))
    assert abs(np.mean(inner) - 1.0) < SIGMAS / math.sqrt(inner.size * len(readings))


def test_a_step_is_answered_by_an_exponential():
    corner_hz = 2e3
    readings = _sensor(bandwidth_hz=corner_hz).read(np.ones(200))
    time_s = np.arange(1, 201) / RATE_HZ
    expected = 1.0 - np.exp(-2.0 * math.pi * corner_hz * time_s)
    np.testing.assert_allclose(readings, expected, rtol=ROUNDING)


def test_at_the_corner_frequency_the_power_is_halved():
    corner_hz, periods = 100.0, 50
    time_s = np.arange(int(periods * RATE_HZ / corner_hz)) / RATE_HZ
    readings = _sensor(bandwidth_hz=corner_hz).read(np.sin(2.0 * math.pi * corner_hz * time_s))
    settled = readings[len(readings) // 2 :]
    # A corner 250 times below half the rate: what a sample and hold adds is of its square.
    assert 2.0 * np.mean(settled**2) == pytest.approx(0.5, rel=1e-2, abs=0.0)


def test_the_low_pass_lets_a_known_share_of_the_noise_pass():
    corner_hz, density = 2e3, 1e-6
    readings = _sensor(noise=density, bandwidth_hz=corner_hz).read(np.zeros(SAMPLES))
    decay = math.exp(-2.0 * math.pi * corner_hz / RATE_HZ)
    # y' = a y + (1 - a) x has the variance (1 - a)/(1 + a) of that of x.
    variance = (1.0 - decay) / (1.0 + decay) * density**2 * RATE_HZ / 2.0
    independent = SAMPLES * (1.0 - decay**2) / (1.0 + decay**2)
    assert abs(np.var(readings[1000:]) / variance - 1.0) < SIGMAS * math.sqrt(2.0 / independent)


def test_readings_lie_on_the_grid_of_the_resolution_next_to_the_truth():
    truth = np.random.default_rng(0).normal(0.0, 1e-6, 10_000)
    readings = _sensor(resolution=1e-9).read(truth)
    counts = np.round(readings / 1e-9)
    np.testing.assert_allclose(readings, counts * 1e-9, rtol=ROUNDING)
    assert np.max(np.abs(readings - truth)) <= 0.5e-9 * (1.0 + 1e-6)
    assert len(np.unique(counts)) > 1000


def test_the_low_pass_works_on_unrounded_values():
    readings = _sensor(bandwidth_hz=10.0, resolution=1.0).read(np.full(100_000, 0.9))
    assert readings[0] == 0.0
    assert readings[-1] == 1.0


def test_a_resolution_far_below_the_reading_is_no_worse_than_none():
    truth = np.array([1e-7, -3e-8])
    readings = _sensor(resolution=1e-30).read(truth)
    np.testing.assert_allclose(readings, truth, rtol=1e-9)


def test_a_block_read_in_pieces_reads_the_same():
    truth = np.linspace(0.0, 1e-6, 1000)
    faults = {'noise': 1e-12, 'bandwidth_hz': 5e3, 'resolution': 1e-10}
    whole, pieces = _sensor(**faults), _sensor(**faults)
    read = np.concatenate([pieces.read(part) for part in np.split(truth, [1, 50, 777])])
    np.testing.assert_array_equal(read, whole.read(truth))


def test_a_reset_sensor_reads_the_same_again():
    sensor = _sensor(noise=1e-12, bandwidth_hz=5e3)
    first = sensor.read(np.full(100, 1e-6))
    assert not np.array_equal(sensor.read(np.full(100, 1e-6)), first)
    sensor.reset()
    np.testing.assert_array_equal(sensor.read(np.full(100, 1e-6)), first)


def test_the_two_sensors_share_no_noise(stand):
    changes = {
        f'{sensor}.{name}': 0.0
        for sensor in ('interferometer', 'load_cell')
        for name in ('bandwidth', 'resolution')
    }
    parameters = stand.updated(changes)
    sensors = interferometer(parameters), load_cell(parameters)
    laser, cell = (sensor.read(np.zeros(SAMPLES)) for sensor in sensors)
    assert abs(np.corrcoef(laser, cell)[0, 1]) < SIGMAS / math.sqrt(SAMPLES)
    assert np.std(laser) == pytest.approx(1e-12 * math.sqrt(25e3), rel=1e-2, abs=0.0)
    assert np.std(cell) == pytest.approx(1e-6 * math.sqrt(25e3), rel=1e-2, abs=0.0)


def test_neighbouring_seeds_share_no_noise():
    streams = [
        _sensor(noise=1.0, seed=seed).read(np.zeros(SAMPLES)) for seed in ((1, 1), (1, 2), (2, 1))
    ]
    correlation = np.corrcoef(streams) - np.eye(3)
    assert np.max(np.abs(correlation)) < SIGMAS / math.sqrt(SAMPLES)
