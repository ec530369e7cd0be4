"""The sensors of the stand: true position and force in, readings out."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import COUNT, FLOAT, Record, kind, records
from stickslip_ros.drive.advance import FORCE, POSITION, TIME
from stickslip_ros.instrument.interferometer import (
    BEAM,
    OPTICS,
    find_beam,
    optics_of,
    read_position,
)
from stickslip_ros.instrument.load_cell import CELL, STRAIN, cell_of, read_force
from stickslip_ros.instrument.reports import Readings, Status
from stickslip_ros.instrument.signal_chain import CONDITIONS, FAULT
from stickslip_ros.instrument.state_tree import ANY_FLOAT, refusal
from stickslip_ros.parameters import FaultParameters, Parameters
from stickslip_ros.units import NANO

SENSOR_PRESENT, IS_REFERENCED = int(Status.SENSOR_PRESENT), int(Status.IS_REFERENCED)
BEAM_LOST, FORCE_OVERRANGE = int(Status.BEAM_LOST), int(Status.FORCE_OVERRANGE)
INTERFEROMETER_STREAM, LOAD_CELL_STREAM = 1, 2
"""Numbers of the random streams: sensors never share noise."""
DRIFT_STREAM = 1
"""Number of the random walk below INTERFEROMETER_STREAM: it leaves the white noise alone."""
NUMBERS_AT_ONCE = 4096
"""Random numbers that are drawn at once."""

SENSORS = kind(
    samples=COUNT,
    optics=OPTICS,
    beam=BEAM,
    beam_fault=FAULT,
    cell=CELL,
    strain=STRAIN,
    strain_fault=FAULT,
)
"""
Interferometer and load cell.

Fields
------
samples : int
    Samples of the trace that they have read.
optics, beam, beam_fault : record of OPTICS, BEAM, FAULT
    Interferometer: constants, state, what is broken.
cell, strain, strain_fault : record of CELL, STRAIN, FAULT
    The same of the load cell.

"""

SENSED = SENSORS[['samples', 'beam', 'strain']]
"""What changes of it with every sample."""


@entry_point
def read_sensors(
    sensors: Record,
    start_ns: int,
    sample_ns: int,
    trace: Array,
    past_m: Array,
    noise_m: Array,
    noise_n: Array,
    walk: Array,
) -> None:
    """
    Replace true position and force in a trace by readings, and fill in the times.

    Parameters
    ----------
    sensors : array of one record of SENSORS
        Changed in place.
    start_ns, sample_ns : int
        Time of the trace before its first sample, and between two.
    trace : array, shape (samples, 5)
        The truth; its first column is filled, its last two are replaced.
    past_m : array
        Ring of the latest counts of the interferometer, as long as its latency; changed in place.
    noise_m, noise_n, walk : array, shape (samples,)
        Unit noise of both sensors and of the random drift of the interferometer.

    """
    both = sensors[0]
    both.strain.overrange = False
    for i in range(len(trace)):
        both.samples += 1
        trace[i, TIME] = (start_ns + (i + 1) * sample_ns) * NANO
        trace[i, POSITION] = read_position(
            both.optics,
            both.beam,
            both.beam_fault,
            past_m,
            both.samples,
            trace[i, POSITION],
            noise_m[i],
            walk[i],
        )
        trace[i, FORCE] = read_force(
            both.cell, both.strain, both.strain_fault, both.samples, trace[i, FORCE], noise_n[i]
        )


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


class Sensing:
    """
    Interferometer and load cell.

    Attributes
    ----------
    position_m : float
        Mean position reading of the last block, m; not a number where there is none.

    """

    REMEMBERED: ClassVar[Mapping[str, Any]] = {
        'memory': (SENSED, (1,)),
        '_past_m': (FLOAT, (-1,)),
        '_noise_m': Noise,
        '_noise_n': Noise,
        '_walk': Noise,
        '_faults': FaultParameters,
        '_is_referenced': bool,
        'position_m': ANY_FLOAT,
    }

    def __init__(self, parameters: Parameters) -> None:
        rate_hz = parameters.trace.sample_rate
        self._sample_ns = parameters.sample_ns
        self._seed = parameters.sim.seed
        self._first = records(
            SENSORS,
            optics=optics_of(parameters.interferometer, rate_hz),
            cell=cell_of(parameters.load_cell, rate_hz),
        )
        self._first[0].beam.truth_m = math.nan
        self._wanders = bool(self._first[0].optics.walk_m > 0.0)
        self.reset()

    def reset(self) -> None:
        """Go back to the start: at rest at zero, no tare, the beam found, the same noise again."""
        self._sensors = self._first.copy()
        self._past_m = np.zeros(math.ceil(self._first[0].optics.lag) + 3)
        self._noise_m = Noise((self._seed, INTERFEROMETER_STREAM))
        self._noise_n = Noise((self._seed, LOAD_CELL_STREAM))
        self._walk = Noise((self._seed, INTERFEROMETER_STREAM, DRIFT_STREAM))
        self._faults = FaultParameters()
        self._is_referenced = False
        self.position_m = 0.0

    @property
    def memory(self) -> Record:
        """What both remember, an array of one record of SENSED."""
        return self._sensors[list(SENSED.names)]

    def recall(self, values: dict[str, Any]) -> None:
        """Remember what was read from a file."""
        memory, past_m = values.pop('memory'), values['_past_m']
        if len(past_m) != len(self._past_m):
            told = f'{len(self._past_m)} numbers, as long as interferometer.latency'
            raise refusal('checkpoint.sensing._past_m', len(past_m), told)
        for name in SENSED.names:
            self._sensors[name] = memory[name]
        for name in ('_noise_m', '_noise_n', '_walk'):
            getattr(self, name).recall(values.pop(name))
        vars(self).update(values)
        self._break_down(self._faults)

    def zero_position(self) -> None:
        """Make the present position reading 0; a lost beam is found, the count starts anew."""
        both = self._sensors[0]
        if both.beam.lost:
            find_beam(both.beam, both.beam_fault, self._past_m)
        both.beam.zero_m = both.beam.standing_m
        self._is_referenced = True
        self.position_m = 0.0

    def tare_force(self) -> None:
        """Make the present force reading 0."""
        strain = self._sensors[0].strain
        strain.zero_n = strain.standing_n

    @property
    def beam_lost(self) -> bool:
        """Whether the runner was too fast, so that the count stands still."""
        return bool(self._sensors['beam']['lost'].item())

    @property
    def overrange(self) -> bool:
        """Whether a sample of the last block reached the end of the range of the load cell."""
        return bool(self._sensors['strain']['overrange'].item())

    def read(
        self, trace: Array, time_ns: int, voltage_v: float, faults: FaultParameters
    ) -> Readings:
        """Replace true position and force in a trace by readings; return what is published."""
        if faults is not self._faults:
            self._break_down(faults)
        truth_m, truth_n = float(trace[-1, POSITION]), float(trace[-1, FORCE])
        count = len(trace)
        noise_m, noise_n = self._noise_m.take(count), self._noise_n.take(count)
        walk = self._walk.take(count) if self._wanders else noise_m
        read_sensors(
            self._sensors,
            time_ns - count * self._sample_ns,
            self._sample_ns,
            trace,
            self._past_m,
            noise_m,
            noise_n,
            walk,
        )
        mean_m = float(np.add.reduce(trace[:, POSITION])) / count
        self.position_m = math.nan if self.beam_lost else mean_m
        return Readings(
            time_ns=time_ns,
            position_m=float(trace[-1, POSITION]),
            force_n=float(trace[-1, FORCE]),
            voltage_v=voltage_v,
            trace=trace,
            truth_position_m=truth_m,
            truth_force_n=truth_n,
        )

    def _break_down(self, faults: FaultParameters) -> None:
        self._faults = faults
        broken = self._sensors[0]
        broken.beam_fault.condition = CONDITIONS[faults.interferometer]
        broken.beam_fault.offset = faults.interferometer_offset
        broken.strain_fault.condition = CONDITIONS[faults.load_cell]
        broken.strain_fault.offset = faults.load_cell_offset

    @property
    def status_bits(self) -> int:
        """Bits of Status that sensors set."""
        return (
            SENSOR_PRESENT * (not math.isnan(self.position_m))
            | IS_REFERENCED * self._is_referenced
            | BEAM_LOST * self.beam_lost
            | FORCE_OVERRANGE * self.overrange
        )
