# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Energy put in is energy found: the balance closes, and ever better with shorter steps."""

import numpy as np
import pytest

from stickslip_ros.drive.advance import RAMP_MEAN
from stickslip_ros.drive.waveform import level, sawtooth

WAVE = sawtooth(0.0, 300.0, 1000.0, 0)
RUN_S = 0.2

RESIDUAL = 1e-3
"""Largest residual at the default step, relative to the work of the feet."""
EXTREME_RESIDUAL = 3e-3
"""The same where the step is as long as the fastest swing of the runner allows."""
ORDER_4 = (100.0, 600.0)
"""A quarter of the step leaves 4^-4 of the error; closing loops scatter it."""
NEGLIGIBLE = 1e-12
"""Rounding of sums over the run, relative to the work of the feet."""


@pytest.mark.parametrize('damping', [0.0, 80.0])
@pytest.mark.parametrize('profile', ['rough', 'smooth'])
@pytest.mark.parametrize('preload_n', [0.1, 1.0])
def test_the_balance_closes_at_the_default_step(damping, profile, preload_n, drive):
    machine = drive(
        runner__damping=damping, contact__profile=profile, stand__preload=preload_n
    ).start(WAVE, [RUN_S])
    assert machine.ledger.feet_work_j > 0.0
    assert abs(machine.residual) < RESIDUAL


@pytest.mark.parametrize(('damping', 'error'), [(0.0, 6e-6), (80.0, 1.5e-6)])
def test_the_motion_is_of_fourth_order_in_the_step(damping, error, drive):
    """The errors of 4 us are twice those found; a step that drops a term may keep its order."""
    means_m = [
        drive(stand__preload=0.7, runner__damping=damping, sim__dt=dt_s)
        .start(sawtooth(0.0, 243.75, 1000.0, 0), [RUN_S])
        .ramps[199, RAMP_MEAN]
        for dt_s in (1.6e-5, 4e-6, 5e-7)
    ]
    errors_m = np.abs(np.array(means_m[:-1]) - means_m[-1])
    assert ORDER_4[0] < errors_m[0] / errors_m[1] < ORDER_4[1]
    assert errors_m[1] < error * means_m[-1]


@pytest.mark.parametrize(('damping', 'preload_n'), [(0.0, 0.5), (80.0, 0.1), (80.0, 1.0)])
def test_the_balance_of_a_rival_law_closes_with_the_fourth_power_of_the_step(
    damping, preload_n, drive
):
    residuals = []
    for dt_s in (5e-6, 1.25e-6):
        machine = drive(
            contact__law='dahl', runner__damping=damping, stand__preload=preload_n, sim__dt=dt_s
        )
        residuals.append(abs(machine.start(WAVE, [0.05]).residual))
    assert ORDER_4[0] < residuals[0] / residuals[1] < ORDER_4[1]


@pytest.mark.parametrize(
    ('law', 'error'), [('coulomb', 2e-5), ('dahl', 1e-4), ('lugre', 1e-4), ('epm', 4e-3)]
)
def test_a_rival_law_takes_the_steps_of_the_model_and_misses_little_of_a_step(law, error, drive):
    """The errors are of the step of the feet, at most twice those found; in EPM they add up."""
    wave, run_s = sawtooth(0.0, 300.0, 333.0, 40), [40 / 333.0]
    model = drive().start(wave, run_s).state
    found = drive(contact__law=law).start(wave, run_s)
    fine = drive(contact__law=law, sim__dt=5e-7).start(wave, run_s)
    assert found.state.passes_made < 1.01 * model.passes_made
    missed_m = np.max(np.abs(found.ramps[:40] - fine.ramps[:40]))
    assert missed_m < error * 300.0 * found.plant.gain_m_per_v


def test_the_balance_closes_at_every_instant(drive):
    machine = drive(runner__damping=80.0).start(WAVE, ())
    residuals_j = []
    for _ in range(1000):
        machine.run(WAVE, [1.7e-5])
        residuals_j.append(machine.ledger.residual_j)
    assert np.max(np.abs(residuals_j)) < RESIDUAL * machine.ledger.feet_work_j


def test_the_balance_holds_under_a_load_that_comes_and_goes(drive):
    machine = drive(runner__damping=20.0).start(WAVE, [0.02])
    for load_n in (0.2, -0.3, 0.0):
        before = machine.ledger
        start_m = machine.state.position_m
        machine.run(WAVE, [0.02], load_n)
        after = machine.ledger
        gained_j = after.load_work_j - before.load_work_j
        expected_j = load_n * (machine.state.position_m - start_m)
        scale_j = abs(load_n * machine.state.position_m)
        assert gained_j == pytest.approx(expected_j, rel=0.0, abs=1e-9 * scale_j)
        assert abs(after.residual_j) < RESIDUAL * after.feet_work_j


def test_a_load_alone_pays_for_everything(drive):
    machine = drive(runner__damping=20.0).start(level(0.0), [0.05], 0.3)
    ledger = machine.ledger
    assert ledger.feet_work_j == 0.0
    spring_j = 0.5 * machine.plant.cell_n_per_m * machine.state.position_m**2
    assert ledger.cell_j == pytest.approx(spring_j, rel=1e-12, abs=0.0)
    assert ledger.load_work_j > ledger.cell_j > 0.0
    assert abs(ledger.residual_j) < RESIDUAL * ledger.load_work_j


def test_no_energy_is_negative_and_no_loss_is_undone(drive):
    machine = drive(runner__damping=20.0).start(WAVE, ())
    ledgers = []
    for _ in range(400):
        machine.run(WAVE, [1.3e-5])
        ledgers.append(machine.ledger)
    within_j = NEGLIGIBLE * ledgers[-1].feet_work_j
    for term in ('kinetic_j', 'cell_j', 'contact_stored_j', 'contact_lost_j', 'damping_lost_j'):
        values_j = np.array([getattr(ledger, term) for ledger in ledgers])
        assert np.min(values_j) >= -within_j
        assert np.max(values_j) > 0.0
        if term.endswith('lost_j'):
            assert np.min(np.diff(values_j)) >= -within_j


@pytest.mark.parametrize(
    'extreme',
    [
        {'runner__mass': 1e-6},
        {'runner__mass': 10.0},
        {'runner__damping': 1e4},
        {'load_cell__stiffness': 1e9},
        {'amplifier__slew_rate': 1e12},
        {'amplifier__slew_rate': 1e6},
        {'sim__dt': 2e-5, 'runner__mass': 1e-4, 'stand__preload': 2.0},
        {'contact__law': 'lugre', 'friction_law__bristle_damping': 100.0},
        {'contact__law': 'dahl', 'friction_law__bristle_stiffness': 1e10},
    ],
    ids=str,
)
def test_steps_are_short_enough_at_the_ends_of_the_bounds(extreme, drive):
    machine = drive(**extreme).start(WAVE, [0.02])
    assert np.isfinite(machine.state.position_m)
    assert abs(machine.residual) < EXTREME_RESIDUAL
