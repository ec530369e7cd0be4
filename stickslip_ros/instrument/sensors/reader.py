# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What all sensors have in common: noise of their own, a fault, a zero, a memory."""

import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.instrument.sensors.signal_chain import CONDITIONS, low_pass_gain
from stickslip_ros.kernels.record import Kind, Record, records
from stickslip_ros.parameters import SENSORS, TRUTH, FaultParameters, Parameters, Sensor

NUMBERS_AT_ONCE = 4096
"""Random numbers that are drawn at once."""


class Noise:
    """Normal random numbers, drawn many at once: the same ones, however many one takes."""

    REMEMBERED: ClassVar[Mapping[str, Any]] = {'place': range(1 << 128)}

    def __init__(self, seed: tuple[int, ...]) -> None:
        self._source = np.random.default_rng(seed)
        self._before = self._source.bit_generator.state
        self._drawn: Array = np.empty(0)
        self._taken = self._older = 0

    @property
    def place(self) -> int:
        """State of the generator after the numbers that were taken, not those that were drawn."""
        source = np.random.default_rng(0)
        source.bit_generator.state = self._before
        source.standard_normal(self._taken - self._older)
        return int(source.bit_generator.state['state']['state'])

    def recall(self, values: dict[str, Any]) -> None:
        """Go on at a place that was read from a file."""
        self._before['state']['state'] = values['place']
        self._source.bit_generator.state = self._before

    def take(self, count: int) -> Array:
        """Return the next numbers, shape (count,)."""
        if self._taken + count > len(self._drawn):
            self._before = self._source.bit_generator.state
            self._older = len(self._drawn) - self._taken
            more = self._source.standard_normal(max(count, NUMBERS_AT_ONCE))
            self._drawn = np.concatenate((self._drawn[self._taken :], more))
            self._taken = 0
        self._taken += count
        return self._drawn[self._taken - count : self._taken]


class Reader:
    """A sensor at work; each has a class of its own."""

    KIND: ClassVar[Kind]  # Its `sensor_kind`
    KERNEL: ClassVar[Callable[..., None]]  # What `read` calls, with unit noise
    ALARMS: ClassVar[Mapping[str, int]] = {}  # Status bits that flags of its memory set
    REMEMBERED: ClassVar[Mapping[str, Any]]
    record: Record  # An array of one record of KIND
    memory: Record  # What changes of it, an array of one record
    sees: int  # Column of a trace that it looks at
    column: int  # Column that receives its readings

    def __init_subclass__(cls, **more: Any) -> None:
        """Note what a sensor remembers."""
        cls.REMEMBERED = {'memory': (cls.KIND['memory'], (1,)), 'noise': Noise, **more}

    def __init__(self, row: Sensor, column: int, parameters: Parameters) -> None:
        self._name = row.name
        self.seed = parameters.sim.seed, SENSORS.index(row) + 1  # sensors never share noise
        self.sees, self.column = TRUTH.index(row.sees), column
        setting, rate_hz = getattr(parameters, row.name), parameters.trace.sample_rate
        self._first = records(
            self.KIND,
            noise=setting.noise_density * math.sqrt(rate_hz / 2.0),
            gain=low_pass_gain(setting.bandwidth, rate_hz),
            resolution=setting.resolution,
            **self.constants_of(setting, rate_hz),
        )
        self.reset()

    @staticmethod
    def constants_of(_setting: Any, _rate_hz: float) -> Mapping[str, Any]:
        """Return what only this kind of sensor is by its parameters, at a rate of the trace."""
        return {}

    def read(self, trace: Array) -> None:
        """Write its readings into its column of a trace."""
        noise = self.noise.take(len(trace))
        self.KERNEL(self.record, trace, self.sees, self.column, noise)

    def reset(self) -> None:
        """Go back to the start: at rest at zero, the same noise again."""
        self.record = self._first.copy()
        self.memory = self.record['memory']
        self._alarms = [(bit, self.memory[name]) for name, bit in self.ALARMS.items()]
        self.noise = Noise(self.seed)

    def recall(self, values: dict[str, Any]) -> None:
        """Remember what was read from a file."""
        self.memory[:] = values['memory']
        self.noise.recall(values['noise'])

    def break_down(self, faults: FaultParameters) -> None:
        """Have its part of these faults from now on."""
        fault = self.record[0].fault
        fault.condition = CONDITIONS[getattr(faults, self._name)]
        fault.offset = getattr(faults, f'{self._name}_offset')

    def zero(self) -> None:
        """Make the present reading 0."""
        memory = self.record[0].memory
        memory.zero = memory.standing

    @property
    def status_bits(self) -> int:
        """Bits of Status that it sets."""
        bits = 0
        for bit, flag in self._alarms:
            bits |= bit * flag.item()
        return bits
