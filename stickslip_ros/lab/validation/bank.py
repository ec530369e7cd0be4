# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Answers for the drive's springs, at constant preload and on ramps."""

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.contact.springs import move_springs, springs_kind, stored_in_springs
from stickslip_ros.drive.build import all_contacts
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.kernels.record import Record, record
from stickslip_ros.lab.validation.contacts import missing_share, zigzag
from stickslip_ros.parameters import Parameters

_move_springs = entry_point(move_springs)
_stored_in_springs = entry_point(stored_in_springs)

TURN_SEED, TURNS, TURN_STEPS = 20140, 60, 8
"""Random history at constant preload, with nested loops and full slip."""
FAR_M = 1e-6  # displacement of full slip
RAMP_N = (2.0, 0.1, 1.5, 0.2, 1.0)  # corners of the preload on ramps, from the last corner
RAMP_SEED, RAMP_TURNS, RAMP_STEPS = 97, 25, 40
RAMP_REACH_M = 120e-9  # largest turn on ramps: full slip at light preload, stick at heavy preload
_BALANCE_STEPS = 4000


def random_turns(seed: int, count: int) -> tuple[float, ...]:
    """Return turning points, uniform between -1 and 1."""
    return tuple(np.random.default_rng(seed).uniform(-1.0, 1.0, count).tolist())


def random_path(reach_m: float) -> Array:
    """Return the random history, scaled to a reach, m."""
    return zigzag(tuple(turn * reach_m for turn in random_turns(TURN_SEED, TURNS)), TURN_STEPS)


def ramp(refinement: int = 1) -> tuple[Array, Array]:
    """Return displacements, m, and preloads, N, of the ramps, refined."""
    turns = tuple(RAMP_REACH_M * turn for turn in random_turns(RAMP_SEED, RAMP_TURNS))
    displacements_m = zigzag(turns, RAMP_STEPS)
    last = len(displacements_m) - 1
    steps = np.linspace(0.0, last, refinement * last + 1, dtype=np.float64)
    corners = np.linspace(0.0, last, len(RAMP_N) + 1, dtype=np.float64)
    return (
        np.interp(steps, np.arange(last + 1.0), displacements_m),
        np.interp(steps, corners, (RAMP_N[-1], *RAMP_N)),
    )


@lru_cache(maxsize=16)
def bank_for(profile: str, preload_n: float) -> Record:
    """Return the springs of a drive for preloads up to ``preload_n``."""
    values = {'contact.profile': profile, 'stand.preload': preload_n}
    return all_contacts(Parameters().updated(values)).bank


def drag_bank(bank: Record, displacements_m: Array, preloads_n: Array) -> Array:
    """Return force, stored and lost energy along displacements, from unloaded springs."""
    springs = record(springs_kind(len(bank.heights_m)))
    place_m, preload_n, lost_j = displacements_m[0], preloads_n[0], 0.0
    rows = []
    for next_m, next_n in zip(displacements_m, preloads_n, strict=True):
        force_n, loss_j = _move_springs(bank, springs, next_m - place_m, preload_n, next_n)
        place_m, preload_n, lost_j = next_m, next_n, lost_j + loss_j
        rows.append((force_n, _stored_in_springs(bank, springs), lost_j))
    return np.array(rows)


@lru_cache(maxsize=16)
def random_log(profile: str, preload_n: float, reach_m: float) -> Array:
    """Return force, stored and lost energy along the random history."""
    path_m = random_path(reach_m)
    return drag_bank(bank_for(profile, preload_n), path_m, np.full(len(path_m), preload_n))


def bank_full_slip_n(profile: str, preload_n: float) -> float:
    """Return the force in full slip of springs for up to 2 N."""
    there_m = np.array([0.0, FAR_M])
    bank = bank_for(profile, max(RAMP_N))
    return float(drag_bank(bank, there_m, np.full(2, preload_n))[-1, 0])


@lru_cache(maxsize=4)
def ramp_log(profile: str) -> Array:
    """Return force, stored and lost energy along the ramps."""
    return drag_bank(bank_for(profile, max(RAMP_N)), *ramp())


def bank_missing(profile: str) -> float:
    """Return the share of work that is neither stored nor lost while the preload changes."""
    angles = np.linspace(0.0, 4.0 * np.pi, _BALANCE_STEPS + 1, dtype=np.float64)
    path_m, preloads_n = RAMP_REACH_M * np.sin(angles), 0.6 + 0.4 * np.cos(0.7 * angles)
    log = drag_bank(bank_for(profile, max(RAMP_N)), path_m, preloads_n)
    return missing_share(path_m, log[:, 0], log[:, 1] + log[:, 2])


ANSWERS: Mapping[str, Callable[..., Any]] = {
    'bank_force_n': lambda legs, **at: random_log(**at)[round(legs * TURN_STEPS), 0],
    'bank_full_slip_n': bank_full_slip_n,
    'ramp_force_n': lambda profile, step: ramp_log(profile)[round(step), 0],
    'ramp_loss_j': lambda profile: ramp_log(profile)[-1, 2],
    'bank_missing': bank_missing,
}
"""Functions by quantity; the name ends with the unit."""
