# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Runs against each other over time: the same, moved, attached, with gaps."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from stickslip_ros.errors import StickSlipError
from stickslip_ros.interface.cdr import pack_stamped
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.lab.comparison.compare import CompareOptions, compare
from stickslip_ros.lab.comparison.in_time import align
from stickslip_ros.lab.comparison.result import Incomparable
from stickslip_ros.lab.measurements.measurement import Side, TimeRun
from stickslip_ros.lab.measurements.recorded import recorded_series
from stickslip_ros.message_types import POINT_STAMPED
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.series import Series

LATE_S = 1.234567
SAMPLE_S = 2e-5
"""Spacing of the default trace."""
SUBSAMPLE = 0.05
"""Share of a sample to which the lag of a smooth signal is found."""
MS_NS = 1_000_000


def compared(a, b=None, **options):
    return compare(a, b, options=CompareOptions(**options))


def write_series(path, series, late_s=0.0, sigma=None):
    """Write a recording's quantities as an experiment file, each float to the bit."""
    columns = {'time_s': next(iter(series.values())).time_s + late_s}
    columns |= {name: each.value for name, each in series.items()}
    columns |= {} if sigma is None else {sigma[0]: sigma[1]}
    pd.DataFrame(columns).to_csv(path, index=False)
    return path


@pytest.fixture(scope='module')
def series(recorded_run):
    return recorded_series(Recording(recorded_run[1]))


@pytest.fixture(scope='module')
def late(series, tmp_path_factory):
    """Give the recorded run as an experiment that is late by a known time."""
    return write_series(tmp_path_factory.mktemp('late') / 'late.csv', series, LATE_S)


def record_points(path, values_m, attachments=None):
    """Record positions alone, 1 kHz."""
    channels = [Channel('/position', POINT_STAMPED, Qos(10))]
    with Recorder(path, channels, attachments=attachments or {}) as recorder:
        for tick, value_m in enumerate(values_m):
            at_ns = tick * MS_NS
            message = pack_stamped(at_ns, 'stage_base', (value_m, 0.0, 0.0))
            recorder.put('/position', at_ns, message, wait=True)
    return path


def test_a_recording_equals_itself(recorded_run):
    comparison = compared(recorded_run[1], recorded_run[1])
    names = [quantity.name for quantity in comparison.quantities]
    assert names == ['position_m', 'force_n', 'voltage_v', 'foot_m']
    assert comparison.differences == ()
    for quantity in comparison.quantities:
        told = quantity.agreement
        assert (told.bias, told.rms, told.largest, told.relative_rms) == (0.0, 0.0, 0.0, 0.0)
        assert told.correlation == pytest.approx(1.0, rel=1e-12)
        assert quantity.left_out == 0


def test_a_known_shift_is_found_and_undone(recorded_run, late):
    alignment = compared(recorded_run[1], recorded_run[1], align=True).alignment
    assert max(abs(alignment.shift_s), alignment.error_s) < 1e-3 * SAMPLE_S
    assert alignment.decided_by == 'voltage_v'
    comparison = compared(recorded_run[1], late, align=True)
    assert comparison.alignment.method == 'estimated'
    assert comparison.alignment.shift_s == pytest.approx(-LATE_S, abs=SUBSAMPLE * SAMPLE_S)
    for quantity in comparison.quantities:
        assert quantity.agreement.correlation > 0.999


def test_a_given_shift_is_taken(recorded_run, late):
    comparison = compared(recorded_run[1], late, shift_s=-LATE_S)
    assert (comparison.alignment.shift_s, comparison.alignment.method) == (-LATE_S, 'given')
    # Times of the order of a second are exact to 1e-16 s, slopes are below 1e8 V/s.
    for quantity in comparison.quantities:
        assert quantity.agreement.relative_rms < 1e-9


def test_readings_that_are_far_off_do_not_move_the_zero(recorded_run, series, tmp_path):
    """A sensor that loses count for a tenth of the time: the median of the differences stays."""
    position, moved_m = series['position_m'], 3e-7
    values_m = position.value - moved_m
    values_m[: len(values_m) // 10] += 2e-6
    lost = {'position_m': replace(position, value=values_m)}
    path = write_series(tmp_path / 'lost.csv', lost)
    [quantity] = compared(recorded_run[1], path, offset=True).quantities
    assert quantity.offset == pytest.approx(moved_m, rel=1e-9)


def test_runs_that_share_no_time_are_refused(recorded_run, late):
    with pytest.raises(StickSlipError) as caught:
        compared(recorded_run[1], late, shift_s=5.0)
    assert 'position_m of' in str(caught.value)
    assert 'shift B with --shift or --align' in str(caught.value)


def test_b_is_interpolated_onto_the_times_of_a_within_both(tmp_path):
    a = tmp_path / 'a.csv'
    a.write_text('time_s,position_m\n0,0\n1,1e-9\n2,2e-9\n3,3e-9\n')
    b = tmp_path / 'b.csv'
    b.write_text('time_s,position_m,foot_m\n0.5,1.5e-9,0\n2.5,3.5e-9,1e-9\n')
    [position] = compared(a, b).quantities
    [part] = position.parts
    np.testing.assert_array_equal(part.x, [1.0, 2.0])
    np.testing.assert_allclose(part.difference, [1e-9, 1e-9], rtol=1e-9)
    assert position.left_out == 0


def test_the_uncertainties_of_a_run_give_chi_square(series, tmp_path):
    rng = np.random.default_rng(5)
    position = series['position_m'].window(0.0, 0.005)
    sigma_m = 2e-9
    noise_m = rng.normal(scale=sigma_m, size=len(position))
    noisy = Series(position.time_s, position.value + noise_m, 'm', 'noisy')
    a = write_series(
        tmp_path / 'a.csv', {'position_m': noisy}, sigma=('position_sigma_m', sigma_m)
    )
    b = write_series(tmp_path / 'b.csv', {'position_m': position})
    chi = compared(a, b).quantities[0].agreement.chi_square
    assert chi.chi_square == pytest.approx(np.sum((noise_m / sigma_m) ** 2), rel=1e-9)
    assert chi.degrees_of_freedom == len(position)
    assert 0.01 < chi.p_value < 0.99


def test_what_is_no_number_is_left_out_and_counted(tmp_path):
    a = record_points(tmp_path / 'a.mcap', [0.0, 1e-9, math.nan, 3e-9, 4e-9])
    b = record_points(tmp_path / 'b.mcap', [0.0, 1e-9, 2e-9, 3e-9, 5e-9])
    [position] = compared(a, b).quantities
    assert (position.agreement.points, position.left_out) == (4, 1)
    assert position.agreement.largest == pytest.approx(1e-9)
    dark = record_points(tmp_path / 'dark.mcap', [math.nan] * 5)
    with pytest.raises(StickSlipError, match='position_m has no numbers at common times in'):
        compared(a, dark)


def test_a_recording_alone_is_compared_with_the_experiment_that_it_carries(tmp_path):
    text = b'# as measured\ntime_s,position_m\n0,1e-9\n0.002,3e-9\n'
    path = record_points(
        tmp_path / 'run.mcap', [0.0, 1e-9, 2e-9], {'experiment.csv': ('text/csv', text)}
    )
    comparison = compared(path)
    assert comparison.b.origin == f'{path} experiment.csv'
    assert comparison.b.notes == ('as measured',)
    [position] = comparison.quantities
    assert position.agreement.bias == pytest.approx(1e-9)
    assert position.agreement.points == 3


def test_a_recording_alone_without_an_experiment_is_refused(recorded_run):
    with pytest.raises(StickSlipError, match=r'has no attached experiment\.csv; give a file or'):
        compared(recorded_run[1])


def test_a_damaged_attachment_is_refused_by_its_line(tmp_path):
    content = {'experiment.csv': ('text/csv', b'time_s,position_m\n0,1 nm\n1,2\n')}
    path = record_points(tmp_path / 'run.mcap', [0.0, 1e-9], content)
    with pytest.raises(StickSlipError, match=r"experiment\.csv: line 2, column position_m: '1 nm"):
        compared(path)


def test_kinds_that_do_not_fit_are_refused(recorded_run, tmp_path):
    points = tmp_path / 'points.csv'
    points.write_text('preload_n,amplitude_m,force_n\n0.5,6e-8,0.02\n')
    for a, b in ((recorded_run[1], points), (points, recorded_run[1])):
        with pytest.raises(StickSlipError, match='two files over time, or two by amplitude'):
            compared(a, b)
    foot = tmp_path / 'foot.csv'
    foot.write_text('time_s,foot_m\n0,0\n1,1e-9\n')
    voltage = tmp_path / 'voltage.csv'
    voltage.write_text('time_s,voltage_v\n0,0\n1,1\n')
    with pytest.raises(StickSlipError, match='compare runs that share a quantity'):
        compared(foot, voltage)


@pytest.mark.parametrize(
    ('options', 'told'),
    [({'shift_s': 1.0}, 'give the clock'), ({'steps': 5}, 'leave out --frequency and --steps')],
)
def test_what_the_voltage_of_a_run_says_is_not_asked_of_the_user(recorded_run, options, told):
    with pytest.raises(StickSlipError, match=told):
        compared(recorded_run[1], {}, **options)


def test_draws_need_a_model(recorded_run):
    with pytest.raises(StickSlipError, match='need the model as B'):
        compare(recorded_run[1], recorded_run[1], draws=[Parameters()])


def _bump(time_s, at_s):
    return np.exp(-(((time_s - at_s) / 0.1) ** 2))


def aligned(a, b):
    """Return the shift of B to A, each two rows of times and positions."""
    side = Side('x.csv', 'experiment over time', 0, {}, None)
    series = (Series(time_s, position_m, 'm', 'x.csv') for time_s, position_m in (a, b))
    return align(*(TimeRun(side, {'position_m': each}) for each in series))


@pytest.mark.parametrize('late_s', [0.0, 0.003, -0.0042, 0.25, -0.3371])
def test_the_lag_of_a_smooth_signal_is_found_between_samples(late_s):
    time_s = np.arange(200, dtype=float) * 0.01
    b = 2.0 * _bump(time_s, 0.9 + late_s) - 1.0
    shift_s = aligned((time_s, 5.0 + _bump(time_s, 0.9)), (time_s + 3.0, b)).shift_s
    assert shift_s == pytest.approx(-3.0 - late_s, abs=SUBSAMPLE * 0.01)


def test_the_lag_of_noisy_signals_of_different_rates_is_found():
    rng = np.random.default_rng(2)
    fine_s, coarse_s = (np.arange(0.0, 2.0, step, dtype=float) for step in (0.001, 0.004))
    a = _bump(fine_s, 0.8) + 0.05 * rng.normal(size=len(fine_s))
    b = _bump(coarse_s, 1.1) + 0.05 * rng.normal(size=len(coarse_s))
    found = aligned((fine_s, a), (coarse_s, b))
    assert found.shift_s == pytest.approx(-0.3, abs=0.01)
    assert abs(found.shift_s + 0.3) < 4.0 * found.error_s


def test_of_equal_periods_the_smallest_shift_counts():
    time_s = np.arange(400, dtype=float) * 0.01
    wave = time_s, (time_s * 2.0) % 1.0
    assert aligned(wave, wave).shift_s == pytest.approx(0.0, abs=1e-4)


def test_where_nothing_changes_no_lag_is_found():
    time_s = np.arange(10, dtype=float)
    with pytest.raises(StickSlipError, match='changes in both; give --shift instead of --align'):
        aligned((time_s, np.ones(10)), (time_s, np.ones(10)))


BURSTS_LATE_S = np.array([0.061, 0.059, 0.061, 0.0605])  # bursts of a second playback of one bag
LEAST_S, MOST_S = float(BURSTS_LATE_S.min()), float(BURSTS_LATE_S.max())


def playback(late_s, rate_hz, quantities, runner_moves=1.0):
    """Return a run of four bursts of a saw-tooth of 100 Hz, whose runner moves 140 nm a period."""
    time_s = np.arange(0.3 / rate_hz, 5.0, 1.0 / rate_hz)
    periods = np.zeros((2, len(time_s)))  # of now, and those that are over
    for start_s, count in zip(
        np.array([0.5, 1.5, 2.3, 3.5]) + late_s, (40, 30, 60, 90), strict=True
    ):
        place = np.clip((time_s - start_s) * 100.0, 0.0, count)
        periods += place % 1.0, np.floor(place)
    noise = np.random.default_rng(int(rate_hz)).standard_normal((2, len(time_s)))
    place_m = 140e-9 * (periods[0] + runner_moves * periods[1])
    values = {
        'voltage_v': 280.0 * periods[0] + 0.02 * noise[0],
        'position_m': place_m + 3e-10 * noise[1],
    }
    series = {name: Series(time_s, values[name], name[-1], name) for name in quantities}
    return TimeRun(Side('playback', 'over time', len(time_s), {}, None), series)


@pytest.mark.parametrize('rate_hz', [1000.0, 10_000.0])
@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_of_like_peaks_of_the_voltage_the_runner_says_which(rate_hz, sign):
    both = [
        playback(late_s, rate_hz, ('voltage_v', 'position_m'))
        for late_s in (0.0 * BURSTS_LATE_S, BURSTS_LATE_S)[:: int(sign)]
    ]
    found = align(*both)
    assert found.decided_by == 'position_m'
    assert -MOST_S - 0.0015 < sign * found.shift_s < -LEAST_S + 0.0015
    assert abs(sign * found.shift_s + BURSTS_LATE_S.mean()) < found.error_s < 0.003


@pytest.mark.parametrize('sign', [1.0, -1.0])
@pytest.mark.parametrize(
    ('quantities', 'runner_moves'),
    [(('voltage_v',), 1.0), (('position_m',), 0.0), (('voltage_v', 'position_m'), 0.0)],
)
def test_the_error_of_a_shift_is_the_distance_of_its_farthest_rival(
    sign, quantities, runner_moves
):
    both = [
        playback(late_s, 2000.0, quantities, runner_moves)
        for late_s in (0.0 * BURSTS_LATE_S, BURSTS_LATE_S)[:: int(sign)]
    ]
    found = align(*both)
    assert abs(sign * found.shift_s + BURSTS_LATE_S.mean()) < found.error_s
    assert found.error_s < 0.5


WAVES = {
    'sine': lambda place: np.sin(2.0 * np.pi * place),
    'triangle': lambda place: 4.0 * np.abs(place % 1.0 - 0.5) - 1.0,
    'saw-tooth': lambda place: 2.0 * (place % 1.0) - 1.0,
}
DEVIATIONS = 5.0  # of a shift from the true one, in its standard errors
REFUSED_WAVES = {('sine', 2.2, 0.00052), ('triangle', 2.5, 0.0003)}
"""Waves of so few samples a cycle that no shift shows a motion that both have."""
BURSTS = ((0.2, 80), (0.7, 60), (1.2, 100))  # starts, s, and cycles


def sampled_bursts(wave, per_cycle, late_s, seed):
    """Return the voltage of three bursts, so many samples a cycle, 1 ms apart, with noise."""
    time_s = np.arange(0.0003, 2.0, 0.001)
    value = 0.02 * np.random.default_rng(seed).standard_normal(len(time_s))
    for start_s, cycles in BURSTS:
        place = (time_s - start_s - late_s) / (0.001 * per_cycle)
        value += np.where((place >= 0.0) & (place < cycles), 150.0 * WAVES[wave](place), 0.0)
    series = {'voltage_v': Series(time_s.astype(float), value.astype(float), 'V', 'bursts')}
    return TimeRun(Side('bursts', 'over time', len(time_s), {}, None), series)


@pytest.mark.parametrize('wave', WAVES)
@pytest.mark.parametrize('per_cycle', [2.2, 2.5, 2.8, 3.3, 4.0, 5.0, 8.0])
@pytest.mark.parametrize('late_s', [0.0003, 0.00052, 0.0173])
def test_the_error_of_a_shift_is_no_less_than_few_samples_a_cycle_can_show(
    wave, per_cycle, late_s
):
    both = [sampled_bursts(wave, per_cycle, *each) for each in ((0.0, 1), (late_s, 2))]
    try:
        found = align(*both)
    except Incomparable as refused:
        assert (wave, per_cycle, late_s) in REFUSED_WAVES
        assert 'below 0.8; give --shift' in str(refused)  # noqa: PT017
        return
    assert abs(found.shift_s + late_s) < DEVIATIONS * found.error_s
