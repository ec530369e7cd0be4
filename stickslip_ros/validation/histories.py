"""The package's contacts, and their answers along histories of displacement and preload."""

from dataclasses import dataclass

import numpy as np

from stickslip_ros.contact.hemisphere import elasticity_of, profile_of
from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.mdr import Elasticity, Presliding, presliding
from stickslip_ros.contact.memory import fresh_memory, lost_energy, move, stored_energy
from stickslip_ros.contact.profile import Array, PowerProfile, Profile
from stickslip_ros.contact.record import Record, record
from stickslip_ros.contact.springs import move_springs, springs_kind, stored_in_springs
from stickslip_ros.contact.virgin import CELLS, tabulate
from stickslip_ros.drive.build import all_contacts
from stickslip_ros.parameters import Parameters
from stickslip_ros.validation.checks import Tolerance
from stickslip_ros.validation.references import (
    E_STAR_PA,
    FRICTION,
    G_STAR_PA,
    LOWER_SHARE,
    TERMS,
    PowerContact,
)

move_springs = entry_point(move_springs)
lost_energy = entry_point(lost_energy)
move = entry_point(move)
stored_energy = entry_point(stored_energy)
stored_in_springs = entry_point(stored_in_springs)

SPHERE_TABLE = 1.5 * 0.2079 * CELLS**-1.5
"""Error of the table for a sphere, of the maximal force: 1.2e-6. The stiffness 1.5 sqrt(1 - s)
ends in a root, and there the trapezoidal rule misses -zeta(-1/2) h^(3/2)."""
TABLE = Tolerance(
    2.0 * SPHERE_TABLE, f'{CELLS} cells under the root of the stiffness, twice after a reversal'
)
ROUGH_TABLE = Tolerance(1e-7, f'{CELLS} cells under a smooth stiffness: the square of their width')
MU_FN = 'mu F_n'
WANDERING = (0.7, -0.3, 0.5, -0.1, 0.35, 0.05, 0.6, -0.5, 0.9, -1.2, 1.4, 0.2)
"""Turning points u/u_max with nested, closing and fully slipping loops."""


def lower_contact(profile: str, preload_n: float) -> Presliding:
    """Return a lower contact of the stand as the package solves it with its defaults."""
    parameters = Parameters().updated({'contact.profile': profile}).contact
    return presliding(
        profile_of(parameters),
        elasticity_of(parameters),
        parameters.friction,
        LOWER_SHARE * preload_n,
    )


def power_profile(body: str) -> PowerProfile:
    """Return the package's profile of one of TERMS."""
    return PowerProfile(*zip(*TERMS[body], strict=True))


def pressed(profile: Profile, force_n: float) -> Presliding:
    """Return the package's contact of a profile, of the moduli and friction of the reference."""
    return presliding(profile, Elasticity(E_STAR_PA, G_STAR_PA), FRICTION, force_n)


def closed_form_of(contact: Presliding, profile: str) -> PowerContact:
    """Return the independent closed form of a contact, of the same radius."""
    return PowerContact(TERMS[profile], contact.indentation.radius_m)


def model_at(preload_n: float, profile: str = 'rough') -> Record:
    """Return the contacts of the drive at a preload."""
    values = {'contact.profile': profile, 'stand.preload': preload_n}
    return all_contacts(Parameters().updated(values))


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

    @property
    def work_j(self) -> Array:
        """Work done so far, by the trapezoidal rule, J."""
        means_n = 0.5 * (self.force_n[1:] + self.force_n[:-1])
        work_j = np.cumsum(means_n * np.diff(self.displacement_m))
        return np.concatenate((np.zeros(1), work_j))

    def part(self, some: slice) -> 'History':
        """Return some of the displacements."""
        return History(*(values[some] for values in vars(self).values()))


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
    return History(displacements_m, *np.array(rows).T)


def drag_along(bank: Record, displacements_m: Array, preloads_n: Array) -> History:
    """Return the answer of a bank, from unloaded springs at the first place and preload."""
    springs = record(springs_kind(len(bank.heights_m)))
    place_m, preload_n, lost_j = displacements_m[0], preloads_n[0], 0.0
    rows = []
    for next_m, next_n in zip(displacements_m, preloads_n, strict=True):
        force_n, loss_j = move_springs(bank, springs, next_m - place_m, preload_n, next_n)
        place_m, preload_n, lost_j = next_m, next_n, lost_j + loss_j
        rows.append((force_n, stored_in_springs(bank, springs), lost_j))
    return History(displacements_m, *np.array(rows).T)


def fractions(count: int) -> Array:
    """Return that many equal steps from above 0 to 1."""
    return np.linspace(0.0, 1.0, count + 1, dtype=np.float64)[1:]


def zigzag(turning_points_m: tuple[float, ...], steps: int) -> Array:
    """Return a history from 0 through turning points, each leg in equal steps."""
    legs: list[Array] = [np.zeros(1)]
    for start_m, end_m in zip((0.0, *turning_points_m), turning_points_m, strict=False):
        legs.append(np.linspace(start_m, end_m, steps + 1, dtype=np.float64)[1:])
    return np.concatenate(legs)


def wandering(contact: Presliding, steps: int) -> Array:
    """Return the history WANDERING of a contact, m."""
    return zigzag(tuple(turn * contact.max_displacement_m for turn in WANDERING), steps)


def random_turns(seed: int, count: int) -> tuple[float, ...]:
    """Return turning points, uniform between -1 and 1."""
    return tuple(np.random.default_rng(seed).uniform(-1.0, 1.0, count))
