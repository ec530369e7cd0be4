# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A fit says what its stand lacks, and gives no intervals where none hold."""

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fit_cases import EXACT, motion_of
from scipy.signal import lfilter
from spring_rig import Rig, voltage

from stickslip_ros.arrays import Array
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.experiments.experiment import Experiment, Readout, Voltage
from stickslip_ros.lab.experiments.predict import Prediction
from stickslip_ros.lab.fitting.fit import FitOptions, fit
from stickslip_ros.lab.fitting.free import choose_free
from stickslip_ros.lab.fitting.metric import CORRELATED_S, Allowance, metric_of, waves_of
from stickslip_ros.lab.fitting.missing import missing_from
from stickslip_ros.lab.fitting.problem import pose
from stickslip_ros.lab.fitting.report import Fit, as_object, warnings_of
from stickslip_ros.lab.fitting.result import read_draws
from stickslip_ros.parameters import Parameters, Scalar

ROWS = voltage((300.0, 600.0, 6), rest_s=1e-3)
RATE_HZ, NOISE_M = 50e3, 1.5e-9
SETTINGS: dict[str, Scalar] = {'stand.preload': 0.6, 'load_cell.contact': 'absent'}
UNDAMPED = Parameters()
STAND = UNDAMPED.updated({'runner.damping': 20.0})
RINGS = {'actuator.resonance': 160e3, 'actuator.damping_ratio': 0.07}
TWO = ['contact.friction', 'actuator.gain']
ALONE = FitOptions(starts=1, workers=1, assume=EXACT)


def shown(lacking: Mapping[str, Any], on: Parameters = STAND, rows: Array = ROWS) -> Experiment:
    """Give the position of a stand without noise, whose standard error is stated."""
    one = motion_of(on.updated({**SETTINGS, **lacking}), rows)
    return replace(one, observed=(replace(one.observed[0], sigma=NOISE_M),))


def with_error(one: Experiment, error_m: Array | float = 0.0) -> Experiment:
    """Add an error, and noise, to a position."""
    [seen] = one.observed
    noise = np.random.default_rng(1).normal(0.0, NOISE_M, len(seen.values))
    return replace(one, observed=(replace(seen, values=seen.values + error_m + noise),))


def first_of(one: Experiment, on: Parameters = STAND) -> str:
    """Give the first suspect of a recording at the values of a stand."""
    stand, free, _ = choose_free(on, TWO)
    problem = pose(stand, free, [one])
    problem = problem.measured_at(problem.predicted([stand])[0])
    first, *_ = missing_from(problem, problem.start)
    assert first.odds > 2.0
    return first.name


@pytest.mark.parametrize(
    ('on', 'lacking', 'name'),
    [
        (UNDAMPED, {'runner.damping': 20.0}, 'runner.damping'),
        (UNDAMPED, RINGS, 'actuator.resonance'),
        (UNDAMPED, {'amplifier.bandwidth': 220e3}, 'amplifier.bandwidth'),
        (UNDAMPED, {'stand.load': 0.02}, 'stand.load'),
        (UNDAMPED, {'frame.resonance': 2e3, 'frame.mass': 0.1}, 'frame.resonance'),
        (UNDAMPED, {'contact.friction_rate': 0.03}, 'contact.friction_rate'),
        (STAND, {'contact.friction_ageing': 0.02}, 'contact.friction_ageing'),
        (STAND, {'actuator.hysteresis': 0.05}, 'actuator.hysteresis'),
        (STAND, {'feet.guide_friction': 9e-3}, 'feet.guide_friction'),
    ],
)
def test_what_the_stand_lacks_is_named_first(on, lacking, name):
    assert first_of(with_error(shown(lacking, on)), on) == name


@pytest.mark.parametrize('fringe_m', [158.2e-9, 316.4e-9])
def test_a_cyclic_error_of_the_sensor_is_named_with_its_fringe_and_solved_for(fringe_m: float):
    one = shown({})
    error_m = 4e-9 * np.sin(2.0 * np.pi * one.observed[0].values / fringe_m + 1.0)
    assert first_of(with_error(one, error_m)) == f'cyclic error of {1e9 * fringe_m:.4g} nm'
    found = fit(with_error(one, error_m), TWO, parameters=STAND, options=ALONE)
    assert_holds(found)
    assert any(f'in each fringe of {1e9 * fringe_m:.4g} nm is ' in x for x in found.notes)


def assert_holds(found: Fit) -> None:
    """Assert that a fit holds, and that its intervals hold the values of STAND."""
    assert found.holds
    for each in found.estimates:
        assert each.low < STAND.flat()[each.name] < each.high


def fit_of(rig: Rig, seed: int, free: list[str]) -> Fit:
    """Fit a rig with the damping of STAND."""
    time_s, position_m = rig.positions(ROWS, RATE_HZ, seed)
    one = Experiment('rig', SETTINGS, Voltage(ROWS), (Readout('position_m', position_m, time_s),))
    return fit(one, free, parameters=STAND, options=FitOptions(starts=1, workers=1))


@pytest.fixture(scope='module')
def ringing() -> Fit:
    """Give a fit without a resonance of a rig whose piezo rings."""
    rig = Rig(preload_n=0.6, resonance_hz=160e3)
    return fit_of(rig, 3, ['contact.friction', 'runner.mass'])


def test_a_ringing_piezo_that_passes_for_little_friction_is_told(ringing: Fit):
    assert ringing.estimates[0].value < 0.1  # where 0.3 is true
    assert ringing.missing[0].chi_square < 1.1 * ringing.readings  # says nothing
    [reason] = ringing.reasons
    assert reason.startswith('values move beyond their errors with actuator.resonance ')
    assert reason.endswith(' standard errors')
    [warning] = [text for text in warnings_of(ringing) if text.startswith('the stand may lack')]
    assert warning.startswith('the stand may lack actuator.resonance ')


def test_a_fit_that_does_not_hold_shows_no_intervals_and_gives_no_draws(ringing, tmp_path):
    assert repr(ringing).splitlines()[0].endswith(', not reliable')
    verdict, ratios, values, *others = ringing.sections()
    assert 'correlations of the parameters' not in {each.title for each in others}
    assert {row[2:5] for row in (*ratios.rows, *values.rows)} == {('-', '-', '-')}
    assert verdict.notes[0].startswith('The fit does not hold, so no errors are given')
    path = tmp_path / 'fitted.json'
    path.write_text(json.dumps(as_object(ringing)), encoding='utf-8')
    with pytest.raises(StickSlipError, match='is of a fit that failed its checks; free the'):
        read_draws(path)


def test_a_value_that_is_held_wrong_and_moves_a_free_one_is_told():
    held = fit_of(Rig(preload_n=0.6, mass_kg=3.3e-3), 4, TWO)
    assert held.chi_square < 1.5 * held.readings  # the allowance covers what is missed
    assert held.p_value is None
    told = 'values move beyond their errors with '
    assert any(reason.startswith(told) for reason in held.reasons)


def shape(time_s: Array, rows: Array, rms_m: float) -> Array:
    """Give an error of a motion that is the same in each cycle of a wave."""
    chance, error_m = np.random.default_rng(3), np.zeros(len(time_s))
    for wave in waves_of(rows):
        grid_s = np.arange(0.0, wave[0].length_s + 1e-3, 1e-5)
        heavy = chance.normal(size=len(grid_s))
        like = lfilter([1.0], [1.0, -np.exp(-1e-5 / CORRELATED_S)], heavy)
        for cycle in wave:
            inside = (time_s >= cycle.start_s) & (time_s < cycle.start_s + cycle.length_s)
            error_m[inside] = np.interp(time_s[inside] - cycle.start_s, grid_s, like)
    return rms_m * error_m / max(float(np.std(error_m)), 1e-300)


@pytest.mark.parametrize('rms_m', [5e-9, 0.0])
def test_the_shape_that_a_model_owes_is_found_in_its_residual(rms_m: float):
    rows = voltage((-60.0, 250.0, 4), (280.0, 300.0, 6), (300.0, 600.0, 8))
    one = shown({}, rows=rows)
    [[true], [seen]] = (
        one.observed,
        with_error(one, shape(one.observed[0].time_s, rows, rms_m)).observed,
    )
    still, owed_m = np.zeros_like(true.values), 1e-9
    model = Prediction(true.values, still, still)
    metric = metric_of(seen, model, rows, NOISE_M, Allowance(shape_m=owed_m))
    for _ in range(8):
        squares, counts = metric.model_error(model.values - seen.values)
        factor = float(np.sqrt(squares[0] / counts[0]))
        owed_m, metric = owed_m * factor, metric.with_sizes(np.array([factor, 1.0, 1.0]))
    assert owed_m == pytest.approx(rms_m, rel=0.3, abs=0.3e-9)


def test_a_fit_holds_with_the_errors_of_what_its_model_owes():
    one = shown({})
    right, wrong = (
        fit(with_error(one, each), TWO, parameters=STAND, options=ALONE)
        for each in (0.0, shape(one.observed[0].time_s, ROWS, 2e-9))
    )
    assert_holds(right)
    assert_holds(wrong)
    assert right.problem.allowance == Allowance()
    assert wrong.problem.allowance is not None
    assert wrong.problem.allowance.shape_m > 1e-9
    assert wrong.estimates[1].standard_error > 1.5 * right.estimates[1].standard_error
