# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The table that kernels read against the closed form that it tabulates."""

import numpy as np
import pytest

from stickslip_ros.contact.virgin import (
    CELLS,
    TABLE_ERROR,
    tabulate,
    virgin_energy,
    virgin_force,
    virgin_stiffness,
)
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.kernels.record import Record

ROUNDING = 1e-12
"""Sums over the cells of a table."""
BETWEEN_NODES = np.linspace(0.0, 1.1, 10 * CELLS + 7)
"""Displacements, in units of the displacement of full slip, that rarely meet a node."""


@entry_point
def _look_up(curve: Record, u_m, force_n, stiffness, energy_j):
    for i in range(len(u_m)):
        force_n[i] = virgin_force(curve, u_m[i])
        stiffness[i] = virgin_stiffness(curve, u_m[i])
        energy_j[i] = virgin_energy(curve, u_m[i])


@pytest.fixture(scope='module')
def looked_up(curve):
    """Give displacement, force, stiffness and energy from the table."""
    u_m = BETWEEN_NODES * curve.limit_m
    columns = [np.empty_like(u_m) for _ in range(3)]
    _look_up(curve, u_m, *columns)
    return u_m, *columns


def test_the_force_of_the_table_is_that_of_the_closed_form(curve, contacts, looked_up):
    u_m, force_n, _, _ = looked_up
    exact_n = sum(contact.tangential_force(u_m) for contact in contacts)
    assert np.max(np.abs(force_n - exact_n)) < TABLE_ERROR * curve.force_max_n


def test_full_slip_is_exactly_coulombs_force(curve, contacts, looked_up):
    u_m, force_n, stiffness, _ = looked_up
    slips = u_m >= curve.limit_m
    largest_n = sum(contact.friction * contact.indentation.normal_force_n for contact in contacts)
    assert curve.force_max_n == pytest.approx(largest_n, rel=ROUNDING, abs=0.0)
    assert slips.sum() > CELLS / 2
    assert set(force_n[slips]) == {curve.force_max_n}
    assert set(stiffness[slips]) == {0.0}


def test_the_table_ends_where_the_last_contact_slips(curve, contacts):
    limit_m = max(contact.max_displacement_m for contact in contacts)
    assert curve.limit_m == pytest.approx(limit_m, rel=ROUNDING, abs=0.0)
    assert curve.core_m == pytest.approx(limit_m / CELLS, rel=ROUNDING, abs=0.0)


def test_the_stiffness_begins_with_that_of_full_stick_and_falls_to_zero(
    curve, contacts, looked_up
):
    _, _, stiffness, _ = looked_up
    full_stick = sum(contact.stick_stiffness_n_per_m for contact in contacts)
    # The first cell has its mean stiffness, and the steepest loss of a core is in proportion.
    assert stiffness[0] == pytest.approx(full_stick, rel=1.0 / CELLS, abs=0.0)
    assert np.all(np.diff(stiffness) <= ROUNDING * full_stick)
    assert stiffness[-1] == 0.0


def test_the_first_cell_is_linear_and_hence_free_of_loss(curve):
    u_m = np.linspace(0.0, 1.0, 11) * curve.core_m * (1.0 - ROUNDING)
    force_n, stiffness, energy_j = (np.empty_like(u_m) for _ in range(3))
    _look_up(curve, u_m, force_n, stiffness, energy_j)
    assert set(stiffness) == {curve.cells[0, 1]}
    np.testing.assert_allclose(force_n, stiffness[0] * u_m, rtol=ROUNDING)
    np.testing.assert_allclose(2.0 * energy_j, force_n * u_m, rtol=ROUNDING)


def test_the_energy_is_the_integral_of_the_force(curve, looked_up):
    u_m, force_n, _, energy_j = looked_up
    trapezoid_j = np.concatenate(
        ([0.0], np.cumsum(0.5 * (force_n[1:] + force_n[:-1]) * np.diff(u_m)))
    )
    # Ten trapezoids per cell: their error is (1/10)^2/12 of what a parabola bends within a cell.
    within = 1e-8 * curve.force_max_n * curve.limit_m
    np.testing.assert_allclose(energy_j, trapezoid_j, rtol=0.0, atol=within)


def test_contacts_that_share_a_displacement_add_up(hemisphere):
    one, two = hemisphere('rough', 0.1), hemisphere('smooth', 0.3)
    both, alone = tabulate([one, two]), tabulate([two])
    limit_m = one.max_displacement_m
    assert both.limit_m == pytest.approx(
        max(limit_m, two.max_displacement_m), rel=ROUNDING, abs=0.0
    )
    assert both.force_max_n == pytest.approx(0.3 * 0.4, rel=ROUNDING, abs=0.0)
    pair = tabulate([two, two])
    np.testing.assert_allclose(pair.cells, 2.0 * alone.cells, rtol=ROUNDING)


def test_a_displacement_that_no_contact_has_reads_nothing_beyond_the_table(curve):
    u_m = np.array([-1.0, -1e15, np.inf, np.nan])
    columns = [np.empty_like(u_m) for _ in range(3)]
    _look_up(curve, u_m, *columns)
    assert (columns[0] == curve.force_max_n).all()
    assert (columns[1] == 0.0).all()
