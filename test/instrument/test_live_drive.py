# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Friction, mass and damping change while the drive runs."""

from collections.abc import Mapping

import numpy as np
import pytest
from bench_runs import MS, PERFECT, drive_bench, load, sawtooth

from stickslip_ros.contact.hemisphere import elasticity_of
from stickslip_ros.contact.springs import BANK_ERROR
from stickslip_ros.drive.records import POSITION, TIME
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.reports import Result
from stickslip_ros.parameters import Parameters

ENERGY_RESIDUAL = 1e-3
"""The ledger's error at the default step, relative to the work of the feet."""
LITTLE_FRICTION = 3e-5
"""Ten times the friction limit of the swinging runner, per force: a loss for each half swing."""
OTHER = {'contact.friction': 0.1, 'runner.mass': 0.012, 'runner.damping': 40.0}


def changed(values: Mapping[str, float]) -> Request:
    return Request('parameters', settings=tuple(values.items()))


def smooth_force_n(parameters: Parameters, friction: float, u_m: float) -> float:
    """Return the force of smooth feet moved once by u, by Cattaneo and Mindlin."""
    stuff, force_n = elasticity_of(parameters.contact), 0.0
    stiffness = stuff.normal_pa * np.sqrt(parameters.contact.radius)
    for feet, share in zip(parameters.feet.count, parameters.feet.share, strict=True):
        normal_n = share * parameters.stand.preload
        depth_m = (0.75 * normal_n / stiffness) ** (2.0 / 3.0)
        sticks = 1.0 - u_m / (friction * stuff.cattaneo_mindlin * depth_m)
        assert 0.0 < sticks < 1.0, 'a part of each contact sticks'
        force_n += feet * friction * normal_n * (1.0 - sticks**1.5)
    return force_n


def test_under_less_friction_the_springs_above_it_slip_at_once_and_no_others():
    stuck = {'contact.profile': 'smooth', 'fault.runner_stuck': True}
    parameters = Parameters().updated(stuck)
    bench = Bench(parameters)
    drive_bench(bench, 20 * MS, {0: [Request('voltage', (20.0,))]})
    u_m = parameters.actuator.gain * 20.0
    before_n, before = bench.state.contact_n, bench.ledger
    assert abs(before_n) == pytest.approx(smooth_force_n(parameters, 0.3, u_m), rel=1e-5)
    for friction in (0.15, 0.3):  # what slipped stays where it is
        drive_bench(bench, MS, {0: [changed({'contact.friction': friction})]})
        expected_n = smooth_force_n(parameters, 0.15, u_m)
        assert abs(bench.state.contact_n) == pytest.approx(expected_n, rel=BANK_ERROR)
        after = bench.ledger
        freed_j = before.contact_stored_j - after.contact_stored_j
        lost_j = after.contact_lost_j - before.contact_lost_j
        assert lost_j == pytest.approx(freed_j, rel=0.0, abs=BANK_ERROR * before.feet_work_j)
        assert lost_j > 10.0 * BANK_ERROR * before.feet_work_j


@pytest.mark.parametrize('change', [{'runner.mass': 0.012}, {'runner.damping': 5.0}])
def test_the_runner_swings_on_from_its_place_and_velocity(change: dict[str, float]):
    """On its load cell the runner is an oscillator with a known motion."""
    slippery = {'contact.friction': 1e-3, 'stand.preload': 1e-3, 'stand.load_limit': 1.0}
    parameters = Parameters().updated(PERFECT | slippery)
    cell_n_per_m, force_n = parameters.load_cell.stiffness, 1.0
    bench = Bench(parameters)
    drive_bench(bench, 3 * MS, {0: [load(force_n)]})
    start_m = bench.state.position_m - force_n / cell_n_per_m
    start_m_per_s = bench.state.velocity_m_per_s
    bench.accept(changed(change))
    assert bench.state.velocity_m_per_s == start_m_per_s
    runner, trace = parameters.updated(change).runner, drive_bench(bench, 10 * MS, {}).trace
    time_s, decay = trace[:, TIME] - 3e-3, 0.5 * runner.damping / runner.mass
    omega = np.sqrt(cell_n_per_m / runner.mass - decay**2)
    swing_m = start_m * np.cos(omega * time_s)
    swing_m += (start_m_per_s + decay * start_m) / omega * np.sin(omega * time_s)
    expected_m = force_n / cell_n_per_m + np.exp(-decay * time_s) * swing_m
    error_m = LITTLE_FRICTION * np.ptp(expected_m)
    np.testing.assert_allclose(trace[:, POSITION], expected_m, rtol=0.0, atol=error_m)
    ledger = bench.ledger
    assert abs(ledger.residual_j) < ENERGY_RESIDUAL * ledger.load_work_j


@pytest.mark.parametrize(
    'stand',
    [
        {},
        {'feet.count': [3, 3], 'feet.share': [0.5, 0.4], 'feet.gain': [1.0, -0.5]},
        {'contact.friction_rate': 0.01, 'contact.friction_ageing': 0.01},
        {'contact.law': 'coulomb'},
        {'contact.law': 'lugre'},
        {'contact.loss_factor': 0.1},
        {'actuator.stiffness': 1e7, 'actuator.resonance': 1e5, 'frame.mass': 0.05},
        {'fault.dead_foot': 2},
        {'stand.preload_end': 0.8},
    ],
    ids=str,
)
def test_energy_balances_and_a_checkpoint_goes_on_alike_after_every_change(
    stand: dict[str, object],
):
    bench = Bench(Parameters().updated(stand))
    drive_bench(bench, 4 * MS, {0: [sawtooth(300.0, 700.0)]})
    for change in (OTHER, {'contact.friction': 0.4, 'runner.mass': 0.001}):
        run = drive_bench(bench, 4 * MS, {0: [changed(change)]})
        assert [event.result for event in run.events] == [Result.DONE]
        assert bench.parameters.flat().items() >= change.items()
        again = Bench.restore(bench.save())
        assert again.plant.tobytes() == bench.plant.tobytes()
        one, other = (drive_bench(each, 4 * MS, {}) for each in (bench, again))
        assert one.trace.tobytes() == other.trace.tobytes()
    assert abs(bench.ledger.residual_j) < ENERGY_RESIDUAL * bench.ledger.feet_work_j


def test_the_value_that_is_set_already_changes_nothing():
    one, other = (Bench(Parameters()) for _ in range(2))
    same = changed({'contact.friction': 0.3, 'runner.mass': 3e-3})
    for bench, requests in ((one, ()), (other, (same,))):
        drive_bench(bench, 4 * MS, {0: [sawtooth(300.0, 700.0)], 2 * MS: requests})
    assert one.state.tobytes() == other.state.tobytes()


def test_a_reset_leads_to_rest_with_the_new_values():
    bench = Bench(Parameters())
    drive_bench(bench, 3 * MS, {0: [sawtooth(300.0, 700.0)], MS: [changed(OTHER)]})
    drive_bench(bench, MS, {0: [Request('reset')]})
    anew = Bench(Parameters().updated(OTHER))
    assert bench.plant.tobytes() == anew.plant.tobytes()


@pytest.mark.parametrize(
    ('stand', 'change', 'parts'),
    [
        ({'stand.weight': True}, {'runner.mass': 0.004}, ('0.004 kg', '0.003 kg', 'stand.weight')),
        (
            {'contact.profile': 'rough_line', 'contact.travel': 1.0},
            {'contact.friction': 0.2},
            ('contact.friction 0.2', 'from 0.3', 'contact.travel'),
        ),
        ({'feet.guide_friction': 0.1}, {'contact.friction': 0.2}, ('feet.guide_friction',)),
        (
            {'contact.law': 'dahl', 'feet.friction': 0.2},
            {'contact.friction': 0.2},
            ('feet.friction', 'dahl'),
        ),
    ],
)
def test_a_change_that_the_contacts_cannot_follow_is_refused_and_changes_nothing(
    stand: dict[str, object], change: dict[str, float], parts: tuple[str, ...]
):
    parameters = Parameters().updated(stand)
    bench, twin = Bench(parameters), Bench(parameters)
    run, undisturbed = (
        drive_bench(each, MS, {0: [sawtooth(300.0, 1000.0), *requests]})
        for each, requests in ((bench, [changed(change)]), (twin, []))
    )
    [event] = run.events
    assert event.result is Result.INVALID_PARAMETER
    for part in (*parts, 'deactivate'):
        assert part in event.message
    assert bench.parameters == parameters
    assert run.trace.tobytes() == undisturbed.trace.tobytes()
