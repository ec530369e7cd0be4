# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Numbers of rigs of springs teach a drive: steps, a data sheet, 0-amplitude, ring-down."""

import math
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
import pytest
from fit_cases import EXACT
from spring_rig import G_STAR_PA, SHARES, SLEW_V_PER_S, Rig, contact

from stickslip_ros import load_yaml, stage_file
from stickslip_ros.arrays import Array
from stickslip_ros.drive.build import friction_limit_n, slew_of
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.comparison.compare import CompareOptions, compare
from stickslip_ros.lab.experiments.experiment import Experiment, Readout, VoltageStep
from stickslip_ros.lab.experiments.options import ReadingOptions
from stickslip_ros.lab.experiments.predict import predict, ring_down
from stickslip_ros.lab.experiments.reading import read_experiments
from stickslip_ros.lab.fitting.fit import FitOptions, fit
from stickslip_ros.lab.fitting.report import as_object
from stickslip_ros.lab.fitting.search import Minimum, distinct
from stickslip_ros.lab.linear.linearise import linearise
from stickslip_ros.lab.runs.sawtooth_run import run_drive, simulate, voltage_for
from stickslip_ros.lab.runs.zero_amplitude import WITHOUT_CELL, zero_amplitude
from stickslip_ros.parameters import Parameters

SET = Parameters().updated({'stand.preload': 0.5})
FREE = SET.updated({'load_cell.contact': 'absent'})
RIG = Rig(
    preload_n=0.4,
    friction=0.26,
    mass_kg=3.4e-3,
    damping_n_s_per_m=25.0,
    noise_m=0.0,
    zero_m=0.0,
    drift_m_per_s=0.0,
)
STIFFNESS_SHARE = 2e-4  # that springs of finite width miss of the stiffness of a contact
STROKES_M = np.linspace(115e-9, 160e-9, 4)
STEPS, PERIOD_S = 14, 1e-3


def linear(rig: Rig) -> tuple[float, float]:
    """Give frequency and decay of the mass on its sticking contacts: m x'' + c x' + K x = 0."""
    stiff_n_per_m = sum(
        2.0 * G_STAR_PA * contact(share * rig.preload_n, rig.prefactor)[0] for share in SHARES
    )
    decay_per_s = rig.damping_n_s_per_m / (2.0 * rig.mass_kg)
    rate = np.sqrt(stiff_n_per_m / rig.mass_kg - decay_per_s**2)
    return rate / (2.0 * np.pi), 1.0 / decay_per_s


def rung(rig: Rig, amplitude_m: float) -> tuple[float, float]:
    """Give frequency and decay of a rig after a step of its voltage."""
    volts = amplitude_m / rig.gain_m_per_v
    fall_s = volts / SLEW_V_PER_S
    rows = np.array([(0.0, 0.0), (1e-5, 0.0), (1e-5 + fall_s, volts), (2e-3, volts)])
    time_s, position_m = rig.positions(rows, 2e5, 1)
    after = time_s >= 1e-5 + fall_s
    return ring_down(time_s[after], position_m[after])


def stand(rig: Rig) -> Parameters:
    return Parameters().updated(
        {
            'stand.preload': rig.preload_n,
            'contact.friction': rig.friction,
            'contact.prefactor': rig.prefactor,
            'runner.mass': rig.mass_kg,
            'runner.damping': rig.damping_n_s_per_m,
            'actuator.gain': rig.gain_m_per_v,
        }
    )


def steps_m(rig: Rig, volts: float) -> tuple[float, float]:
    """Give the sizes of the steps of a rig up and down."""
    found = []
    for low_v, high_v in ((0.0, volts), (volts, 0.0)):
        ramp_s = PERIOD_S - volts / SLEW_V_PER_S
        cycles = [
            (k * PERIOD_S + at_s, to_v)
            for k in range(STEPS)
            for at_s, to_v in ((ramp_s, high_v), (PERIOD_S, low_v))
        ]
        time_s, position_m = rig.positions(np.array([(0.0, low_v), *cycles]), 1e6, 1)
        places_m = np.interp(PERIOD_S * np.array([STEPS - 10, STEPS]), time_s, position_m)
        found.append(abs(np.diff(places_m)[0]) / 10.0)
    return found[0], found[1]


def predicted(columns: dict[str, list[Any]], on: Parameters, **said: Any) -> list[float]:
    """Give the predictions of a table of an owner."""
    read = read_experiments(pd.DataFrame(columns), on, ReadingOptions(**said))
    return [float(each.values[0]) for [each] in predict(on, read)]


def rings(rig: Rig, amplitude_m: float) -> tuple[float, float]:
    nothing = np.zeros(1)
    seen = Readout('ringing_hz', nothing), Readout('decay_s', nothing)
    [[hertz, decay]] = predict(
        stand(rig), [Experiment('', WITHOUT_CELL, VoltageStep(amplitude_m), seen)]
    )
    return float(hertz.values[0]), float(decay.values[0])


@pytest.mark.parametrize('damping_n_s_per_m', [4.0, 25.0, 90.0])
def test_a_small_ring_down_is_that_of_a_linear_oscillator(damping_n_s_per_m: float):
    rig = Rig(preload_n=0.4, damping_n_s_per_m=damping_n_s_per_m)
    hertz, decay_s = rings(rig, 1e-12)
    expected_hz, expected_s = linear(rig)
    assert hertz == pytest.approx(expected_hz, rel=STIFFNESS_SHARE, abs=0.0)
    assert decay_s == pytest.approx(expected_s, rel=1e-6, abs=0.0)


@pytest.mark.parametrize('amplitude_m', [2e-9, 3e-8, 1.2e-7])
def test_a_large_ring_down_is_that_of_springs_that_slip(amplitude_m: float):
    rig = RIG
    hertz, decay_s = rings(rig, amplitude_m)
    expected_hz, expected_s = rung(rig, amplitude_m)
    assert hertz == pytest.approx(expected_hz, rel=1e-3, abs=0.0)
    assert decay_s == pytest.approx(expected_s, rel=0.02, abs=0.0)


def test_the_nearest_damped_cosine_is_found_whatever_its_rest_and_drift():
    time_s: Array = np.linspace(0.0, 399 * 5e-6, 400, dtype=np.float64)
    motion = np.exp(-time_s / 2.3e-4) * np.cos(2.0 * np.pi * 9.1e3 * time_s + 0.4)
    found = ring_down(time_s, 1e-9 * motion + 3e-9 + 2e-7 * time_s)
    assert found == pytest.approx((9.1e3, 2.3e-4), rel=1e-7, abs=0.0)
    still = ring_down(time_s, 0.0 * time_s)
    assert np.all(np.isfinite(still))


def test_who_knows_a_0_amplitude_and_a_ring_down_learns_friction_mass_and_damping():
    rig = RIG
    lengths_m = [steps_m(rig, each / rig.gain_m_per_v)[0] for each in STROKES_M]
    slope, at_0_m = np.polyfit(STROKES_M, lengths_m, 1)
    hertz, decay_s = linear(rig)
    zeros = pd.DataFrame(
        {
            '0-amplitude (nm)': [-1e9 * at_0_m / slope],
            '0-amplitude std (nm)': [0.5],
            'frequency (Hz)': [1000.0],
        }
    )
    ringing = pd.DataFrame(
        {
            'stroke (nm)': [0.1],
            'ringing (kHz)': [1e-3 * hertz],
            'ringing std (kHz)': [0.02],
            'decay (ms)': [1e3 * decay_s],
            'decay std (ms)': [0.01],
        }
    )
    free = ['contact.friction', 'runner.mass', 'runner.damping']
    said: Any = {'preloads_n': (rig.preload_n,), 'steps': STEPS}
    exact = FitOptions(**said, starts=1, assume=EXACT)
    found = fit([zeros, ringing], free, options=exact)
    for one, true in zip(
        found.estimates, (rig.friction, rig.mass_kg, rig.damping_n_s_per_m), strict=True
    ):
        assert one.low < true < one.high
        assert one.standard_error < 0.1 * true
    mass = found.estimates[1]  # twice the relative error of the frequency
    assert mass.standard_error / mass.value == pytest.approx(40.0 / hertz, rel=0.05, abs=0.0)
    assert found.uncertainty.dof == 0
    points = as_object(found)['points']
    assert [each['quantity'] for each in points] == ['zero_amplitude_m', 'ringing_hz', 'decay_s']
    of_model = zero_amplitude(
        found.parameters.updated({'stand.preload': 0.4}), 1000.0, steps=STEPS
    )
    assert points[0]['model'] == pytest.approx(of_model.zero_amplitude_m, rel=1e-9, abs=0.0)
    options = CompareOptions(preloads_n=(rig.preload_n,))
    compared = compare(ringing, found.parameters, options=options)
    assert [each.name for each in compared.quantities] == ['ringing_hz', 'decay_s']
    assert compared.quantities[0].agreement.rms < 20.0
    alone = compare(zeros, found.parameters, options=CompareOptions(**said))
    assert alone.axis == 'preload_n'
    assert alone.quantities[0].agreement.rms < 0.5e-9
    assert [axes.get_xlabel() for axes in alone.plot().axes][-1] == 'preload (N)'


@pytest.mark.parametrize(
    ('columns', 'message'),
    [
        ({'ringing (kHz)': [9.1], 'decay (ms)': [0.2]}, 'there is no amplitude_m or voltage_v'),
        (
            {'stroke (nm)': [90.0], 'force (mN)': [9.0], '0-amplitude (nm)': [80.0]},
            'has both zero_amplitude_m and numbers by amplitude; give it in a separate table',
        ),
    ],
)
def test_numbers_that_need_more_or_less_are_refused(columns: dict, message: str):
    with pytest.raises(StickSlipError) as refusal:
        fit(pd.DataFrame(columns), ['runner.mass'], options=FitOptions(preloads_n=(0.5,)))
    assert message in str(refusal.value)


def test_a_step_curve_and_a_sheet_teach_a_drive_and_hold_for_other_voltages():
    rig = RIG
    rows = {volts: steps_m(rig, volts) for volts in (140.0, 180.0, 220.0, 260.0, 300.0)}

    def curve(*volts: float) -> pd.DataFrame:
        up, down = np.transpose([rows[each] for each in volts])
        columns = {'Voltage (V)': volts, 'step up (nm)': 1e9 * up, 'step down (nm)': 1e9 * down}
        return pd.DataFrame({**columns, 'tolerance (%)': 3.0})

    sheet = pd.DataFrame(
        [
            ('holding force', rig.friction * rig.preload_n * sum(SHARES), 'N'),
            ('moving mass', 1e3 * rig.mass_kg, 'g'),
            ('resonance frequency', 1e-3 * linear(rig)[0], 'kHz'),
        ],
        columns=['quantity', 'value', 'unit'],
    )
    began = stand(rig).updated({'contact.friction': 0.35, 'actuator.gain': 6e-10})
    free = ['contact.friction', 'actuator.gain', 'runner.mass']
    said: Any = {'steps': STEPS}
    found = fit(
        [curve(140.0, 180.0, 260.0), sheet],
        free,
        parameters=began,
        options=FitOptions(**said, starts=1),
    )
    truth = (rig.friction, rig.gain_m_per_v, rig.mass_kg)
    for one, true in zip(found.estimates, truth, strict=True):
        assert one.low < true < one.high
        assert one.standard_error < 0.2 * true
    assert found.holds
    told = {row[0] for section in found.sections() for row in section.rows}
    assert 'points' in told
    compared = compare(
        curve(220.0, 300.0),
        found.parameters,
        options=CompareOptions(**said),
        draws=found.draws(20),
    )
    assert [each.name for each in compared.quantities] == ['step_length_m', 'step_back_m']
    assert [each.agreement.within_95 for each in compared.quantities] == [1.0, 1.0]
    assert all(each.parts[0].axis == 'voltage_v' for each in compared.quantities)
    assert len(found.plot().axes) == 10


def test_the_numbers_of_a_sheet_are_those_of_the_stand():
    sheet = {
        'holding force (N)': [0.4],
        'moving mass (g)': [3.0],
        'stage frequency (kHz)': [9.0],
        'capacitance (nF)': [5.0],
        'slew rate (V/us)': [150.0],
    }
    found = predicted(sheet, SET.updated({'amplifier.current_max': 0.5}))
    mu, share = SET.contact.friction, 2**0.5 / 2
    assert found[0] == pytest.approx(mu * 0.5 * (2 * share + 4 * share / 2), rel=1e-12, abs=0.0)
    assert found[0] == pytest.approx(friction_limit_n(SET), rel=1e-12, abs=0.0)
    assert found[1] == SET.runner.mass
    assert found[2] == pytest.approx(linearise(FREE).resonance_hz, rel=1e-12, abs=0.0)
    assert found[3:] == [SET.actuator.capacitance, 0.5 / SET.actuator.capacitance]
    assert slew_of(SET) == SET.amplifier.slew_rate


def test_a_step_at_a_voltage_is_that_of_its_stroke_both_ways_and_with_a_load():
    columns = {
        'voltage (V)': [200.0, 200.0],
        'load_n': [0.0, 0.05],
        'step up (nm)': [9.0, 9.0],
        'step down (nm)': [9.0, 9.0],
        'speed (um/s)': [9.0, 9.0],
    }
    up, pushed, down, held, speed, _ = predicted(columns, SET, frequency_hz=500.0)
    run = partial(run_drive, FREE, 200.0 * SET.actuator.gain)
    assert up == run(500.0).step_length_m
    assert pushed == run(500.0, load_n=0.05).step_length_m
    assert down == pytest.approx(up, rel=1e-9, abs=0.0)  # a mirrored drive
    assert held == -run(-500.0, load_n=0.05).step_length_m < down < pushed
    assert speed == 500.0 * up


def test_steps_begin_at_the_onset_voltage():
    [onset_v] = predicted({'onset voltage (V)': [100.0], 'preload (N)': [0.5]}, Parameters())
    found = zero_amplitude(SET, 1000.0)
    assert onset_v == found.zero_amplitude_m / SET.actuator.gain
    below, above = predicted(
        {'voltage (V)': [0.9 * onset_v, 1.1 * onset_v], 'step (nm)': [9.0, 9.0]}, SET
    )
    assert abs(below) < found.step_min_m < above


def test_the_blocking_force_is_the_largest_of_the_stand_against_its_load_cell():
    [full_n, half_n] = predicted({'blocking force (mN)': [170.0, 90.0], 'V (V)': ['', 150.0]}, SET)
    stiff = SET.updated({'load_cell.bandwidth': 0.0, 'load_cell.noise_density': 0.0})
    for force_n, volts in ((full_n, 300.0), (half_n, 150.0)):
        force = simulate(stiff, voltage_v=volts, frequency_hz=1000.0, steps=200).frame['force_n']
        assert force_n == pytest.approx(force.max(), rel=0.01, abs=0.0)


def test_a_curve_and_a_sheet_are_compared_together():
    curve = pd.DataFrame({'voltage (V)': [200.0, 300.0], 'step (nm)': [50.0, 90.0]})
    sheet = pd.DataFrame({'mass (g)': [3.0], 'holding force (N)': [0.4]})
    report = compare([curve, sheet], SET)
    points = {each.name: each.agreement.points for each in report.quantities}
    assert points == {'step_length_m': 2, 'holding_force_n': 1, 'moving_mass_kg': 1}
    [step_m] = predicted({'step (nm)': [50.0], 'voltage (V)': [200.0]}, SET)
    assert report.quantities[0].parts[0].b[0] == step_m


def test_one_row_is_enough_for_one_parameter_and_a_voltage_out_of_reach_is_refused():
    one = pd.DataFrame({'voltage (V)': [300.0], 'step (nm)': [90.0]})
    exact = FitOptions(starts=1, assume=EXACT)
    found = fit(one, ['contact.friction'], parameters=SET, options=exact)
    assert found.estimates[0].low < SET.contact.friction < found.estimates[0].high
    with pytest.raises(StickSlipError) as refusal:
        predicted({'voltage (V)': [310.0], 'step (nm)': [90.0]}, SET)
    assert 'voltage_v 310 V is above the 300 V that the amplifier gives; raise' in str(
        refusal.value
    )
    with pytest.raises(StickSlipError, match='there is no preload_n'):
        predicted({'voltage (V)': [300.0], 'step (nm)': [90.0]}, Parameters())


def test_a_stand_of_another_friction_law_has_no_stage_frequency():
    sheet = {'stage frequency (Hz)': [9e3], 'mass (g)': [3.0]}
    with pytest.raises(StickSlipError, match='without one stiffness for all small motions'):
        predicted(sheet, SET.updated({'contact.law': 'coulomb'}))


@pytest.mark.parametrize('back', [1.0, -1.0])
def test_a_curve_to_full_voltage_teaches_a_gain_whatever_the_sign_of_steps_back(back):
    volts = [15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 60.0]
    up_nm = np.array([148.8, 233.5, 317.8, 407.2, 572.9, 757.9, 924.4])
    down_nm = np.array([149.7, 230.6, 314.4, 417.6, 571.4, 755.9, 905.3])
    columns = {'voltage (V)': volts, 'step up (nm)': up_nm, 'step down (nm)': back * down_nm}
    on = load_yaml(stage_file('rod'))
    options = FitOptions(preloads_n=(2.6,), frequency_hz=300.0, starts=1)
    free = ['contact.friction', 'actuator.gain']
    found = fit(pd.DataFrame(columns), free, parameters=on, options=options)
    assert found.holds
    gain = found.estimates[1]
    assert gain.low < 1.72e-8 < gain.high
    assert gain.standard_error < 3e-10
    assert {'step_length_m', 'step_back_m'} == found.noise_of_numbers.keys()
    assert all(1e-9 < each < 2e-8 for each in found.noise_of_numbers.values())
    quality = next(each for each in found.sections() if each.title == 'quality')
    noises = [str(text) for name, text in quality.rows if str(name).startswith('noise of ')]
    assert [text.rpartition(' ')[2] for text in noises] == ['m', 'm']


def test_a_voltage_that_a_gain_has_rounded_is_played():
    for gain in np.linspace(1e-8, 3e-8, 500).tolist():
        on = load_yaml(stage_file('rod')).updated({'actuator.gain': gain})
        assert voltage_for(on, 60.0 * gain) == pytest.approx(60.0, rel=1e-15)
        assert voltage_for(on, 60.0 * gain) <= 60.0


def test_the_best_of_searches_is_found_beside_one_that_met_an_impossible_stand():
    dead = Minimum((), math.inf, converged=False, evaluations=0)
    ended = Minimum((0.0, 1.0), 3.0, converged=True, evaluations=9)
    assert distinct([dead, ended, dead]) == [ended]


def test_rows_of_two_stands_make_no_fit_that_holds():
    columns = {
        'voltage (V)': [200.0, 250.0, 300.0] * 2,
        'step up (nm)': [49.0, 70.0, 92.0, 9.0, 14.0, 19.0],
        'step down (nm)': [47.0, 66.0, 88.0, 8.0, 13.0, 18.0],
    }
    options = FitOptions(preloads_n=(0.5,), starts=1)
    free = ['contact.friction', 'actuator.gain']
    found = fit(pd.DataFrame(columns), free, options=options)
    assert not found.holds
    told = ' '.join(found.reasons)
    assert 'step_length_m is missed by ' in told
    assert 'more than 20 % of its largest number' in told
