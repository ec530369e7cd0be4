# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A fit says what its stand lacks, and gives no intervals where none hold."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from spring_rig import Rig, voltage

from stickslip_ros.arrays import Array
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.experiments.experiment import Experiment, Seen, Voltage
from stickslip_ros.lab.experiments.predict import predict
from stickslip_ros.lab.fitting.draws import read_draws
from stickslip_ros.lab.fitting.fit import FitOptions, fit
from stickslip_ros.lab.fitting.free import choose_free
from stickslip_ros.lab.fitting.missing import missing_from
from stickslip_ros.lab.fitting.problem import Predicted, Problem, StandardErrors, pose
from stickslip_ros.lab.fitting.profile import ChiSquareGrid
from stickslip_ros.lab.fitting.report import Fit, as_object, warnings_of
from stickslip_ros.lab.fitting.search import along_valley, search
from stickslip_ros.lab.fitting.statistics import QUANTILE_95, Uncertainty
from stickslip_ros.parameters import Parameters, Scalar

ROWS = voltage((300.0, 600.0, 6), rest_s=1e-3)
RATE_HZ, NOISE_M = 50e3, 1.5e-9
SETTINGS: dict[str, Scalar] = {'stand.preload': 0.6, 'load_cell.contact': 'absent'}


@pytest.mark.parametrize(
    'lacking',
    [
        {'runner.damping': 20.0},
        {'actuator.resonance': 160e3, 'actuator.damping_ratio': 0.07},
        {'amplifier.bandwidth': 220e3},
        {'actuator.hysteresis': 0.05},
    ],
)
def test_a_part_that_is_switched_off_is_named_where_a_recording_shows_it(
    lacking: Mapping[str, float],
):
    time_s = np.arange(0.0, ROWS[-1, 0], 1.0 / RATE_HZ)
    blank = Seen('position_m', np.zeros(len(time_s)), time_s, NOISE_M)
    asked = Experiment('drive', SETTINGS, Voltage(ROWS), (blank,))
    [[shown]] = predict(Parameters().updated(dict(lacking)), [asked])
    noise = np.random.default_rng(1).normal(0.0, NOISE_M, len(time_s))
    one = replace(asked, seen=(replace(blank, values=shown.values + noise),))
    stand, free, _ = choose_free(Parameters(), ['contact.friction', 'actuator.gain'])
    problem = pose(stand, free, [one])
    found = missing_from(problem, problem.start)
    assert found[0].name == next(iter(lacking))


@pytest.fixture(scope='module')
def ringing() -> Fit:
    """Give a fit without a resonance of a rig whose piezo rings."""
    rig = Rig(preload_n=0.6, resonance_hz=160e3)
    time_s, position_m = rig.positions(ROWS, RATE_HZ, 3)
    seen = Seen('position_m', position_m, time_s)
    one = Experiment('rig', SETTINGS, Voltage(ROWS), (seen,))
    stand = Parameters().updated({'runner.damping': rig.damping_n_s_per_m})
    free = ['contact.friction', 'runner.mass']
    return fit(one, free, parameters=stand, options=FitOptions(starts=1, workers=1))


def test_a_ringing_piezo_that_passes_for_little_friction_is_found_by_a_trial(ringing: Fit):
    friction, _ = ringing.estimates
    assert friction.value < 0.1  # where 0.3 is true, and chi-square says nothing
    assert ringing.p_value is not None
    assert ringing.p_value > 0.05
    assert ringing.trial is not None
    assert ringing.trial.values[0] == pytest.approx(0.3, rel=0.15, abs=0.0)
    assert not ringing.holds
    [warning] = [text for text in warnings_of(ringing) if 'the model is incomplete' in text]
    assert 'with actuator.resonance, actuator.damping_ratio, amplifier.bandwidth free' in warning
    assert 'with other values: contact.friction 0.2' in warning


def test_a_fit_that_does_not_hold_shows_no_intervals_and_gives_no_draws(
    ringing: Fit, tmp_path: Path
):
    assert repr(ringing).splitlines()[0].endswith(', not reliable')
    ratios, values, *_ = ringing.sections()
    assert {row[2:5] for row in (*ratios.rows, *values.rows)} == {('-', '-', '-')}
    assert values.notes[0].startswith('The fit failed its checks, so no errors are given')
    path = tmp_path / 'fitted.json'
    path.write_text(json.dumps(as_object(ringing)), encoding='utf-8')
    with pytest.raises(StickSlipError, match='is of a fit that failed its checks; free the'):
        read_draws(path)


def test_a_grid_tells_how_far_what_follows_it_may_be():
    places = np.array([[0.0, 1.0], [1.0, 3.0], [2.0, 9.0]])
    grid = ChiSquareGrid(places, np.array([5.0, 6.0, 50.0]), np.array([0.0, 0.5]))
    assert grid.range_of(0, 4.0) == (0.0, 1.0)
    assert grid.range_of(1, 4.0) == pytest.approx((0.0, 3.0 + 0.5 * np.sqrt(3.0)))


def test_intervals_reach_those_of_other_minima():
    doubt = Uncertainty(
        dof=10,
        variance_scale=1.0,
        quantile=QUANTILE_95,
        covariance_z=np.array([[1.0, 0.5], [0.5, 4.0]]),
        at_bound=np.zeros(2, np.bool_),
        inert=np.zeros(2, np.bool_),
        undetermined=np.zeros(2, np.bool_),
        singular_values=(1.0, 1.0),
        weakest=(1.0, 0.0),
    )
    wider = doubt.reaching(np.zeros(2), np.array([[5.0, 0.0]]), np.array([0.0]))
    assert wider.errors_z[0] == pytest.approx((5.0 + QUANTILE_95) / QUANTILE_95)
    assert wider.errors_z[1] == pytest.approx(2.0)
    assert wider.correlation == pytest.approx(doubt.correlation)
    assert doubt.reaching(np.zeros(2), np.empty((0, 2)), np.empty(0)) is doubt


class Valley(Problem):
    """A curved valley of two coordinates with a rough floor, lowest near (1, 1)."""

    @property
    def bounds(self) -> tuple[Array, Array]:
        return np.full(2, -3.0), np.full(2, 3.0)

    def residuals(self, coordinates: Array) -> Array:
        x, y = coordinates
        return np.array([300.0 * (y - x * x), 2.0 * (x - 1.0), 0.6 * np.cos(1000.0 * x)])

    def slopes(self, coordinates: Array, *, central: bool = False) -> Array:
        x, _ = coordinates
        return np.array([[-600.0 * x, 300.0], [2.0, 0.0], [0.0, 0.0]])  # the ripple is too fine

    def stand(self, coordinates: Array) -> Parameters:
        return Parameters()

    def predicted(self, stands: Sequence[Parameters]) -> list[Predicted]:
        return [[] for _ in stands]


def test_a_search_goes_on_where_a_curved_valley_with_a_rough_floor_stopped_it():
    problem = Valley(Parameters(), (), (), StandardErrors(known=True, values=()))
    stopped = search(problem, np.array([-0.6, 0.36]))
    assert stopped.converged
    assert stopped.chi_square > 5.0
    _, found = along_valley(problem, stopped)
    assert found[-1].chi_square < 1.0


def test_a_value_that_is_held_wrong_and_moves_a_free_one_is_told():
    rig = Rig(preload_n=0.6, mass_kg=3.1e-3)
    time_s, position_m = rig.positions(ROWS, RATE_HZ, 4)
    one = Experiment('rig', SETTINGS, Voltage(ROWS), (Seen('position_m', position_m, time_s),))
    stand = Parameters().updated({'runner.damping': rig.damping_n_s_per_m})
    held = fit(
        one,
        ['contact.friction', 'actuator.gain'],
        parameters=stand,
        options=FitOptions(starts=1, workers=1),
    )
    assert held.p_value is not None
    assert held.p_value > 0.01  # the allowance covers what is missed
    assert held.is_biased
    assert not held.holds
    assert any('the model is incomplete' in text for text in warnings_of(held))
