# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Readings of both sensors: their grid, their zero, their faults, and any cut into blocks."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from sensor_setups import (
    EVERYTHING,
    HEALTHY,
    RATE_HZ,
    ROUNDING,
    SENSORS,
    SIGMAS,
    Sensor,
    broken,
    sensor_with,
    sensor_with_everything,
    shaken,
    times,
)

from stickslip_ros.parameters import Parameters, Spec, specs

UNLIKELY = 1e-6
"""Probability below which an agreement is none; the seed is fixed."""
BLOCK = 50


@pytest.fixture(params=SENSORS)
def name(request):
    return request.param


def _zero(name, sensor):
    getattr(sensor, name).zero()


def _fault(name, word='none', offset=0.0):
    return broken(**{name: word, f'{name}_offset': offset})


def _noisy(name, **settings):
    density = {'interferometer': 1e-11, 'load_cell': 1e-5}[name]
    settings = {'noise_density': density, 'bandwidth': 5e3} | settings
    return sensor_with(name, {f'{name}.{k}': v for k, v in settings.items()})


def test_without_errors_it_reads_the_truth(name):
    truth = np.random.default_rng(0).normal(0.0, 1e-7, 1000)
    readings = sensor_with(name, {}).readings(truth, HEALTHY)
    np.testing.assert_allclose(readings, truth, rtol=0.0, atol=ROUNDING * np.max(np.abs(truth)))


def test_a_step_is_answered_by_an_exponential_that_has_gone_63_percent_after_its_time(name):
    after = 40
    sensor = sensor_with(name, {f'{name}.bandwidth': RATE_HZ / (2.0 * np.pi * after)})
    readings = sensor.readings(np.ones(200), HEALTHY)
    expected = 1.0 - np.exp(-np.arange(1, 201) / after)
    np.testing.assert_allclose(readings, expected, rtol=0.0, atol=ROUNDING)
    assert readings[after - 1] == pytest.approx(0.632, abs=5e-4)


@pytest.mark.parametrize('drift', [1e-3, -2.0])
def test_the_zero_drifts_steadily(name, drift):
    drift *= {'interferometer': 1e-6, 'load_cell': 1.0}[name]
    sensor = sensor_with(name, {f'{name}.drift': drift})
    readings = sensor.readings(np.full(1000, 2e-8), HEALTHY)
    expected = 2e-8 + drift * times(1000)
    atol = ROUNDING * np.max(np.abs(expected))
    np.testing.assert_allclose(readings, expected, rtol=0.0, atol=atol)


@pytest.mark.parametrize('resolution', [1e-12, 1e-9, 1e-5])
def test_every_reading_is_a_multiple_of_the_resolution_next_to_the_truth(name, resolution):
    samples = 20_000
    truth = np.random.default_rng(0).normal(0.0, 1e4 * resolution, samples)
    readings = sensor_with(name, {f'{name}.resolution': resolution}).readings(truth, HEALTHY)
    np.testing.assert_array_equal(readings, np.rint(readings / resolution) * resolution)
    errors = (readings - truth) / resolution
    # 1e5 steps have five digits of the sixteen.
    assert np.max(np.abs(errors)) <= 0.5 + 1e-10
    assert stats.kstest(errors, 'uniform', args=(-0.5, 1.0)).pvalue > UNLIKELY
    # The square of an error that is uniform over a step scatters by 2/sqrt(5) of its mean.
    off = abs(12.0 * np.mean(errors**2) - 1.0)
    assert off < SIGMAS * 2.0 / np.sqrt(5.0 * samples)


def test_the_low_pass_works_on_unrounded_values(name):
    sensor = sensor_with(name, {f'{name}.bandwidth': 10.0, f'{name}.resolution': 1e-3})
    readings = sensor.readings(np.full(100_000, 9e-4), HEALTHY)
    assert readings[0] == 0.0
    assert readings[-1] == 1e-3


@pytest.mark.parametrize('resolution', [1e-30, 5e-324])
def test_a_resolution_far_below_the_reading_is_no_worse_than_none(name, resolution):
    truth = np.array([1e-7, -3e-8])
    readings = sensor_with(name, {f'{name}.resolution': resolution}).readings(truth, HEALTHY)
    np.testing.assert_allclose(readings, truth, rtol=ROUNDING)


def test_zeroing_makes_the_present_reading_zero_with_the_noise_that_is_in_it(name):
    plain, zeroed = _noisy(name), _noisy(name)
    truth = np.full(BLOCK, 3e-4)
    present = plain.readings(truth, HEALTHY)[-1]
    zeroed.readings(truth, HEALTHY)
    _zero(name, zeroed)
    expected = plain.readings(truth, HEALTHY) - present
    np.testing.assert_array_equal(zeroed.readings(truth, HEALTHY), expected)


def test_zeroing_twice_takes_the_later_reading(name):
    sensor = sensor_with(name, {})
    for level in (1e-4, 3e-4):
        sensor.readings(np.full(BLOCK, level), HEALTHY)
        _zero(name, sensor)
    readings = sensor.readings(np.full(BLOCK, 4e-4), HEALTHY)
    np.testing.assert_allclose(readings, 1e-4, rtol=ROUNDING)


def test_readings_are_on_the_grid_after_zeroing_too(name):
    sensor = _noisy(name, resolution=1e-9)
    sensor.readings(np.full(BLOCK, 1.2345e-6), HEALTHY)
    _zero(name, sensor)
    readings = sensor.readings(np.full(BLOCK, 1.2345e-6), HEALTHY)
    np.testing.assert_array_equal(readings, np.rint(readings / 1e-9) * 1e-9)


def test_zeroing_before_the_first_reading_changes_nothing(name):
    plain, zeroed = _noisy(name), _noisy(name)
    _zero(name, zeroed)
    truth = np.full(BLOCK, 3e-4)
    np.testing.assert_array_equal(zeroed.readings(truth, HEALTHY), plain.readings(truth, HEALTHY))


@pytest.mark.parametrize('word', ['none', 'freeze', 'dropout'])
@pytest.mark.parametrize('offset', [0.0, 2e-3])
def test_after_a_fault_the_sensor_reads_as_if_it_had_gone_on_all_the_time(name, word, offset):
    faulty, healthy = sensor_with_everything(name), sensor_with_everything(name)
    fault = _fault(name, word, offset)
    for i, block in enumerate(np.split(shaken(name, 20 * BLOCK), 20)):
        broken = 5 <= i < 12
        readings = faulty.readings(block, fault if broken else HEALTHY)
        expected = healthy.readings(block, HEALTHY)
        if broken and (word, offset) != ('none', 0.0):
            assert not np.array_equal(readings, expected)
        else:
            assert readings.tobytes() == expected.tobytes()


@pytest.mark.parametrize('offset', [0.0, 1e-3])
def test_a_frozen_reading_stands_at_the_last_one_and_does_not_jump(name, offset):
    sensor, frozen = _noisy(name), _fault(name, 'freeze', offset)
    last = sensor.readings(np.full(BLOCK, 1e-4), HEALTHY)[-1]
    for _ in range(3):
        readings = sensor.readings(np.full(BLOCK, 2e-4), frozen)
        np.testing.assert_array_equal(readings, np.full(BLOCK, last))


def test_a_sensor_frozen_from_the_start_on_reads_zero(name):
    readings = _noisy(name).readings(np.full(BLOCK, 1e-4), _fault(name, 'freeze'))
    np.testing.assert_array_equal(readings, np.zeros(BLOCK))


def test_a_sensor_that_dropped_out_reads_no_number(name):
    readings = _noisy(name, resolution=1e-9).readings(
        np.zeros(BLOCK), _fault(name, 'dropout', 1e-3)
    )
    assert np.all(np.isnan(readings))


@pytest.mark.parametrize('offset', [5e-4, -2e-9])
def test_a_jump_is_added_to_the_reading_before_it_is_quantised(name, offset):
    plain, jumped = _noisy(name), _noisy(name)
    coarse = _noisy(name, resolution=1e-6)
    truth, fault = np.full(BLOCK, 1e-4), _fault(name, offset=offset)
    shifted = plain.readings(truth, HEALTHY) + offset
    np.testing.assert_array_equal(jumped.readings(truth, fault), shifted)
    np.testing.assert_array_equal(coarse.readings(truth, fault), np.rint(shifted / 1e-6) * 1e-6)


def test_the_fault_of_one_sensor_is_none_of_the_other(name):
    (other,) = set(SENSORS) - {name}
    truth, fault = np.full(BLOCK, 1e-4), _fault(other, 'dropout', 1e-3)
    np.testing.assert_array_equal(
        _noisy(name).readings(truth, fault), _noisy(name).readings(truth, HEALTHY)
    )


def test_zeroing_under_a_jump_makes_the_reading_zero_and_the_end_of_the_jump_is_seen(name):
    sensor, jump = sensor_with(name, {}), _fault(name, offset=1e-3)
    sensor.readings(np.zeros(BLOCK), jump)
    _zero(name, sensor)
    np.testing.assert_array_equal(sensor.readings(np.zeros(BLOCK), jump), np.zeros(BLOCK))
    np.testing.assert_array_equal(sensor.readings(np.zeros(BLOCK), HEALTHY), np.full(BLOCK, -1e-3))


def test_zeroing_while_dropped_out_takes_what_the_sensor_would_read(name):
    sensor = sensor_with(name, {})
    sensor.readings(np.full(BLOCK, 1e-4), _fault(name, 'dropout'))
    _zero(name, sensor)
    np.testing.assert_array_equal(sensor.readings(np.full(BLOCK, 1e-4), HEALTHY), np.zeros(BLOCK))


@pytest.fixture(scope='module')
def whole():
    """Give the readings of one long call, with all errors."""
    return {
        name: sensor_with_everything(name).readings(shaken(name, 600), HEALTHY) for name in SENSORS
    }


@given(cuts=st.lists(st.integers(0, 600), max_size=20))
def test_blocks_of_any_size_give_the_bytes_of_one_long_call(name, whole, cuts):
    sensor = sensor_with_everything(name)
    parts = np.split(shaken(name, 600), sorted(cuts))
    readings = np.concatenate([sensor.readings(part, HEALTHY) for part in parts])
    assert readings.tobytes() == whole[name].tobytes()


@pytest.mark.parametrize('word', ['none', 'freeze', 'dropout'])
def test_a_reset_sensor_gives_the_same_bytes_again(name, word, whole):
    sensor = sensor_with_everything(name)
    truth = shaken(name, 600)
    sensor.readings(truth, _fault(name, word, 1e-3))
    _zero(name, sensor)
    sensor.readings(truth[:77], _fault(name, word))
    sensor.reset()
    assert sensor.readings(truth, HEALTHY).tobytes() == whole[name].tobytes()


@pytest.mark.parametrize('setting', EVERYTHING)
def test_each_of_all_errors_at_once_changes_the_readings(setting, whole):
    name = setting.split('.')[0]
    # Without a range there is no hysteresis either.
    off = {'load_cell.hysteresis': 0.0} if setting == 'load_cell.range' else {}
    sensor = sensor_with_everything(name, {setting: 0.0} | off)
    assert not np.array_equal(sensor.readings(shaken(name, 600), HEALTHY), whole[name])


def _values(spec: Spec) -> st.SearchStrategy:
    return st.sampled_from([spec.minimum, spec.maximum]) | st.floats(spec.minimum, spec.maximum)


SETTINGS = st.fixed_dictionaries(
    {'trace.sample_rate': st.sampled_from([1e3, 50e3, 1e6])},
    optional={
        parameter: _values(spec)
        for parameter, spec in specs().items()
        if parameter.startswith(tuple(SENSORS))
        and spec.kind is float
        and parameter != 'load_cell.resonance'  # a mass of the drive, 0 or from 1 Hz on
    },
)


@given(settings=SETTINGS, full_scale_n=st.floats(1e-6, 1e6))
def test_any_allowed_setting_gives_readings_that_are_numbers(name, settings, full_scale_n):
    if settings.get('load_cell.hysteresis'):
        settings['load_cell.range'] = full_scale_n
    whole = {'trace.period': 0.1, 'sim.block': 0.1}
    sensor = Sensor(name, Parameters().updated(settings | whole))
    assert np.all(np.isfinite(sensor.readings(shaken(name, 200), HEALTHY)))
