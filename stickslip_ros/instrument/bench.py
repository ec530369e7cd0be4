# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The virtual test stand, from time and requests to readings, events and status."""

import math
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

from stickslip_ros.drive.build import start_clock
from stickslip_ros.drive.ledger import EnergyLedger, take_ledger
from stickslip_ros.drive.waveform import can_be_played
from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.files import read_bytes
from stickslip_ros.instrument import checkpoint
from stickslip_ros.instrument.checks import BeyondSoftLimit
from stickslip_ros.instrument.closed_loop import Observation, Outcome
from stickslip_ros.instrument.commands import COMMANDS, Accepted, Request, check_request
from stickslip_ros.instrument.motion import Motion
from stickslip_ros.instrument.reports import (
    FIRST_READING,
    Event,
    Identity,
    Output,
    Readings,
    Result,
    Status,
)
from stickslip_ros.instrument.sensing import Sensing
from stickslip_ros.instrument.stand import NO_RAMPS, SimulatedStand
from stickslip_ros.instrument.state_tree import UNCHECKED, read_tree, refusal
from stickslip_ros.kernels.record import Record
from stickslip_ros.parameters import (
    FaultParameters,
    Parameters,
    Scalar,
    checked_arguments,
    to_nanoseconds,
)
from stickslip_ros.units import NANO, with_unit

MOVE_DELAYED, AMPLIFIER_ENABLED = int(Status.MOVE_DELAYED), int(Status.AMPLIFIER_ENABLED)
_LOADED, _REFUSED = int(Status.LOADED), int(Status.REFUSED)
_PRELOADING, _FAULT = int(Status.PRELOADING), int(Status.FAULT)
_NEVER_NS, _TIME_MAX_NS = -1, 10**17
"""Before each time; latest time of a checkpoint: with the system time as origin, later stamps
still fit."""


def start_bench(parameters: Parameters) -> 'Bench':
    """
    Return a bench at rest, or in the state of the file ``sim.checkpoint``.

    Raises RecordingError if the file cannot be read; WrongKind if it is no checkpoint of this
    version, or a parameter differs that must not change.

    """
    path = parameters.sim.checkpoint
    if not path:
        return Bench(parameters)
    saved = read_bytes(Path(path), 'check sim.checkpoint')
    return Bench.restore(saved, parameters.flat())


class AmplifierOff(StickSlipError):
    """A move was requested while the amplifier is off."""


RESULTS = {
    BeyondSoftLimit: Result.RANGE_LIMIT_REACHED,
    AmplifierOff: Result.AMPLIFIER_DISABLED,
}
"""Results of refusals other than INVALID_PARAMETER."""


@checked_arguments
class Bench:
    """
    The drive with its sensors, stepped in simulated time.

    It does not use wall-clock time: the same parameters and the same requests at the same times
    give the same output, to the bit.

    Attributes
    ----------
    stand, sensing, motion : SimulatedStand, Sensing, Motion
        Drive, sensors and moves, on which commands act.
    faults : FaultParameters
        The present faults.
    refused : int
        Requests refused since the start.
    attached : tree
        Unchecked attachment of the checkpoint that the bench was restored from.

    Examples
    --------
    >>> parameters = Parameters()
    >>> bench = Bench(parameters)
    >>> output = bench.update(parameters.block_ns, [Request('voltage', (100.0,))])
    >>> [event.result.name for event in output.events]
    ['DONE']

    """

    REMEMBERED: ClassVar[Mapping[str, Any]] = {
        'time_ns': int,
        'refused': int,
        'faults': FaultParameters,
        'stand': SimulatedStand,
        'sensing': Sensing,
        'motion': Motion,
        '_enabled': bool,
        '_requests': int,
        '_preloading': Identity | None,
        '_preloads_replaced': int,
        '_delayed': deque[tuple[int, int, Annotated[Request, UNCHECKED]]],
        '_events': list[Event],
        '_last_refused': bool,
        '_read': tuple[float | None, float | None],
    }

    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters
        self.time_ns = 0
        self.refused = 0
        self.attached: Any = {}
        self.faults = parameters.fault
        self._enabled = True
        self._is_faulty = False
        self._block_ns, self._sample_ns = parameters.block_ns, parameters.sample_ns
        self.stand = SimulatedStand(parameters)
        self.sensing = Sensing(parameters)
        sim = parameters.sim
        tells_blocks = self.sensing.may_alarm or sim.publish_truth or sim.publish_clock
        self._told_ns = self._block_ns if tells_blocks else parameters.trace_period_ns
        self.motion = Motion(parameters, self._report)
        self._requests = 0
        self._preloading: Identity | None = None
        self._preloads_replaced = 0
        self._delayed: deque[tuple[int, int, Request]] = deque()
        self._events: list[Event] = []
        self._last_refused = False
        self._read: tuple[float | None, float | None] = (None, None)
        self._last_bits, self._last_status = 0, Status(0)
        # Until then nothing takes effect or ends; never, until an update has told of a request.
        self._calm_until_ns = _NEVER_NS
        self.apply_faults(self.faults)

    def __repr__(self) -> str:
        bits = [bit.name for bit in Status if bit.name and bit & self.status]
        position = with_unit(float(self.state['position_m']), 'm')
        voltage = with_unit(self.stand.voltage_v, 'V')
        at = f'{self.time_ns * NANO:.9g} s'
        return f'Bench(at {at}: runner at {position}, {voltage}, {", ".join(bits)})'

    @property
    def replaced(self) -> int:
        """Number of set points replaced by a later set point of their topic, without an event."""
        return self.motion.replaced + self._preloads_replaced

    @property
    def is_at_start(self) -> bool:
        """Whether time is 0 and no request has come."""
        return self.time_ns == 0 and self._requests == 0

    @property
    def plant(self) -> Record:
        """Present constants of the drive, a record of PLANT."""
        return self.stand.plants[0]

    @property
    def state(self) -> Record:
        """True state of the drive, a record of STATE that changes with every update."""
        return self.stand.states[0]

    @property
    def ledger(self) -> EnergyLedger:
        """Energy balance since the start or the last reset."""
        return take_ledger(self.stand.plants, self.stand.states)

    def save(self, attached: Mapping[str, Any] | None = None) -> bytes:
        """
        Return a checkpoint: the exact state of the bench, and its parameters.

        Parameters
        ----------
        attached : mapping of str to object, optional
            Numbers, texts and arrays to attach; ``state_tree.read`` restores arrays.

        """
        return checkpoint.pack_checkpoint(self.parameters, self, attached or {})

    @classmethod
    def restore(cls, saved: bytes, changes: Mapping[str, object] | None = None) -> 'Bench':
        """
        Return a bench that continues from a checkpoint.

        Parameters
        ----------
        saved : bytes
            A checkpoint.
        changes : mapping of str to object, optional
            Parameters to change, if the saved state does not depend on them.

        Raises
        ------
        WrongKind
            If it is no checkpoint of this version, or a parameter must not change.
        StickSlipError
            If a parameter is refused.

        """
        parameters, state, attached = checkpoint.unpack_checkpoint(saved)
        bench = cls(checkpoint.changed_stand(parameters, changes or {}))
        bench._recall(read_tree(cls.REMEMBERED, state, 'checkpoint'))
        bench.attached = attached
        return bench

    def _recall(self, values: dict[str, Any]) -> None:
        """Restore checked values of a checkpoint, if they are consistent."""
        stand, sensing, motion = (values.pop(name) for name in ('stand', 'sensing', 'motion'))
        vars(self).update(values)
        read_tree(range(0, _TIME_MAX_NS + 1, self._sample_ns), self.time_ns, 'checkpoint.time_ns')
        self._events = [replace(each, time_ns=self.time_ns) for each in self._events]
        self._is_faulty = bool(self.faults.names)
        self.stand.recall(stand, self.faults, is_powered=self._is_powered())
        self.sensing.recall(sensing)
        self.motion.recall(motion)
        wave, ramp_s = self.motion.wave, 0.0 if self.motion.is_new else self.stand.ramp_s
        if not can_be_played(wave, self.stand.cycle, ramp_s):
            expected = 'a wave that can be played from its position'
            raise refusal('checkpoint.motion.wave', str(wave), expected)

    def update(self, until_ns: int, requests: Iterable[Request] = ()) -> Output:
        """
        Carry out requests at the present time, then advance to ``until_ns``.

        A bad request is refused with an event and changes nothing.

        Raises
        ------
        OutOfRange
            If ``until_ns`` is not a whole number of samples ahead, or more than one block.
        StickSlipError
            If the integration has failed.

        """
        samples = self._samples_until(until_ns)
        for request in requests:
            self.accept(request)
        self._deliver()
        first_cycle = self._start_wave()
        trace = self.stand.advance(self.motion.wave, samples)
        self.time_ns = until_ns
        readings = self.sensing.read(trace, until_ns, self.faults)
        self._note(readings)
        motion = self.motion
        if self.stand.held_because:
            outcome = Outcome(Result.CORNER_LIMIT_REACHED, self.stand.held_because)
            motion.end(outcome, self._observe())
        if motion.is_running and (motion.may_end_early or self.stand.has_arrived(motion.wave)):
            motion.watch(self._observe())
        if self._preloading is not None and self.stand.is_preloaded:
            self._end_preloading(Result.DONE)
        events, self._events = tuple(self._events), []
        self._calm_until_ns = until_ns
        ramps = self.stand.ramps_since(first_cycle)
        return Output(readings, events, self.status, ramps)

    def update_blocks(self, blocks: int) -> list[Output]:
        """
        Advance by blocks; return their outputs, without ramps.

        It is only one block if something can end within more. An output holds the blocks up to the
        end of a trace period, or one if its status, truth or clock is told.

        """
        if not self._is_calm_until(self.time_ns + blocks * self._block_ns):
            return [self.update(self.time_ns + self._block_ns)]
        trace = self.stand.advance(self.motion.wave, blocks * self._block_ns // self._sample_ns)
        outputs, first = list[Output](), 0
        while first < len(trace):
            left_ns = self._told_ns - self.time_ns % self._told_ns
            part = trace[first : first + left_ns // self._sample_ns]
            first += len(part)
            self.time_ns += len(part) * self._sample_ns
            readings = self.sensing.read(part, self.time_ns, self.faults)
            status = self.status if self.sensing.may_alarm else self._last_status
            outputs.append(Output(readings, (), status, NO_RAMPS))
        self._note(readings)
        return outputs

    def _is_calm_until(self, end_ns: int) -> bool:
        """Start a new wave; return whether no command takes effect or ends up to a time."""
        motion = self.motion
        if self._calm_until_ns >= end_ns:
            return True
        is_told = self._calm_until_ns >= self.time_ns
        if not is_told or self._delayed or (motion.is_running and motion.may_end_early):
            return False
        if self._preloading is not None or self.stand.may_change:
            return False
        self._start_wave()
        self._calm_until_ns = _TIME_MAX_NS
        if motion.is_running:
            wave = motion.wave
            left_s = (wave.cycles - self.stand.cycle - 1) * (wave.period_s - wave.lead_s)
            self._calm_until_ns = self.time_ns + int(left_s / NANO) - self._block_ns
        return self._calm_until_ns >= end_ns

    def _note(self, readings: Readings) -> None:
        """Keep the last readings for events."""
        position_m, force_n = readings.trace[-1, FIRST_READING : FIRST_READING + 2].tolist()
        self._read = _if_finite(position_m), _if_finite(force_n)
        self.sensing.reading_m = self._read[0]

    def accept(self, request: Request) -> None:
        """Carry out a request now; its event comes with the next update."""
        self._calm_until_ns = _NEVER_NS
        self._requests += 1
        delay_ns = to_nanoseconds(self.faults.command_delay)
        command = COMMANDS.get(request.name)
        if delay_ns and command is not None and command.has_topic:
            self._delayed.append((self.time_ns + delay_ns, self._requests, request))
        else:
            self._obey(self._requests, request)

    def _deliver(self) -> None:
        """Carry out the delayed requests that are due, in the order of their times."""
        if not self._delayed:
            return
        due = [each for each in self._delayed if each[0] <= self.time_ns]
        due.sort(key=lambda each: each[:2])
        for each in due:
            self._delayed.remove(each)
            self._obey(*each[1:])

    def _obey(self, number: int, request: Request) -> None:
        self._last_refused = False
        command = _identity(number, request)
        try:
            accepted = Accepted(command, check_request(request, self.parameters))
            result = COMMANDS[command.name].act(self, accepted)
        except StickSlipError as refusal:
            self.refused += 1
            self._last_refused = True
            result = RESULTS.get(type(refusal), Result.INVALID_PARAMETER)
            self._report(command, result, str(refusal))
        else:
            if result is not None:
                self._report(command, result)

    def change_preload(self, command: Identity, preload_n: float) -> None:
        """Start a change of the preload; its end is reported on arrival."""
        self._preloads_replaced += self._preloading is not None
        self._preloading = command
        self.stand.change_preload(preload_n)

    def end_move(self, why: str) -> None:
        self.motion.end(Outcome(Result.ABORTED, why), self._observe())

    def reset(self, why: str) -> None:
        """Return to the state at the start, but keep faults and time."""
        self.end_move(why)
        self._end_preloading(Result.ABORTED, why)
        while self._delayed:
            _, number, request = self._delayed.popleft()
            self._report(_identity(number, request), Result.ABORTED, why)
        self.stand.reset()
        self.sensing.reset()
        self.motion.reset(self.stand.voltage_v)
        self.apply_faults(self.faults)

    def enable(self, *, wanted: bool) -> None:
        """Switch the amplifier on or off."""
        self._enabled = wanted
        self.apply_faults(self.faults)

    def change_parameters(self, values: Mapping[str, Scalar]) -> None:
        self.parameters = self.parameters.updated(values)
        self.stand.change_parameters(self.parameters)
        self.motion.change_parameters(self.parameters, self._observe())

    def apply_faults(self, faults: FaultParameters) -> None:
        """Set the present faults, or refuse them."""
        is_powered = self._enabled and not faults.amplifier_off
        self.stand.apply_faults(faults, is_powered=is_powered)
        self.faults = faults
        self._is_faulty = bool(faults.names)
        if not is_powered:
            why = 'the amplifier was switched off'
            self.motion.end(Outcome(Result.AMPLIFIER_DISABLED, why), self._observe())
        self.motion.wave = self.stand.wave_with(self.motion.wave, faults)

    def observe_powered(self) -> Observation:
        """
        Return the present observation of the stand for a move.

        Raises AmplifierOff if the amplifier is off.

        """
        if not self._is_powered():
            raise AmplifierOff(
                'the amplifier is off; switch it on with ~/enable_amplifier, end its fault'
            )
        return self._observe()

    def _is_powered(self) -> bool:
        return self._enabled and not self.faults.amplifier_off

    def _samples_until(self, until_ns: int) -> int:
        samples, rest_ns = divmod(until_ns - self.time_ns, self._sample_ns)
        if rest_ns or not 0 < until_ns - self.time_ns <= self._block_ns:
            limit = (
                f'not a whole number of samples ({self._sample_ns} ns) and at most one '
                f'block ({self._block_ns} ns) after {self.time_ns} ns'
            )
            raise OutOfRange('until_ns', until_ns, 'ns', limit, 'go block by block')
        return samples

    def _start_wave(self) -> int:
        """Start the clock of a new wave; return the number of its present ramp."""
        if self.motion.is_new:
            self.motion.is_new = False
            self.motion.wave = self.stand.wave_with(self.motion.wave, self.faults)
            start_clock(self.stand.states)
        return self.stand.cycle

    def _observe(self) -> Observation:
        return Observation(
            time_ns=self.time_ns,
            position_m=self.sensing.position_m,
            reading_m=self.sensing.reading_m,
            voltage_v=self.stand.voltage_v,
            cycles=0 if self.motion.is_new else self.stand.cycle,
            ramp_s=0.0 if self.motion.is_new else self.stand.ramp_s,
            arrived=self.stand.has_arrived(self.motion.wave),
        )

    @property
    def status(self) -> Status:
        """Present status bits of the drive."""
        bits = (
            self.sensing.status_bits
            | self.motion.status_bits
            | MOVE_DELAYED * bool(self._delayed)
            | AMPLIFIER_ENABLED * self._is_powered()
            | _LOADED * (self.stand.load_n != 0.0)
            | _REFUSED * self._last_refused
            | _PRELOADING * (not self.stand.is_preloaded)
            | _FAULT * self._is_faulty
        )
        if bits != self._last_bits:
            self._last_bits, self._last_status = bits, Status(bits)
        return self._last_status

    def _end_preloading(self, result: Result, why: str = '') -> None:
        command, self._preloading = self._preloading, None
        if command is not None:
            self._report(command, result, why)

    def event(
        self,
        command: Identity,
        result: Result,
        message: str = '',
        steps: int = 0,
        step_m: float | None = None,
    ) -> Event:
        """Return the end of a command at the present time, with the last readings."""
        number, name, sent_ns, tag = command
        end = (self.time_ns, number, name, result, steps, message, sent_ns, tag)
        return Event(*end, *self._read, step_m)

    def _report(self, *end: Any) -> None:
        self._events.append(self.event(*end))


def _if_finite(reading: float) -> float | None:
    return reading if math.isfinite(reading) else None


def _identity(number: int, request: Request) -> Identity:
    return Identity(number, request.name, request.stamp_ns, request.tag)
