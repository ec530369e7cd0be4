# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The moving mass of the load cell: added to the runner, or met in impacts."""

import math

import numpy as np
import pytest

from stickslip_ros.drive.advance import RAMP_END, RAMP_MEAN, observe_samples
from stickslip_ros.drive.records import FORCE
from stickslip_ros.drive.waveform import level, sawtooth
from stickslip_ros.lab.linear.linearise import linearise
from stickslip_ros.parameters import Parameters

WAVE = sawtooth(0.0, 287.3, 1153.4, 0)
ONE_SIDED = {'load_cell__contact': 'one_sided', 'load_cell__gap': 1e-7}
MASS_KG = 1e5 / (2.0 * math.pi * 1.5e3) ** 2
"""1.1 g: that of 1.5 kHz on 100 kN/m."""
LOOSE = {'stand__preload': 1e-3, 'load_cell__contact': 'one_sided', 'load_cell__gap': 1e-6}
"""Friction of 0.8 mN is nothing against the 100 N of an impact at 0.05 m/s."""
RESIDUAL = 1e-4


@pytest.mark.parametrize('restitution', [0.0, 0.6])
def test_the_error_falls_with_the_fourth_power_and_the_balance_closes(restitution, drive):
    ends_m = []
    for dt_s in (1e-5, 5e-6, 1.25e-6, 3e-7):
        machine = drive(
            **ONE_SIDED, load_cell__resonance=1.5e3, load_cell__restitution=restitution,
            sim__dt=dt_s,
        ).start(WAVE, [12e-3])  # fmt: skip
        assert abs(machine.residual) < RESIDUAL
        ends_m.append(machine.ramps[:12, (RAMP_MEAN, RAMP_END)])
    errors = [np.sqrt(np.mean((each - ends_m[-1]) ** 2)) for each in ends_m[:-1]]
    assert machine.ledger.stand_lost_j > 0.0
    assert errors[0] / errors[2] > 8.0**3


@pytest.mark.parametrize('restitution', [0.0, 0.5, 1.0])
def test_an_impact_keeps_momentum_and_turns_its_share_of_velocity_round(restitution, drive):
    machine = drive(
        **LOOSE, load_cell__resonance=1.5e3, load_cell__restitution=restitution,
    ).start(level(0.0), ())  # fmt: skip
    machine.state.velocity_m_per_s = 0.05
    while machine.state.button_m_per_s == 0.0:
        machine.run(level(0.0), [1e-7])
    state = machine.state
    momentum = 3e-3 * state.velocity_m_per_s + MASS_KG * state.button_m_per_s
    # Within 0.1 us the spring has hardly been pressed.
    assert momentum == pytest.approx(3e-3 * 0.05, rel=1e-3)
    apart = state.button_m_per_s - state.velocity_m_per_s
    assert apart == pytest.approx(restitution * 0.05, rel=1e-2, abs=1e-12)
    assert state.pressed == (restitution == 0.0)
    shared_kg = 1.0 / (1.0 / 3e-3 + 1.0 / MASS_KG)
    expected_j = 0.5 * shared_kg * 0.05**2 * (1.0 - restitution**2)
    # A button that springs back ahead of the runner loses a little to its damping.
    assert state.sums.stand_lost_j == pytest.approx(expected_j, rel=5e-3, abs=2e-9)


def test_runner_and_button_swing_as_one_body_and_part_where_the_push_ends(drive):
    machine = drive(**LOOSE, load_cell__resonance=1.5e3, load_cell__damping_ratio=0.001)
    machine.start(level(0.0), ())
    machine.state.velocity_m_per_s = 0.05
    seen, step_s = [], 1e-6
    for _ in range(1000):
        machine.run(level(0.0), [step_s])
        seen.append((machine.state.pressed, machine.state.position_m, machine.state.button_m))
    pressed, place_m, button_m = np.array(seen).T
    mass_kg, omega = 3e-3 + MASS_KG, math.sqrt(1e5 / (3e-3 + MASS_KG))
    speed = 3e-3 * 0.05 / mass_kg
    assert np.count_nonzero(pressed) * step_s == pytest.approx(math.pi / omega, rel=0.02)
    assert place_m.max() - 1e-6 == pytest.approx(speed / omega, rel=5e-3)
    after = np.flatnonzero(np.diff(pressed) < 0.0)[-1] + 1
    # The button is left at rest in the middle with the velocity of both: it swings on.
    assert np.abs(button_m[after:]).max() > 0.5 * speed / (2.0 * math.pi * 1.5e3)
    assert machine.state.velocity_m_per_s == pytest.approx(-speed, rel=0.02)


def test_the_gauge_reads_the_spring_of_a_button_that_rings_on(drive):
    machine = drive(**LOOSE, load_cell__resonance=1.5e3).start(level(0.0), ())
    machine.state.velocity_m_per_s = 0.05
    truth, ramps = np.empty((200, 5)), np.empty((8, 3))
    observe_samples(machine.plants, machine.states, level(0.0), 0.0, 2e-5, truth, ramps)
    assert truth[-1, FORCE] == 1e5 * machine.state.button_m
    # Pressed and pulled: a wall would never read less than nothing.
    assert truth[:, FORCE].min() < -0.01 < truth[:, FORCE].max()


def test_pressed_it_is_in_the_linear_drive_and_its_poles(drive):
    values = {'load_cell.contact': 'one_sided', 'load_cell.resonance': 1.5e3}
    linear = linearise(Parameters().updated(values), 200.0)
    mass_kg, cell_n_s_per_m = 3e-3 + MASS_KG, 0.2 * 1e5 / (2.0 * math.pi * 1.5e3)
    poles = np.roots([mass_kg, cell_n_s_per_m, linear.contact_n_per_m + 1e5])
    np.testing.assert_allclose(
        np.sort_complex(np.linalg.eigvals(linear.A)), np.sort_complex(poles), rtol=1e-9
    )


def test_a_stuck_runner_lets_the_button_go(drive):
    machine = drive(**ONE_SIDED, load_cell__resonance=1.5e3).start(WAVE, [5e-3])
    machine.plant.stuck = True
    machine.run(WAVE, [5e-3])
    assert np.isfinite(machine.state.button_m)
    assert abs(machine.state.button_m) < 1e-5
