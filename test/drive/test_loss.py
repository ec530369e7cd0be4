# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Loss in sticking contacts: ring-down, small loops, balance, and the same in all steps."""

import math

import numpy as np
import pytest

from stickslip_ros.drive.build import change_preload
from stickslip_ros.drive.waveform import level, sawtooth, table

WAVE = sawtooth(0.0, 300.0, 1000.0, 0)
STACKS = {'actuator__resonance': 1.5e5, 'actuator__stiffness': 3.5e7}
FRAME = {'frame__mass': 0.02, 'frame__resonance': 1e4}
DELAYS = {'feet__count': (3, 3), 'feet__share': 0.47, 'feet__delay': (0.0, 5e-4)}
RING_M_PER_S = 1e-7
"""It swings by some pm, in the core of the virgin curve, which has no friction loss."""
RINGS = 1e-3
"""Peaks between samples of 1 us; 1.1e-4 was seen."""
LOOP = 2e-3
RESIDUAL = 5e-5
"""Relative to the work of the feet; 3.1e-5 was seen, on stacks with a loss factor of 1."""
STEPS_AGREE = 1e-5


@pytest.mark.parametrize(
    'stand',
    [
        {},
        {'load_cell__contact': 'absent'},
        {'load_cell__stiffness': 3e6},
        {'runner__mass': 1e-2},
        {'stand__preload': 0.2, 'runner__mass': 1e-3},
        {'feet__gain': (1.0, 0.0)},
        {'actuator__resonance': 1.5e5},
    ],
    ids=str,
)
@pytest.mark.parametrize('loss_factor', [0.02, 0.1, 0.3])
def test_a_stuck_runner_rings_down_with_half_the_loss_factor(stand, loss_factor, drive):
    machine = drive(contact__loss_factor=loss_factor, **stand).start(level(0.0), [])
    machine.state.velocity_m_per_s = RING_M_PER_S
    positions_m = []
    for _ in range(600):
        machine.run(level(0.0), [1e-6])
        positions_m.append(machine.state.position_m)
    x = np.array(positions_m)
    peaks = 1 + np.flatnonzero((x[1:-1] > x[:-2]) & (x[1:-1] > x[2:]))
    before, top, after = (x[peaks + shift] for shift in (-1, 0, 1))
    heights = top + (after - before) ** 2 / (8.0 * (2.0 * top - before - after))
    decay = math.log(heights[0] / heights[2]) / 2.0
    ratio = decay / math.hypot(2.0 * math.pi, decay)
    assert ratio == pytest.approx(0.5 * loss_factor, rel=RINGS)


def test_a_small_loop_loses_two_pi_times_the_factor_of_its_elastic_energy(drive):
    """The runner is held and the feet swing at the frequency at which it would ring."""
    machine = drive(contact__loss_factor=0.1, load_cell__contact='absent', sim__dt=1e-6)
    plant = machine.plant
    stiffness = float(plant.contacts[0].curve.cells[0, 1])
    period_s = 2.0 * math.pi * math.sqrt(plant.mass_kg / stiffness)
    plant.stuck, plant.ideal, plant.only_long_steps = True, False, False
    share, volts = np.arange(257) / 256.0, 0.01
    rows = np.column_stack((share * period_s, volts * (1.0 - np.cos(2.0 * np.pi * share))))
    wave = table(rows, 0)
    machine.start(wave, [3.0 * period_s])
    before_j = machine.ledger.sticking_lost_j
    machine.run(wave, [period_s])
    lost_j = machine.ledger.sticking_lost_j - before_j
    elastic_j = 0.5 * stiffness * (plant.gain_m_per_v * volts) ** 2
    assert lost_j == pytest.approx(2.0 * math.pi * 0.1 * elastic_j, rel=LOOP, abs=0.0)


@pytest.mark.parametrize('loss_factor', [0.1, 1.0])
@pytest.mark.parametrize(
    'stand',
    [
        {},
        {'feet__gain': (1.0, 0.0)},
        {'actuator__gain_tolerance': 0.2},
        {'load_cell__contact': 'one_sided', 'load_cell__resonance': 1500.0},
        {**STACKS, **FRAME},
        {**STACKS, **FRAME, **DELAYS},
        {'contact__friction_rate': 0.01, 'contact__friction_ageing': 0.015},
        {'contact__profile': 'rough_line', 'contact__travel': 1.0},
    ],
    ids=str,
)
def test_the_balance_closes_with_a_loss_in_every_stand(stand, loss_factor, drive):
    machine = drive(contact__loss_factor=loss_factor, **stand).start(WAVE, [0.01])
    assert machine.ledger.sticking_lost_j > 0.1 * machine.ledger.feet_work_j
    assert abs(machine.residual) < RESIDUAL


def test_the_loss_of_a_changed_preload_is_that_of_its_stiffness(drive):
    machine, other = (
        drive(contact__loss_factor=0.1, stand__preload=preload_n) for preload_n in (0.3, 0.8)
    )
    change_preload(machine.plants, machine.states, machine.parameters, 0.8)
    machine.start(WAVE, [0.01])
    assert machine.plant.loss_s == pytest.approx(other.plant.loss_s, rel=1e-12)
    assert abs(machine.residual) < RESIDUAL


def test_short_steps_lose_what_long_steps_lose(drive):
    long, short = (drive(contact__loss_factor=0.1) for _ in range(2))
    short.separate()
    for machine in (long, short):
        machine.start(WAVE, [0.02])
    assert long.plant.only_long_steps
    assert not short.plant.ideal
    assert short.state.position_m == pytest.approx(long.state.position_m, rel=STEPS_AGREE)
    lost_j = long.ledger.sticking_lost_j
    assert short.ledger.sticking_lost_j == pytest.approx(lost_j, rel=10.0 * STEPS_AGREE)


def test_contacts_in_full_slip_have_no_drag(drive):
    """A fast runner is slowed by the friction limit alone."""
    found = []
    for loss_factor in (0.0, 1.0):
        machine = drive(contact__loss_factor=loss_factor, load_cell__contact='absent')
        machine.start(level(0.0), [])
        machine.state.velocity_m_per_s = 0.1
        machine.run(level(0.0), [1e-4])
        before = float(machine.state.velocity_m_per_s)
        machine.run(level(0.0), [1e-4])
        found.append(before - machine.state.velocity_m_per_s)
    limit_n = machine.plant.contacts[0].curve.force_max_n
    assert found == pytest.approx([1e-4 * limit_n / machine.plant.mass_kg] * 2, rel=1e-9)
