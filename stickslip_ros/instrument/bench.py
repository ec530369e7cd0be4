"""The virtual test stand: time and requests in; readings, events and status out."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.drive.amplifier import SETTLED_V
from stickslip_ros.drive.build import (
    change_preload,
    clock_at_start,
    history_of,
    plant_of,
    state_at_rest,
)
from stickslip_ros.drive.ledger import EnergyLedger, take_ledger
from stickslip_ros.drive.records import State, Wave
from stickslip_ros.drive.waveform import level
from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.instrument.commands import (
    Command,
    Load,
    Move,
    Preload,
    Request,
    Reset,
    Stop,
    check_request,
)
from stickslip_ros.instrument.reports import (
    FORCE,
    POSITION,
    TIME,
    Event,
    Output,
    Readings,
    Result,
    Status,
)
from stickslip_ros.instrument.scope import observe
from stickslip_ros.instrument.sensor import interferometer, load_cell
from stickslip_ros.parameters import Parameters

NANO = 1e-9


@dataclass(frozen=True)
class RunningMove:
    """The move that is being carried out, and its number."""

    number: int
    move: Move


class Bench:
    """
    The drive with its sensors, stepped in simulated time.

    Nothing here knows what time it is: the same parameters and the same requests at the same
    times give the same output, to the bit.

    Parameters
    ----------
    parameters : Parameters
        The stand.

    """

    _state: State
    _wave: Wave
    _load_n: float
    _running: RunningMove | None = None

    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters
        self.plant = self._first_plant = plant_of(parameters)
        self.time_ns = 0
        self.refused = 0
        self._history = history_of(self.plant)
        self._sensors = (interferometer(parameters), load_cell(parameters))
        ramps = math.ceil(parameters.sim.block * parameters.amplifier.frequency_max) + 1
        self._ramps = np.zeros((ramps, 3))
        self._requests = 0
        self._events: list[Event] = []
        self._last_refused = False
        self._to_rest()

    @property
    def state(self) -> State:
        """The true state of the drive."""
        return self._state

    @property
    def ledger(self) -> EnergyLedger:
        """Where the energy went since the start or the last reset."""
        return take_ledger(self.plant, self._history, self._state)

    def update(self, until_ns: int, requests: Iterable[Request] = ()) -> Output:
        """
        Carry out requests at the present time, then advance to ``until_ns``.

        Parameters
        ----------
        until_ns : int
            Simulated time to advance to, ns: a whole number of samples ahead, at most one block.
        requests : iterable of Request
            What was asked for; a bad one is refused with an event and changes nothing.

        Returns
        -------
        Output
            Readings, ended commands, status and finished ramps.

        Raises
        ------
        OutOfRange
            If ``until_ns`` does not lie a whole number of samples ahead, within one block.
        StickSlipError
            If the integration has failed.

        """
        samples = self._samples_until(until_ns)
        for request in requests:
            self._accept(request)
        first_cycle = self._state.clock.cycle
        trace = np.empty((samples, 5))
        sample_ns = self.parameters.sample_ns
        self._state = observe(
            self.plant,
            self._history,
            self._state,
            self._wave,
            self._load_n,
            sample_ns * NANO,
            trace,
            self._ramps,
        )
        self._check_motion()
        trace[:, TIME] = (self.time_ns + sample_ns * np.arange(1, samples + 1)) * NANO
        self.time_ns = until_ns
        self._end_move_if_done()
        if self._is_preloaded():
            self._end_preloading(Result.DONE)
        truth_position_m, truth_force_n = trace[-1, POSITION], trace[-1, FORCE]
        for sensor, column in zip(self._sensors, (POSITION, FORCE), strict=True):
            trace[:, column] = sensor.read(trace[:, column])
        return self._report(trace, first_cycle, (float(truth_position_m), float(truth_force_n)))

    def _check_motion(self) -> None:
        if not math.isfinite(self._state.position_m + self._state.velocity_m_per_s):
            raise StickSlipError(
                f'the motion is no longer finite after {self.time_ns} ns; lower sim.dt, or bring '
                'mass, damping and stiffnesses nearer to each other'
            )

    def _samples_until(self, until_ns: int) -> int:
        samples, rest_ns = divmod(until_ns - self.time_ns, self.parameters.sample_ns)
        if rest_ns or not 0 < until_ns - self.time_ns <= self.parameters.block_ns:
            limit = (
                f'not a whole number of samples ({self.parameters.sample_ns} ns) and at most one '
                f'block ({self.parameters.block_ns} ns) after {self.time_ns} ns'
            )
            raise OutOfRange('until_ns', until_ns, 'ns', limit, 'go block by block')
        return samples

    def _report(self, trace: Array, first_cycle: int, truth: tuple[float, float]) -> Output:
        cycles = np.arange(first_cycle, self._state.clock.cycle)
        events, self._events = tuple(self._events), []
        readings = Readings(
            time_ns=self.time_ns,
            position_m=float(trace[-1, POSITION]),
            force_n=float(trace[-1, FORCE]),
            voltage_v=self._state.voltage_v,
            trace=trace,
            truth_position_m=truth[0],
            truth_force_n=truth[1],
        )
        return Output(readings, events, self._status(), self._ramps[cycles % len(self._ramps)])

    def _status(self) -> Status:
        status = Status(0)
        if self._running is not None:
            status |= Status.MOVING
        if not self._is_preloaded():
            status |= Status.PRELOADING
        if self._load_n != 0.0:
            status |= Status.LOADED
        if self._last_refused:
            status |= Status.REFUSED
        return status

    def _accept(self, request: Request) -> None:
        self._requests += 1
        try:
            command = check_request(request, self.parameters)
        except StickSlipError as refusal:
            self.refused += 1
            self._last_refused = True
            self._tell(self._requests, request.name, Result.INVALID_PARAMETER, str(refusal))
            return
        self._last_refused = False
        self._carry_out(command)

    def _carry_out(self, command: Command) -> None:
        number = self._requests
        match command:
            case Move():
                self._abort_move(f'replaced by command {number}')
                self._running = RunningMove(number, command)
                self._wave = command.wave
                self._state = self._state._replace(clock=clock_at_start(self._state))
            case Load():
                self._load_n = command.force_n
                self._tell(number, 'load', Result.DONE)
            case Preload():
                self._end_preloading(Result.ABORTED, f'replaced by command {number}')
                self._preloading = number
                self._change_preload(command.force_n)
            case Stop():
                self._abort_move(f'stopped by command {number}')
                self._wave = level(self._state.voltage_v)
                self._tell(number, 'stop', Result.DONE)
            case Reset():
                self._abort_move(f'reset by command {number}')
                self._end_preloading(Result.ABORTED, f'reset by command {number}')
                self._to_rest()
                self._tell(number, 'reset', Result.DONE)

    def _to_rest(self) -> None:
        self.plant = self._first_plant
        preload_n = self.parameters.stand.preload
        self._state = state_at_rest(self.plant, self._history, preload_n)
        self._wave = level(self._state.voltage_v)
        self._load_n = 0.0
        self._running = None
        self._preloading = 0
        if self.parameters.stand.preload_end:
            self._change_preload(self.parameters.stand.preload_end)
        for sensor in self._sensors:
            sensor.reset()

    def _change_preload(self, preload_n: float) -> None:
        """Let the springs take over, and go to another preload."""
        self.plant, self._state = change_preload(
            self.plant, self._history, self._state, self.parameters, preload_n
        )

    def _is_preloaded(self) -> bool:
        return self._state.contact.preload_n == self.plant.contact.preload_n

    def _end_preloading(self, result: Result, why: str = '') -> None:
        """Tell the end of a preload command, if one is on its way."""
        number, self._preloading = self._preloading, 0
        if number:
            self._tell(number, 'preload', result, why)

    def _abort_move(self, why: str) -> None:
        if self._running is not None:
            self._end_move(self._running, Result.ABORTED, why)

    def _end_move_if_done(self) -> None:
        if self._running is None:
            return
        ramps_done = self._state.clock.cycle >= self._wave.cycles
        arrived = abs(self._state.voltage_v - self._wave.start_v) <= SETTLED_V
        if ramps_done and arrived:
            self._end_move(self._running, Result.DONE)

    def _end_move(self, running: RunningMove, result: Result, why: str = '') -> None:
        steps = self._state.clock.cycle
        self._running = None
        self._tell(running.number, running.move.name, result, why, steps)

    def _tell(
        self, number: int, command: str, result: Result, message: str = '', steps: int = 0
    ) -> None:
        self._events.append(Event(self.time_ns, number, command, result, steps, message))
