# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The load cell: low-pass, hysteresis, drift, and the end of its range."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sensor_setups import HEALTHY, ROUNDING, broken, load_cell_with, times

RANGE = 0.8
QUARTER = 400
"""Samples from zero to the end of the range; zero and both ends are hit exactly."""
OPENING = 0.05


def _assert_equal(readings, expected):
    atol = ROUNDING * np.max(np.abs(expected))
    np.testing.assert_allclose(readings, expected, rtol=0.0, atol=atol)


def _way(*corners):
    """Return a way through the corners, in shares of the range, in equal steps."""
    parts: list[np.ndarray] = [np.zeros(1)]
    for start, end in zip((0.0, *corners), corners, strict=False):
        steps = round(abs(end - start) * QUARTER)
        parts.append(np.linspace(start, end, steps + 1)[1:])
    return RANGE * np.concatenate(parts)


@pytest.mark.parametrize('opening', [0.001, OPENING, 0.4])
def test_the_loop_of_the_whole_range_is_as_open_in_the_middle_as_declared(opening):
    sensor = load_cell_with(hysteresis=opening, range=RANGE)
    readings = sensor.readings(_way(1.0, -1.0, 1.0), HEALTHY)
    down, up = readings[2 * QUARTER], readings[4 * QUARTER]
    assert down - up == pytest.approx(opening * RANGE, rel=ROUNDING)
    assert down == pytest.approx(-up, rel=ROUNDING)


def test_the_loop_goes_through_the_ends_of_the_range_with_a_gain_of_one():
    sensor = load_cell_with(hysteresis=OPENING, range=RANGE)
    readings = sensor.readings(_way(1.0, -1.0, 1.0, -1.0), HEALTHY)
    ends = readings[[QUARTER, 3 * QUARTER, 5 * QUARTER, 7 * QUARTER]]
    _assert_equal(ends, RANGE * np.array([1.0, -1.0, 1.0, -1.0]))


def test_the_loop_is_nowhere_wider_than_in_the_middle():
    sensor = load_cell_with(hysteresis=OPENING, range=RANGE)
    readings = sensor.readings(_way(1.0, -1.0, 1.0), HEALTHY)
    down, up = readings[QUARTER : 3 * QUARTER + 1], readings[3 * QUARTER :]
    width = down[::-1] - up
    assert np.max(width) == pytest.approx(width[QUARTER], rel=ROUNDING)
    assert np.min(width) >= -ROUNDING
    assert width[0] == pytest.approx(0.0, abs=ROUNDING)
    assert width[-1] == pytest.approx(0.0, abs=ROUNDING)


def test_a_second_turn_of_the_loop_is_the_first_again():
    sensor = load_cell_with(hysteresis=OPENING, range=RANGE)
    turn = _way(1.0, -1.0, 1.0)
    sensor.readings(turn, HEALTHY)
    first = sensor.readings(turn[QUARTER + 1 :], HEALTHY)
    _assert_equal(sensor.readings(turn[QUARTER + 1 :], HEALTHY), first)


@pytest.mark.parametrize('inner', [0.1, 0.5, 0.9])
def test_a_small_loop_closes_and_is_forgotten(inner):
    sensor = load_cell_with(hysteresis=OPENING, range=RANGE)
    straight = sensor.readings(_way(1.0, -1.0), HEALTHY)
    sensor.reset()
    detour = sensor.readings(_way(1.0, 0.0, inner, 0.0, -1.0), HEALTHY)
    _assert_equal(
        np.delete(detour, np.s_[-QUARTER - 2 * round(inner * QUARTER) : -QUARTER]), straight
    )
    loop = detour[2 * QUARTER : 2 * QUARTER + 2 * round(inner * QUARTER) + 1]
    assert np.max(np.abs(loop[::-1] - loop)) > 0.0


def test_right_after_a_reversal_the_gain_is_one_without_the_opening():
    sensor = load_cell_with(hysteresis=OPENING, range=RANGE)
    readings = sensor.readings(_way(1.0, 0.99), HEALTHY)
    gain = (readings[QUARTER] - readings[-1]) / (0.01 * RANGE)
    assert gain == pytest.approx(1.0 - OPENING, rel=1e-9)


@given(st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=30))
def test_within_the_range_a_reading_is_off_by_half_the_opening_at_most(shares):
    sensor = load_cell_with(hysteresis=OPENING, range=RANGE)
    truth = RANGE * np.array(shares)
    error = np.abs(sensor.readings(truth, HEALTHY) - truth)
    assert np.max(error) <= 0.5 * OPENING * RANGE * (1.0 + ROUNDING)


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_beyond_its_range_the_reading_stands_at_the_end_and_the_flag_tells(sign):
    sensor = load_cell_with(range=RANGE)
    inside, beyond = sign * _way(0.999), sign * RANGE * np.linspace(1.001, 3.0, 50)
    _assert_equal(sensor.readings(inside, HEALTHY), inside)
    assert not sensor.overrange
    _assert_equal(sensor.readings(beyond, HEALTHY), np.full(50, sign * RANGE))
    assert sensor.overrange
    _assert_equal(sensor.readings(inside, HEALTHY), inside)
    assert not sensor.overrange


def test_one_sample_at_the_end_of_the_range_is_enough_for_the_flag():
    sensor = load_cell_with(range=RANGE)
    sensor.readings(np.array([0.0, RANGE, 0.0]), HEALTHY)
    assert sensor.overrange
    sensor.reset()
    assert not sensor.overrange


def test_the_tare_takes_from_one_side_of_the_range_and_adds_to_the_other():
    sensor = load_cell_with(range=RANGE)
    sensor.readings(np.full(5, 0.25 * RANGE), HEALTHY)
    sensor.load_cell.zero()
    readings = sensor.readings(RANGE * np.array([0.25, 2.0, -2.0]), HEALTHY)
    _assert_equal(readings, RANGE * np.array([0.0, 0.75, -1.25]))


def test_a_jump_and_a_drift_of_the_zero_can_overload_it():
    range_n, drift = 0.05, 1e3
    sensor = load_cell_with(range=range_n, drift=drift)
    drifted = np.minimum(drift * times(10), range_n)
    _assert_equal(sensor.readings(np.zeros(10), HEALTHY), drifted)
    assert sensor.overrange
    sensor.reset()
    jump = broken(load_cell_offset=-range_n)
    # From the first sample on, the drift takes the jump back.
    _assert_equal(sensor.readings(np.zeros(2), jump), drift * times(2) - range_n)
    assert not sensor.overrange
    sensor.reset()
    against = broken(load_cell_offset=-2.0 * range_n)
    np.testing.assert_array_equal(sensor.readings(np.zeros(2), against), np.full(2, -range_n))
    assert sensor.overrange
