# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A drive for tests, advanced by pieces of time."""

from collections.abc import Callable, Iterable

import numpy as np
import pytest

from stickslip_ros.drive.advance import advance
from stickslip_ros.drive.build import divide_feet, plant_of, set_ideal, start_clock, state_at_rest
from stickslip_ros.drive.ledger import EnergyLedger, take_ledger
from stickslip_ros.drive.records import ALL, Wave
from stickslip_ros.kernels.record import Record
from stickslip_ros.parameters import Parameters


class Drive:
    """A drive with its log of ramps and its state, which starts at rest."""

    def __init__(self, ramps: int = 256, **changes: object) -> None:
        """Change parameters by their names with two underscores for the point."""
        values = {name.replace('__', '.'): value for name, value in changes.items()}
        self.parameters = Parameters().updated(values)
        self.plants = plant_of(self.parameters)
        self.states = state_at_rest(self.plants, self.parameters.stand.preload)
        self.ramps = np.zeros((ramps, 3))

    def run(self, wave: Wave, times_s: Iterable[float], load_n: float = 0.0) -> 'Drive':
        """Advance under the present wave by pieces of time."""
        for time_s in times_s:
            advance(self.plants, self.states, wave, load_n, time_s, self.ramps)
        return self

    def start(self, wave: Wave, times_s: Iterable[float], load_n: float = 0.0) -> 'Drive':
        """Advance under a new wave."""
        start_clock(self.states)
        return self.run(wave, times_s, load_n)

    def separate(self) -> 'Drive':
        """Separate the feet."""
        divide_feet(self.plants, self.states, self.parameters)
        set_ideal(self.plant)
        return self

    @property
    def plant(self) -> Record:
        """Its constants."""
        return self.plants[0]

    @property
    def state(self) -> Record:
        """The changing state; copy it to compare it later."""
        return self.states[0]

    @property
    def contacts(self) -> Record:
        """State of the active contacts: all as one, those of each motion, or each foot."""
        active = slice(1, 1 + self.plant.moved) if self.plant.separate else slice(ALL, ALL + 1)
        return self.state.contacts[active]

    @property
    def ledger(self) -> EnergyLedger:
        return take_ledger(self.plants, self.states)

    @property
    def residual(self) -> float:
        """Energy that the balance misses, relative to the work of the feet."""
        return self.ledger.residual_j / self.ledger.feet_work_j


@pytest.fixture(scope='session')
def drive() -> Callable[..., Drive]:
    """Give the class: ``drive(stand__preload=0.1)`` is a drive at rest."""
    return Drive
