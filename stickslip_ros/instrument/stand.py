"""The drive on its test stand: the truth that the sensors look at."""

import math

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.repeated import Repeated
from stickslip_ros.drive.amplifier import has_arrived
from stickslip_ros.drive.build import (
    change_preload,
    clock_at_start,
    history_of,
    plant_of,
    state_at_rest,
)
from stickslip_ros.drive.faults import apply_faults
from stickslip_ros.drive.ledger import EnergyLedger, take_ledger
from stickslip_ros.drive.passes import MADE, check_motion
from stickslip_ros.drive.records import State, Wave
from stickslip_ros.drive.waveform import missing
from stickslip_ros.instrument.reports import TRACE_COLUMNS
from stickslip_ros.instrument.scope import observe
from stickslip_ros.parameters import FaultParameters, Parameters

NANO = 1e-9
NO_RAMPS = np.empty((0, 3))


class Stand:
    """
    Plant and state of the drive, its load and its preload.

    Parameters
    ----------
    parameters : Parameters
        The stand.

    Attributes
    ----------
    plant : Plant
        What does not change while the drive runs, but for preload and faults.
    state : State
        What does.
    load_n : float
        External force on the runner, N.

    """

    state: State
    load_n: float

    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters
        self.plant = self._first_plant = plant_of(parameters)
        self._history = history_of(self.plant)
        ramps = math.ceil(parameters.sim.block * parameters.amplifier.frequency_max) + 1
        self._ramps = np.zeros((ramps, 3))
        self._sample_s = parameters.sample_ns * NANO
        self._observe = Repeated(observe, records=4)
        self.to_rest()

    @property
    def ledger(self) -> EnergyLedger:
        """Where the energy went since the start or the last reset."""
        return take_ledger(self.plant, self._history, self.state)

    @property
    def passes_made(self) -> int:
        """Passes that the loops over time have made: what the drive has cost so far."""
        return int(self._history.passes[MADE])

    @property
    def is_preloaded(self) -> bool:
        """Whether the preload has come to the wanted one."""
        return self.state.contact.preload_n == self.plant.contact.preload_n

    def to_rest(self) -> None:
        """Go back to the state at the start, without faults."""
        stand = self.parameters.stand
        self.plant = self._first_plant
        self.state = state_at_rest(self.plant, self._history, stand.preload)
        self.load_n = 0.0
        if stand.preload_end:
            self.change_preload(stand.preload_end)

    def change_preload(self, preload_n: float) -> None:
        """Let the springs take over, and go to another preload, N."""
        self.plant, self.state = change_preload(
            self.plant, self._history, self.state, self.parameters, preload_n
        )

    def break_down(self, faults: FaultParameters, *, is_powered: bool) -> None:
        """Have these faults, and no others, from now on; without power, no voltage either."""
        self.plant, self.state = apply_faults(
            self.plant,
            self._history,
            self.state,
            dead_foot=faults.dead_foot,
            runner_stuck=faults.runner_stuck,
            amplifier_on=is_powered,
        )

    def wave_with(self, wave: Wave, faults: FaultParameters) -> Wave:
        """Return a wave as the faults leave it."""
        return missing(wave, faults.missed_steps, self.parameters.sim.seed)

    def start_clock(self) -> None:
        """Let a new wave begin now."""
        self.state = self.state._replace(clock=clock_at_start(self.state))

    def has_arrived(self, wave: Wave) -> bool:
        """Tell whether a wave and the amplifier are at their end."""
        return has_arrived(self.plant, wave, self.state)

    def advance(self, wave: Wave, samples: int) -> Array:
        """
        Advance by some samples of the trace; return the truth, one row each, without times.

        Raises
        ------
        StickSlipError
            If the integration has failed.

        """
        trace = np.empty((samples, len(TRACE_COLUMNS)))
        self.state = self._observe(
            self.plant,
            self._history,
            self.state,
            wave,
            self.load_n,
            self._sample_s,
            trace,
            self._ramps,
        )
        check_motion(self._history, self.state, self.load_n)
        return trace

    def ramps_since(self, wave: Wave, cycle: int) -> Array:
        """Return start, mean and end (m) of the ramps that ended from a cycle of a wave on."""
        if cycle == self.state.clock.cycle or len(wave.rows) > 0:
            return NO_RAMPS
        cycles = np.arange(cycle, self.state.clock.cycle)
        ramps: Array = self._ramps[cycles % len(self._ramps)]
        return ramps
