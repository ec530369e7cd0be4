# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Faults: no power, a stuck runner, a dead foot."""

import numpy as np
import pytest

from stickslip_ros.drive.build import change_preload
from stickslip_ros.drive.faults import apply_faults
from stickslip_ros.drive.records import ALL
from stickslip_ros.drive.waveform import level, sawtooth
from stickslip_ros.errors import OutOfRange

WAVE = sawtooth(0.0, 300.0, 1000.0, 0)
NO_FAULTS = {'dead_foot': 0, 'runner_stuck': False, 'amplifier_on': True}
SAME_FORCE = 1e-9
"""Relative to the friction limit; sums of six tables instead of one."""
SHORT = 2e-5
"""Relative; what short steps miss against long ones."""
RESIDUAL = 1e-3
"""Largest residual at the default step, relative to the work of the feet."""


def _apply(machine, **faults):
    apply_faults(machine.plants, machine.states, machine.parameters, **(NO_FAULTS | faults))
    return machine


def test_no_fault_changes_nothing(drive):
    machine, twin = (drive().start(WAVE, [3.3e-3]) for _ in range(2))
    _apply(machine).run(WAVE, [5e-3])
    twin.run(WAVE, [5e-3])
    assert machine.state == twin.state
    assert machine.plant.ideal


@pytest.mark.parametrize('changes', [{}, {'amplifier__bandwidth': 1e5}], ids=str)
def test_without_power_the_voltage_goes_to_the_lowest_and_comes_back(changes, drive):
    machine = drive(**changes).start(level(250.0), [1e-3])
    _apply(machine, amplifier_on=False).run(level(250.0), [1e-6])
    assert 90.0 < machine.state.voltage_v < 250.0
    machine.run(level(250.0), [1e-4])
    assert machine.state.voltage_v == pytest.approx(0.0, abs=1e-9)
    _apply(machine).run(level(250.0), [1e-3])
    assert machine.state.voltage_v == pytest.approx(250.0, rel=1e-12)
    assert abs(machine.residual) < RESIDUAL


def test_without_power_a_wave_still_counts_its_ramps(drive):
    machine = _apply(drive(), amplifier_on=False).start(WAVE, [5.5e-3])
    assert machine.state.clock.cycle == 5
    assert machine.state.voltage_v == 0.0
    assert machine.state.position_m == 0.0


@pytest.mark.parametrize('law', ['mdr', 'coulomb', 'dahl'])
@pytest.mark.parametrize('tolerance', [0.0, 0.1])
def test_a_stuck_runner_stays_while_the_feet_work_and_moves_again(law, tolerance, drive):
    if law == 'coulomb':
        tolerance = 0.0
    machine = drive(contact__law=law, actuator__gain_tolerance=tolerance, runner__damping=20.0)
    machine.start(WAVE, [3.3e-3])
    kinetic_j = machine.ledger.kinetic_j
    _apply(machine, runner_stuck=True)
    stuck_m = machine.state.position_m
    assert machine.ledger.stuck_lost_j == kinetic_j > 0.0
    lost_j = machine.ledger.contact_lost_j
    machine.run(WAVE, [5e-3])
    assert machine.state.position_m == stuck_m
    assert machine.state.velocity_m_per_s == 0.0
    assert machine.ledger.contact_lost_j > lost_j
    _apply(machine).run(WAVE, [5e-3])
    assert machine.state.position_m != stuck_m
    # The force of Coulomb's law jumps from step to step.
    assert abs(machine.residual) < (0.05 if law == 'coulomb' else 2.0 * RESIDUAL)


@pytest.mark.parametrize('profile', ['rough', 'smooth', 'rough_line'])
@pytest.mark.parametrize('time_s', [0.0, 0.4e-3, 1.0001e-3, 7.77e-3, 50.3e-3])
def test_six_feet_split_from_one_have_its_force_its_energy_and_its_turning_points(
    profile, time_s, drive
):
    machine = drive(contact__profile=profile).start(WAVE, [time_s])
    before, memory = machine.ledger, machine.state.contacts[ALL].memory.copy()
    machine.separate()
    limit_n = machine.plant.contacts[ALL].curve.force_max_n
    gained_n = machine.state.contact_n - memory.force_n
    assert abs(gained_n) < SAME_FORCE * limit_n
    assert np.all(machine.contacts['memory']['depth'] == memory.depth)
    scale_j = max(before.feet_work_j, 1e-30)
    assert abs(machine.ledger.contact_lost_j - before.contact_lost_j) < 1e-12 * scale_j
    assert abs(machine.ledger.contact_stored_j - before.contact_stored_j) < 1e-9 * scale_j


def test_a_split_drive_moves_on_like_the_one_it_was(drive):
    machine, twin = (drive(runner__damping=20.0).start(WAVE, [3.3e-3]) for _ in range(2))
    machine.separate()
    for drive_ in (machine, twin):
        drive_.run(WAVE, [5e-3])
    assert machine.state.position_m == pytest.approx(twin.state.position_m, rel=SHORT)
    assert abs(machine.residual) < RESIDUAL


def test_springs_are_split_with_their_force_and_their_energy(drive):
    machine = drive().start(WAVE, [3.3e-3])
    change_preload(machine.plants, machine.states, machine.parameters, 0.8)
    machine.run(WAVE, [2.6e-3])
    assert machine.contacts['on_springs'].all()
    before, force_n = machine.ledger, machine.state.contact_n
    _apply(machine, dead_foot=2)
    limit_n = machine.plant.contacts[ALL].curve.force_max_n
    assert abs(machine.state.contact_n - force_n) < SAME_FORCE * limit_n
    assert machine.ledger.contact_stored_j == pytest.approx(before.contact_stored_j, rel=1e-12)
    assert machine.ledger.contact_lost_j == pytest.approx(before.contact_lost_j, rel=1e-12)
    machine.run(WAVE, [5e-3])
    assert machine.contacts['on_springs'].all()
    assert abs(machine.residual) < 5.0 * RESIDUAL


@pytest.mark.parametrize('law', ['mdr', 'dahl', 'lugre'])
@pytest.mark.parametrize('tolerance', [0.0, 0.1])
def test_a_dead_foot_stays_and_follows_again_from_where_it_is(law, tolerance, drive):
    machine = drive(contact__law=law, actuator__gain_tolerance=tolerance, runner__damping=20.0)
    machine.start(WAVE, [3.3e-3])
    _apply(machine, dead_foot=4)
    places_m = machine.state.places_m[1:7].copy()
    machine.run(WAVE, [0.3e-3])
    moved = machine.state.places_m[1:7] != places_m
    assert moved.tolist() == [True, True, True, False, True, True]
    _apply(machine)
    assert machine.state.places_m[4] == places_m[3]
    machine.run(WAVE, [1e-9])
    # In a nanosecond the feet move by 0.2 pm.
    assert machine.state.places_m[4] == pytest.approx(places_m[3], abs=1e-12)
    machine.run(WAVE, [0.2e-3])
    ratio = machine.plant.ratios[4]
    gained_m = machine.state.places_m[4] - places_m[3]
    assert gained_m == pytest.approx(ratio * 160e-9 * 0.2, rel=1e-4)
    assert abs(machine.residual) < 2.0 * RESIDUAL


def test_a_dead_foot_brakes(drive):
    whole = drive(load_cell__contact='absent').start(WAVE, [0.05])
    lame = _apply(drive(load_cell__contact='absent'), dead_foot=1).start(WAVE, [0.05])
    assert 0.0 < lame.state.position_m < 0.9 * whole.state.position_m
    assert abs(lame.residual) < RESIDUAL


def test_faults_come_and_go_in_any_order_and_the_balance_closes(drive):
    machine = drive(runner__damping=20.0, actuator__hysteresis=0.1).start(WAVE, [2.2e-3])
    for faults in (
        {'dead_foot': 3},
        {'dead_foot': 3, 'runner_stuck': True},
        {'dead_foot': 5, 'runner_stuck': True},
        {'dead_foot': 5, 'amplifier_on': False},
        {'amplifier_on': False, 'runner_stuck': True},
        {'dead_foot': 5},
        {},
    ):
        _apply(_apply(machine, **faults), **faults).run(WAVE, [1.3e-3])
        assert abs(machine.residual) < RESIDUAL
    assert machine.plant.dead == 0
    assert not machine.plant.stuck


def test_coulombs_law_does_not_say_how_feet_share_a_load(drive):
    machine = drive(contact__law='coulomb').start(WAVE, [1e-3])
    with pytest.raises(OutOfRange, match=r'fault.dead_foot 2 is refused under Coulomb'):
        _apply(machine, dead_foot=2)
