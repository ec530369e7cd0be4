"""What the tests of the drive share: a drive that is advanced by pieces of time."""

from collections.abc import Callable, Iterable

import numpy as np
import pytest

from stickslip_ros.drive.build import clock_at_start, history_of, plant_of, state_at_rest
from stickslip_ros.drive.ledger import EnergyLedger, take_ledger
from stickslip_ros.drive.plant import advance
from stickslip_ros.drive.records import State, Wave
from stickslip_ros.parameters import Parameters


class Drive:
    """A drive with its history, its log of ramps and its state, which starts at rest."""

    def __init__(self, ramps: int = 256, **changes: object) -> None:
        """Change parameters by their names with two underscores for the point."""
        values = {name.replace('__', '.'): value for name, value in changes.items()}
        self.parameters = Parameters().updated(values)
        self.plant = plant_of(self.parameters)
        self.history = history_of(self.plant)
        preload_n = self.parameters.stand.preload
        self.state: State = state_at_rest(self.plant, self.history, preload_n)
        self.ramps = np.zeros((ramps, 3))

    def run(self, wave: Wave, times_s: Iterable[float], load_n: float = 0.0) -> 'Drive':
        """Advance under a wave that goes on, piece of time by piece of time."""
        for time_s in times_s:
            self.state = advance(
                self.plant, self.history, self.state, wave, load_n, time_s, self.ramps
            )
        return self

    def start(self, wave: Wave, times_s: Iterable[float], load_n: float = 0.0) -> 'Drive':
        """Advance under a wave that begins now."""
        self.state = self.state._replace(clock=clock_at_start(self.state))
        return self.run(wave, times_s, load_n)

    @property
    def ledger(self) -> EnergyLedger:
        return take_ledger(self.plant, self.history, self.state)


@pytest.fixture(scope='session')
def drive() -> Callable[..., Drive]:
    """Give the class: ``drive(stand__preload=0.1)`` is a drive at rest."""
    return Drive
