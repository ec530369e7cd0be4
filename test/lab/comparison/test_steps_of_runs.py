# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The steps that a run over time made, off its voltage and its position."""

import numpy as np
import pytest

from stickslip_ros.arrays import Array
from stickslip_ros.lab.comparison.compare import compare
from stickslip_ros.lab.comparison.in_time import steps_of
from stickslip_ros.lab.measurements.measurement import Side, TimeRun
from stickslip_ros.lab.runs.sawtooth_run import simulate
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.series import Series

FREQUENCY_HZ, RAMPS, SAMPLE_S = 113.76725643485543, 400, 7.3e-5
FALL = 0.03  # share of the period


def run_with(steps_m: Array, *, sense=1.0, noise_v=0.0, ramp=1.0 - FALL):
    """Return a run of a saw-tooth of 237 V whose runner goes by these steps, along the ramps."""
    count = int(len(steps_m) / FREQUENCY_HZ / SAMPLE_S)
    time_s: Array = SAMPLE_S * np.arange(count, dtype=float)
    cycle, phase = np.divmod(time_s * FREQUENCY_HZ, 1.0)
    share = np.minimum(phase / ramp, (1.0 - phase) / (1.0 - ramp))
    noise = np.random.default_rng(7).normal(0.0, 1.0, len(time_s))
    voltage_v = 237.0 * (share if sense > 0.0 else 1.0 - share) + noise_v * noise
    starts_m = np.concatenate(([0.0], np.cumsum(steps_m)))
    in_ramp = cycle.astype(int)
    position_m: Array = starts_m[in_ramp] + steps_m[in_ramp] * phase
    series = {
        'voltage_v': Series(time_s, voltage_v, 'V', 'voltage'),
        'position_m': Series(time_s, position_m, 'm', 'position'),
    }
    return TimeRun(Side('a test', 'test', len(time_s), {}, None), series)


def scattered():
    return 1e-7 * (1.0 + 0.1 * np.sin(2.0 * np.pi * np.arange(RAMPS) / 40.0))


@pytest.mark.parametrize('sense', [1.0, -1.0])
def test_mean_scatter_and_correlation_of_known_steps_are_found(sense):
    found = steps_of(run_with(sense * scattered(), sense=sense))
    assert found.count == RAMPS // 2
    assert found.mean_m == pytest.approx(sense * 1e-7, rel=1e-3)
    # Over a ramp that begins in one step and ends in the next the sine loses 0.4 %.
    assert found.scatter_m == pytest.approx(1e-8 / np.sqrt(2.0), rel=1e-2)
    known_m = 1e-7 * 40.0 / (2.0 * np.pi) * np.arccos(np.exp(-1.0))
    assert found.correlation_m == pytest.approx(known_m, rel=0.05)


def test_a_noisy_voltage_adds_no_steps():
    found = steps_of(run_with(scattered(), noise_v=4.0))
    assert found.count == RAMPS // 2
    assert found.mean_m == pytest.approx(1e-7, rel=2e-3)


def test_a_symmetric_wave_has_steps_too():
    found = steps_of(run_with(np.full(RAMPS, 1e-7), ramp=0.5))
    assert found.mean_m == pytest.approx(1e-7, rel=1e-6)
    assert found.scatter_m < 1e-12


def test_a_pause_between_two_waves_is_no_step():
    run = run_with(np.full(RAMPS, 1e-7))
    late = {}
    for name, each in run.series.items():
        time_s = np.concatenate((each.time_s, each.time_s + each.time_s[-1] + 0.5))
        value = np.concatenate((each.value, each.value + (name == 'position_m') * 3e-5))
        late[name] = Series(time_s, value, each.unit, name)
    found = steps_of(TimeRun(run.side, late))
    assert found.mean_m == pytest.approx(1e-7, rel=1e-6)


def test_without_ten_ramps_or_a_voltage_there_are_none():
    assert steps_of(run_with(np.full(9, 1e-7))) is None
    run = run_with(scattered())
    voltage, position = run.series['voltage_v'], run.series['position_m']
    assert steps_of(TimeRun(run.side, {'position_m': position})) is None
    constant = Series(voltage.time_s, 0.0 * voltage.value, 'V', '')
    assert steps_of(TimeRun(run.side, {**run.series, 'voltage_v': constant})) is None


def test_a_simulated_run_scatters_in_a_comparison_as_it_says_itself(tmp_path):
    free = {'load_cell.contact': 'absent', 'contact.profile': 'rough_line'}
    runs = []
    for travel in (0.0, 1.0):
        parameters = Parameters().updated({**free, 'contact.travel': travel})
        path = tmp_path / f'{travel}.mcap'
        runs.append(simulate(parameters, amplitude_m=113.77e-9, steps=200, record=path))
    report = compare(*runs)
    noise_m = 0.3e-9  # of two readings of the interferometer
    for run, steps in zip(runs, report.steps, strict=True):
        assert steps.scatter_m == pytest.approx(run.result.step_scatter_m, abs=noise_m)
    assert report.steps[0].mean_m == pytest.approx(runs[0].step_length_m, rel=2e-3)
    assert report.steps[1].scatter_m > 10.0 * report.steps[0].scatter_m
    table = {each.title: each.rows for each in report.sections()}
    assert len(table['steps in the second half of each run']) == 4
    assert report.to_json()['steps'][1]['count'] == report.steps[1].count
