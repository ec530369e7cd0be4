# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Feet with a mass on stacks that their loads bend."""

import numpy as np
import pytest

from stickslip_ros.drive.advance import RAMP_END, RAMP_MEAN
from stickslip_ros.drive.faults import apply_faults
from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.drive.waveform import level, sawtooth
from stickslip_ros.lab.linear.linearise import linearise
from stickslip_ros.parameters import Parameters

WAVE = sawtooth(0.0, 287.3, 1153.4, 0)
SOFT = {
    'actuator__stiffness': 3.2e7, 'actuator__resonance': 1.5e5, 'actuator__damping_ratio': 0.1
}  # fmt: skip
STACK_N_PER_M = 3.2e7
FOOT_KG = STACK_N_PER_M / (2.0 * np.pi * 1.5e5) ** 2
LIGHT = {'frame__mass': 60.0 * FOOT_KG, 'frame__resonance': 1e4}
"""A frame of which the feet are a tenth."""
RESIDUAL = 1e-4


def test_a_load_at_rest_bends_each_stack_by_force_per_stiffness(drive):
    machine = drive(**SOFT, runner__damping=50.0).start(level(0.0), [0.02], 0.02)
    forces_n = machine.contacts['memory']['force_n']
    # The load cell carries the rest.
    assert forces_n.sum() == pytest.approx(0.02, rel=0.02)
    np.testing.assert_allclose(
        machine.state.places_m[1:7], forces_n / STACK_N_PER_M, rtol=1e-3, atol=1e-15
    )
    # The upper feet carry twice the load and are stiffer: they bend more.
    assert machine.state.places_m[1] > 1.2 * machine.state.places_m[3]


def test_stiffer_stacks_come_ever_nearer_to_feet_that_no_load_bends(drive):
    rings = SOFT | {'actuator__stiffness': 0.0}
    deaf = drive(**rings, sim__dt=6e-7).start(WAVE, [3e-3]).ramps[2, RAMP_MEAN]
    off = []
    for stiffer in (1.0, 1e2, 1e4):
        changed = {'actuator__stiffness': stiffer * STACK_N_PER_M}
        machine = drive(**SOFT | changed, sim__dt=6e-7).start(WAVE, [3e-3])
        off.append(abs(machine.ramps[2, RAMP_MEAN] / deaf - 1.0))
    assert off[1] < 0.05 * off[0]
    assert off[2] < 1e-3 * off[0] + 1e-6


@pytest.mark.parametrize('frame', [{}, {'frame__mass': 0.02, 'frame__resonance': 1e4}, LIGHT])
def test_the_error_falls_with_the_step_and_the_balance_closes(frame, drive):
    ends_m = []
    for dt_s in (1e-5, 5e-6, 1.25e-6, 3e-7):
        machine = drive(**SOFT, **frame, sim__dt=dt_s).start(WAVE, [5e-3])
        assert abs(machine.residual) < 2.0 * RESIDUAL
        ends_m.append(machine.ramps[:5, (RAMP_MEAN, RAMP_END)])
    errors = [np.sqrt(np.mean((each - ends_m[-1]) ** 2)) for each in ends_m[:-1]]
    assert errors[1] < 3e-4 * np.abs(ends_m[-1]).max()
    assert errors[1] / errors[2] > 4.0**2


def test_the_balance_closes_while_the_feet_of_a_light_frame_fall(drive):
    """There the motion of their centre of mass, which the frame has, is a tenth of theirs."""
    machine = drive(**SOFT, **LIGHT, sim__dt=6e-7).start(WAVE, [3.0 / 1153.4])
    fastest_j = 0.0
    for _ in range(20):
        machine.run(WAVE, [2e-7])
        speeds = machine.state.feet['m_per_s'][1:7]
        fastest_j = max(fastest_j, 0.5 * FOOT_KG * float(np.sum(speeds**2)))
        assert abs(machine.residual) < RESIDUAL
    assert fastest_j > 0.1 * machine.ledger.feet_work_j


@pytest.mark.parametrize('loss_factor', [0.0, 0.1])
@pytest.mark.parametrize('frame', [{}, {'frame.mass': 1e-3, 'frame.resonance': 1e4}])
def test_the_linear_drive_has_the_poles_of_the_bodies_on_their_springs(frame, loss_factor):
    values = {name.replace('__', '.'): each for name, each in SOFT.items()}
    values['contact.loss_factor'] = loss_factor
    parameters = Parameters().updated(values | frame)
    linear, kg = linearise(parameters, 0.0), frame.get('frame.mass', 0.0)
    each = [contact.stick_stiffness_n_per_m for contact in contacts_of(parameters)]
    bodies = ['runner', *range(6), *(['frame'] if kg else [])]
    n, own = len(bodies), (2.0 * np.pi * 1e4) ** 2 * kg
    lag_s = loss_factor * np.sqrt(3e-3 * (sum(each) + 1e5)) / sum(each)
    mass = np.diag([3e-3, *[FOOT_KG] * 6, *([kg - 6 * FOOT_KG] if kg else [])])
    spring, damper = np.zeros((n, n)), np.zeros((n, n))
    spring[0, 0] += 1e5
    for k in range(1, 7):
        spring[np.ix_((0, k), (0, k))] += each[k - 1] * np.array([[1, -1], [-1, 1]])
        damper[np.ix_((0, k), (0, k))] += lag_s * each[k - 1] * np.array([[1, -1], [-1, 1]])
        ends = (k, 7) if kg else (k,)
        pattern = np.array([[1, -1], [-1, 1]]) if kg else np.ones((1, 1))
        spring[np.ix_(ends, ends)] += STACK_N_PER_M * pattern
        damper[np.ix_(ends, ends)] += 0.2 * 2.0 * np.pi * 1.5e5 * FOOT_KG * pattern
    if kg:
        spring[7, 7] += own
        damper[7, 7] += 2.0 * 0.01 * 2.0 * np.pi * 1e4 * kg
    inverse = np.linalg.inv(mass)
    whole = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ spring, -inverse @ damper]])
    found, expected = np.linalg.eigvals(linear.A), np.linalg.eigvals(whole)
    for pole in expected:
        assert np.abs(found - pole).min() < 1e-5 * abs(pole)


def test_a_dead_foot_bends_on_and_follows_again(drive):
    machine = drive(**SOFT).start(WAVE, [2.3e-3])
    for foot in (2, 0):
        apply_faults(
            machine.plants, machine.states, machine.parameters,
            dead_foot=foot, runner_stuck=False, amplifier_on=True,
        )  # fmt: skip
        machine.run(WAVE, [3e-3])
        assert abs(machine.residual) < 2.0 * RESIDUAL
    assert machine.state.places_m[2] == pytest.approx(machine.state.places_m[1], abs=2e-7)
