# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Friction loops of a tribometer: tangential force of a sphere against displacement."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.contact.spring_contact import SpringContact
from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters import Parameters

_LOADED = 0.05
"""Largest force in the first row of a loop that begins at rest, as a share of the largest."""

_OF_TIME = {'contact.loss_factor', 'contact.friction_rate', 'contact.friction_ageing'}
"""Parameters with an effect that depends on time."""


@dataclass(frozen=True, eq=False)
class FrictionLoop:
    """A displacement of a sphere under a normal force, row by row."""

    displacement_m: Array  # of the far end of the rig, shape (n,)
    normal_n: Array  # shape (n,)
    rig_n_per_m: float  # stiffness of the rig; 0: rigid
    # whether the first row has a tangential force: the loop was passed before, from its middle
    is_closed: bool


@dataclass(frozen=True)
class LoopRow:
    """A row of a friction loop, from 1."""

    loop: FrictionLoop
    row: int
    number: int = 0  # of the loop, from 1; 0 for the only loop

    def _asdict(self) -> dict[str, float]:
        """Return the labels of the row that the settings of its experiment lack."""
        preload_n = float(self.loop.normal_n.max())
        return {'preload_n': preload_n, 'loop': self.number, 'row': self.row}

    @property
    def way_m(self) -> float:
        """Displacement in the row, the abscissa of figures."""
        return float(self.loop.displacement_m[self.row - 1])


def loops_of(columns: Mapping[str, Any]) -> list[FrictionLoop]:
    """Return the loop of each file; the column ``row`` restarts at 1 in each file."""
    names = 'displacement_m', 'normal_n', 'tangential_n'
    way_m, normal_n, force_n = (np.asarray(columns[name]) for name in names)
    starts = np.flatnonzero(np.asarray(columns['row']) == 1.0)[1:]
    rig_n_per_m = np.asarray(columns.get('rig_n_per_m', np.zeros(len(way_m))))
    parts = (np.split(each, starts) for each in (way_m, normal_n, force_n, rig_n_per_m))
    found = list[FrictionLoop]()
    for ways, normals, forces, rigs in zip(*parts, strict=True):
        known = forces[~np.isnan(forces)]
        is_closed = bool(abs(known[0]) > _LOADED * np.max(np.abs(known)))
        found.append(FrictionLoop(ways, normals, float(rigs[0]), is_closed))
    _check_sign(way_m, force_n)
    return found


def _check_sign(way_m: Array, force_n: Array) -> None:
    """Refuse forces along the motion, as friction gives no energy."""
    works_j = np.nan_to_num(0.5 * (force_n[1:] + force_n[:-1]) * np.diff(way_m))
    if works_j.sum() < -_LOADED * np.abs(works_j).sum():
        limit = 'below 0, the work of a friction that drives the motion'
        hint = 'turn the sign, --map tangential_n="NAME (-1 N)"'
        raise OutOfRange('work along the loop', float(works_j.sum()), 'J', limit, hint)


def without_effect(stand: Parameters) -> tuple[str, ...]:
    """Return notes on changed parameters of a stand that have no effect without time."""
    changed = stand.changed()
    names = [name for name in changed if name in _OF_TIME]
    return tuple(f'{e} {changed[e]:g} has no effect: loops have no time' for e in names)


@lru_cache(maxsize=64)
def loop_forces(stand: Parameters, loop: FrictionLoop) -> Array:
    """Return the tangential force of one contact in each row of a loop, N, shape (n,)."""
    contact = SpringContact(stand, float(loop.normal_n.max()), rig_n_per_m=loop.rig_n_per_m)
    way_m = loop.displacement_m
    begins_m = 0.5 * (way_m.max() + way_m.min()) if loop.is_closed else way_m[0]
    changes_m = np.diff(way_m, prepend=begins_m).tolist()
    forces_n = np.zeros(len(changes_m))
    for _ in range(1 + loop.is_closed):
        for row, pair in enumerate(zip(changes_m, loop.normal_n.tolist(), strict=True)):
            forces_n[row] = contact.move(*pair)
        changes_m[0] = float(way_m[0] - way_m[-1])
    return forces_n
