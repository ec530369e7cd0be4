"""What all sensors have in common: noise of their own, a fault, a zero, a memory."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import Kind, Record, records
from stickslip_ros.instrument.sensors.signal_chain import CONDITIONS
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


class Reader(ABC):
    """
    A sensor at work; each kind of sensor has a class of its own, with KIND, its `sensor_kind`.

    Attributes
    ----------
    record : array of one record of KIND
        Constants, fault, memory.
    sees, column : int
        Columns of a trace: what it looks at, and what receives its readings.

    """

    KIND: ClassVar[Kind]
    ALARMS: ClassVar[Mapping[str, int]] = {}
    """Status bits that flags of its memory set."""
    REMEMBERED: ClassVar[Mapping[str, Any]]

    def __init_subclass__(cls, **more: Any) -> None:
        """Note what a sensor remembers."""
        cls.REMEMBERED = {'memory': (cls.KIND['memory'], (1,)), 'noise': Noise, **more}

    def __init__(self, row: Sensor, column: int, parameters: Parameters) -> None:
        self._name = row.name
        self.seed = parameters.sim.seed, SENSORS.index(row) + 1  # sensors never share noise
        self.sees, self.column = TRUTH.index(row.sees), column
        setting, rate_hz = getattr(parameters, row.name), parameters.trace.sample_rate
        self._first = records(self.KIND, constants=self.constants_of(setting, rate_hz))
        self.reset()

    @staticmethod
    @abstractmethod
    def constants_of(setting: Any, rate_hz: float) -> Record:
        """Return what it is by its parameters, in samples of the trace."""

    @abstractmethod
    def read(self, trace: Array) -> None:
        """Write its readings into its column of a trace."""

    def reset(self) -> None:
        """Go back to the start: at rest at zero, the same noise again."""
        self.record = self._first.copy()
        self.noise = Noise(self.seed)

    @property
    def memory(self) -> Record:
        """What changes of it, an array of one record."""
        return self.record['memory']

    def recall(self, values: dict[str, Any]) -> None:
        """Remember what was read from a file."""
        self.record['memory'] = values['memory']
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
        own = self.memory['own']
        return sum(bit for name, bit in self.ALARMS.items() if own[name].item())
