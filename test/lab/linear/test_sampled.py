# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The sampled plant: its poles against scipy, its response against sines through the sensors."""

import math
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
from scipy.signal import cont2discrete

from stickslip_ros import Bench, Request, StickSlipError, linearise
from stickslip_ros.parameters import Parameters, load_yaml

CONFIG = Path(__file__).parents[3] / 'config'
DT_S = 1e-3
LINEAR_SENSOR = {
    'interferometer.noise_density': 0.0,
    'interferometer.resolution': 0.0,
    'interferometer.cyclic_error': 0.0,
    'interferometer.drift': 0.0,
    'interferometer.random_walk': 0.0,
    'amplifier.resolution': 0.0,
    'runner.damping': 20.0,
}
"""Without what is no linear function of the voltage; ringing dies out within a block."""
STANDS = {
    'ideal': Parameters().updated({'runner.damping': 5.0}),
    'realistic': load_yaml(CONFIG / 'realistic.yaml'),
    'coupled': load_yaml(CONFIG / 'realistic.yaml', CONFIG / 'coupled.yaml'),
}
CASES: list[tuple[str, dict[str, Any]]] = [
    ('ideal', {}),
    ('ideal', {'interferometer.bandwidth': 150.0}),
    ('ideal', {'interferometer.latency': 1.73e-3}),
    ('realistic', {}),
    ('realistic', {'interferometer.latency': 2e-3, 'interferometer.bandwidth': 0.0}),
    ('realistic', {'interferometer.sample_rate': 5e3, 'interferometer.latency': 2.7e-4}),
    ('coupled', {'interferometer.latency': 3.1e-3, 'interferometer.bandwidth': 333.0}),
]
HERTZ = (37.3, 411.9)
AMPLITUDE_V = 0.1
BLOCKS = 300
SETTLING = 150
AGREEMENT = 2e-3
"""Partial slip takes up to 1e-4 off the stiffness at that amplitude, and with it the phase of what
rings on from one reading to the next."""


def readings_um(parameters: Parameters, hertz: float, amplitude_v: float) -> Any:
    """Return the reading before each of BLOCKS blocks, in each of which a sine is held."""
    bench, read_um = Bench(parameters), [0.0]
    for block in range(-SETTLING, BLOCKS):
        rise = 0.5 - 0.5 * math.cos(math.pi * min(1.0 + 1.5 * block / SETTLING, 1.0))
        sine_v = amplitude_v * math.sin(2.0 * math.pi * hertz * DT_S * block)
        sent = [Request('voltage', (rise * (150.0 + sine_v),))]
        output = bench.update(bench.time_ns + parameters.block_ns, sent)
        read_um.append(1e6 * output.readings.position_m)
    return np.array(read_um[SETTLING:-1])


def measured(parameters: Parameters, hertz: float) -> complex:
    """Return the response of the readings, um/V; creep is the same for either sign of a sine."""
    there, back = (readings_um(parameters, hertz, side * AMPLITUDE_V) for side in (1.0, -1.0))
    turns, window = 2.0 * np.pi * hertz * DT_S * np.arange(BLOCKS), np.hanning(BLOCKS + 1)[:-1]
    basis = np.column_stack((np.sin(turns), np.cos(turns), np.ones(BLOCKS))) * window[:, None]
    found = np.linalg.lstsq(basis, window * (there - back), rcond=None)[0]
    return complex(found[0], found[1]) / (2.0 * AMPLITUDE_V)


@pytest.mark.usefixtures('compiled_kernels')
@pytest.mark.parametrize(('stand', 'changes'), CASES)
def test_sines_through_the_sensors_measure_the_sampled_plant(stand: str, changes: dict[str, Any]):
    parameters = STANDS[stand].updated(LINEAR_SENSOR | changes)
    plant = linearise(parameters).to_control(DT_S, sensors=True)
    assert (plant.dt, plant.output_labels) == (DT_S, ['position_um'])
    for hertz in HERTZ:
        expected = plant['position_um', 'voltage_v'](np.exp(2j * np.pi * hertz * DT_S))
        assert measured(parameters, hertz) == pytest.approx(complex(expected), rel=AGREEMENT)


@pytest.mark.parametrize('stand', STANDS)
def test_poles_are_those_of_scipy(stand: str):
    linear = linearise(STANDS[stand])
    plant = linear.to_control(DT_S)
    theirs = cont2discrete((linear.A, linear.B, linear.C, linear.D), DT_S)
    ours, expected = plant.poles(), np.linalg.eigvals(theirs[0])
    nearest = np.abs(ours[:, None] - expected).min(axis=1)
    assert len(ours) == len(expected)
    assert nearest.max() < 1e-9


@pytest.mark.parametrize(
    ('stand', 'gain', 'phase_deg'),
    [('ideal', 9.0, 85.8), ('realistic', 8.69, 81.0), ('coupled', np.inf, 78.0)],
)
def test_python_control_finds_the_margins_of_the_whole_plant(stand, gain, phase_deg):
    plant = linearise(STANDS[stand]).to_control(DT_S, sensors=True)['position_um', 'voltage_v']
    loop = plant * control.ss(1.0, 1.0, 450.0, 450.0, DT_S)
    omega = 2.0 * np.pi * np.geomspace(0.1, 499.9, 4_000)
    found = control.stability_margins(control.frd(loop, omega, smooth=True))
    assert found[:2] == pytest.approx((gain, phase_deg), rel=1e-3)


def test_what_cannot_be_sampled_is_refused():
    linear = linearise(STANDS['ideal'])
    with pytest.raises(StickSlipError, match='sensors True is of a sampled system only; give dt'):
        linear.to_control(sensors=True)
    with pytest.raises(
        StickSlipError, match=r'dt 1.23e-05 s is not a multiple of the period of tra'
    ):
        linear.to_control(1.23e-5, sensors=True)
    slow = STANDS['ideal'].updated({'interferometer.sample_rate': 700.0})
    with pytest.raises(StickSlipError, match=r'period of interferometer\.sample_rate'):
        linearise(slow).to_control(DT_S, sensors=True)
    framed = STANDS['coupled'].updated({'interferometer.reference': 'frame'})
    with pytest.raises(StickSlipError, match=r"interferometer\.reference 'frame'"):
        linearise(framed).to_control(DT_S, sensors=True)
