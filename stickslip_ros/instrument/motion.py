"""Moves of the piezo: which wave the amplifier follows, and how every move ends."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from stickslip_ros.drive.records import Wave
from stickslip_ros.drive.waveform import level
from stickslip_ros.instrument.closed_loop import ClosedLoop, Sight, Verdict
from stickslip_ros.instrument.commands import Jog, Move, Target
from stickslip_ros.instrument.reports import Result, Status
from stickslip_ros.parameters import Parameters, to_nanoseconds

FAILURES = {
    Result.RANGE_LIMIT_REACHED: Status.RANGE_LIMIT_REACHED,
    Result.END_STOP_REACHED: Status.END_STOP_REACHED,
    Result.FOLLOWING_LIMIT_REACHED: Status.FOLLOWING_LIMIT_REACHED,
    Result.TIMEOUT: Status(0),
    Result.NO_SENSOR: Status(0),
    Result.AMPLIFIER_DISABLED: Status(0),
}
"""Results of a failed move, and the bit that each sets beside MOVEMENT_FAILED."""
SET_POINTS = ('voltage', 'position')
"""Moves to a value that is wanted: the next one of the same topic is no end that is told."""
HOLD = 'hold'
"""Name under which the end of a hold is told."""


@dataclass(frozen=True)
class Running:
    """
    The move that is being carried out.

    Attributes
    ----------
    number : int
        Number of its command.
    name : str
        Name of its command.
    direction : int
        +1 or -1 for steps that soft limits stop, else 0.
    steps : int
        Steps that a jog made at its earlier rates.

    """

    number: int
    name: str
    direction: int = 0
    steps: int = 0


Tell = Callable[[int, str, Result, str, int], None]


class Motion:
    """
    The moves of one drive.

    Parameters
    ----------
    parameters : Parameters
        The stand.
    tell : callable
        Receives the end of a move: number and name of its command, result, reason, steps.

    Attributes
    ----------
    wave : Wave
        What the amplifier shall follow.
    is_new : bool
        Whether the wave begins now; whoever starts its clock sets it back.
    replaced : int
        Set-points, since the start, that the next one of their topic has replaced.

    """

    def __init__(self, parameters: Parameters, tell: Tell) -> None:
        self._parameters = parameters
        self._tell = tell
        self.replaced = 0
        self.reset(float(parameters.amplifier.voltage_initial))

    def reset(self, voltage_v: float) -> None:
        """Forget every move and hold a voltage."""
        self._running: Running | None = None
        self._loop: ClosedLoop | None = None
        self._jog_ends_ns = 0
        self._jog_hz = 0.0
        self._failed = Status(0)
        self._follow(level(voltage_v))

    @property
    def is_running(self) -> bool:
        """Whether a move runs or its target is held."""
        return self._running is not None

    @property
    def status(self) -> Status:
        """Bits that moves set."""
        status = self._failed
        loop, running = self._loop, self._running
        if running is None:
            return status
        if loop is None or not loop.holds:
            status |= Status.MOVING
        if loop is not None:
            status |= Status.CLOSED_LOOP
            status |= Status.IN_POSITION if loop.in_position else Status(0)
        if running.name == 'waveform':
            status |= Status.STREAMING
        return status

    def start(self, number: int, command: Move | Jog | Target, sight: Sight) -> None:
        """Replace the running move by another."""
        if isinstance(command, Jog):
            self._jog(number, command, sight)
            return
        name = command.name if isinstance(command, Move) else 'position'
        self._make_way(number, name, sight)
        if isinstance(command, Move):
            self._running = Running(number, name, command.direction)
            self._follow(command.wave)
            self._stop_beyond_soft_limit(sight)
        else:
            self._running = Running(number, name)
            self._loop = ClosedLoop(self._parameters, command.position_m, sight)
            self._follow(level(sight.voltage_v))

    def watch(self, sight: Sight) -> None:
        """Look at the stand after a block: go on, or end the move."""
        if self._running is None:
            return
        if self._stop_beyond_soft_limit(sight):
            return
        if self._loop is not None:
            self._go_on(self._loop, sight)
        elif self._running.name == 'jog':
            if sight.time_ns >= self._jog_ends_ns:
                self._end_jog('jog.timeout passed without a new command', sight)
        elif sight.arrived:
            self.end(Verdict(Result.DONE), sight)

    def end(self, verdict: Verdict, sight: Sight) -> None:
        """End the running move, if there is one, and hold its present voltage."""
        running, loop = self._running, self._loop
        self._running = self._loop = None
        if running is None:
            return
        if verdict.result is not Result.DONE:
            self._follow(level(sight.voltage_v))
        if verdict.result in FAILURES:
            self._failed = Status.MOVEMENT_FAILED | FAILURES[verdict.result]
        if loop is None:
            steps = running.steps + sight.cycles if running.direction else 0
            self._tell(running.number, running.name, verdict.result, verdict.why, steps)
        elif not loop.holds:
            self._tell(running.number, running.name, verdict.result, verdict.why, 0)
        elif verdict.result in FAILURES:
            self._tell(running.number, HOLD, verdict.result, verdict.why, 0)

    def _make_way(self, number: int, name: str, sight: Sight) -> None:
        """End the running move; tell it, unless a set-point gives way to the next of its topic."""
        running, loop = self._running, self._loop
        if running is None or running.name != name or name not in SET_POINTS:
            self.end(Verdict(Result.ABORTED, f'replaced by command {number}'), sight)
        else:
            self.replaced += loop is None or not loop.holds
            self._running = self._loop = None
        self._failed = Status(0)

    def _follow(self, wave: Wave) -> None:
        self.wave = wave
        self.is_new = True

    def _jog(self, number: int, command: Jog, sight: Sight) -> None:
        """Start to jog, go on with it, at another rate or not, or end it."""
        running, move = self._running, command.move
        jogs = running is not None and running.name == 'jog'
        if move is None:
            if jogs:
                self._end_jog(f'ended by command {number}', sight)
            else:
                self._tell(number, 'jog', Result.DONE, 'no jog was running', 0)
            return
        if running is None or not jogs:
            self._make_way(number, 'jog', sight)
            self._jog_at(command.frequency_hz, move, Running(number, 'jog', move.direction))
        elif command.frequency_hz != self._jog_hz:
            self.replaced += 1
            steps = running.steps + sight.cycles
            running = replace(running, direction=move.direction, steps=steps)
            self._jog_at(command.frequency_hz, move, running)
        self._jog_ends_ns = sight.time_ns + to_nanoseconds(self._parameters.jog.timeout)
        self._stop_beyond_soft_limit(sight)

    def _jog_at(self, frequency_hz: float, move: Move, running: Running) -> None:
        """Step at another rate from now on."""
        self._running = running
        self._jog_hz = frequency_hz
        self._follow(move.wave)

    def _end_jog(self, why: str, sight: Sight) -> None:
        self._follow(level(sight.voltage_v))
        self.end(Verdict(Result.DONE, why), sight)

    def _go_on(self, loop: ClosedLoop, sight: Sight) -> None:
        held = loop.holds
        wave, verdict = loop.update(sight)
        if wave is not None:
            self._follow(wave)
        if verdict is None:
            return
        if verdict.result is not Result.DONE:
            self.end(verdict, sight)
        elif self._running is not None and not held:
            self._tell(self._running.number, 'position', Result.DONE, '', 0)
            if not self._parameters.closed_loop.hold:
                self._running = self._loop = None

    def _stop_beyond_soft_limit(self, sight: Sight) -> bool:
        """End steps that lead out of the soft limits, or begin beyond them; tell whether."""
        limits, running = self._parameters.limits, self._running
        if running is None or not limits.has_soft_limits or not running.direction:
            return False
        if running.direction > 0 and sight.position_m > limits.soft_max:
            side = f'above limits.soft_max {limits.soft_max:g} m'
        elif running.direction < 0 and sight.position_m < limits.soft_min:
            side = f'below limits.soft_min {limits.soft_min:g} m'
        else:
            return False
        why = f'{sight.position_m:.6g} m is {side}'
        # A wave that has not begun yet has made no ramp, whatever the one before it made.
        cycles = 0 if self.is_new else sight.cycles
        self.end(Verdict(Result.RANGE_LIMIT_REACHED, why), sight._replace(cycles=cycles))
        return True
