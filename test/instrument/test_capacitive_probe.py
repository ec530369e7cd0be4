# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The capacitive probe: there on request, with errors of its own, and no error of the others."""

import numpy as np
import pytest
from bench_runs import MS, drive_bench, sawtooth
from sensor_setups import HEALTHY, RATE_HZ, ROUNDING, SIGMAS, broken

from stickslip_ros.drive.records import FOOT, FORCE, POSITION
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.reports import trace_columns
from stickslip_ros.instrument.sensing import Sensing
from stickslip_ros.parameters import FaultParameters, Parameters

PROBE = FORCE + 1
"""Column of the trace."""
ENABLED = {'capacitive_probe.enabled': True}
EXACT = {f'capacitive_probe.{name}': 0.0 for name in ('noise_density', 'resolution', 'bandwidth')}
RUN = {0: [sawtooth(200.0, 1000.0)], 7 * MS: [sawtooth(120.0, -777.0)]}


def probe(**settings: float) -> Sensing:
    """Give sensors with a probe that has no errors but the given ones."""
    chosen = {f'capacitive_probe.{name}': value for name, value in settings.items()}
    return Sensing(Parameters().updated({**ENABLED, **EXACT, **chosen}))


def readings(sensing: Sensing, feet_m: np.ndarray, faults: FaultParameters = HEALTHY):
    trace = np.zeros((len(feet_m), PROBE + 1))
    trace[:, FOOT] = feet_m
    sensing.read(trace, 0, faults)
    assert trace[:, FOOT].tobytes() == feet_m.tobytes()
    return trace[:, PROBE]


def test_it_is_there_only_where_it_is_enabled():
    assert len(trace_columns(Parameters())) == PROBE
    stand = Parameters().updated(ENABLED)
    assert trace_columns(stand)[PROBE] == 'foot_position[m]'
    assert Bench(stand).update(MS).readings.trace.shape == (50, PROBE + 1)


def test_it_changes_no_byte_of_the_other_sensors():
    with_it, without = (
        drive_bench(Bench(Parameters().updated(each)), 20 * MS, RUN) for each in (ENABLED, {})
    )
    assert with_it.trace[:, :PROBE].tobytes() == without.trace.tobytes()
    assert with_it.status == without.status


def test_without_errors_it_reads_where_the_feet_are():
    trace = drive_bench(Bench(Parameters().updated({**ENABLED, **EXACT})), 20 * MS, RUN).trace
    assert np.ptp(trace[:, FOOT]) > 50e-9
    np.testing.assert_allclose(trace[:, PROBE], trace[:, FOOT], rtol=ROUNDING, atol=1e-22)


def test_the_noise_at_rest_has_its_density_and_is_its_own():
    density, samples = 1e-11, 50_000
    noise_m = readings(probe(noise_density=density), np.zeros(samples))
    sigma_m = density * np.sqrt(RATE_HZ / 2.0)
    assert np.std(noise_m) == pytest.approx(sigma_m, rel=SIGMAS / np.sqrt(2.0 * samples))
    for column in (POSITION, FORCE):
        trace = np.zeros((samples, PROBE + 1))
        probe().read(trace, 0, HEALTHY)
        assert abs(np.corrcoef(noise_m, trace[:, column])[0, 1]) < SIGMAS / np.sqrt(samples)


def test_a_step_is_answered_by_the_exponential_of_its_bandwidth():
    after = 40
    told_m = readings(probe(bandwidth=RATE_HZ / (2.0 * np.pi * after)), np.full(200, 1e-7))
    expected_m = 1e-7 * (1.0 - np.exp(-np.arange(1, 201) / after))
    np.testing.assert_allclose(told_m, expected_m, rtol=ROUNDING)


def test_a_reading_is_the_multiple_of_the_resolution_next_to_the_truth():
    feet_m = np.random.default_rng(0).normal(0.0, 1e-7, 2000)
    told_m = readings(probe(resolution=1e-9), feet_m)
    np.testing.assert_array_equal(told_m, np.rint(told_m / 1e-9) * 1e-9)
    assert np.max(np.abs(told_m - feet_m)) <= 0.5e-9 * (1.0 + 1e-9)


def test_it_jumps_freezes_drops_out_and_comes_back():
    sensing, feet_m = probe(), np.linspace(1e-9, 5e-8, 50)
    jumped_m = readings(sensing, feet_m, broken(capacitive_probe_offset=1e-6))
    np.testing.assert_allclose(jumped_m, feet_m + 1e-6, rtol=ROUNDING)
    frozen_m = readings(sensing, feet_m, broken(capacitive_probe='freeze'))
    np.testing.assert_array_equal(frozen_m, jumped_m[-1])
    dropped = readings(sensing, feet_m, broken(capacitive_probe='dropout'))
    assert np.isnan(dropped).all()
    np.testing.assert_allclose(readings(sensing, feet_m), feet_m, rtol=ROUNDING)


def test_it_goes_on_from_a_checkpoint_to_the_bit():
    bench = Bench(Parameters().updated(ENABLED))
    drive_bench(bench, 5 * MS, RUN)
    again = Bench.restore(bench.save())
    first, second = (drive_bench(each, 5 * MS, {}).trace for each in (bench, again))
    assert first.tobytes() == second.tobytes()


def test_a_sensor_behind_another_one_sees_the_truth_and_not_its_reading():
    settings = {**ENABLED, **EXACT, 'interferometer.resolution': 1e-6}
    sensing = Sensing(Parameters().updated(settings))
    vars(sensing)['capacitive_probe'].sees = POSITION
    trace = np.zeros((50, PROBE + 1))
    trace[:, POSITION] = truth_m = np.linspace(1e-9, 5e-8, 50)
    sensing.read(trace, 0, HEALTHY)
    np.testing.assert_array_equal(trace[:, POSITION], 0.0)
    np.testing.assert_allclose(trace[:, PROBE], truth_m, rtol=ROUNDING)
