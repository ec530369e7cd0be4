# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Errors of the constants that a fit assumes: intervals hold on feet that are not the assumed."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fit_cases import motion_of
from spring_rig import voltage

from stickslip_ros import load_yaml, stage_file
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.experiments.experiment import Experiment, Voltage
from stickslip_ros.lab.experiments.predict import predict
from stickslip_ros.lab.figures.page import page_of
from stickslip_ros.lab.fitting.assumed import (
    ASSUMED_SHARES,
    CALIBRATIONS,
    FEET_NUMBER,
    LOAD_FACTOR,
    assumed_of,
    slopes_of_constants,
    with_constant,
)
from stickslip_ros.lab.fitting.fit import FitOptions, fit
from stickslip_ros.lab.fitting.free import Free
from stickslip_ros.lab.fitting.report import Fit, as_object
from stickslip_ros.lab.fitting.statistics import uncertainty
from stickslip_ros.lab.measurements.numbers import stage_hz
from stickslip_ros.parameters import Parameters

ROWS = voltage((-60.0, 250.0, 1), (-170.0, 200.0, 1), (280.0, 300.0, 5), (300.0, 600.0, 8))
TRUTH = {
    'contact.friction': 0.25,
    'contact.prefactor': 5.5e-4,
    'runner.mass': 3.2e-3,
    'runner.damping': 25.0,
    'actuator.gain': 5.5e-10,
}
DRIVEN_BY = 'one wave', 'another wave'
PRELOAD_N, NOISE_M = 0.33, 1.5e-9
STAND = Parameters().updated({**TRUTH, 'stand.preload': PRELOAD_N})
LIMIT_N = TRUTH['contact.friction'] * 2.0 * 2.0**0.5 * PRELOAD_N
LOADED: Mapping[str, Any] = {'stand.load': 0.05 * LIMIT_N}
THREE_FEET: Mapping[str, Any] = {'feet.count': (3,), 'feet.share': (0.943,)}
ALUMINIUM: Mapping[str, Any] = {'contact.young_runner': 70e9}
STEPWISE = 1e-9  # relative rounding of two stands that move alike


def recorded(changes: Mapping[str, Any]) -> Experiment:
    """Give the noisy position of a stand that differs from the stand of the paper."""
    seen = motion_of(STAND.updated(dict(changes)), ROWS, NOISE_M, seed=2)
    return replace(seen, drive=Voltage(ROWS, notes=DRIVEN_BY))


def learned(seen: Experiment, assume: Mapping[str, str], known: str | None = None) -> Fit:
    free = [Free(name, known=known if name == 'runner.mass' else None) for name in TRUTH]
    return fit(seen, free, options=FitOptions(starts=1, assume=assume))


def assuming(found: Fit, shares: Mapping[str, float]) -> Fit:
    """Give a fit with other errors of constants, of which only its errors depend."""
    doubt = uncertainty(found.problem, found.found.place, shares, found.missing)
    return replace(found, uncertainty=doubt)


@pytest.fixture(scope='module', params=[THREE_FEET, ALUMINIUM], ids=['three feet', 'aluminium'])
def changes(request: pytest.FixtureRequest) -> Mapping[str, Any]:
    """Give feet or a runner that the fit does not know."""
    return dict(request.param)


@pytest.fixture(scope='module')
def other(changes: Mapping[str, Any]) -> tuple[Experiment, Fit]:
    """Give a recording of them, and its fit."""
    seen = recorded(changes)
    return seen, learned(seen, {})


def test_intervals_hold_on_feet_and_runners_that_nobody_described(other: tuple[Experiment, Fit]):
    _, found = other
    assert found.holds
    for one in found.estimates:
        assert one.low < TRUTH[one.name] < one.high
    exact = assuming(found, {})
    assert exact.holds
    mass = exact.estimates[2]
    assert mass.low > 1.1 * TRUTH['runner.mass']  # with the contact as exact


def test_friction_allows_for_a_load_that_was_not_told():
    seen, true = recorded(LOADED), LIMIT_N / TRUTH['runner.mass']
    found = learned(seen, {})
    feet_alone = {**found.uncertainty.shares, LOAD_FACTOR: 0.0}
    friction, exact = (
        next(one for one in each.ratios if one.name == 'friction, mu F/m')
        for each in (found, assuming(found, feet_alone))
    )
    assert friction.low < true < friction.high
    assert not exact.low < true < exact.high
    one = replace(seen, load_n=LOADED['stand.load'])
    told = fit(one, 'actuator.gain', parameters=STAND, options=FitOptions(starts=1))
    assert LOAD_FACTOR not in told.uncertainty.shares


def test_a_load_can_be_free():
    free = [*map(Free, TRUTH), Free('stand.load', low=-0.1, high=0.1)]
    found = fit(recorded(LOADED), free, options=FitOptions(starts=1))
    load = found.estimates[-1]
    assert load.low < LOADED['stand.load'] < load.high
    assert load.standard_error < LOADED['stand.load']
    assert found.scale_of('stand.load') == 'from the assumed contact'
    assert LOAD_FACTOR not in found.uncertainty.shares


def test_ratios_are_narrow_and_hold_whatever_the_feet_are(changes, other):
    _, found = other
    ratios = {one.name: one for one in found.ratios}
    ringing = ratios['ringing, k/m']
    assert ringing.high - ringing.low < 5.0 * ringing.standard_error
    for name, true in (
        ('ringing, k/m', stage_hz(STAND.updated(dict(changes)))),
        ('damping, c/m', TRUTH['runner.damping'] / TRUTH['runner.mass']),
        ('friction, mu F/m', LIMIT_N / TRUTH['runner.mass']),
        ('gain', TRUTH['actuator.gain']),
    ):
        assert ratios[name].low < true < ratios[name].high
        assert ratios[name].standard_error < 0.03 * true


def test_the_report_says_where_the_scale_comes_from(other: tuple[Experiment, Fit]):
    _, found = other
    text = repr(found)
    assert (
        'Scale from the assumed contact: contact.friction, contact.prefactor, runner.mass' in text
    )
    assert 'Assumed errors, also in the covariance: scale 30 %, contact.radius 50 %' in text
    assert 'feet and contacts are those of the paper, as none were described' in text
    page = page_of(found.sections())
    pictures = 'readings (A) and model (B)', 'correlations of the parameters'
    told = (
        f'<h1>fit of {", ".join(TRUTH)} to rig',
        'The fit holds.',
        'what the recording shows, whatever the feet are',
        '<h2>fitted parameters</h2>\n<table>',
        *(f'alt="{each}, drawn"' for each in pictures),
        '<td>driven by</td><td>one wave<br>another wave</td>',
    )
    places = [page.find(each) for each in told]
    assert places == sorted(places)
    assert places[0] > 0
    assert not any(each in found._repr_html_() for each in pictures)
    content = as_object(found)
    untold = {'contact.radius': 0.5, FEET_NUMBER: 0.5, LOAD_FACTOR: 0.03}
    assert content['assumed'] == {**ASSUMED_SHARES, **untold, **CALIBRATIONS}
    assert [each['name'] for each in content['ratios']][-1] == 'gain'
    assert content['bands'].startswith('bands hold for motions; forces also have the error of')


def test_the_scale_moves_whatever_opposes_a_motion_and_nothing_else(other: tuple[Experiment, Fit]):
    _, found = other
    problem, place, doubt = found.problem, found.found.place, found.uncertainty
    readings = slice(-len(place))  # without what was known before
    [grown] = slopes_of_constants(problem, place, ['scale'])[readings].T
    natural, *_ = np.linalg.lstsq(problem.slopes(place, central=True)[readings], -grown)
    moves = doubt.per_natural @ natural / doubt.sizes
    assert moves == pytest.approx([1.0, 0.0, 1.0, 1.0, 0.0], rel=0.0, abs=0.02)


def test_twice_the_feet_move_as_twice_the_feet():
    one = recorded({})
    twice = {'feet.count': (4, 8), 'feet.share': (2.0**0.5 / 4, 2.0**0.5 / 8)}
    [[true]] = predict(STAND.updated(twice), [one])
    [[found]] = predict(STAND, [with_constant(STAND, one, FEET_NUMBER, 2.0)])
    assert found.values == pytest.approx(true.values, rel=0.0, abs=STEPWISE * np.ptp(true.values))


def test_a_voltage_monitor_that_is_2_percent_wrong_puts_the_gain_two_errors_off():
    seen, true = recorded({}), TRUTH['actuator.gain']
    wrong = replace(seen, drive=Voltage(ROWS * [1.0, 0.98]))
    found = learned(wrong, {})
    [gain] = [one for one in found.estimates if one.name == 'actuator.gain']
    [shown] = [one for one in found.ratios if one.name == 'gain']
    for one in (gain, shown):
        assert one.value == pytest.approx(true / 0.98, rel=1e-3)
        assert one.standard_error == pytest.approx(0.01 * true, rel=0.1)
        assert 1.9 < (one.value - true) / one.standard_error < 2.1
    assert 'voltage 1 %, position 0.1 %' in repr(found)
    spread = np.std(np.log([each.actuator.gain for each in found.draws(400)]))
    own = np.sqrt(found.uncertainty.recorded_z[4, 4])
    assert spread == pytest.approx(np.hypot(own, 3e-3), rel=0.15)  # 0.3 % of a step is owed


CLAMP = load_yaml(stage_file('clamp'))
GUIDED = {**TRUTH, 'runner.mass': 0.036, 'runner.damping': 31.0, 'actuator.gain': 9.1e-9}
GUIDED |= {'feet.share[1]': 0.08}  # where the file assumes 0.05, from 0.005 to 1


@pytest.fixture(scope='module')
def clamped() -> Experiment:
    """Give the noisy position of a clamp with a stiffer guide than that of its file."""
    rows = voltage((95.0, 200.0, 3), (-60.0, 200.0, 1), (70.0, 400.0, 5))
    return motion_of(CLAMP.updated({**GUIDED, 'stand.preload': 8.0}), rows, NOISE_M, seed=3)


def test_the_share_of_a_guide_is_named_and_can_be_learned(clamped: Experiment):
    options = FitOptions(starts=1)
    lacking = fit(clamped, [*TRUTH], parameters=CLAMP, options=options)
    assert lacking.missing[0].name == 'feet.share[1]'
    assert lacking.missing[0].odds > 20.0
    share = Free('feet.share[1]', low=0.005, high=1.0)
    options = FitOptions(starts=1, assume={'contact.radius': '5mm+-2%'})
    weighed = [name for name in TRUTH if name != 'runner.mass']
    free: list[str | Free] = [*weighed, Free('runner.mass', known='36g+-1%'), share]
    found = fit(clamped, free, parameters=CLAMP, options=options)
    assert found.holds
    for one in found.estimates:
        assert one.low < GUIDED[one.name] < one.high
    assert found.estimates[-1].value == pytest.approx(0.08, rel=0.02)
    friction = found.estimates[0]
    assert friction.standard_error < 0.08 * friction.value


def test_ranges_of_a_stage_are_assumed_errors_unless_a_value_is_given():
    _, shares = assumed_of(CLAMP, ['runner.mass', 'feet.share[1]'], {'contact.radius': '+-2%'})
    assert shares['contact.radius'] == 0.02
    assert 'feet.share[1]' not in shares
    assert shares['stand.preload'] == pytest.approx(np.log(30.0) / 3.92)  # 95 % within 1 to 30 N
    assert shares[FEET_NUMBER] == pytest.approx(np.log(4.0) / 3.92)
    _, shares = assumed_of(CLAMP.updated({'contact.radius': '4mm'}), ['runner.mass'], {})
    assert shares['contact.radius'] == ASSUMED_SHARES['contact.radius']
    assert shares['feet.share[1]'] == pytest.approx(np.log(200.0) / 3.92)
    walker = assumed_of(load_yaml(stage_file('walker')), ['runner.mass'], {})[1]
    assert walker['stand.load'] == pytest.approx(0.5 / 0.2 / 3.92)  # a range that ends at 0


@pytest.mark.slow  # a fit on feet that it does not know, and another of a weighed runner
def test_a_weighed_mass_far_from_that_of_the_readings_is_named():
    seen = recorded({})
    found = learned(seen, {}, known='6g+-1%')
    assert not found.holds
    [tension] = [each for each in found.tensions if each.name == 'runner.mass']
    assert tension.apart > 3.0
    assert TRUTH['runner.mass'] < tension.preferred < 0.9 * 6e-3
    assert any(text.startswith('runner.mass is 0.006 +- 1 %, but the') for text in found.reasons)


def test_a_weighed_mass_and_a_free_radius_learn_the_friction_of_unknown_feet():
    free: list[str | Free] = [name for name in TRUTH if name != 'runner.mass']
    weighed = Free('runner.mass', known='3.2g+-1%')
    options = FitOptions(starts=1)
    found = fit(recorded(THREE_FEET), [*free, weighed, 'contact.radius'], options=options)
    assert found.holds
    friction = found.estimates[0]
    assert friction.low < TRUTH['contact.friction'] < friction.high
    assert friction.standard_error < 0.1 * friction.value
    assert found.scale_of('runner.mass') == 'weighed'
    assert found.scale_of('contact.friction') == 'from the weighed mass'


def test_values_and_errors_of_constants_are_stated_and_a_described_foot_is_no_doubt():
    stand, shares = assumed_of(
        Parameters(),
        ['contact.young_runner'],
        {'contact.radius': '0.4mm+-2%', 'scale': '+-0%', 'amplifier.slew_rate': (1e8, 0.1)},
    )
    assert stand.contact.radius == pytest.approx(4e-4, rel=1e-12, abs=0.0)
    assert stand.amplifier.slew_rate == 1e8
    assert shares.pop('scale') == 0.0
    assert shares == pytest.approx(
        {
            'contact.radius': 0.02,
            'contact.young_sphere': 0.1,
            'stand.preload': 0.05,
            'amplifier.slew_rate': 0.1,
        }
    )


@pytest.mark.parametrize(
    ('name', 'stated', 'message'),
    [
        ('contact.radius', '1mm', 'is not VALUE'),
        ('contact.radius', '+-100%', 'with an error of 0 to less than 100 %'),
        ('scale', '2+-10%', r'not a value above 0 \(scale, feet, load, voltage, position: 1\)'),
        ('contact.friction', '+-1%', 'of a free parameter; leave it out, or use --known'),
        ('contact.radus', '+-1%', 'contact.radius'),
        ('feet.count', '+-1%', 'a quantity'),
        ('actuator.creep', '+-1%', 'not a value above 0'),
    ],
)
def test_an_assumption_that_is_none_is_refused(name: str, stated: str, message: str):
    with pytest.raises(StickSlipError, match=message):
        assumed_of(Parameters(), ['contact.friction'], {name: stated})
