# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""0-amplitude and ring-down of rigs of springs, and of a linear oscillator, tell what they are."""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from fit_cases import EXACT
from spring_rig import G_STAR_PA, SHARES, SLEW_V_PER_S, Rig, contact

from stickslip_ros.arrays import Array
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.comparison.compare import CompareOptions, compare
from stickslip_ros.lab.experiments.experiment import Experiment, Readout, VoltageStep
from stickslip_ros.lab.experiments.predict import predict, ring_down
from stickslip_ros.lab.fitting.fit import FitOptions, fit
from stickslip_ros.lab.fitting.report import as_object
from stickslip_ros.lab.runs.zero_amplitude import zero_amplitude
from stickslip_ros.parameters import Parameters

FREE = {'load_cell.contact': 'absent'}
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
STEPS = 14


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


def rings(rig: Rig, amplitude_m: float) -> tuple[float, float]:
    nothing = np.zeros(1)
    seen = Readout('ringing_hz', nothing), Readout('decay_s', nothing)
    [[hertz, decay]] = predict(stand(rig), [Experiment('', FREE, VoltageStep(amplitude_m), seen)])
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
    rig, period_s = RIG, 1e-3
    lengths_m = []
    for stroke_m in STROKES_M:
        volts = stroke_m / rig.gain_m_per_v
        ramp_s = period_s - volts / SLEW_V_PER_S
        cycles = [
            (k * period_s + at_s, to_v)
            for k in range(STEPS)
            for at_s, to_v in ((ramp_s, volts), (period_s, 0.0))
        ]
        time_s, position_m = rig.positions(np.array([(0.0, 0.0), *cycles]), 1e6, 1)
        places_m = np.interp(period_s * np.array([STEPS - 10, STEPS]), time_s, position_m)
        lengths_m.append(np.diff(places_m)[0] / 10.0)
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
            'has both zero_amplitude_m and numbers by amplitude; give it in a table of its own',
        ),
    ],
)
def test_numbers_that_need_more_or_less_are_refused(columns: dict, message: str):
    with pytest.raises(StickSlipError) as refusal:
        fit(pd.DataFrame(columns), ['runner.mass'], options=FitOptions(preloads_n=(0.5,)))
    assert message in str(refusal.value)
