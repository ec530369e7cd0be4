# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The drive on its test stand, with the true position and force that the sensors measure."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.advance import VoltageHeld, observe_samples
from stickslip_ros.drive.amplifier import has_arrived
from stickslip_ros.drive.build import (
    change_preload,
    plant_of,
    separate_feet,
    set_ideal,
    set_preload,
    state_at_rest,
)
from stickslip_ros.drive.division import slip_at_once, switch_all_to_springs
from stickslip_ros.drive.faults import apply_faults
from stickslip_ros.drive.records import STATE, Wave
from stickslip_ros.drive.waveform import with_missed_steps
from stickslip_ros.instrument.checks import check_load, check_preload
from stickslip_ros.instrument.reports import trace_columns
from stickslip_ros.kernels.record import Record
from stickslip_ros.parameters import TRUTH, FaultParameters, Parameters
from stickslip_ros.units import NANO

NO_RAMPS = np.zeros((0, 3))


def is_other_drive(before: Parameters, after: Parameters) -> bool:
    """Return whether friction, mass or damping differ, which change the drive itself."""
    return (before.contact, before.runner) != (after.contact, after.runner)


class SimulatedStand:
    """Plant and state of the drive, its load and its preload."""

    REMEMBERED: ClassVar[Mapping[str, Any]] = {
        'load_n': float,
        'wanted_n': float,
        'is_divided': bool,
        'states': (STATE, (1,)),
    }
    plants: Record  # one record of PLANT; preload, faults and live parameters change it
    states: Record  # one record of STATE
    load_n: float  # external force on the runner
    wanted_n: float  # wanted preload

    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters
        # `check_frequency` and `check_repetition` guard the ramps of a block.
        ramps = math.ceil(parameters.sim.block * parameters.amplifier.frequency_max) + 1
        self._ramps = np.zeros((ramps, 3))
        self._sample_s = parameters.sample_ns * NANO
        self.held_because = ''  # cause for which the last advance held the voltage
        self._columns = max(len(TRUTH), len(trace_columns(parameters)))
        self.reset()

    @property
    def voltage_v(self) -> float:
        """Output of the amplifier, V."""
        return float(self._voltage.item())

    @property
    def cycle(self) -> int:
        """Number of finished ramps of the wave."""
        return int(self._cycle.item())

    @property
    def ramp_s(self) -> float:
        """Time since the start of the present ramp of the wave, s."""
        return float(self._ramp.item())

    @property
    def is_divided(self) -> bool:
        """Whether each foot moves separately."""
        return bool(self.plants['divided'].item())

    @property
    def is_preloaded(self) -> bool:
        return bool(self._preload.item() == self.wanted_n)

    @property
    def may_change(self) -> bool:
        """Whether its preload changes, or its voltage may be held."""
        return not self.is_preloaded or bool(self.plants['delayed'].item())

    def reset(self) -> None:
        """Return to the state at the start, without faults."""
        stand = self.parameters.stand
        self.plants = plant_of(self.parameters)
        self._set_states(state_at_rest(self.plants, stand.preload))
        self.load_n = 0.0
        self.wanted_n = stand.preload
        if stand.preload_end:
            self.change_preload(stand.preload_end)

    def _set_states(self, states: Record) -> None:
        """Replace the states, and keep views of the fields that every block reads."""
        self.states = states
        self._cycle, self._ramp = states['clock']['cycle'], states['clock']['ramp_s']
        self._voltage, self._preload = states['voltage_v'], states['preload_n']

    def change_preload(self, preload_n: float) -> None:
        """Start a change to another preload, N."""
        change_preload(self.plants, self.states, self.parameters, preload_n)
        self.wanted_n = preload_n

    def recall(self, values: dict[str, Any], faults: FaultParameters, *, is_powered: bool) -> None:
        """Restore values from a checkpoint, and set the plant to match."""
        self.load_n, self.wanted_n = values['load_n'], values['wanted_n']
        self._set_states(values['states'])
        check_load(self.parameters, self.load_n)
        stand = self.parameters.stand
        if self.wanted_n not in (stand.preload, stand.preload_end):
            check_preload(self.parameters, self.wanted_n)
        plant = self.plants[0]
        plant.dead, plant.stuck = faults.dead_foot, faults.runner_stuck
        plant.amplifier.on = is_powered
        self._rebuild_plant(is_divided=values['is_divided'] or plant.dead > 0)

    def change_parameters(self, parameters: Parameters) -> None:
        """
        Set friction, mass and damping at once; the runner keeps place and velocity.

        After a change of friction, springs are the memory of the contacts, as after one of the
        preload; those above their new limit slip at once. A mass that joins the runner brings its
        kinetic energy along, (m' - m) v^2/2, which counts as external work.

        """
        before, self.parameters = self.parameters, parameters
        is_other_contact = before.contact != parameters.contact
        if is_other_contact:
            switch_all_to_springs(self.plants, self.states)
        if is_other_drive(before, parameters):
            mass_kg, speed = self.plants[0].mass_kg, self.states[0].velocity_m_per_s
            self._rebuild_plant(is_divided=self.is_divided)
            added_kg = self.plants[0].mass_kg - mass_kg
            self.states[0].sums.load_work_j += 0.5 * added_kg * speed**2
        if is_other_contact:
            slip_at_once(self.plants, self.states)

    def _rebuild_plant(self, *, is_divided: bool) -> None:
        """Build the plant from parameters and wanted preload, with its faults."""
        before, self.plants = self.plants[0], plant_of(self.parameters)
        plant = self.plants[0]
        if is_divided and not plant.divided:
            separate_feet(self.plants, self.parameters)
        set_preload(self.plants, self.parameters, self.wanted_n)
        plant.dead, plant.stuck = before.dead, before.stuck
        plant.amplifier.on = before.amplifier.on
        set_ideal(plant)

    def apply_faults(self, faults: FaultParameters, *, is_powered: bool) -> None:
        """Set the present faults; without power the voltage goes to the lowest."""
        apply_faults(
            self.plants,
            self.states,
            self.parameters,
            dead_foot=faults.dead_foot,
            runner_stuck=faults.runner_stuck,
            amplifier_on=is_powered,
        )

    def wave_with(self, wave: Wave, faults: FaultParameters) -> Wave:
        """Return a wave with the missed steps of the faults."""
        return with_missed_steps(wave, faults.missed_steps, self.parameters.sim.seed)

    def has_arrived(self, wave: Wave) -> bool:
        """Return whether a wave is over and the voltage has reached its final value."""
        return has_arrived(self.plants, wave, self.states)

    def advance(self, wave: Wave, samples: int) -> Array:
        """
        Advance by a number of samples; return their true values, a row each, without times.

        Raises StickSlipError if the integration has failed.

        """
        trace, self.held_because = np.zeros((samples, self._columns)), ''
        drive = self.plants, self.states, wave, self.load_n, self._sample_s, trace, self._ramps
        try:
            observe_samples(*drive)
        except VoltageHeld as held:
            self.held_because = str(held)
        return trace

    def ramps_since(self, cycle: int) -> Array:
        """Return start, mean and end (m) of the finished ramps from a cycle of the wave on."""
        now = self.cycle
        if cycle == now:
            return NO_RAMPS
        return self._ramps.take(range(cycle, now), axis=0, mode='wrap')
