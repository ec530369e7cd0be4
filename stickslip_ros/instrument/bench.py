"""The virtual test stand: time and requests in; readings, events and status out."""

from collections import deque
from collections.abc import Iterable

from stickslip_ros.contact.record import Record
from stickslip_ros.drive.ledger import EnergyLedger
from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.instrument import commands
from stickslip_ros.instrument.checks import BeyondSoftLimit, check_request
from stickslip_ros.instrument.closed_loop import Sight, Verdict
from stickslip_ros.instrument.commands import Command, Request
from stickslip_ros.instrument.motion import Motion
from stickslip_ros.instrument.reports import Event, Output, Result, Status
from stickslip_ros.instrument.sensing import Sensing
from stickslip_ros.instrument.stand import Stand
from stickslip_ros.parameters import FaultParameters, Parameters, to_nanoseconds

DELAYED = frozenset(
    ('voltage', 'sawtooth', 'steps', 'jog', 'waveform', 'position', 'load', 'preload')
)
"""Requests that ``fault.command_delay`` holds up: those that come over topics."""
MOVE_DELAYED, AMPLIFIER_ENABLED = int(Status.MOVE_DELAYED), int(Status.AMPLIFIER_ENABLED)
LOADED, REFUSED = int(Status.LOADED), int(Status.REFUSED)
PRELOADING, FAULT = int(Status.PRELOADING), int(Status.FAULT)


class Bench:
    """
    The drive with its sensors, stepped in simulated time.

    Nothing here knows what time it is: the same parameters and the same requests at the same
    times give the same output, to the bit.

    Parameters
    ----------
    parameters : Parameters
        The stand.

    Attributes
    ----------
    faults : FaultParameters
        What is broken at the moment.
    refused : int
        Requests refused since the start.

    """

    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters
        self.time_ns = 0
        self.refused = 0
        self.faults = parameters.fault
        self._enabled = True
        self._is_faulty = False
        self._block_ns, self._sample_ns = parameters.block_ns, parameters.sample_ns
        self._stand = Stand(parameters)
        self._sensing = Sensing(parameters)
        self._motion = Motion(parameters, self._tell)
        self._requests = 0
        self._preloading = 0
        self._preloads_replaced = 0
        self._delayed: deque[tuple[int, int, Request]] = deque()
        self._events: list[Event] = []
        self._last_refused = False
        self._told_bits, self._told_status = 0, Status(0)
        self._apply_faults(self.faults)

    @property
    def replaced(self) -> int:
        """Set-points since the start that the next one of their topic has replaced, untold."""
        return self._motion.replaced + self._preloads_replaced

    @property
    def plant(self) -> Record:
        """The drive as it is now, a record of PLANT."""
        return self._stand.plants[0]

    @property
    def state(self) -> Record:
        """The true state of the drive, a record of STATE; it goes on changing."""
        return self._stand.states[0]

    @property
    def ledger(self) -> EnergyLedger:
        """Where the energy went since the start or the last reset."""
        return self._stand.ledger

    @property
    def passes_made(self) -> int:
        """Passes that the loops over time have made: what the drive has cost so far."""
        return self._stand.passes_made

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
            self.accept(request)
        self._deliver()
        first_cycle = self._start_wave()
        wave = self._motion.wave
        trace = self._stand.advance(wave, samples)
        self.time_ns = until_ns
        readings = self._sensing.read(trace, until_ns, self._stand.voltage_v, self.faults)
        if self._motion.is_running:
            self._motion.watch(self._sight())
        if self._preloading and self._stand.is_preloaded:
            self._end_preloading(Result.DONE)
        events, self._events = tuple(self._events), []
        ramps = self._stand.ramps_since(wave, first_cycle)
        return Output(readings, events, self.status, ramps)

    def accept(self, request: Request) -> None:
        """
        Carry out a request at the present time; a bad one is refused with an event.

        Parameters
        ----------
        request : Request
            What was asked for. Its event comes with the next update.

        """
        self._requests += 1
        delay_ns = to_nanoseconds(self.faults.command_delay)
        if delay_ns and request.name in DELAYED:
            self._delayed.append((self.time_ns + delay_ns, self._requests, request))
        else:
            self._obey(self._requests, request)

    def _deliver(self) -> None:
        """Carry out the delayed requests whose time has come, in the order of that time."""
        if not self._delayed:
            return
        due = sorted(each for each in self._delayed if each[0] <= self.time_ns)
        for each in due:
            self._delayed.remove(each)
            self._obey(*each[1:])

    def _obey(self, number: int, request: Request) -> None:
        self._last_refused = False
        try:
            command = check_request(request, self.parameters)
            self._carry_out(number, request.name, command)
        except BeyondSoftLimit as refusal:
            self._refuse(number, request.name, Result.RANGE_LIMIT_REACHED, str(refusal))
        except StickSlipError as refusal:
            self._refuse(number, request.name, Result.INVALID_PARAMETER, str(refusal))

    def _refuse(self, number: int, name: str, result: Result, why: str) -> None:
        self.refused += 1
        self._last_refused = True
        self._tell(number, name, result, why)

    def _carry_out(self, number: int, name: str, command: Command) -> None:
        """Begin what takes time and tell its end later; do the rest at once and tell it now."""
        match command:
            case commands.Move() | commands.Jog() | commands.Target():
                self._move(number, name, command)
            case commands.Preload():
                self._preloads_replaced += bool(self._preloading)
                self._preloading = number
                self._stand.change_preload(command.force_n)
            case _:
                self._do_at_once(number, command)
                self._tell(number, name, Result.DONE)

    def _do_at_once(self, number: int, command: Command) -> None:
        match command:
            case commands.Load():
                self._stand.load_n = command.force_n
            case commands.Stop():
                self._end_move(f'stopped by command {number}')
            case commands.Reset():
                self._end_move(f'reset by command {number}')
                self._end_preloading(Result.ABORTED, f'reset by command {number}')
                self._end_delayed(f'reset by command {number}')
                self._to_rest()
            case commands.ZeroPosition():
                self._end_move(f'position zeroed by command {number}', closed_loop_only=True)
                self._sensing.zero_position()
            case commands.TareForce():
                self._sensing.tare_force()
            case commands.EnableAmplifier():
                self._enabled = command.wanted
                self._apply_faults(self.faults)
            case commands.SetFaults() | commands.ClearFaults():
                self._apply_faults(command.applied_to(self.faults))

    def _move(
        self, number: int, name: str, command: commands.Move | commands.Jog | commands.Target
    ) -> None:
        if self._is_powered():
            self._motion.start(number, command, self._sight())
        else:
            why = 'the amplifier is off; switch it on with ~/enable_amplifier, end its fault'
            self._refuse(number, name, Result.AMPLIFIER_DISABLED, why)

    def _end_move(self, why: str, *, closed_loop_only: bool = False) -> None:
        if not closed_loop_only or self._motion.status & Status.CLOSED_LOOP:
            self._motion.end(Verdict(Result.ABORTED, why), self._sight())

    def _apply_faults(self, faults: FaultParameters) -> None:
        """Let the drive have these faults, and no others, from now on; or refuse them."""
        is_powered = self._enabled and not faults.amplifier_off
        self._stand.break_down(faults, is_powered=is_powered)
        self.faults = faults
        self._is_faulty = bool(faults.names)
        if not is_powered:
            verdict = Verdict(Result.AMPLIFIER_DISABLED, 'the amplifier was switched off')
            self._motion.end(verdict, self._sight())
        self._motion.wave = self._stand.wave_with(self._motion.wave, faults)

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
        if self._motion.is_new:
            self._motion.is_new = False
            self._motion.wave = self._stand.wave_with(self._motion.wave, self.faults)
            self._stand.start_clock()
        return self._stand.cycle

    def _sight(self) -> Sight:
        return Sight(
            time_ns=self.time_ns,
            position_m=self._sensing.position_m,
            voltage_v=self._stand.voltage_v,
            cycles=0 if self._motion.is_new else self._stand.cycle,
            arrived=self._stand.has_arrived(self._motion.wave),
        )

    @property
    def status(self) -> Status:
        """State of the drive now, bit by bit."""
        bits = (
            self._sensing.status_bits
            | int(self._motion.status)
            | MOVE_DELAYED * bool(self._delayed)
            | AMPLIFIER_ENABLED * self._is_powered()
            | LOADED * (self._stand.load_n != 0.0)
            | REFUSED * self._last_refused
            | PRELOADING * (not self._stand.is_preloaded)
            | FAULT * self._is_faulty
        )
        if bits != self._told_bits:
            self._told_bits, self._told_status = bits, Status(bits)
        return self._told_status

    def _to_rest(self) -> None:
        self._stand.to_rest()
        self._sensing.reset()
        self._motion.reset(self._stand.voltage_v)
        self._apply_faults(self.faults)

    def _end_delayed(self, why: str) -> None:
        """Tell the end of commands that have come and will never take effect."""
        while self._delayed:
            _, number, request = self._delayed.popleft()
            self._tell(number, request.name, Result.ABORTED, why)

    def _end_preloading(self, result: Result, why: str = '') -> None:
        """Tell the end of a preload command, if one is on its way."""
        number, self._preloading = self._preloading, 0
        if number:
            self._tell(number, 'preload', result, why)

    def _tell(
        self, number: int, command: str, result: Result, message: str = '', steps: int = 0
    ) -> None:
        self._events.append(Event(self.time_ns, number, command, result, steps, message))
