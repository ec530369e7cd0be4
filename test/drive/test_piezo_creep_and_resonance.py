# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Creep against its logarithmic law, the resonance against closed forms of an oscillator."""

import math

import numpy as np
import pytest

from stickslip_ros.drive.build import plant_of
from stickslip_ros.drive.piezo import displace, free_ring, prepare_piezo, rest_piezo
from stickslip_ros.drive.records import PIEZO_STATE
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.kernels.record import record
from stickslip_ros.lab.runs.sawtooth_run import run_drive
from stickslip_ros.parameters import Parameters

displace = entry_point(displace)
free_ring = entry_point(free_ring)
prepare_piezo = entry_point(prepare_piezo)

GAIN = Parameters().actuator.gain
STEP_V = 100.0
STEP_M = GAIN * STEP_V
RIPPLE = 0.05
"""Of the growth per decade, by which elements one decade apart miss a straight line."""
BEHIND_LOW_PASS = 1e-3
"""Seen: 8e-4; 1.4e-3 and 1.1e-2 if only the chord of the voltage drove the resonance."""
ROUNDING = 1e-11
"""Some hundred steps of doubles."""


class Piezo:
    """A piezo that follows voltages in steps of time."""

    def __init__(self, **actuator: float) -> None:
        values = {f'actuator.{name}': value for name, value in actuator.items()}
        self.plant = plant_of(Parameters().updated(values))[0]
        self.memory = record(PIEZO_STATE)
        rest_piezo(self.plant, self.memory)

    def jump(self) -> 'Piezo':
        """Be at STEP_V from now on, with the mass of the piezo still at rest."""
        self.memory.static_m = self.memory.driving_m = STEP_M
        return self

    def hold(self, time_s: float, voltage_v: float = STEP_V) -> float:
        ring = prepare_piezo(self.plant, self.memory, time_s)
        return float(displace(self.plant, self.memory, voltage_v, 0.0, ring, time_s))


def test_creep_grows_with_the_logarithm_of_time():
    times_s = np.logspace(-1.5, 2.5, 81)
    piezo = Piezo(creep=0.02).jump()
    found_m = [piezo.hold(step_s) for step_s in np.diff(np.concatenate(([0.0], times_s)))]
    growth = (np.array(found_m) / STEP_M - 1.0) / 0.02
    slope, offset = np.polyfit(np.log10(times_s), growth, 1)
    assert slope == pytest.approx(1.0, rel=0.02, abs=0.0)
    assert np.max(np.abs(growth - slope * np.log10(times_s) - offset)) < RIPPLE


def test_creep_of_a_held_voltage_is_its_sum_of_exponentials_however_time_is_cut():
    piezo = Piezo(creep=0.05).jump()
    at_s = 0.0
    for time_s in (1e-7, 3e-4, 2e-2, 0.5, 7.0, 300.0):
        at_s += time_s
        found_m = piezo.hold(time_s)
        taken_in = sum(1.0 - math.exp(-at_s / 10.0**k) for k in range(-2, 4))
        assert found_m == pytest.approx(STEP_M * (1.0 + 0.05 * taken_in), rel=1e-12, abs=0.0)


def test_creep_goes_back_when_the_voltage_does():
    piezo = Piezo(creep=0.05).jump()
    piezo.hold(1e4)
    back_m = [piezo.hold(time_s, 0.0) for time_s in (1e-9, 1.0, 1e5)]
    assert back_m[0] == pytest.approx(0.3 * STEP_M, rel=1e-3, abs=0.0)
    assert back_m[0] > back_m[1] > back_m[2]
    assert back_m[2] == pytest.approx(0.0, abs=1e-12 * STEP_M)


@pytest.mark.parametrize('damping', [0.001, 0.05, 0.5, 0.9999999, 1.0, 1.0000001, 2.0, 10.0])
@pytest.mark.parametrize('phase', [1e-6, 0.1, 3.0, 40.0])
def test_a_free_ring_is_the_closed_form_of_the_oscillator(damping, phase):
    omega = 2.0 * math.pi * 1e5
    found = np.array(free_ring(omega, damping, phase / omega)) * [1.0, omega, 1.0 / omega, 1.0]
    root = np.sqrt(complex(damping**2 - 1.0))
    slow, fast = -damping + root, -damping - root
    if abs(root) < 1e-6:
        decay = math.exp(-phase)
        expected = np.array([1.0 + phase, phase, -phase, 1.0 - phase]) * decay
    else:
        e_slow, e_fast = np.exp(slow * phase), np.exp(fast * phase)
        odd = (e_slow - e_fast) / (slow - fast)
        even = (slow * e_fast - fast * e_slow) / (slow - fast)
        expected = np.real([even, odd, -odd, (slow * e_slow - fast * e_fast) / (slow - fast)])
    # Close to critical damping the expected roots lose half their digits.
    within = 1e-6 if abs(damping - 1.0) < 1e-3 else ROUNDING
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=within)


def test_a_jump_overshoots_and_rings_at_the_damped_frequency():
    resonance_hz, damping = 1e5, 0.1
    piezo, step_s = Piezo(resonance=resonance_hz, damping_ratio=damping).jump(), 1e-8
    found_m = np.array([piezo.hold(step_s) for _ in range(10_000)])
    off_m = found_m - STEP_M
    overshoot = math.exp(-math.pi * damping / math.sqrt(1.0 - damping**2))
    assert np.max(off_m) / STEP_M == pytest.approx(overshoot, rel=1e-4, abs=0.0)
    signs = np.nonzero(np.diff(np.sign(off_m)) > 0.0)[0][:5]
    crossings_s = [(i + off_m[i] / (off_m[i] - off_m[i + 1])) * step_s for i in signs]
    rate_hz = resonance_hz * math.sqrt(1.0 - damping**2)
    assert np.diff(crossings_s) == pytest.approx(1.0 / rate_hz, rel=1e-4, abs=0.0)
    # After a hundred microseconds exp(-2 pi) is left.
    assert abs(off_m[-1]) / STEP_M < 1.1 * math.exp(-2.0 * math.pi)


def test_along_a_ramp_the_steps_do_not_matter():
    rate_v_per_s, end_s = 1e6, 1e-5
    ends_m = []
    for steps in (1, 7, 1000):
        piezo = Piezo(resonance=7e4, damping_ratio=0.02)
        for i in range(1, steps + 1):
            end_m = piezo.hold(end_s / steps, rate_v_per_s * end_s * i / steps)
        ends_m.append(end_m)
    np.testing.assert_allclose(ends_m, ends_m[0], rtol=ROUNDING)


@pytest.mark.parametrize(
    ('preload_n', 'damping', 'bandwidth', 'resonance', 'hertz', 'cell', 'found', 'fine'),
    [
        (1.0, 0.23, 2e5, 3e5, -385.7, 'absent', 'step_length_m', -2.675612e-9),
        (0.3, 0.5, 1e5, 2e5, 200.0, 'attached', 'force_mean_n', 46.253414e-3),
    ],
)
def test_behind_a_low_pass_the_default_step_gives_what_a_sixteenth_of_it_gives(
    preload_n, damping, bandwidth, resonance, hertz, cell, found, fine
):
    changes = {'stand.preload': preload_n, 'load_cell.contact': cell}
    changes |= {'amplifier.bandwidth': bandwidth, 'actuator.resonance': resonance}
    stand = Parameters().updated({**changes, 'actuator.damping_ratio': damping})
    run = run_drive(stand, 150.0 * GAIN, hertz, 30)
    assert getattr(run, found) == pytest.approx(fine, rel=BEHIND_LOW_PASS, abs=0.0)
