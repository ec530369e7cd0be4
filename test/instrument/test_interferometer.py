# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The interferometer: filter, cyclic error, drift, latency, own samples, and its beam."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sensor_setups import HEALTHY, RATE_HZ, ROUNDING, broken, interferometer_with, times

WAVELENGTH = 6.328e-7
VELOCITY = 1e-3
"""Velocity of ramps, m/s: 20 nm per sample."""
JUST = 1e-6
"""How far above and below a limit, relative to it."""


def _ramp(samples):
    return VELOCITY * times(samples)


def _assert_equal(readings, expected):
    atol = ROUNDING * np.max(np.abs(expected))
    np.testing.assert_allclose(readings, expected, rtol=0.0, atol=atol)


def test_at_the_corner_the_reading_is_3_db_smaller_and_45_degrees_late():
    corner_hz, periods = 100.0, 40
    samples = round(periods * RATE_HZ / corner_hz)
    angle = 2.0 * math.pi * corner_hz * times(samples)
    readings = interferometer_with(bandwidth=corner_hz).readings(np.sin(angle), HEALTHY)
    half = samples // 2
    response = 2.0 * np.mean(readings[half:] * np.exp(-1j * angle[half:])) * 1j
    # The input counts as constant between two samples: half a sample early, 0.36 degrees.
    sample_deg = 360.0 * corner_hz / RATE_HZ
    assert 20.0 * math.log10(abs(response)) == pytest.approx(-3.01, abs=0.03)
    assert np.angle(response, deg=True) == pytest.approx(-45.0, abs=0.6 * sample_deg)


def test_the_cyclic_error_of_a_ramp_repeats_every_half_wavelength():
    amplitude, repeats, samples = 2e-9, 8, 1000
    truth = repeats * WAVELENGTH / 2.0 * np.arange(1, samples + 1) / samples
    sensor = interferometer_with(cyclic_error=amplitude, wavelength=WAVELENGTH)
    spectrum = np.fft.rfft(sensor.readings(truth, HEALTHY) - truth) * 2.0 / samples
    assert np.argmax(np.abs(spectrum)) == repeats
    assert abs(spectrum[repeats]) == pytest.approx(amplitude, rel=1e-9)
    others = np.delete(np.abs(spectrum), repeats)
    assert np.max(others) < 1e-9 * amplitude


def test_the_cyclic_error_is_none_where_the_runner_started():
    sensor = interferometer_with(cyclic_error=2e-9)
    np.testing.assert_array_equal(sensor.readings(np.zeros(10), HEALTHY), np.zeros(10))


def test_the_cyclic_error_follows_the_runner_and_not_the_drift():
    drift, truth = 1e-3, np.full(1000, WAVELENGTH / 8.0)
    sensor = interferometer_with(cyclic_error=2e-9, wavelength=WAVELENGTH, drift=drift)
    readings = sensor.readings(truth, HEALTHY)
    _assert_equal(readings, truth + 2e-9 + drift * times(1000))


@pytest.mark.parametrize('late', [0.0, 0.3, 1.0, 10.3, 2499.9999])
def test_a_reading_is_as_old_as_the_latency_says_to_a_fraction_of_a_sample(late):
    readings = interferometer_with(latency=late / RATE_HZ).readings(_ramp(3000), HEALTHY)
    expected = VELOCITY * np.maximum(0.0, times(3000) - late / RATE_HZ)
    _assert_equal(readings, expected)


def test_a_step_arrives_in_the_samples_on_both_sides_of_the_latency():
    truth = np.where(np.arange(100) < 20, 0.0, 1e-6)
    readings = interferometer_with(latency=10.3 / RATE_HZ).readings(truth, HEALTHY)
    np.testing.assert_array_equal(readings[:30], np.zeros(30))
    _assert_equal(readings[30:32], [0.7e-6, 1e-6])


@pytest.mark.parametrize('rate_hz', [1, 10_000, 17_001, 49_999])
# In doubles 51 samples of latency are a little more than 51 samples.
@pytest.mark.parametrize('late', [Fraction(0), Fraction(7), Fraction(21, 2), Fraction(51)])
def test_own_samples_are_held_until_the_next_one(rate_hz, late):
    samples = 2000
    sensor = interferometer_with(sample_rate=rate_hz, latency=float(late) / RATE_HZ)
    step = Fraction(rate_hz, round(RATE_HZ))
    newest = [max(0, math.floor((i - late) * step)) for i in range(1, samples + 1)]
    expected = VELOCITY * np.array(newest) / rate_hz
    atol = ROUNDING * VELOCITY * samples / RATE_HZ
    readings = sensor.readings(_ramp(samples), HEALTHY)
    np.testing.assert_allclose(readings, expected, rtol=0.0, atol=atol)


@pytest.mark.parametrize('rate_hz', [50_000, 100_000, 10_000_000])
def test_own_samples_at_a_multiple_of_the_rate_of_the_trace_change_nothing(rate_hz):
    _assert_equal(
        interferometer_with(sample_rate=rate_hz).readings(_ramp(500), HEALTHY), _ramp(500)
    )


def test_own_samples_faster_than_the_trace_show_the_newest_one():
    rate_hz = 70_000
    readings = interferometer_with(sample_rate=rate_hz).readings(_ramp(500), HEALTHY)
    _assert_equal(readings, VELOCITY * (np.arange(1, 501) * 7 // 5) / rate_hz)


def test_a_sample_of_its_own_that_is_late_by_a_hair_is_the_count_of_that_time():
    period = 100_000.0 * (1.0 + 5e-10)
    readings = interferometer_with(sample_rate=RATE_HZ / period).readings(_ramp(100_000), HEALTHY)
    np.testing.assert_array_equal(readings[:-1], np.zeros(99_999))
    assert readings[-1] == pytest.approx(_ramp(100_000)[-1], rel=ROUNDING)


@given(st.floats(1e-3, 1e7), st.floats(0.0, 2e-3))
def test_a_reading_is_never_older_than_latency_and_period_together(rate_hz, latency_s):
    sensor = interferometer_with(sample_rate=rate_hz, latency=latency_s)
    age_s = times(300) - sensor.readings(_ramp(300), HEALTHY) / VELOCITY
    slack_s = 1e-8 * (1.0 / RATE_HZ + 1.0 / rate_hz)
    arrived = times(300) > latency_s
    assert np.all(age_s[arrived] >= latency_s - slack_s)
    assert np.all(age_s <= latency_s + 1.0 / rate_hz + slack_s)


def _limited(**settings):
    return interferometer_with(velocity_max=VELOCITY, **settings)


def test_a_runner_just_below_the_limit_keeps_the_beam():
    sensor = _limited()
    truth = np.concatenate([_ramp(100), _ramp(100)[::-1]]) * (1.0 - JUST)
    _assert_equal(sensor.readings(truth, HEALTHY), truth)
    assert not sensor.beam_lost


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_a_runner_just_above_the_limit_loses_the_beam_and_the_reading_stands(sign):
    sensor = _limited()
    slow, fast = 0.5 * _ramp(100), (1.0 + JUST) * _ramp(100)
    truth = sign * np.concatenate([slow, slow[-1] + fast])
    readings = sensor.readings(truth, HEALTHY)
    _assert_equal(readings[:100], truth[:100])
    np.testing.assert_array_equal(readings[100:], np.full(100, readings[99]))
    assert sensor.beam_lost


def test_a_lost_beam_stays_lost_when_the_runner_stops():
    sensor = _limited(noise_density=1e-12)
    sensor.readings(np.zeros(10), HEALTHY)
    jump = sensor.readings(np.full(10, 1e-6), HEALTHY)
    later = sensor.readings(np.full(1000, 1e-6), HEALTHY)
    assert sensor.beam_lost
    np.testing.assert_array_equal(later, np.full(1000, jump[0]))


def test_the_first_sample_has_no_velocity():
    sensor = _limited()
    sensor.readings(np.full(10, 1.0), HEALTHY)
    assert not sensor.beam_lost


def test_zeroing_finds_the_beam_and_counts_anew_from_there():
    sensor = _limited()
    sensor.readings(np.repeat([0.0, 1e-3], 10), HEALTHY)
    sensor.interferometer.zero()
    assert not sensor.beam_lost
    readings = sensor.readings(1e-3 + 0.5 * _ramp(100), HEALTHY)
    np.testing.assert_allclose(readings, 0.5 * _ramp(100), rtol=0.0, atol=ROUNDING * 1e-3)


def test_a_beam_found_while_the_runner_is_too_fast_is_lost_again():
    sensor = _limited()
    truth = 2.0 * _ramp(20)
    sensor.readings(truth[:10], HEALTHY)
    sensor.interferometer.zero()
    np.testing.assert_array_equal(sensor.readings(truth[10:], HEALTHY), np.zeros(10))
    assert sensor.beam_lost


def test_with_a_latency_the_last_counts_still_arrive_after_the_beam_is_lost():
    sensor = _limited(latency=5.0 / RATE_HZ)
    slow = 0.5 * _ramp(20)
    readings = sensor.readings(np.concatenate([slow, np.full(20, 1e-3)]), HEALTHY)
    _assert_equal(readings[:25], np.concatenate([np.zeros(5), slow]))
    np.testing.assert_array_equal(readings[25:], np.full(15, readings[24]))
    sensor.interferometer.zero()
    after = sensor.readings(1e-3 + 0.5 * _ramp(20), HEALTHY)
    expected = np.concatenate([np.zeros(5), 0.5 * _ramp(15)])
    np.testing.assert_allclose(after, expected, rtol=0.0, atol=ROUNDING * 1e-3)


def test_between_own_samples_zeroing_finds_the_beam_too():
    sensor = _limited(sample_rate=RATE_HZ / 5.0)
    sensor.readings(np.repeat([0.0, 1e-3], [1, 6]), HEALTHY)
    sensor.interferometer.zero()
    readings = sensor.readings(np.full(20, 1e-3), HEALTHY)
    np.testing.assert_array_equal(readings, np.zeros(20))


def test_zeroing_finds_the_beam_under_a_jump_of_the_reading():
    sensor, jump = _limited(), broken(interferometer_offset=1e-6)
    sensor.readings(np.repeat([0.0, 1e-3], 10), jump)
    sensor.interferometer.zero()
    np.testing.assert_array_equal(sensor.readings(np.full(5, 1e-3), jump), np.zeros(5))
    expected = np.full(5, -1e-6)
    readings = sensor.readings(np.full(5, 1e-3), HEALTHY)
    np.testing.assert_allclose(readings, expected, rtol=0.0, atol=ROUNDING * 1e-3)


def test_a_frozen_reading_is_zero_after_zeroing_even_if_the_beam_was_lost():
    sensor, frozen = _limited(), broken(interferometer='freeze')
    sensor.readings(np.full(5, 1e-7), HEALTHY)
    sensor.readings(np.full(5, 1e-3), frozen)
    assert sensor.beam_lost
    sensor.interferometer.zero()
    np.testing.assert_array_equal(sensor.readings(np.full(5, 1e-3), frozen), np.zeros(5))
    assert not sensor.beam_lost
    np.testing.assert_array_equal(sensor.readings(np.full(5, 1e-3), HEALTHY), np.zeros(5))
