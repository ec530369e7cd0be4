"""The springs of the drive along histories of displacement and preload."""

from math import sqrt

import numpy as np

from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import Record, record
from stickslip_ros.contact.springs import drag, springs_kind, stored_in_springs
from stickslip_ros.drive.build import all_contacts
from stickslip_ros.parameters import Parameters
from stickslip_ros.validation.histories import History
from stickslip_ros.validation.stand import FRICTION

drag = entry_point(drag)
stored_in_springs = entry_point(stored_in_springs)

LIMIT_PER_PRELOAD = FRICTION * 2.0 * sqrt(2.0)
"""Full slip of all six contacts per preload: mu times the sum of Eq. 19."""


def model_at(preload_n: float, profile: str = 'rough') -> Record:
    """Return the contacts of the drive at a preload."""
    values = {'contact.profile': profile, 'stand.preload': preload_n}
    return all_contacts(Parameters().updated(values))


def random_turns(seed: int, count: int) -> tuple[float, ...]:
    """Return turning points, uniform between -1 and 1."""
    return tuple(np.random.default_rng(seed).uniform(-1.0, 1.0, count))


def drag_along(bank: Record, displacements_m: Array, preloads_n: Array) -> History:
    """Return the answer of a bank, from unloaded springs at the first place and preload."""
    springs = record(springs_kind(len(bank.heights_m)))
    place_m, preload_n, lost_j = displacements_m[0], preloads_n[0], 0.0
    rows = []
    for next_m, next_n in zip(displacements_m, preloads_n, strict=True):
        force_n, loss_j = drag(bank, springs, next_m - place_m, preload_n, next_n)
        place_m, preload_n, lost_j = next_m, next_n, lost_j + loss_j
        rows.append((force_n, stored_in_springs(bank, springs), lost_j))
    forces_n, stored, lost = np.array(rows).T
    return History(displacements_m, forces_n, stored, lost)
