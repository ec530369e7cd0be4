# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Waves recognised in samples of noisy monitors, with their true corners, or refused."""

import math
import re

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from monitors import SLEW_V_PER_S, corners_of, hold, ramp, sampled, saw

from stickslip_ros.drive.advance import advance
from stickslip_ros.drive.build import plant_of, state_at_rest
from stickslip_ros.drive.waveform import table
from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.lab.waveform.recognise import (
    AS_SAMPLED,
    HOLD,
    RAMP,
    SAWTOOTH,
    NotRecognised,
    RecognisedWave,
    Segment,
    recognise,
)
from stickslip_ros.lab.waveform.wave_piece import WavePiece
from stickslip_ros.parameters import Parameters

STAND = Parameters()
AWKWARD = saw(87.3, 113.76725643485543, 17)
COURSE = [
    hold(0.005),
    ramp(60.0, 0.004),
    ramp(0.0, 0.004),
    hold(0.004),
    saw(280.0, 300.0, 10),
    hold(0.004),
    saw(300.0, -610.3, 12),
    hold(0.004),
    AWKWARD,
    hold(0.005),
]
DEVIATIONS = 6.0
"""Of fitted values from the true ones, in standard errors: once in 5e8 values by chance."""


def sawteeth(found: RecognisedWave) -> list:
    return [each for each in found.segments if each.kind == SAWTOOTH]


def assert_sawteeth(found: RecognisedWave, truth, noise_v: float) -> None:
    assert found.refusals == ()
    assert len(sawteeth(found)) == len(truth)
    for each, (_, amplitude_v, frequency_hz, cycles) in zip(sawteeth(found), truth, strict=True):
        assert each.cycles == cycles
        # falls divide the samples: half of them lie on either side of the mean phase
        error_v = noise_v * math.sqrt(12.0 / each.samples)
        assert each.piece.amplitude_v == pytest.approx(amplitude_v, abs=DEVIATIONS * error_v)
        error_hz = error_v / amplitude_v * abs(frequency_hz)
        assert each.piece.frequency_hz == pytest.approx(frequency_hz, abs=DEVIATIONS * error_hz)


@pytest.mark.parametrize('rate_hz', [5000.0, 10000.0])
def test_at_a_multiple_of_its_frequency_a_full_stroke_keeps_within_the_rails(rate_hz):
    course = [saw(300.0, 500.0, 100)]
    found = recognise(*sampled(corners_of(course), rate_hz, 0.05, seed=1), STAND)
    [tooth] = sawteeth(found)
    assert (tooth.piece.base_v, tooth.piece.amplitude_v) == pytest.approx((0.0, 300.0), abs=0.1)
    assert found.refusals == ()


@pytest.mark.parametrize('noise_v', [0.02, 0.5])
@pytest.mark.parametrize('rate_hz', [10000.0, 16000.0])
@pytest.mark.parametrize('frequency_hz', [500.0, 1000.0])
def test_samples_in_step_with_the_wave_may_lie_at_its_corners(frequency_hz, rate_hz, noise_v):
    truth = corners_of([hold(0.01), saw(200.0, frequency_hz, 40), hold(0.01)])
    times_s = np.arange(0.0, truth[-1, 0], 1.0 / rate_hz)
    noise = noise_v * np.random.default_rng(1).standard_normal(len(times_s))
    found = recognise(times_s, np.interp(times_s, *truth.T) + noise, STAND)
    assert found.refusals == ()
    [tooth] = sawteeth(found)
    assert (tooth.cycles, tooth.start_s) == pytest.approx((40.0, 0.01), abs=1e-4)


@pytest.mark.parametrize('noise_v', [0.05, 0.75])
@pytest.mark.parametrize('rate_hz', [6200.0, 8000.0, 20000.0, 50000.0])
def test_a_course_of_saw_teeth_triangles_and_holds_is_recognised(rate_hz, noise_v):
    times_s, volts_v = sampled(corners_of(COURSE), rate_hz, noise_v, seed=1)
    found = recognise(times_s, volts_v, STAND)
    assert_sawteeth(found, [each for each in COURSE if each[0] == 'saw'], noise_v)
    kinds = [HOLD, RAMP, RAMP, HOLD, SAWTOOTH, HOLD, SAWTOOTH, HOLD, SAWTOOTH, HOLD]
    assert [each.kind for each in found.segments] == kinds


@pytest.mark.parametrize(
    'trouble',
    [
        {'jitter_s': 5e-6},
        {'late_s': 5e-6},
        {'dropped': 0.1},
        {'gaps_s': [(0.03, 0.04), (0.0585, 0.0595)]},
    ],
)
def test_jitter_late_stamps_drops_and_gaps_leave_cycles_and_heights_as_they_are(trouble):
    times_s, volts_v = sampled(corners_of(COURSE), 8000.0, 0.1, seed=2, **trouble)
    found = recognise(times_s, volts_v, STAND)
    truth = [each for each in COURSE if each[0] == 'saw']
    # a stamp that is 5 us off is off by the slope of the steepest ramp
    assert_sawteeth(found, truth, 0.1 + 5e-6 * 300.0 * 610.3)


@pytest.mark.parametrize(
    ('rate_hz', 'frequency_hz'),
    [(2000.0, 300.0), (2000.0, 610.3), (5000.0, 610.3), (5000.0, 900.0)],
)
@pytest.mark.parametrize('noise_v', [0.05, 0.75])
def test_a_monitor_with_fewer_than_ten_samples_a_cycle_is_refused_with_value_limit_and_remedy(
    rate_hz, frequency_hz, noise_v
):
    wave = corners_of([hold(0.01), saw(280.0, frequency_hz, 30), hold(0.01)])
    found = recognise(*sampled(wave, rate_hz, noise_v, seed=4), STAND)
    with pytest.raises(NotRecognised) as refused:
        found.corners()
    [refusal] = refused.value.refusals
    words = re.fullmatch(
        r'a monitor of (\S+) Hz takes (\S+) samples in a cycle of (\S+) Hz, '
        r'below the 10 \((\S+) Hz\) that show it',
        refusal,
    )
    assert words, refusal
    expected = rate_hz, rate_hz / frequency_hz, frequency_hz, 10.0 * frequency_hz
    assert [float(each) for each in words.groups()] == pytest.approx(expected, rel=0.01)
    assert str(refused.value).endswith('; give the commands with --commands (Python: commands)')


def test_corners_are_those_of_the_wave_with_falls_at_the_slew_rate():
    truth = corners_of(COURSE)
    found = recognise(*sampled(truth, 8000.0, 0.05, seed=4), STAND)
    times_s, volts_v = found.corners().T
    assert (np.diff(times_s) > 0.0).all()
    slopes = np.diff(volts_v) / np.diff(times_s)
    falls = np.abs(slopes) > 0.5 * SLEW_V_PER_S
    assert falls.sum() == 10 + 12 + 17
    assert np.abs(slopes[falls]) == pytest.approx(SLEW_V_PER_S, rel=1e-3)
    # a corner's time is as sure as the noise over the slope
    near_s = 5e-6
    grid_s = np.linspace(times_s[0], times_s[-1], 100_001)
    wave_v = np.interp(grid_s, times_s, volts_v)
    around_v = [np.interp(grid_s + off_s, *truth.T) for off_s in (-near_s, 0.0, near_s)]
    off_v = np.maximum(np.min(around_v, 0) - wave_v, wave_v - np.max(around_v, 0))
    assert off_v.max() < 0.3


def test_a_curve_is_played_as_it_is_where_it_is_sampled_fast_and_refused_where_not():
    times_s = np.arange(0.0, 0.2, 2e-5)
    curve_v = 150.0 - 150.0 * np.cos(2.0 * np.pi * 400.0 * times_s)
    noisy_v = curve_v + 0.05 * np.random.default_rng(9).standard_normal(len(times_s))
    fast = recognise(times_s, noisy_v, STAND)
    played_s, played_v = fast.corners().T
    assert np.abs(np.interp(times_s, played_s, played_v) - curve_v).max() < 0.02 * 300.0
    assert {each.kind for each in fast.segments} <= {AS_SAMPLED, RAMP, HOLD}
    slow = recognise(times_s[::25], noisy_v[::25], STAND)
    assert slow.refusals


def random_volts(seed: int) -> tuple[np.ndarray, np.ndarray]:
    return np.arange(600) / 5000.0, 300.0 * np.random.default_rng(seed).random(600)


def changing_heights() -> tuple[np.ndarray, np.ndarray]:
    """Give saw-teeth each of another height."""
    cycles = 250.0 * np.arange(2000) / 5000.0
    heights_v = np.random.default_rng(18).uniform(100.0, 300.0, 101)[cycles.astype(int)]
    return np.arange(2000) / 5000.0, heights_v * (cycles % 1.0)


@pytest.mark.parametrize(
    'samples',
    [
        *map(random_volts, range(6)),
        changing_heights(),
        sampled(corners_of([hold(0.01), saw(1.0, 300.0, 60), hold(0.01)]), 5000.0, 0.4, seed=10),
    ],
)
def test_samples_that_are_no_wave_or_within_the_noise_are_refused(
    samples: tuple[np.ndarray, np.ndarray],
):
    assert recognise(*samples, STAND).refusals


def test_samples_may_come_in_any_order_with_gaps_of_nan_and_a_few_beyond_the_rails():
    times_s, volts_v = sampled(corners_of(COURSE), 8000.0, 0.1, seed=11)
    whole = recognise(times_s, volts_v, STAND)
    volts_v[[50, 300]] = np.nan, 4000.0
    order = np.random.default_rng(11).permutation(len(times_s))
    found = recognise(times_s[order], volts_v[order], STAND)
    assert [each.cycles for each in found.segments] == [each.cycles for each in whole.segments]
    assert any('2 samples left out' in each for each in found.notes)


def test_noise_beyond_the_rails_is_clipped_and_counted():
    found = recognise(*sampled(corners_of(COURSE), 8000.0, 0.75, 12), STAND)
    _, volts_v = found.corners().T
    assert volts_v.min() >= 0.0
    assert volts_v.max() <= 300.0
    assert any('clipped' in each for each in found.notes)


@pytest.mark.parametrize(
    ('times_s', 'volts_v', 'error', 'words'),
    [
        (np.arange(10.0), np.arange(10.0), OutOfRange, 'number of samples 10'),
        (np.arange(30.0), np.arange(29.0), WrongKind, 'shapes'),
        (np.arange(30.0), np.full(30, 4500.0), OutOfRange, 'rails 0 and 300 V'),
        (np.full(30, np.nan), np.arange(30.0), OutOfRange, 'number of samples 0'),
    ],
)
def test_samples_that_cannot_be_a_monitor_are_refused_with_value_and_limit(
    times_s, volts_v, error, words
):
    with pytest.raises(error, match=words):
        recognise(times_s, volts_v, STAND)


def moved_m(corners: np.ndarray) -> float:
    """Give the way that a free runner makes by a voltage, from rest."""
    stand = STAND.updated({'load_cell.contact': 'absent', 'runner.damping': 20.0})
    plants = plant_of(stand)
    states = state_at_rest(plants, 0.5)
    lasts_s = float(corners[-1, 0] - corners[0, 0])
    wave = table(corners - corners[0] * (1.0, 0.0))
    advance(plants, states, wave, 0.0, lasts_s, np.empty((1, 3)))
    return float(states['position_m'].item())


@pytest.mark.parametrize(('rate_hz', 'share'), [(6200.0, 1e-3), (20000.0, 1e-3)])
def test_a_runner_goes_as_far_by_the_recognised_wave_as_by_the_true_one(rate_hz, share):
    steps = [saw(280.0, 300.0, 10), hold(0.004), saw(300.0, 600.0, 12), hold(0.004)]
    wave = corners_of([hold(0.005), *steps])
    times_s, volts_v = sampled(wave, rate_hz, 0.1, seed=13)
    true_m = moved_m(wave)
    found = recognise(times_s, volts_v, STAND)
    assert moved_m(found.corners()) == pytest.approx(true_m, rel=share)
    naive_m = moved_m(np.column_stack((times_s, np.clip(volts_v, 0.0, 300.0))))
    assert naive_m != pytest.approx(true_m, rel=0.3)


@pytest.mark.parametrize('rate_hz', [3100.0, 5000.0, 20000.0, 50000.0])
def test_bursts_of_two_steps_are_saw_teeth(rate_hz):
    burst = saw(280.0, 301.7, 2)
    samples = sampled(corners_of([hold(0.02), burst, hold(0.02)]), rate_hz, 0.1, seed=14)
    assert_sawteeth(recognise(*samples, STAND), [burst], 0.1)


def test_the_top_of_a_single_step_needs_a_monitor_that_sees_it():
    wave = corners_of([hold(0.02), saw(280.0, 300.0, 1), hold(0.02)])
    slow = recognise(*sampled(wave, 5000.0, 0.1, seed=15), STAND)
    assert any(
        'jumps by' in each and 'record the voltage faster' in each for each in slow.refusals
    )
    _, volts_v = recognise(*sampled(wave, 50000.0, 0.1, seed=15), STAND).corners().T
    # it fell somewhere between two samples, in which the ramp rises by 1.7 V
    assert volts_v.max() == pytest.approx(280.0, abs=1.7)


def test_a_spline_with_falls_is_played_with_falls_at_the_slew_rate():
    times_s = np.arange(0.0, 0.1, 2e-5)
    curve_v = 280.0 * (200.0 * times_s % 1.0) ** 1.5
    noisy_v = curve_v + 0.1 * np.random.default_rng(17).standard_normal(len(times_s))
    played_s, played_v = recognise(times_s, noisy_v, STAND).corners().T
    off_v = np.abs(np.interp(times_s, played_s, played_v) - curve_v)
    # two per cent of a fall, which is as long as the one between two samples that nobody saw
    assert np.quantile(off_v, 0.99) < 0.02 * 280.0
    slopes = np.diff(played_v) / np.diff(played_s)
    assert np.sum(slopes < -0.9 * SLEW_V_PER_S) == 19


@pytest.mark.parametrize('frequency_hz', [1000.0, 20000.0])
def test_samples_of_a_megahertz_are_thinned(frequency_hz):
    wave = corners_of([hold(0.001), saw(280.0, frequency_hz, 5), hold(0.001)])
    thinned = recognise(*sampled(wave, 1e6, 0.1, seed=19), STAND)
    assert_sawteeth(thinned, [saw(280.0, frequency_hz, 5)], 0.1)


def test_samples_that_show_falls_are_played_as_they_are():
    wave = corners_of([hold(0.001), saw(280.0, 1000.0, 5), hold(0.001)])
    times_s, volts_v = sampled(wave, 1e7, 0.1, seed=19)
    whole = recognise(times_s, volts_v, STAND)
    assert [each.kind for each in whole.segments] == [AS_SAMPLED]
    np.testing.assert_array_equal(whole.corners()[:, 0], times_s)


def test_a_monitor_that_was_divided_is_asked_for_its_unit():
    times_s, volts_v = sampled(corners_of(COURSE), 8000.0, 0.1, seed=20)
    found = recognise(times_s, volts_v / 15.0, STAND)
    assert any('give its unit' in each for each in found.notes)


def test_hum_of_the_mains_below_the_noise_of_a_hold_changes_no_cycle():
    times_s, volts_v = sampled(corners_of(COURSE), 6200.0, 0.1, seed=21)
    hum_v = 0.3 * np.sin(2.0 * np.pi * 50.0 * times_s)
    found = recognise(times_s, volts_v + hum_v, STAND)
    assert [each.cycles for each in sawteeth(found)][:2] == [10, 12]
    times_s, volts_v = found.corners().T
    assert np.sum(np.abs(np.diff(volts_v) / np.diff(times_s)) > 0.5 * SLEW_V_PER_S) == 39


def test_a_constant_voltage_is_refused():
    with pytest.raises(OutOfRange, match='at all times'):
        recognise(np.arange(100.0), np.full(100, 3.0), STAND)


def test_a_record_of_noise_alone_ends_in_a_line(monkeypatch):
    monkeypatch.setattr('stickslip_ros.lab.waveform.finder.PIECES_MOST', 100)
    noise_v = 0.1 * np.random.default_rng(23).standard_normal(20_000)
    with pytest.raises(OutOfRange, match='after 100 lines'):
        recognise(np.arange(20_000) / 5000.0, noise_v, STAND)


def test_a_recognised_wave_is_printed_line_by_line():
    found = recognise(*sampled(corners_of(COURSE), 8000.0, 0.1, 22), STAND)
    lines = found.lines()
    assert '10 cycles of a saw-tooth forwards, 28' in lines[4]
    assert '12 cycles of a saw-tooth backwards' in lines[6]
    assert any('waves above 800 Hz would be mistaken' in each for each in lines)
    level = WavePiece(0, 100, SLEW_V_PER_S, 0.0, -0.001)
    near = Segment(0, 100, level, level.corners(0.0, 1.0))
    assert str(near) == '0.000000 to 1.000000 s: hold at 0.00 V; 100 samples, scatter 0 V'


@settings(max_examples=40, deadline=None)
@given(
    bursts=st.lists(
        st.tuples(
            st.floats(60.0, 299.0),
            st.floats(60.0, 900.0),
            st.booleans(),
            st.integers(3, 30),
            st.floats(0.003, 0.01),
        ),
        min_size=1,
        max_size=4,
    ),
    rate_hz=st.sampled_from([2000.0, 5000.0, 10000.0, 20000.0]),
    trouble=st.sampled_from([{}, {'jitter_s': 5e-6}, {'late_s': 5e-6}, {'dropped': 0.1}]),
    seed=st.integers(0, 1000),
)
def test_corners_reproduce_the_samples_or_the_wave_is_refused(bursts, rate_hz, trouble, seed):
    parts = [hold(0.005)]
    for amplitude_v, frequency_hz, backwards, cycles, rest_s in bursts:
        way = -frequency_hz if backwards else frequency_hz
        parts += [saw(amplitude_v, way, cycles), hold(rest_s)]
    wave = corners_of(parts)
    found = recognise(*sampled(wave, rate_hz, 0.1, seed, **trouble), STAND)
    if found.refusals:
        return
    times_s, volts_v = found.corners().T
    # A few slow cycles may be called ramps between falls: what is played is the same.
    jumps_v = np.abs(np.diff(volts_v))
    falls = (jumps_v > 0.5 * SLEW_V_PER_S * np.diff(times_s)) & (jumps_v > 30.0)
    assert falls.sum() == sum(each[3] for each in parts if each[0] == 'saw')
    grid_s = np.linspace(times_s[0], times_s[-1], 20_001)
    near_s = 3e-5  # of a fall: some errors of times that 3 cycles of 7 samples leave
    around_v = [np.interp(grid_s + off_s, *wave.T) for off_s in np.linspace(-near_s, near_s, 31)]
    wave_v = np.interp(grid_s, times_s, volts_v)
    off_v = np.maximum(np.min(around_v, 0) - wave_v, wave_v - np.max(around_v, 0))
    assert off_v.max() < 0.02 * 300.0


@settings(max_examples=60, deadline=None)
@given(
    frequency_hz=st.floats(20.0, 950.0),
    backwards=st.booleans(),
    amplitude_v=st.floats(30.0, 299.0),
    cycles=st.integers(3, 40),
    rate_hz=st.sampled_from([2000.0, 5000.0, 10000.0, 20000.0]),
    noise_v=st.floats(0.05, 0.75),
    seed=st.integers(0, 1000),
)
@example(113.76725643485543, False, 87.3, 17, 2000.0, 0.75, 0)
def test_a_burst_is_recognised_with_all_its_cycles_or_refused_never_wrong(
    frequency_hz, backwards, amplitude_v, cycles, rate_hz, noise_v, seed
):
    burst = saw(amplitude_v, -frequency_hz if backwards else frequency_hz, cycles)
    wave = corners_of([hold(0.01), burst, hold(0.01)])
    times_s, volts_v = sampled(wave, rate_hz, noise_v, seed)
    found = recognise(times_s, volts_v, STAND)
    if found.refusals:
        # ten samples a cycle, and the noise a fiftieth of the wave, are enough for anybody
        assert rate_hz < 10.3 * frequency_hz or amplitude_v < 50.0 * noise_v
        return
    assert_sawteeth(found, [burst], noise_v)
