# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Base of all sensors: noise, faults, zero and memory."""

import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.instrument.sensors.signal_chain import CONDITIONS, low_pass_gain
from stickslip_ros.kernels.record import Record, RecordKind, records
from stickslip_ros.parameters import SENSORS, TRUTH, FaultParameters, Parameters, Sensor

NUMBERS_FIRST, NUMBERS_AT_ONCE = 512, 4096
"""Random numbers that are drawn at first, and later twice as many each time up to a limit."""


@lru_cache(maxsize=16)
def _sequence_of(seed: tuple[int, ...]) -> np.random.SeedSequence:
    return np.random.SeedSequence(seed)


class Noise:
    """A sequence of normal random numbers, drawn in blocks, independent of how it is taken."""

    REMEMBERED: ClassVar[Mapping[str, Any]] = {'place': range(1 << 128)}

    def __init__(self, seed: tuple[int, ...]) -> None:
        self._source = np.random.default_rng(_sequence_of(seed))
        self._block_state = self._source.bit_generator.state
        self._numbers: Array = np.empty(0)
        self._used = self._leftover = 0

    @property
    def place(self) -> int:
        """State of the generator after the last number taken; more are drawn in advance."""
        source = np.random.default_rng(0)
        source.bit_generator.state = self._block_state
        source.standard_normal(self._used - self._leftover)
        return int(source.bit_generator.state['state']['state'])

    def recall(self, values: dict[str, Any]) -> None:
        """Continue at a place from a checkpoint."""
        self._block_state['state']['state'] = values['place']
        self._source.bit_generator.state = self._block_state

    def take(self, count: int) -> Array:
        """Return the next numbers, shape (count,)."""
        if self._used + count > len(self._numbers):
            self._block_state = self._source.bit_generator.state
            self._leftover = len(self._numbers) - self._used
            many = min(2 * len(self._numbers) or NUMBERS_FIRST, NUMBERS_AT_ONCE)
            more = self._source.standard_normal(max(count, many))
            self._numbers = np.concatenate((self._numbers[self._used :], more))
            self._used = 0
        self._used += count
        return self._numbers[self._used - count : self._used]


class Reader:
    """Base class of the sensors."""

    KIND: ClassVar[RecordKind]  # Type from `sensor_kind`
    KERNEL: ClassVar[Callable[..., None]]  # Kernel of `read`, with unit noise
    ALARMS: ClassVar[Mapping[str, int]] = {}  # Status bits by the flags of the memory
    REMEMBERED: ClassVar[Mapping[str, Any]]
    record: Record  # Array of one record of KIND
    memory: Record  # Changing part of ``record``
    sees: int  # Trace column of the measured quantity
    column: int  # Trace column of the readings

    def __init_subclass__(cls, **more: Any) -> None:
        """Define REMEMBERED: memory, noise and ``more``."""
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
        """Return the constants of this kind of sensor for its parameters and a sample rate."""
        return {}

    def read(self, trace: Array) -> None:
        """Write the readings into its column of a trace."""
        noise = self.noise.take(len(trace))
        self.KERNEL(self.record, trace, self.sees, self.column, noise)

    def reset(self) -> None:
        """Return to the start: rest at zero, and the same noise again."""
        self.record = self._first.copy()
        self.memory = self.record['memory']
        self._alarms = [(bit, self.memory[name]) for name, bit in self.ALARMS.items()]
        self.noise = Noise(self.seed)

    def recall(self, values: dict[str, Any]) -> None:
        self.memory[:] = values['memory']
        self.noise.recall(values['noise'])

    def apply_faults(self, faults: FaultParameters) -> None:
        fault = self.record[0].fault
        fault.condition = CONDITIONS[getattr(faults, self._name)]
        fault.offset = getattr(faults, f'{self._name}_offset')

    def zero(self) -> None:
        """Make the present reading 0."""
        memory = self.record[0].memory
        memory.zero = memory.standing

    @property
    def may_alarm(self) -> bool:
        """Whether one of its ALARMS can be raised."""
        return False

    @property
    def status_bits(self) -> int:
        bits = 0
        for bit, flag in self._alarms:
            bits |= bit * flag.item()
        return bits
