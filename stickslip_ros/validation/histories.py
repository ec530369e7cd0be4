"""A history of displacements through the memory kernel that the drive uses."""

from dataclasses import dataclass

import numpy as np

from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.memory import fresh_memory, move
from stickslip_ros.contact.memory_energy import lost_energy, stored_energy
from stickslip_ros.contact.presliding import Presliding
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import Record
from stickslip_ros.contact.virgin import CELLS, tabulate
from stickslip_ros.validation.checks import Tolerance

move = entry_point(move)
stored_energy = entry_point(stored_energy)
lost_energy = entry_point(lost_energy)

SPHERE_TABLE = 1.5 * 0.2079 * CELLS**-1.5
"""Error of the table for a sphere, of the maximal force: 1.2e-6. The stiffness 1.5 sqrt(1 - s)
ends in a root, and there the trapezoidal rule misses -zeta(-1/2) h^(3/2)."""
TABLE = Tolerance(
    2.0 * SPHERE_TABLE, f'{CELLS} cells under the root of the stiffness, twice after a reversal'
)
ROUGH_TABLE = Tolerance(1e-7, f'{CELLS} cells under a smooth stiffness: the square of their width')
LOSS_TABLE = Tolerance(
    8.0 * SPHERE_TABLE, f'{CELLS} cells under the root of the stiffness; W has eight such areas'
)
WANDERING = (0.7, -0.3, 0.5, -0.1, 0.35, 0.05, 0.6, -0.5, 0.9, -1.2, 1.4, 0.2)
"""Turning points u/u_max with nested, closing and fully slipping loops."""


@dataclass(frozen=True)
class History:
    """
    Answer of a contact to a history of displacements, one value per displacement.

    Attributes
    ----------
    displacement_m, force_n, stored_j, lost_j : array
        Displacement, sum of the spring forces, elastic energy, friction loss so far.

    """

    displacement_m: Array
    force_n: Array
    stored_j: Array
    lost_j: Array


def remember(contact: Presliding, displacements_m: Array) -> History:
    """Return the answer of the memory kernel, from a relaxed contact at 0."""
    return remember_all(tabulate([contact]), displacements_m)


def remember_all(curve: Record, displacements_m: Array) -> History:
    """Return the answer of the memory kernel for contacts that are tabulated together."""
    memory = fresh_memory()
    rows = []
    for place_m in displacements_m:
        move(curve, memory, float(place_m))
        stored_j = stored_energy(curve, memory)
        rows.append((memory.force_n, stored_j, lost_energy(curve, memory)))
    forces_n, stored, lost = np.array(rows).T
    return History(displacements_m, forces_n, stored, lost)


def zigzag(turning_points_m: tuple[float, ...], steps: int) -> Array:
    """Return a history from 0 through turning points, each leg in equal steps."""
    legs: list[Array] = [np.zeros(1)]
    for start_m, end_m in zip((0.0, *turning_points_m), turning_points_m, strict=False):
        legs.append(np.linspace(start_m, end_m, steps + 1, dtype=np.float64)[1:])
    return np.concatenate(legs)
