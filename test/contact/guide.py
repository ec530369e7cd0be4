# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Move a memory along a history."""

from typing import NamedTuple

import numpy as np

from stickslip_ros.contact.memory import CAPACITY, fresh_memory
from stickslip_ros.kernels.record import Record
from stickslip_ros.lab.validation.contacts import follow_curve, follow_energies


class Sample(NamedTuple):
    """Force (N), stored and lost energy (J) after one move."""

    force_n: float
    stored_j: float
    lost_j: float


class Guide:
    """A memory that moves along a history."""

    def __init__(self, curve: Record, rows: int = CAPACITY) -> None:
        self.curve = curve
        self.memory = fresh_memory(capacity=rows)

    def go(self, *turns_m: float) -> Sample:
        """Move from turn to turn; return the state after the last move."""
        return Sample(*self.walk(np.array(turns_m))[-1])

    def walk(self, turns_m: np.ndarray) -> np.ndarray:
        """Move from turn to turn; return force, stored and lost energy of each, (n, 3)."""
        samples = np.zeros((len(turns_m), 3))
        follow_energies(self.curve, self.memory, turns_m, samples)
        return samples

    def forces(self, turns_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Move from turn to turn; return force and bound of its error of each, N."""
        log = np.zeros((len(turns_m), 3))
        follow_curve(self.curve, self.memory, turns_m, log)
        return log[:, 0], log[:, 1]
