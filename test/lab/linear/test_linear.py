# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The stuck drive as a linear system: against formulas, against what sines measure."""

import sys
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
from scipy.linalg import expm

from stickslip_ros import LinearDrive, StickSlipError, linearise, measure_response
from stickslip_ros.drive.layout import contacts_of, gain_ratios
from stickslip_ros.lab.linear.swept_sine import SLIDING_SHARE, bode_rows
from stickslip_ros.parameters import Parameters, load_yaml

IDEAL = Parameters()
CONFIG = Path(__file__).parents[3] / 'config'
REALISTIC = load_yaml(CONFIG / 'realistic.yaml').flat()
COUPLED = CONFIG / 'coupled.yaml'
STIFF = 2e-5
"""Relative error of python-control by the exponentials of scipy, 1e-5 with scipy 1.18."""
STAGES: dict[str, dict[str, Any]] = {
    'ideal': {},
    'free': {'load_cell.contact': 'absent'},
    'strong damping': {'runner.damping': 80.0},
    **{
        name: {name: REALISTIC[name]}
        for name in (
            'runner.damping',
            'amplifier.bandwidth',
            'amplifier.resolution',
            'actuator.hysteresis',
            'actuator.creep',
            'actuator.resonance',
            'actuator.gain_tolerance',
            'load_cell.contact',
        )
    },
    'slow amplifier': {'amplifier.bandwidth': 3e3},
    'soft actuator': {'actuator.resonance': 7e3, 'actuator.damping_ratio': 0.05},
    'frame': {'frame.mass': 0.03, 'frame.resonance': 8e3, 'actuator.mass': 5e-4},
    'guide': {'feet.count': [1, 1], 'feet.share': [1.0, 0.3], 'feet.gain': [1.0, 0.0]},
    'one-sided cell': {
        'load_cell.contact': 'one_sided', 'load_cell.gap': 0.0, 'load_cell.stiffness': 3e6
    },
    'loss in the contacts': {'contact.loss_factor': 0.2, 'feet.gain': [1.0, 0.5]},
    'all of it': {name: REALISTIC[name] for name in REALISTIC},
}  # fmt: skip
SHARES = np.array([0.02, 0.1, 0.3, 0.6, 0.8, 0.9])
"""Frequencies, of the resonance."""
AGREEMENT = 0.01
"""The resonance is wrong by half of what partial slip takes off the stiffness, 7e-4 of it; at 0.9
of it this is 4e-3. A converter whose step is a tenth of the sine adds as much."""


@pytest.mark.usefixtures('compiled_kernels')
@pytest.mark.parametrize('stage', STAGES)
def test_sines_measure_the_closed_form_below_the_resonance(stage: str):
    parameters = IDEAL.updated(STAGES[stage])
    found = measure_response(parameters, SHARES * linearise(parameters).resonance_hz)
    assert np.abs(found.deviation).max() < AGREEMENT


@pytest.mark.usefixtures('compiled_kernels')
@pytest.mark.parametrize('at_voltage_v', [2.0, 290.0])
@pytest.mark.parametrize('preload_n', [0.1, 1.0])
def test_a_place_on_the_way_back_or_near_slip_is_as_stiff(at_voltage_v: float, preload_n: float):
    # Against a stiff load cell the virgin branch to 290 V has a tangent far below that of stick.
    parameters = IDEAL.updated(
        {'stand.preload': preload_n, 'load_cell.stiffness': 5e6, 'amplifier.voltage_initial': 0.0}
    )
    linear = linearise(parameters, at_voltage_v)
    found = measure_response(parameters, SHARES * linear.resonance_hz, at_voltage_v)
    assert np.abs(found.deviation).max() < AGREEMENT


@pytest.mark.usefixtures('compiled_kernels')
def test_sines_slide_no_foot_further_than_the_share_and_delays_are_refused():
    values = {'feet.count': [1, 1], 'feet.share': [1.0, 0.3], 'feet.gain': [1.0, 0.0]}
    parameters = IDEAL.updated(values)
    found = measure_response(parameters, 100.0)
    [position_m, foot_m] = found.linear.matrix(100.0)[0, :, 0] * found.voltage_amplitude_v
    least_m = min(each.max_displacement_m for each in contacts_of(parameters))
    slides_m = max(abs(position_m), abs(position_m - foot_m))  # at the guide, at the foot
    assert slides_m == pytest.approx(SLIDING_SHARE * least_m)
    late = parameters.updated({'feet.gain': [1.0, 1.0], 'feet.delay': [0.0, 1e-4]})
    with pytest.raises(StickSlipError, match='is a delay, which no linear model'):
        measure_response(late, 100.0)


@pytest.mark.usefixtures('compiled_kernels')
def test_an_end_stop_counts_where_the_runner_touches_it():
    parameters = IDEAL.updated(
        {'load_cell.contact': 'absent', 'stand.travel_max': 1e-7, 'stand.stop_stiffness': 5e6}
    )
    assert linearise(parameters).cell_n_per_m == 0.0
    linear = linearise(parameters, 280.0)
    assert linear.cell_n_per_m == 5e6
    found = measure_response(parameters, SHARES * linear.resonance_hz, 280.0)
    assert np.abs(found.deviation).max() < AGREEMENT


def test_the_ideal_drive_is_the_oscillator_of_eq_20():
    parameters = IDEAL.updated({'runner.damping': 20.0, 'actuator.gain_tolerance': 0.05})
    linear = linearise(parameters)
    each = np.array([contact.stick_stiffness_n_per_m for contact in contacts_of(parameters)])
    s = 2j * np.pi * np.array([10.0, 5e3, 9e3, 4e4])
    per_n = 1.0 / (parameters.runner.mass * s**2 + 20.0 * s + each.sum() + 1e5)
    drag = each @ gain_ratios(0.05, parameters.sim.seed, 6)
    found = linear.response(s.imag / (2.0 * np.pi))
    np.testing.assert_allclose(found.position_m_per_n, per_n, rtol=1e-9)
    per_v = parameters.actuator.gain * drag * per_n
    np.testing.assert_allclose(found.position_m_per_v, per_v, rtol=1e-9)


def test_stages_multiply():
    changes: dict[str, Any] = {
        'amplifier.bandwidth': 2e3, 'actuator.creep': 0.05, 'actuator.resonance': 4e3
    }  # fmt: skip
    hertz = np.array([1.0, 300.0, 3e3, 2e4])
    s = 2j * np.pi * hertz
    omega, ratio = 2.0 * np.pi * 4e3, IDEAL.actuator.damping_ratio
    stages = 1.0 / (1.0 + s / (2.0 * np.pi * 2e3))
    stages *= omega**2 / (s**2 + 2.0 * ratio * omega * s + omega**2)
    stages *= 1.0 + 0.05 * sum(1.0 / (1.0 + s * 10.0**k) for k in range(-2, 4))
    found = linearise(IDEAL.updated(changes)).response(hertz).position_m_per_v
    expected = stages * linearise(IDEAL).response(hertz).position_m_per_v
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_hysteresis_keeps_its_linear_part():
    plays, opening = 8, 0.1
    changes = {'actuator.hysteresis': opening, 'actuator.plays': plays}
    found = linearise(IDEAL.updated(changes)).response(10.0).position_m_per_v
    weight = opening * (plays + 1) / ((plays + 1) ** 2 // 4)
    expected = (1.0 - weight * plays / 2.0) * linearise(IDEAL).response(10.0).position_m_per_v
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_python_control_has_the_same_system():
    linear = linearise(IDEAL.updated({'runner.damping': 20.0, 'amplifier.bandwidth': 2e3}))
    system = linear.to_control()
    assert isinstance(system, control.StateSpace)
    assert system.input_labels == ['voltage_v', 'load_n']
    assert system.output_labels == ['position_um', 'foot_um']
    assert system.state_labels == ['amplifier_v', 'position_um', 'velocity_um_per_s']
    hertz = np.array([10.0, 9e3, 4e4])
    theirs = system(2j * np.pi * hertz).transpose(2, 0, 1)
    np.testing.assert_allclose(theirs, 1e6 * linear.matrix(hertz), rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize('stand', ['realistic', 'coupled'])
def test_a_closed_loop_of_the_plant_before_its_controller_is_that_of_the_matrices(stand: str):
    """Ten and more poles over nine decades, of which polynomials keep no digit."""
    parameters = IDEAL.updated(REALISTIC)
    if stand == 'coupled':
        parameters = parameters.updated(load_yaml(COUPLED).changed())
    linear = linearise(parameters)
    n, push, per_m = len(linear.A), linear.B[:, 0], linear.C[0]
    integral, share = 1e8, 1e6  # V/(m s), V/m
    # x' = A x + B (share e + z), z' = integral e, e = 1 - C x; the last row is the 1.
    loop = np.zeros((n + 2, n + 2))
    loop[:n, :n] = linear.A - share * np.outer(push, per_m)
    loop[:n, n], loop[:n, n + 1] = push, share * push
    loop[n, :n], loop[n, n + 1] = -integral * per_m, integral
    times_s = np.array([0.0, 2e-5, 1e-3, 2e-2])
    start = np.eye(n + 2)[n + 1]
    expected = [per_m @ (expm(loop * time_s) @ start)[:n] for time_s in times_s]
    plant = linear.to_control()['position_um', 'voltage_v']
    controller = control.tf([1e-6 * share, 1e-6 * integral], [1.0, 0.0])
    found = control.step_response(control.feedback(plant * controller), np.arange(0, 2001) * 1e-5)
    steps = np.rint(times_s / 1e-5).astype(int)
    np.testing.assert_allclose(found.outputs[steps], expected, rtol=STIFF, atol=1e-9)


def test_a_missing_python_control_is_named(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, 'control', None)
    with pytest.raises(StickSlipError, match='pip install control'):
        linearise(IDEAL).to_control()


@pytest.mark.parametrize('law', ['coulomb', 'dahl', 'lugre', 'epm'])
def test_other_laws_are_refused(law: str):
    with pytest.raises(StickSlipError, match=r"contact.law '\w+' is a law without one stiffness"):
        linearise(IDEAL.updated({'contact.law': law}))


@pytest.mark.parametrize(
    ('frequency_hz', 'at_voltage_v', 'why'),
    [
        (0.0, None, 'frequency 0 Hz is not above 0'),
        (-5.0, None, 'not above 0'),
        (100.0, 301.0, "above the amplifier's 300 V"),
        (100.0, 300.0, 'voltage 300.75 V'),
    ],
)
def test_what_cannot_be_measured_is_refused(frequency_hz: float, at_voltage_v: Any, why: str):
    with pytest.raises(StickSlipError, match=why):
        measure_response(IDEAL, frequency_hz, at_voltage_v)


def test_amplitudes_slide_as_little_as_they_say():
    found = measure_response(IDEAL, [100.0, 5e3, 2e4])
    smallest_m = min(contact.max_displacement_m for contact in contacts_of(IDEAL))
    matrix = found.linear.matrix(found.frequency_hz)
    sliding_m = np.abs(matrix[:, 0] - matrix[:, 1]).T * [
        found.voltage_amplitude_v, found.load_amplitude_n
    ]  # fmt: skip
    assert sliding_m.max() == pytest.approx(2e-3 * smallest_m)
    assert found.voltage_amplitude_v.max() <= 0.75
    assert 1e-4 < found.softening < 1e-3


@pytest.mark.usefixtures('compiled_kernels')
def test_phases_lag_without_jumps_and_are_drawn():
    stages = {'amplifier.bandwidth': 2e4, 'actuator.resonance': 3e4, 'actuator.damping_ratio': 0.1}
    measured = measure_response(IDEAL.updated(stages), np.geomspace(500.0, 1.2e5, 9))
    rows = bode_rows(measured)
    lags_deg = np.array([row['voltage_phase_deg'] for row in rows], float)
    assert np.all(np.diff(lags_deg) < 0.0)
    assert -450.0 < lags_deg[-1] < -400.0
    for row in rows[:3]:
        assert row['measured_load_phase_deg'] == pytest.approx(row['load_phase_deg'], abs=0.5)
        assert row['measured_m_per_v'] == pytest.approx(row['position_m_per_v'], rel=AGREEMENT)
    figure = measured.plot()
    assert [axes.get_ylabel() for axes in figure.axes] == [
        'position (nm/V)', 'position (nm/N)', 'phase (degrees)', 'phase (degrees)'
    ]  # fmt: skip
    for axes in figure.axes:
        assert [np.shape(line.get_xdata()) for line in axes.lines][:2] == [(2000,), (9,)]


def test_a_linear_drive_says_where_it_is():
    linear = linearise(IDEAL.updated({'load_cell.stiffness': 2e5}), 60.0)
    assert isinstance(linear, LinearDrive)
    assert (linear.at_voltage_v, linear.cell_n_per_m) == (60.0, 2e5)
    assert linear.at_position_m == pytest.approx(60.0 * IDEAL.actuator.gain, rel=0.05)
    assert linear.states == ('position_m', 'velocity_m_per_s')
    poles_hz = np.abs(np.linalg.eigvals(linear.A)) / (2.0 * np.pi)
    assert poles_hz == pytest.approx(linear.resonance_hz)
