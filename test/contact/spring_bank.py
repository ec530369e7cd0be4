"""
An independent contact of many springs, and drivers that lead the memory along a history.

The bank knows nothing of turning points: each spring of the one-dimensional foundation holds its
own tangential force and slips at mu times its own normal force. It shares with the package only
the numbers that define the contact.

"""

from typing import NamedTuple

import numpy as np

from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.memory import CAPACITY, fresh_memory, move
from stickslip_ros.contact.memory_energy import lost_energy, stored_energy
from stickslip_ros.contact.presliding import Presliding
from stickslip_ros.contact.record import Record

SPRINGS = 4000
"""Springs on one half of a contact."""
BANK_ERROR = 4e-6
"""Twice the error of the table, about 1e-6, since Masing's rule doubles it, and as much for the
bank (midpoint rule, about SPRINGS^-1.7); relative to the full-slip force. For energies relative
to that force times the displacement of full slip, and the travel."""


class Sample(NamedTuple):
    """Force (N), stored and lost energy (J) after one move."""

    force_n: float
    stored_j: float
    lost_j: float


class SpringBank:
    """Springs at the midpoints of equal intervals over the contacts, all with one displacement."""

    def __init__(self, contacts: list[Presliding]) -> None:
        stiffness, limits = [], []
        for contact in contacts:
            dx_m = contact.indentation.radius_m / SPRINGS
            x_m = (np.arange(SPRINGS) + 0.5) * dx_m
            normal = contact.elasticity.normal_pa * dx_m
            limits.append(
                contact.friction
                * normal
                * (contact.indentation.depth_m - contact.profile.height(x_m))
            )
            stiffness.append(np.full(SPRINGS, contact.elasticity.shear_pa * dx_m))
        # A spring stands for two: one on either side of the centre.
        self.stiffness = 2.0 * np.concatenate(stiffness)
        self.limit_n = 2.0 * np.concatenate(limits)
        self.force_n = np.zeros_like(self.stiffness)
        self.lost_j = 0.0
        self.u_m = 0.0

    def move(self, u_m: float) -> Sample:
        trial_n = self.force_n + self.stiffness * (u_m - self.u_m)
        self.force_n = np.clip(trial_n, -self.limit_n, self.limit_n)
        slip_m = np.abs(trial_n - self.force_n) / self.stiffness
        self.lost_j += float(self.limit_n @ slip_m)
        self.u_m = u_m
        stored_j = float(np.sum(0.5 * self.force_n**2 / self.stiffness))
        return Sample(float(np.sum(self.force_n)), stored_j, self.lost_j)


@entry_point
def follow(curve: Record, memory: Record, turns, samples) -> None:
    """Move to each of ``turns``; rows of ``samples`` receive force, stored and lost energy."""
    for i in range(len(turns)):
        move(curve, memory, turns[i])
        samples[i, 0] = memory.force_n
        samples[i, 1] = stored_energy(curve, memory)
        samples[i, 2] = lost_energy(curve, memory)


@entry_point
def follow_force(curve: Record, memory: Record, turns, forces, errors) -> None:
    """Move to each of ``turns``; note the force and the bound of its error behind each."""
    for i in range(len(turns)):
        move(curve, memory, turns[i])
        forces[i] = memory.force_n
        errors[i] = memory.error_n


class Guide:
    """A memory that is led along a history."""

    def __init__(self, curve: Record, rows: int = CAPACITY) -> None:
        self.curve = curve
        self.memory = fresh_memory(capacity=rows)

    def go(self, *turns_m: float) -> Sample:
        """Move from turn to turn; return what the last one left."""
        return Sample(*self.walk(np.array(turns_m))[-1])

    def walk(self, turns_m: np.ndarray) -> np.ndarray:
        """Move from turn to turn; return force, stored and lost energy of each, (n, 3)."""
        samples = np.zeros((len(turns_m), 3))
        follow(self.curve, self.memory, turns_m, samples)
        return samples

    def forces(self, turns_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Move from turn to turn; return force and bound of its error of each, N."""
        forces, bounds = np.zeros(len(turns_m)), np.zeros(len(turns_m))
        follow_force(self.curve, self.memory, turns_m, forces, bounds)
        return forces, bounds
