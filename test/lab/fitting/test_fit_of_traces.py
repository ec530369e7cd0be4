# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Rigs of springs, which share no code with the drive, are learned from the motion they show."""

import json
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from fit_cases import EXACT
from spring_rig import Rig, voltage

from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.lab.comparison.compare import compare
from stickslip_ros.lab.experiments.experiment import Experiment, Readout, Voltage
from stickslip_ros.lab.experiments.predict import (
    SAMPLE_S,
    Prediction,
    at_times,
    low_passed,
    low_passed_readings,
)
from stickslip_ros.lab.experiments.sensor import KnownSensor, keeps_noise, noise_of
from stickslip_ros.lab.experiments.sensor_clock import Lateness, lateness_in, lateness_of
from stickslip_ros.lab.fitting.fit import FitOptions, fit
from stickslip_ros.lab.fitting.free import Free
from stickslip_ros.lab.fitting.metric import DELAY_S, Allowance, metric_of, slower, waves_of
from stickslip_ros.lab.fitting.report import Fit, as_object, warnings_of
from stickslip_ros.lab.fitting.result import read_draws, read_note
from stickslip_ros.lab.runs.sawtooth_run import run_drive
from stickslip_ros.parameters import Parameters, Scalar

ROWS = voltage((-60.0, 250.0, 1), (-170.0, 200.0, 1), (280.0, 300.0, 5), (300.0, 600.0, 8))
"""Triangles and saw-teeth: 50 ms in which a runner sticks, slips partly and slips."""
FEWER = voltage((-60.0, 250.0, 1), (-170.0, 200.0, 1), (280.0, 300.0, 3), (300.0, 600.0, 4))
"""The same in 36 ms."""
SLOWER = voltage((-60.0, 200.0, 1), (-170.0, 200.0, 1), (280.0, 300.0, 6), (220.0, 600.0, 10))
"""Periods of a saw-tooth of 300 Hz that readings at 5 and 10 kHz took for a delay."""
MANY = voltage((300.0, 600.0, 12), (190.0, 200.0, 5))
RATE_HZ = 50e3
NAMES = {
    'contact.friction': 'friction',
    'contact.prefactor': 'prefactor',
    'runner.mass': 'mass_kg',
    'runner.damping': 'damping_n_s_per_m',
    'actuator.gain': 'gain_m_per_v',
}
TWO = ['contact.friction', 'actuator.gain']
THREE = ['contact.friction', 'runner.mass', 'actuator.gain']
STAND = Parameters().updated({'runner.damping': Rig().damping_n_s_per_m})
Z_MAX = 3.5
"""Standard errors that no estimate of ten may be off: by chance one in 2,000 is."""
WALKERS, WALKS = 24, 160
SAME_SPREAD = 0.25  # three standard errors of the 160 independent places of the walks
CLOCK_S = 5e-6  # a quarter of a sample
NOISE_SHARE = 0.03  # two standard errors of the median of 20,000, and the curvature of the motion


def experiment(rig: Rig, seed: int, rows: np.ndarray = ROWS) -> Experiment:
    time_s, position_m = rig.positions(rows, RATE_HZ, seed)
    settings: dict[str, Scalar] = {'stand.preload': rig.preload_n, 'load_cell.contact': 'absent'}
    seen = Readout('position_m', position_m, time_s)
    return Experiment(f'rig {seed}', settings, Voltage(rows), (seen,))


def fit_of(
    rig: Rig, free: Iterable[str | Free], seed: int = 1, rows: np.ndarray = FEWER, **options: Any
) -> Fit:
    """Fit a rig with the damping of STAND, by default from one start."""
    asked = FitOptions(**{'starts': 1, **options})
    return fit(experiment(rig, seed, rows), list(free), parameters=STAND, options=asked)


def assert_holds(found: Fit, rig: Rig) -> None:
    """Assert that estimates are within their errors of what is true."""
    for one in found.estimates:
        true = getattr(rig, NAMES[one.name])
        assert abs(np.log(one.value / true)) < Z_MAX * one.standard_error / one.value


def sensor_of(found: Fit) -> KnownSensor:
    """Give the sensor of a recording as a fit found it."""
    [[seen]] = [one.observed for one in found.experiments]
    return seen.sensor


@pytest.fixture(scope='module')
def learned() -> tuple[Rig, Fit]:
    """Give a rig whose feet differ, whose sensor is slow and late, and what was learned of it."""
    rig = Rig(
        preload_n=0.35,
        friction=0.24,
        prefactor=5.2e-4,
        mass_kg=3.4e-3,
        damping_n_s_per_m=15.0,
        gain_m_per_v=5.0e-10,
        gains=(0.995, 1.004, 1.006, 0.997, 1.0, 0.998),
        late_s=1.3e-3,
        low_pass_hz=20e3,
    )
    return rig, fit_of(rig, NAMES, rows=ROWS)


def test_a_rig_with_another_sensor_and_a_late_clock_is_learned(learned: tuple[Rig, Fit]):
    rig, found = learned
    assert_holds(found, rig)
    by_model_s = lateness_in(experiment(rig, 1), found.parameters)
    for late_s in (sensor_of(found).late_s, by_model_s):
        assert late_s == pytest.approx(rig.late_s, rel=0.0, abs=CLOCK_S)
    assert 0.85 < found.reduced_chi_square < 1.15
    [noise] = found.problem.noise
    assert noise == pytest.approx(rig.noise_m, rel=0.05, abs=0.0)
    assert found.holds
    of_feet, note = found.notes
    assert 'feet and contacts are those of the paper' in of_feet
    assert note.endswith('position_m: its clock is about 1.3 ms late')


def test_the_fitted_stand_is_set_as_the_rig_was(learned: tuple[Rig, Fit]):
    rig, found = learned
    for stand in (found.parameters, *found.draws(2)):
        assert stand.stand.preload == rig.preload_n
        assert stand.load_cell.contact == 'absent'


def test_the_sensor_is_said_and_what_drove_it(learned: tuple[Rig, Fit]):
    rig, found = learned
    [trace] = as_object(found)['traces']
    assert trace['drift_per_s'] == pytest.approx(rig.drift_m_per_s, rel=0.0, abs=2e-8)
    assert trace['zero'] == pytest.approx(rig.zero_m, rel=0.0, abs=5e-9)
    assert trace['rms'] < 2.0 * rig.noise_m


@pytest.mark.parametrize(
    ('rig', 'free', 'starts'),
    [
        (Rig(0.4, 0.27, 4e-4, 3.2e-3, 18.0, 5e-10, low_pass_hz=1e3), NAMES, 1),
        pytest.param(
            Rig(0.28, 0.277, 3.95e-4, 3.27e-3, 28.4, 4.93e-10, low_pass_hz=500.0),
            NAMES,
            3,
            marks=pytest.mark.slow,  # a search of 11 s
        ),
    ],
)
def test_a_sensor_too_slow_for_the_ringing_is_told_and_its_intervals_are_wide(
    rig: Rig, free: Iterable[str], starts: int
):
    found = fit_of(rig, free, 2, ROWS, starts=starts)
    assert_holds(found, rig)
    slow_s = 1.0 / (2.0 * np.pi * rig.low_pass_hz)
    assert sensor_of(found).slow_s == pytest.approx(slow_s, rel=0.1, abs=0.0)
    assert any('its sensor is slow, like a low-pass of' in note for note in found.notes)
    assert found.estimates[0].standard_error > 0.03  # less than 0.02 behind 6.5 kHz


@pytest.mark.parametrize('filters_readings', [True, pytest.param(False, marks=pytest.mark.slow)])
def test_errors_allow_for_a_low_pass_of_readings_and_for_one_of_the_motion(filters_readings: bool):
    rig = Rig(0.65, noise_m=7e-10, low_pass_hz=6.5e3, filters_readings=filters_readings)
    found = fit_of(rig, NAMES, 3, assume=EXACT)
    assert found.holds
    assert_holds(found, rig)
    assert found.estimates[0].standard_error < 0.02


def test_digits_coarser_than_the_noise_count_twice_and_are_told():
    rig, digit_m = Rig(0.35, friction=0.24, noise_m=1e-9), 5e-9
    one = experiment(rig, 1, FEWER)
    [fine] = one.observed
    rounded = replace(fine, values=digit_m * np.round(fine.values / digit_m))
    options = FitOptions(starts=1)
    found = fit(replace(one, observed=(rounded,)), THREE, parameters=STAND, options=options)
    assert found.holds
    assert_holds(found, rig)
    assert any('is rounded by more than its noise' in note for note in found.notes)
    [noise] = found.problem.noise
    assert noise == pytest.approx(digit_m / np.sqrt(3.0), rel=1e-3)


def test_a_low_pass_of_readings_sees_a_step_at_the_next_reading_and_those_that_are_missing():
    samples = np.repeat([2.0, 5.0], [100, 300])  # a step behind 100 samples
    number = np.delete(np.arange(90), [30, 31, 32, 60])
    slow_s, kept = 3e-5, np.exp(-2e-5 / 3e-5)
    shown = low_passed_readings(samples, 2e-5 * number, slow_s)
    expected = 5.0 - 3.0 * kept ** np.maximum(number - 24, 0)
    assert shown == pytest.approx(expected, rel=1e-9)


def test_a_misfit_of_the_start_does_not_pass_for_noise():
    rig = Rig(damping_n_s_per_m=0.0, noise_m=1.5e-10)  # a search begins at 20 N s/m
    found = fit_of(rig, ['runner.damping'])
    [noise] = found.problem.noise
    assert noise == pytest.approx(rig.noise_m, rel=0.1, abs=0.0)


def test_noise_before_the_low_pass_of_a_sensor_is_shared_by_readings_and_told():
    rig = Rig(friction=0.33, mass_kg=2.7e-3, noise_m=5e-9, low_pass_hz=2e3, is_noise_behind=False)
    found = fit_of(rig, THREE, 4, ROWS)
    assert found.holds
    assert_holds(found, rig)
    slow_s = 1.0 / (2.0 * np.pi * rig.low_pass_hz)
    assert sensor_of(found).noise_lasts_s == pytest.approx(slow_s, rel=0.05, abs=0.0)
    assert any('neighbouring readings share its noise' in note for note in found.notes)


@pytest.mark.parametrize('share', [0.3, 0.6, 0.8, 0.95])
def test_whether_readings_keep_noise_is_told_from_their_second_differences(share: float):
    chance = np.random.default_rng(3)
    white = chance.normal(0.0, 1e-9, 4000)
    kept = white.copy()
    for k in range(1, len(kept)):
        kept[k] = share * kept[k - 1] + np.sqrt(1.0 - share**2) * white[k]
    jumps = 1e-7 * np.repeat(np.arange(80) % 2, 50)
    assert keeps_noise(kept + jumps, share)
    assert not keeps_noise(white + jumps, share)
    assert noise_of(kept + jumps, share) == pytest.approx(1e-9, rel=0.15, abs=0.0)


def test_a_clock_that_noise_hides_is_tried_beside_one_on_time():
    rig = Rig(preload_n=0.35, friction=0.24, noise_m=7e-9, late_s=1.05e-3, low_pass_hz=36e3)
    assert not lateness_of(experiment(rig, 1).observed[0], Voltage(ROWS)).is_clear
    found = fit_of(rig, TWO, rows=ROWS, starts=2)
    assert_holds(found, rig)
    assert sensor_of(found).late_s == pytest.approx(rig.late_s, rel=0.0, abs=2e-5)


def test_lateness_and_time_constant_follow_from_what_the_columns_of_a_sensor_hold():
    assert slower(8e-5, 0.0, 0.0) == pytest.approx((0.0, 8e-5))
    late_s, more_s = 3e-6, 1e-6
    first, second = late_s + more_s, late_s**2 / 2.0 + late_s * more_s + (8e-5 + more_s) * more_s
    assert slower(8e-5, first, second) == pytest.approx((late_s, 8e-5 + more_s), rel=1e-9)
    assert slower(1e-6, 0.0, -1e-10) == pytest.approx((1e-6, 0.0))


@pytest.mark.parametrize('slow_s', [1e-6, 2e-5, 3e-4])
def test_a_low_pass_of_a_ramp_is_late_by_its_time_constant_and_rests_before(slow_s: float):
    ramp = 3.0 + np.maximum(SAMPLE_S * (np.arange(1000) - 100), 0.0)
    behind = low_passed(ramp, slow_s)
    since_s = SAMPLE_S * (np.arange(1000) - 100)
    expected = since_s - slow_s * -np.expm1(-np.maximum(since_s, 0.0) / slow_s)
    assert behind == pytest.approx(3.0 + np.where(since_s > 0.0, expected, 0.0), rel=1e-9)
    assert low_passed(ramp, 0.0) is ramp


def test_a_misfit_without_a_suspect_is_warned_of(learned: tuple[Rig, Fit]):
    _, found = learned
    ended = replace(found.found, converged=False)
    told = warnings_of(replace(found, refined=(ended,), missing=()))
    assert told[0].startswith('no tested cause explains the misfit: check preload')


def test_a_mass_that_was_weighed_makes_the_others_surer():
    rig = Rig(preload_n=0.6, friction=0.33, mass_kg=2.6e-3)
    free = ['contact.friction', 'contact.prefactor']
    alone, weighed = (
        fit_of(rig, [*free, mass], 2, assume=EXACT)
        for mass in (Free('runner.mass'), Free('runner.mass', known='2.6g+-0.5%'))
    )
    assert_holds(weighed, rig)
    for one, other in zip(alone.estimates, weighed.estimates, strict=True):
        assert other.standard_error < 0.5 * one.standard_error


@pytest.mark.slow  # 3,840 stands; draws of a fit of a table are compared with curve_fit beside
def test_draws_are_those_of_a_sampler_that_takes_no_slopes():
    import emcee  # noqa: PLC0415 - Ubuntu 24.04 has no package of it

    rig, rows = Rig(0.35, 0.24), voltage((-170.0, 500.0, 1), (300.0, 1000.0, 5), rest_s=1e-3)
    found = fit(experiment(rig, 1, rows), TWO, options=FitOptions(starts=1, assume=EXACT))
    problem, doubt, chance = found.problem, found.uncertainty, np.random.RandomState(1)

    def log_chance(place: np.ndarray) -> float:
        return -0.5 * float(np.sum(problem.residuals(place) ** 2)) / doubt.variance_scale

    errors = np.sqrt(np.diag(doubt.natural(doubt.recorded_z)))
    begins = found.found.place + 0.3 * errors * chance.standard_normal((WALKERS, len(TWO)))
    walks = emcee.EnsembleSampler(WALKERS, len(TWO), log_chance)
    walks.run_mcmc(emcee.State(begins, random_state=chance.get_state()), WALKS)
    places = walks.get_chain(discard=WALKS // 4, flat=True)
    sampled = np.log([list(problem.natural.settings(each).values()) for each in places])
    drawn = np.log([[each.flat()[name] for name in TWO] for each in found.draws(1000)])
    spread = np.std(sampled, axis=0)
    assert np.std(drawn, axis=0) == pytest.approx(spread, rel=SAME_SPREAD)
    assert np.all(np.abs(np.mean(drawn, axis=0) - np.mean(sampled, axis=0)) < SAME_SPREAD * spread)
    correlations = [np.corrcoef(each.T)[0, 1] for each in (drawn, sampled)]
    assert correlations[0] == pytest.approx(correlations[1], abs=SAME_SPREAD)


@pytest.mark.slow  # two fits from two starts each, and their trials
def test_what_a_rig_has_and_the_stand_lacks_is_named_and_warned_of():
    rig = Rig(hysteresis=0.35)
    found, more = (
        fit_of(rig, free, 3, ROWS, starts=2) for free in (TWO, [*TWO, 'actuator.hysteresis'])
    )
    worst = found.missing[0]
    assert worst.name == 'actuator.hysteresis'
    assert not found.holds
    assert warnings_of(found)[0].startswith('the stand may lack actuator.hysteresis')
    moved = 'values move beyond their errors with actuator.hysteresis free: '
    assert any(reason.startswith(moved) for reason in found.reasons)
    assert more.estimates[2].low > 0.05
    assert more.missing[0].chi_square == pytest.approx(worst.expected, rel=0.1, abs=0.0)
    assert more.missing[0].chi_square < 0.5 * worst.chi_square


def test_forces_and_a_trace_are_fitted_at_once():
    rig = Rig(preload_n=0.35, friction=0.26)
    points = pd.DataFrame({'preload_n': 0.1, 'amplitude_m': [8e-8, 1.2e-7, 1.6e-7]})
    there = STAND.updated({'contact.friction': 0.26, 'stand.preload': 0.1})
    runs = [run_drive(there, each, 1000.0) for each in points['amplitude_m'].tolist()]
    forces = points.assign(force_n=[each.force_mean_n for each in runs])
    both: list[Any] = [experiment(rig, 4, FEWER), forces]
    found = fit(both, TWO, parameters=STAND, options=FitOptions(starts=1))
    assert_holds(found, rig)
    assert len(found.experiments) == 4


def test_draws_have_the_mean_and_the_spread_of_the_fit(learned: tuple[Rig, Fit], tmp_path: Path):
    _, found = learned
    path = tmp_path / 'fitted.json'
    path.write_text(json.dumps(as_object(found)), encoding='utf-8')
    assert read_note(path).endswith('forces also have the error of the assumed contact, 58 %')
    draws = read_draws(path, 400)
    assert [each.flat() for each in draws] == [each.flat() for each in found.draws(400)]
    z = np.array(
        [[one.to_coordinate(each.flat()[one.name]) for one in found.estimates] for each in draws]
    )
    covariance = found.uncertainty.recorded_z.copy()
    [gain] = [k for k, one in enumerate(found.estimates) if one.name == 'actuator.gain']
    covariance[gain, gain] += found.problem.allowance.step_share**2
    errors = np.sqrt(np.diag(covariance))
    assert np.all(np.abs(z.mean(axis=0) - found.uncertainty.z) < 4.0 * errors / 20.0)
    assert z.std(axis=0) == pytest.approx(errors, rel=0.15, abs=0.0)
    correlation = covariance / np.outer(errors, errors)
    assert np.corrcoef(z.T) == pytest.approx(correlation, rel=0.0, abs=0.15)


@pytest.mark.parametrize('text', ['', '{}', '[1]', '{"estimates": [{}]}', '[' * 100_000])
def test_a_file_that_is_no_fit_gives_no_draws(text: str, tmp_path: Path):
    path = tmp_path / 'fitted.json'
    path.write_text(text, encoding='utf-8')
    with pytest.raises(StickSlipError, match='is no fit'):
        read_draws(path)


@pytest.mark.parametrize('lasts_s', [0.0, 2.5e-4])
def test_the_metric_is_that_of_its_covariance(lasts_s: float):
    chance = np.random.default_rng(7)
    time_s = np.delete(np.arange(303) / 1e4, [40, 41, 200])
    rows = voltage((200.0, 400.0, 6), rest_s=4e-3)
    motion = np.cumsum(chance.normal(0.0, 1e-8, 300))
    readings = motion + chance.normal(0.0, 1e-9, 300)
    seen = Readout('position_m', readings, time_s, sensor=KnownSensor(noise_lasts_s=lasts_s))
    rate, curvature = chance.normal(size=(2, 300))
    predicted = Prediction(motion, rate, curvature)
    metric = metric_of(seen, predicted, rows, 1e-9, Allowance())
    residual = seen.values - motion
    columns = (metric.places @ metric.root).toarray()
    apart_s = np.abs(time_s[:, np.newaxis] - time_s)
    noise = np.exp(-apart_s / lasts_s) if lasts_s else np.eye(300)
    # Of the inverse of 1e-18 noise + columns columns', whose condition is 5e12: by least squares
    # in the columns, which rounds with its root.
    root = np.linalg.cholesky(1e-18 * noise)
    sides = np.linalg.solve(root, np.column_stack([columns, residual]))
    system = np.vstack([sides[:, :-1], np.eye(columns.shape[1])])
    right = np.append(sides[:, -1], np.zeros(columns.shape[1]))
    left = right - system @ np.linalg.lstsq(system, right, rcond=None)[0]
    expected = left @ left
    whitened = metric.whitened(residual)
    assert whitened @ whitened == pytest.approx(expected, rel=1e-9, abs=0.0)
    assert columns.shape[1] > 60  # zero, drift, delay, low-pass, bins of three waves, a step


def test_zero_drift_and_lateness_of_a_sensor_are_found_in_a_residual():
    time_s = np.arange(2000) / 5e4
    motion = 1e-7 * np.sin(2.0 * np.pi * 900.0 * time_s)
    rate = 1e-7 * 2.0 * np.pi * 900.0 * np.cos(2.0 * np.pi * 900.0 * time_s)
    late_s = 0.1 * DELAY_S
    noise = np.random.default_rng(3).normal(0.0, 1e-10, 2000)
    readings = motion - late_s * rate + 3e-7 + 2e-7 * time_s + noise
    seen = Readout('position_m', readings, time_s)
    curvature = -((2.0 * np.pi * 900.0) ** 2) * motion
    metric = metric_of(seen, Prediction(motion, rate, curvature), ROWS, 1e-10, None)
    (zero, drift, found_s, _), left = metric.of_sensor(motion - readings)
    assert (-zero, -drift) == pytest.approx((3e-7 + 2e-7 * time_s.mean(), 2e-7), rel=1e-2)
    assert found_s == pytest.approx(late_s, rel=0.02, abs=0.0)
    assert left.std() == pytest.approx(1e-10, rel=0.05, abs=0.0)


def test_a_wave_is_the_cycles_that_are_alike():
    waves = waves_of(voltage((-60.0, 250.0, 3), (280.0, 300.0, 4), (150.0, 300.0, 2)))
    found = {(len(wave), wave[0].falls, round(1e3 * wave[0].length_s, 2)) for wave in waves}
    assert {(3, False, 4.0), (4, True, 3.33), (2, True, 3.33)} <= found
    assert sum(len(wave) for wave in waves) == 13  # and four rests


def test_samples_of_a_cubic_are_read_between_them_with_both_derivatives():
    def cubic(t: np.ndarray) -> np.ndarray:
        return 2.0 - 3e3 * t + 4e7 * t**2 - 5e11 * t**3

    samples = cubic(SAMPLE_S * np.arange(40))
    time_s = np.array([3.3e-6, 4.95e-5, 1.2e-4])
    values, rate, curvature = at_times(samples, time_s)
    assert values == pytest.approx(cubic(time_s), rel=1e-9)
    assert rate == pytest.approx(-3e3 + 8e7 * time_s - 1.5e12 * time_s**2, rel=1e-9)
    assert curvature == pytest.approx(8e7 - 3e12 * time_s, rel=1e-9)


@pytest.mark.parametrize('late_s', [0.0, 3e-3, -2.2e-3])
@pytest.mark.parametrize('noise_m', [1.5e-9, 5e-9])
def test_a_late_clock_is_seen_at_the_falls_of_the_voltage(late_s: float, noise_m: float):
    rig = Rig(late_s=late_s, noise_m=noise_m, low_pass_hz=2e4)
    found = lateness_of(experiment(rig, 5).observed[0], Voltage(ROWS))
    assert found.late_s == pytest.approx(late_s, rel=0.0, abs=1e-4)
    assert found.is_clear == (late_s != 0.0)


@pytest.mark.parametrize(
    ('rig', 'rows', 'rate_hz', 'since_s'),
    [
        (Rig(0.8), SLOWER, 5e3, 0.0),  # too few readings in the ringing
        (Rig(0.8), SLOWER, 1e4, 0.0),
        (Rig(0.8, late_s=1.3e-3), SLOWER, 2e4, 0.0),
        (Rig(0.8, late_s=1.0 / 300.0), SLOWER, RATE_HZ, 0.0),  # a period of the drive
        (Rig(noise_m=5e-8), ROWS, RATE_HZ, 0.0),
        (Rig(0.35, 0.26), MANY, RATE_HZ, MANY[-1, 0] - 0.025),  # most falls are before a window
    ],
)
def test_no_clock_is_late_by_few_readings_noise_a_period_or_earlier_falls(
    rig: Rig, rows: np.ndarray, rate_hz: float, since_s: float
):
    time_s, position_m = rig.positions(rows, rate_hz, 1)
    window = time_s >= since_s
    seen = Readout('position_m', position_m[window], time_s[window])
    assert not lateness_of(seen, Voltage(rows)).is_clear


@pytest.mark.parametrize('digits', [0.8, 1.0, 1.5, 2.0, 5.0])
def test_noise_of_rounded_readings_and_of_their_residuals_is_that_of_noise_and_rounding(digits):
    chance, digit_m = np.random.default_rng(4), 1e-9
    motion = digit_m * (0.013 * np.arange(20000) + 30.0 * np.sin(np.arange(20000) / 300.0))
    rounded = digit_m * np.round(motion / digit_m + chance.normal(0.0, digits, 20000))
    rounding_m = digit_m / np.sqrt(12.0)
    expected = pytest.approx(np.hypot(digits * digit_m, rounding_m), rel=NOISE_SHARE, abs=0.0)
    assert noise_of(rounded) == expected
    assert noise_of(motion - rounded, rounding=rounding_m) == expected


@pytest.mark.parametrize('true_s', [0.0, 1.0 / 300.0])
def test_the_better_of_a_delay_by_the_falls_and_none_is_kept(true_s: float, monkeypatch):
    rig, a_period = Rig(preload_n=0.4, late_s=true_s), Lateness(1.0 / 300.0, is_clear=True)
    monkeypatch.setattr('stickslip_ros.lab.fitting.search.lateness_of', lambda *_: a_period)
    found = fit_of(rig, TWO)
    assert found.holds
    assert_holds(found, rig)
    assert sensor_of(found).late_s == pytest.approx(true_s, rel=0.0, abs=CLOCK_S)
    assert any('its clock is about' in note for note in found.notes) == (true_s > 0.0)


@pytest.mark.parametrize(
    ('columns', 'message'),
    [
        (('position_m',), 'does not hold the voltage that drove it; name its voltage, --map vol'),
        (('voltage_v',), 'shows neither a motion nor a force over time'),
    ],
)
def test_a_table_that_says_too_little_is_refused(columns, message, tmp_path):
    path = tmp_path / 'run.csv'
    frame = pd.DataFrame({'time_s': np.arange(100) / 1e4})
    for name in columns:
        frame[name] = np.linspace(0.0, 1e-6, 100)
    frame.to_csv(path, index=False)
    with pytest.raises(StickSlipError) as refusal:
        fit(path, ['contact.friction'])
    assert message in str(refusal.value)


def test_a_run_of_few_readings_is_refused_by_their_number(tmp_path: Path):
    path = tmp_path / 'run.csv'
    time_s = np.arange(3000) / 1e5
    volts = 300.0 * (time_s * 500.0 % 1.0)
    frame = pd.DataFrame({'time_s': time_s, 'voltage_v': volts, 'position_m': np.nan})
    frame.loc[frame.index[::100], 'position_m'] = 1e-9 * volts[::100]
    frame.to_csv(path, index=False)
    with pytest.raises(OutOfRange) as refusal:
        fit(path, ['contact.friction'])
    assert refusal.value.value == 30
    for part in ('position_m', str(path), '32', 'longer'):
        assert part in str(refusal.value)
    with pytest.raises(OutOfRange, match='position_m'):
        compare(path, Parameters())
