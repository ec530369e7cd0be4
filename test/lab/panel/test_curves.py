# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""No peak is lost on the way to the picture, and the scope stands still on the fall."""

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as of_numpy

from stickslip_ros.arrays import Array
from stickslip_ros.drive.records import VOLTAGE
from stickslip_ros.lab.drawing.film import steep_edges
from stickslip_ros.lab.panel.curves import (
    BINS,
    POSITION_READING,
    RECENT,
    SAMPLE_COLUMNS,
    BinHistory,
    SampleRing,
    Scope,
    curve_of,
    table_within,
    thinned_curves,
)

RATE_HZ = 50e3
FORCE = SAMPLE_COLUMNS.index('force')


def sawtooth_samples(seconds: float, frequency_hz: float = 1e3, start_s: float = 0.0):
    """Give samples of a saw-tooth of 300 V, whose fall is shorter than a sample."""
    time_s = start_s + np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    phase = (time_s * frequency_hz + 1e-9) % 1.0
    voltage = 300.0 * phase
    samples = np.full((len(time_s), len(SAMPLE_COLUMNS)), np.nan)
    samples[:, : FORCE + 1] = np.column_stack(
        [time_s, voltage, voltage / 2e9, time_s * 1e-6, 0.01 + 0.0 * time_s]
    )
    return samples


@pytest.mark.parametrize('sizes', [[1] * 40, [3, 4, 5, 6, 7], [10, 10, 10], [23, 2]])
def test_a_ring_keeps_the_last_rows_in_order(sizes: list[int]):
    ring, count = SampleRing(2, 10), 0
    for size in sizes:
        rows = np.arange(count, count + size)
        ring.append(np.column_stack([rows, -rows]))
        count += size
        kept = np.arange(max(0, count - 10), count)
        assert ring.rows[:, 0].tolist() == kept.tolist()
    ring.clear()
    assert len(ring.rows) == 0


@pytest.mark.parametrize('count', [2 * BINS + 1, 1995, 2000, 2003, 12_345])
def test_times_of_a_curve_rise_however_few_samples_a_bin_has(count: int):
    rng = np.random.default_rng(count)
    x = np.cumsum(0.5 + rng.random(count)) * 5e-3
    curve = curve_of(x - x[-1], rng.random(count))
    assert (np.diff(curve.x) > 0.0).all()
    assert len(curve.x) <= 2 * BINS
    assert curve.x[0] == pytest.approx(x[0] - x[-1])
    assert curve.x[-1] <= 0.0


SAMPLES = of_numpy.arrays(
    np.float64,
    st.integers(2 * BINS, 4 * BINS),
    elements=st.integers(-300, 300).map(float) | st.sampled_from([0.0, 300.0, np.nan]),
    fill=st.integers(-9, 9).map(float),
)


def assert_draws(curve, x, y):
    """Assert that a curve is samples in their order, with the ends and extremes of each bin."""
    places = np.searchsorted(x.astype(np.float32), curve.x)
    assert (np.diff(places) > 0).all()  # so that no rise or fall is drawn that they lack
    np.testing.assert_array_equal(curve.x, x[places].astype(np.float32))
    np.testing.assert_array_equal(curve.y, y[places].astype(np.float32))
    assert places[[0, -1]].tolist() == [0, len(x) - 1]
    bins = np.floor((x - x[0]) * ((BINS - 1) / (x[-1] - x[0])))
    for number in np.unique(bins):
        inside, drawn = y[bins == number], y[places][bins[places] == number]
        if np.isfinite(inside).any():
            assert np.nanmin(drawn) == np.nanmin(inside)
            assert np.nanmax(drawn) == np.nanmax(inside)
        else:
            assert len(drawn)


@given(SAMPLES, st.integers(0, 2**32 - 1))
def test_every_drawn_point_is_a_sample_in_its_order_and_no_extreme_is_lost(y, seed):
    random = np.random.default_rng(seed)
    x = 2e-5 * np.cumsum(random.integers(1, 20, len(y))).astype(float)
    other = random.permutation(y)
    curves = thinned_curves(x, {'one': (y, 0.0), 'other': (other, 0.0)})
    for name, values in (('one', y), ('other', other)):
        assert_draws(curves[name], x, values)
    assert curves['one'].x is curves['other'].x  # the page draws a lane over one x


def test_a_clean_sawtooth_of_many_samples_falls_once_a_cycle():
    time_s = (20e-6 * np.arange(1600)).astype(float)
    voltage_v: Array = 300.0 * np.mod(time_s + 0.00165, 0.01) / 0.01
    changes = np.diff(curve_of(time_s, voltage_v, 0.0).y)
    assert (changes > 100.0).sum() == 0
    assert (changes < -100.0).sum() == 3


def test_the_history_of_a_motion_down_never_rises():
    samples = sawtooth_samples(2.0)
    samples[:, POSITION_READING] *= -1.0
    history = BinHistory()
    for begin in range(0, len(samples), 777):
        history.add_all(samples[begin : begin + 777])
    curve = history.curves(2.0, 10.0)['position']
    assert (np.diff(curve.y) <= 0.0).all()
    assert curve.x[-1] == pytest.approx(0.0, abs=2.1 / RATE_HZ)


def test_a_saved_table_has_every_sample_of_the_picture():
    samples = sawtooth_samples(0.2, 100.0)
    picture = Scope().picture(samples, 3)
    text = table_within('oscilloscope', samples, picture.at_s, picture.start_s, picture.end_s)
    names, table = (
        text.partition('\n')[0],
        np.loadtxt(io.StringIO(text), delimiter=',', skiprows=1),
    )
    assert names == 'time_s,position_m,foot_m,voltage_v'
    assert len(table) == round((picture.end_s - picture.start_s) * RATE_HZ) + 1 > 2 * BINS > 1
    shown = np.isclose(samples[:, 0][:, None], table[:, 0] + picture.at_s, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(table[:, 3], samples[shown.any(axis=1), VOLTAGE], rtol=1e-11)


def test_a_nanometre_is_seen_at_a_position_of_five_millimetres():
    y = np.array([5e-3, 5e-3 + 1e-9, 5e-3])
    curve = curve_of(np.array([0.0, 1.0, 2.0]), y)
    assert float(curve.y[1]) == pytest.approx(1e-9, rel=1e-6)


def test_readings_that_are_no_numbers_break_the_curve_and_nothing_else():
    x, y = np.arange(10 * BINS) / 1.0, np.ones(10 * BINS)
    y[4000:5000] = np.nan
    y[10] = np.nan
    curve = curve_of(x, y)
    assert np.isnan(curve.y[np.isclose(curve.x, 4500.0, atol=9.0)]).all()
    assert not np.isnan(curve.y[:100]).any()


@pytest.mark.parametrize('frequency_hz', [777.0, 4000.0])
@pytest.mark.parametrize('sign', [1, -1])
def test_edges_are_the_falls_of_a_sawtooth_or_the_rises_of_one_that_runs_backwards(
    frequency_hz: float, sign: int
):
    voltage: Array = sawtooth_samples(0.1, frequency_hz)[::sign, VOLTAGE]
    edges = steep_edges(voltage)
    assert len(edges) == pytest.approx(0.1 * frequency_hz, abs=1)
    assert (sign * np.diff(voltage)[edges] < -200.0).all()


def test_what_is_no_sawtooth_has_no_edges():
    rises: list[Array] = [np.zeros(500), np.array([0.0, 9.0, 18.0]), np.array([0.0, 9.0, 9.0])]
    assert [len(steep_edges(each)) for each in rises] == [0, 0, 0]


@pytest.mark.parametrize('cycles', [1, 3, 10])
def test_the_picture_stands_still_while_time_goes_on(cycles: int):
    samples, scope = sawtooth_samples(0.2), Scope()
    pictures = [scope.picture(samples[: 9000 + more], cycles) for more in range(0, 60, 7)]
    for picture in pictures:
        assert picture.period_s == pytest.approx(1e-3, rel=1e-6)
        assert (picture.start_s, picture.end_s) == pytest.approx(
            (pictures[0].start_s, pictures[0].end_s), abs=1e-9
        )
        assert picture.end_s == pytest.approx(1e-3 * (cycles + 0.15), abs=2.1e-5)
        assert picture.curves['voltage'].y.tolist() == pytest.approx(
            pictures[0].curves['voltage'].y.tolist(), abs=0.01
        )
    assert len({round(picture.at_s * 1e6) for picture in pictures}) > 1


def test_runner_and_foot_begin_together_before_the_fall():
    picture = Scope().picture(sawtooth_samples(0.2), 2)
    for name in ('runner', 'foot'):
        curve = picture.curves[name]
        assert curve.y[np.searchsorted(curve.x, 0.0)] == 0.0
        assert curve.base > 0.0


def test_a_slow_sawtooth_is_found_in_more_samples():
    picture = Scope().picture(sawtooth_samples(5.2, 1.0), 2)
    assert picture.period_s == pytest.approx(1.0, rel=1e-3)


def test_the_last_cycles_are_held_when_the_drive_rests_until_time_starts_anew():
    moving, scope = sawtooth_samples(0.01), Scope()
    resting = sawtooth_samples(0.5, start_s=0.01)
    resting[:, VOLTAGE] = 0.0
    both = np.concatenate([moving, resting])
    held = scope.picture(moving, 3)
    assert scope.picture(both, 3).at_s == held.at_s
    scope.clear()
    quiet = resting[-RECENT[0] :]
    assert scope.picture(quiet, 3).period_s == 0.0


@pytest.mark.parametrize('swing_v', [300.0, 1.0])
def test_what_trembles_at_rest_is_no_sawtooth_and_a_small_one_after_it_is(swing_v: float):
    moving, scope = sawtooth_samples(0.2), Scope()
    moving[:, VOLTAGE] *= swing_v / 300.0
    held = scope.picture(moving, 3)
    tremor = sawtooth_samples(0.5, 200.0, start_s=0.2)
    tremor[:, VOLTAGE] *= 0.6 * min(1.0, 0.03 * swing_v) / 300.0
    assert scope.picture(np.concatenate([moving, tremor]), 3).at_s == held.at_s
    assert scope.picture(tremor[-RECENT[0] :], 3).at_s == held.at_s  # also when it is long ago
    small = sawtooth_samples(0.5, 200.0, start_s=0.2)
    small[:, VOLTAGE] *= 2.0 * min(1.0, 0.03 * swing_v) / 300.0
    assert scope.picture(np.concatenate([moving, small]), 3).period_s == pytest.approx(5e-3)


@pytest.mark.parametrize('gap', [False, True])
def test_the_noise_of_a_foreign_voltage_is_rest_and_no_sawtooth(gap: bool):
    moving, scope = sawtooth_samples(0.5), Scope()
    resting = sawtooth_samples(5.5, start_s=0.5)
    resting[:, VOLTAGE] = 0.0
    both = np.concatenate([moving, resting])
    both[:, VOLTAGE] += 0.5 * np.random.default_rng(1).standard_normal(len(both))
    both[len(moving) - 900 :: 7000, VOLTAGE] = np.nan if gap else 0.0
    assert scope.picture(both[-RECENT[0] :], 3).period_s == 0.0
    held = scope.picture(both[: len(moving)], 3)
    assert held.period_s == pytest.approx(1e-3, rel=1e-3)
    for end in (len(moving) + RECENT[0], len(both)):
        assert scope.picture(both[:end][-RECENT[-1] :], 3).at_s == held.at_s
    both[:, VOLTAGE] = np.nan
    assert scope.picture(both, 3).period_s == 0.0


def test_slow_samples_without_falls_are_a_curve_not_a_point():
    samples = sawtooth_samples(0.02)
    samples[:, 0] *= 5e3  # 10 Hz
    samples[:, VOLTAGE] = np.nan
    picture = Scope().picture(samples, 3)
    assert len(picture.curves['runner'].x) == 50
    assert picture.start_s == pytest.approx(-4.9)


def test_nothing_gives_no_picture():
    assert Scope().picture(np.empty((0, 5)), 3) is None
    assert BinHistory().curves(1.0, 10.0) == {}


@pytest.mark.parametrize('block', [50, 500, 2500])
def test_the_history_has_the_extremes_of_every_hundredth_of_a_second(block: int):
    samples = sawtooth_samples(1.0)
    samples[30_000, POSITION_READING], samples[40_000, FORCE] = 1.0, -1.0
    history = BinHistory()
    for begin in range(0, len(samples), block):
        history.add_all(samples[begin : begin + block])
    rows = history.samples.rows
    assert 100 <= len(rows) <= 500  # of two sensors, or of equal readings the first
    times = np.searchsorted(samples[:, 0], rows[:, 0])
    np.testing.assert_array_equal(rows, samples[times])
    curves = history.curves(1.0, 10.0)
    assert np.max(curves['position'].y) == pytest.approx(1.0)
    assert curves['position'].x[np.argmax(curves['position'].y)] == pytest.approx(-0.4, abs=0.02)
    assert np.min(curves['force'].y) == pytest.approx(-1.01)
    short = history.curves(1.0, 0.2)
    assert float(short['position'].x[0]) == pytest.approx(-0.2, abs=0.02)
