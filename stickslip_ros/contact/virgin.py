# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Virgin curve of the whole drive as a table for kernels.

All contacts that share one displacement add up to one Prandtl-Ishlinskii operator. The curve
T_v(u) describes it completely: -T_v'' is the density of the elements that slip at u. Between the
nodes of the table the stiffness T_v' is linear, so T_v is quadratic and its integral cubic. The
node stiffnesses fall monotonically, so the density is positive, and the table is itself a
physically admissible friction law: it cannot create energy.

"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.contact.mdr import Presliding
from stickslip_ros.kernels.kernel import entry_point, kernel
from stickslip_ros.kernels.record import FLOAT, Record, kind, records

CELLS = 4096
"""Cells of a table; `virgin_force` and its derivatives check their index."""
TABLE_ERROR = 1.2e-6
"""Largest error of the force in a table, relative to the maximal force; worst for smooth spheres,
whose stiffness falls to zero like a square root."""
STIFFNESSES_KEPT = 8
"""Number of contacts whose stiffness is kept for separate tables."""
CELL_STARTS: Array = np.arange(CELLS) / CELLS
"""Starts of the cells, relative to the limit."""


CURVE = kind(
    # Per cell: force at its start (N), stiffness at its start (N/m), half the slope of the
    # stiffness (N/m^2), integral of the force up to its start (J)
    cells=(FLOAT, (CELLS, 4)),
    cells_per_m=FLOAT,  # Inverse width of a cell, 1/m
    core_m=FLOAT,  # Width of the first cell, m, where the curve is linear and free of loss
    limit_m=FLOAT,  # Displacement of full slip, m; beyond it the force is constant
    force_max_n=FLOAT,  # Force of full slip, N
    energy_max_j=FLOAT,  # Integral of the force from 0 to limit_m, J
)
"""Virgin curve of one Prandtl-Ishlinskii operator, tabulated."""


def tabulate(contacts: Sequence[Presliding], curves: Record = None) -> Record:
    """
    Return the virgin curve, in ``curves`` if given, of contacts that share one displacement.

    The node stiffnesses are the exact 2 G* c of the contacts. The first cell is linear, with its
    exact mean stiffness. The table is scaled, by less than TABLE_ERROR, so that the force of full
    slip is exactly sum(mu F_n).

    """
    whole, _, scale, cell_m = _stiffnesses(contacts)
    return _assemble(whole, scale, cell_m, curves)


def tabulate_each(contacts: Sequence[Presliding]) -> list[Record]:
    """
    Return the virgin curves of single contacts; their sum is ``tabulate`` of all contacts.

    Identical objects share a curve. The tables have the grid and the scale of the common table.
    All curves end at the limit of the contact that slips last; a contact that slips earlier has a
    flat table from its own limit on.

    """
    _, each, scale, cell_m = _stiffnesses(contacts)
    curves = {key: _assemble(stiffness, scale, cell_m) for key, stiffness in each.items()}
    return [curves[id(contact)] for contact in contacts]


def _stiffnesses(contacts: Sequence[Presliding]) -> tuple[Array, dict[int, Array], float, float]:
    """
    Return the data that the tables of contacts share.

    Stiffness at the nodes, N/m, of all contacts together and of each by its id; scale factor by
    which full slip has exactly the force sum(mu F_n); width of a cell, m.

    """
    limit_m = max(contact.max_displacement_m for contact in contacts)
    keys = [id(contact) for contact in contacts]
    own = dict(zip(keys, contacts, strict=True)).items()
    each = {key: _stiffness(contact, limit_m) for key, contact in own}
    whole = np.zeros(CELLS)
    for key, stiffness in each.items():
        whole += keys.count(key) * stiffness
    cell_m = limit_m / CELLS
    full_slip_n = sum(contact.max_force_n for contact in contacts)
    return whole, each, full_slip_n / (_sum(whole) * cell_m), cell_m


@lru_cache(maxsize=STIFFNESSES_KEPT)
def _stiffness(contact: Presliding, limit_m: float) -> Array:
    """Return the stiffness of a contact at the nodes up to a limit, N/m, read-only."""
    return contact.tangential_stiffness(limit_m * CELL_STARTS)


def _assemble(stiffness: Array, scale: float, width_m: float, curves: Record = None) -> Record:
    """Return the curve of the scaled stiffness, N/m, at nodes with a spacing of ``width_m``."""
    curves = records(CURVE) if curves is None else curves
    ends = 1.0 / width_m, width_m, width_m * CELLS
    curves['cells_per_m'], curves['core_m'], curves['limit_m'] = ends
    _fill(stiffness, scale, width_m, curves)
    return curves[0]


@kernel
def _edges(stiffness: Array, cell: int) -> tuple[float, float]:
    """Return the stiffness at start and end of a cell; the first cell is linear."""
    start = stiffness[cell]
    end = stiffness[cell + 1] if cell + 1 < CELLS else 0.0
    middle = 0.5 * (start + end)
    return (start, end) if cell else (middle, middle)


@entry_point
def _sum(stiffness: Array) -> float:
    """Return the sum of the mean stiffness of all cells."""
    total = 0.0
    for i in range(CELLS):
        start, end = _edges(stiffness, i)
        total += 0.5 * (start + end)
    return total


@entry_point
def _fill(stiffness: Array, scale: float, width_m: float, curves: Record) -> None:
    """Fill the cells of a curve, summing force and energy."""
    curve, total, force_n, energy_j = curves[0], 0.0, 0.0, 0.0
    for i in range(CELLS):
        start, end = _edges(stiffness, i)
        start, end = scale * start, scale * end
        half_slope = 0.5 * (end - start) / width_m
        cell = curve.cells[i]
        cell[0], cell[1], cell[2], cell[3] = force_n, start, half_slope, energy_j
        energy_j += width_m * (force_n + width_m * (start / 2.0 + width_m * half_slope / 3.0))
        total += 0.5 * (start + end)
        force_n = total * width_m
    curve.force_max_n, curve.energy_max_j = force_n, energy_j


@kernel
def virgin_force(curve: Record, displacement_m: float) -> float:
    """Return T_v, N, at a displacement >= 0, m."""
    place = displacement_m * curve.cells_per_m
    if not abs(place) < len(curve.cells):  # beyond the table on either side, or NaN
        return curve.force_max_n
    index = int(place)
    rest_m = displacement_m - index * curve.core_m
    return curve.cells[index, 0] + rest_m * (
        curve.cells[index, 1] + rest_m * curve.cells[index, 2]
    )


@kernel
def virgin_stiffness(curve: Record, displacement_m: float) -> float:
    """Return T_v', N/m, at a displacement >= 0, m."""
    place = displacement_m * curve.cells_per_m
    if not abs(place) < len(curve.cells):  # beyond the table, or NaN
        return 0.0
    index = int(place)
    rest_m = displacement_m - index * curve.core_m
    return curve.cells[index, 1] + 2.0 * rest_m * curve.cells[index, 2]


@kernel
def virgin_energy(curve: Record, displacement_m: float) -> float:
    """Return the integral of T_v from 0 to a displacement >= 0, J."""
    place = displacement_m * curve.cells_per_m
    if not abs(place) < len(curve.cells):  # beyond the table, or NaN
        return curve.energy_max_j + curve.force_max_n * (displacement_m - curve.limit_m)
    index = int(place)
    rest_m = displacement_m - index * curve.core_m
    return curve.cells[index, 3] + rest_m * (
        curve.cells[index, 0]
        + rest_m * (curve.cells[index, 1] / 2.0 + rest_m * curve.cells[index, 2] / 3.0)
    )
