# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Moves of the piezo: which wave the amplifier follows, and how every move ends."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from stickslip_ros.drive.records import Wave
from stickslip_ros.drive.waveform import after, level, repeats
from stickslip_ros.instrument.closed_loop import ClosedLoop, Goal, Observation, Outcome
from stickslip_ros.instrument.reports import Identity, Result, Status
from stickslip_ros.instrument.trajectory import Followed
from stickslip_ros.parameters import Parameters, to_nanoseconds

_MOVING, _STREAMING = int(Status.MOVING), int(Status.STREAMING)
CLOSED_LOOP, IN_POSITION = int(Status.CLOSED_LOOP), int(Status.IN_POSITION)
FAILURES = {
    Result.RANGE_LIMIT_REACHED: Status.RANGE_LIMIT_REACHED,
    Result.END_STOP_REACHED: Status.END_STOP_REACHED,
    Result.FOLLOWING_LIMIT_REACHED: Status.FOLLOWING_LIMIT_REACHED,
    Result.TIMEOUT: Status(0),
    Result.NO_SENSOR: Status(0),
    Result.AMPLIFIER_DISABLED: Status(0),
}
"""Results of a failed move, and the bit that each sets beside MOVEMENT_FAILED."""
RAMP_FIELDS = slice(3)
"""Fields of a wave that say what its ramps are; jogs at different rates differ in these."""
_SET_POINTS = ('voltage', 'position')
"""Moves to a value that is wanted: the next one of the same topic is no end that is reported."""
_HOLD = 'hold'
"""Name under which the end of a hold is reported."""


@dataclass(frozen=True)
class Running:
    """
    The move that is being carried out.

    Attributes
    ----------
    command : Identity
        Its command.
    wave : Wave or None
        What it follows; None in closed loop, which finds out on the way.
    steps : int
        Steps that a jog made at its earlier rates.
    start_m : float or None
        Position reading at its start, m; None where there was none, or steps have no one length.

    """

    command: Identity
    wave: Wave | None
    steps: int = 0
    start_m: float | None = None

    @property
    def direction(self) -> int:
        """+1 or -1 for steps, which soft limits stop, else 0."""
        rise_v = 0.0 if self.wave is None else self.wave.rise_v
        return (rise_v > 0.0) - (rise_v < 0.0)

    @property
    def is_cyclic(self) -> bool:
        """Whether its ramps, or cycles, are counted."""
        return self.direction != 0 or (self.wave is not None and repeats(self.wave))


Report = Callable[[Identity, Result, str, int, float | None], None]
"""Receives the end of a move: its command, result, reason, steps and their length, m."""


class Motion:
    """
    The moves of one drive.

    Attributes
    ----------
    wave : Wave
        What the amplifier shall follow.
    is_new : bool
        Whether the wave begins now; whoever starts its clock sets it back.
    replaced : int
        Set-points, since the start, that the next one of their topic has replaced.

    """

    REMEMBERED: ClassVar[Mapping[str, Any]] = {
        'wave': Wave,
        'is_new': bool,
        'replaced': int,
        '_running': Running | None,
        '_loop': ClosedLoop | None,
        '_renewed_ns': int,
        '_failed': Status,
    }

    def __init__(self, parameters: Parameters, report: Report) -> None:
        self._parameters = parameters
        self._report = report
        self.replaced = 0
        self.reset(float(parameters.amplifier.voltage_initial))

    def reset(self, voltage_v: float) -> None:
        """Forget every move and hold a voltage."""
        self._running: Running | None = None
        self._loop: ClosedLoop | None = None
        self._renewed_ns = 0
        self._failed = Status(0)
        self._follow(level(voltage_v))

    def recall(self, values: dict[str, Any]) -> None:
        """Remember what was read from a file."""
        loop = values.pop('_loop')
        vars(self).update(values)
        if loop is not None:
            start = Observation(0, 0.0, 0.0, 0.0, 0, 0.0, arrived=True)
            self._loop = ClosedLoop(self._parameters, loop['goal'], start)
            self._loop.recall(loop)

    @property
    def is_running(self) -> bool:
        """Whether a move runs or its target is held."""
        return self._running is not None

    @property
    def _is_jog(self) -> bool:
        return self._running is not None and self._running.command.name == 'jog'

    @property
    def may_end_early(self) -> bool:
        """Whether it may change or end before its wave has: closed loop, jog, soft limits."""
        return self._is_jog or self._loop is not None or self._parameters.limits.has_soft_limits

    @property
    def status_bits(self) -> int:
        """Bits of Status that moves set."""
        bits = int(self._failed)
        loop, running = self._loop, self._running
        if running is None:
            return bits
        if loop is None or not loop.holds:
            bits |= _MOVING
        if loop is not None:
            bits |= CLOSED_LOOP | IN_POSITION * loop.in_position
        return bits | _STREAMING * (running.command.name == 'waveform')

    @property
    def followed(self) -> Followed | None:
        """Of a trajectory: set point and reading of the last block; other threads may ask."""
        loop = self._loop
        return None if loop is None else loop.followed

    def start(self, command: Identity, wave: Wave, observation: Observation) -> None:
        """Follow a wave in place of the running move; a table, at the end of a cycle of one."""
        before, has_begun = self.wave, not self.is_new or self.wave.lead_s > 0.0
        goes_on = has_begun and repeats(before) and observation.cycles < before.cycles
        if len(wave.rows) and goes_on:
            wave = after(before, observation.ramp_s, wave)
        self._make_way(command, observation)
        self._running = Running(command, wave, start_m=observation.reading_m)
        self._follow(wave)
        self._stop_beyond_soft_limit(observation)

    def approach(self, command: Identity, goal: Goal, observation: Observation) -> None:
        """Pursue a goal in closed loop in place of the running move."""
        self._make_way(command, observation)
        self._close_loop(command, goal, observation)

    def pursue(self, command: Identity, goal: Goal, observation: Observation) -> None:
        """Give a new goal to the closed loop of this command; without one, close the loop."""
        running, loop = self._running, self._loop
        if running is None or loop is None or not _continues(running.command, command):
            self._make_way(command, observation)
            self._close_loop(command, goal, observation)
        else:
            was_holding = loop.holds
            if loop.pursue(goal, observation):
                self.replaced += not was_holding
                self._running = replace(running, command=command)
        self._renewed_ns = observation.time_ns
        self._stop_beyond_soft_limit(observation)

    def change_parameters(self, parameters: Parameters, observation: Observation) -> None:
        """Have other values of live parameters; a target that they exclude is given up."""
        self._parameters = parameters
        if self._loop is None:
            return
        self._loop.change_parameters(parameters)
        target_m, limits = self._loop.goal.position_m, parameters.limits
        is_inside = target_m is None or limits.soft_min <= target_m <= limits.soft_max
        if limits.has_soft_limits and not is_inside and not self._loop.holds:
            why = f'the target {target_m:g} m is outside the soft limits, which have changed'
            self.end(Outcome(Result.RANGE_LIMIT_REACHED, why), observation)

    def forget_start(self) -> None:
        """Know no longer where the running move began: the position has another zero."""
        if self._running is not None:
            self._running = replace(self._running, start_m=None)

    def _close_loop(self, command: Identity, goal: Goal, observation: Observation) -> None:
        self._running = Running(command, None)
        self._loop = ClosedLoop(self._parameters, goal, observation)
        self._follow(level(observation.voltage_v))

    def jog(self, command: Identity, wave: Wave | None, observation: Observation) -> None:
        """Start to jog, go on with it, at another rate or not; without a wave, end it."""
        running = self._running
        if running is None or running.command.name != command.name:
            if wave is None:
                self._report(command, Result.DONE, 'no jog was running', 0, None)
                return
            self._make_way(command, observation)
            self._running = Running(command, wave, start_m=observation.reading_m)
            self._follow(wave)
        elif wave is None:
            self._come_to_rest(f'ended by command {command.number}', observation)
            return
        elif wave[RAMP_FIELDS] != self.wave[RAMP_FIELDS]:
            self.replaced += 1
            steps = running.steps + observation.cycles
            changed = replace(running, wave=wave, steps=steps)
            turns = changed.direction != running.direction
            self._running = replace(changed, start_m=None) if turns else changed
            self._follow(wave)
        self._renewed_ns = observation.time_ns
        self._stop_beyond_soft_limit(observation)

    def watch(self, observation: Observation) -> None:
        """Look at the stand after a block: go on, or end the move."""
        if self._running is None:
            return
        if self._stop_beyond_soft_limit(observation):
            return
        loop, is_jog = self._loop, self._is_jog
        needs_renewal = is_jog or (loop is not None and loop.goal.direction != 0)
        timeout_ns = to_nanoseconds(self._parameters.jog.timeout)
        if needs_renewal and observation.time_ns >= self._renewed_ns + timeout_ns:
            self._come_to_rest('jog.timeout passed without a new command', observation)
        elif loop is not None:
            self._go_on(loop, observation)
        elif not is_jog and observation.arrived:
            self.end(Outcome(Result.DONE), observation)

    def end(self, outcome: Outcome, observation: Observation) -> None:
        """End the running move, if there is one, and hold its present voltage."""
        running, loop = self._running, self._loop
        self._running = self._loop = None
        if running is None:
            return
        if outcome.result is not Result.DONE:
            self._follow(level(observation.voltage_v))
        if outcome.result in FAILURES:
            self._failed = Status.MOVEMENT_FAILED | FAILURES[outcome.result]
        if loop is None:
            steps = running.steps + observation.cycles if running.is_cyclic else 0
            start_m, end_m, step_m = running.start_m, observation.reading_m, None
            if running.direction and steps and start_m is not None and end_m is not None:
                step_m = running.direction * (end_m - start_m) / steps
            self._report(running.command, outcome.result, outcome.why, steps, step_m)
        elif not loop.holds:
            self._report(running.command, outcome.result, outcome.why, 0, loop.step_m)
        elif outcome.result in FAILURES:
            hold = running.command._replace(name=_HOLD)
            self._report(hold, outcome.result, outcome.why, 0, loop.step_m)

    def _make_way(self, command: Identity, observation: Observation) -> None:
        """End the running move; not reported of a set-point that its sender replaces."""
        running, loop = self._running, self._loop
        is_next = running is not None and _continues(running.command, command)
        if not is_next or command.name not in _SET_POINTS:
            why = f'replaced by command {command.number}'
            self.end(Outcome(Result.ABORTED, why), observation)
        else:
            self.replaced += loop is None or not loop.holds
            self._running = self._loop = None
        self._failed = Status(0)

    def _follow(self, wave: Wave) -> None:
        self.wave = wave
        self.is_new = True

    def _come_to_rest(self, why: str, observation: Observation) -> None:
        self._follow(level(observation.voltage_v))
        self.end(Outcome(Result.DONE, why), observation)

    def _go_on(self, loop: ClosedLoop, observation: Observation) -> None:
        held = loop.holds
        wave, outcome = loop.update(observation)
        if wave is not None:
            self._follow(wave)
        if outcome is None:
            return
        if outcome.result is not Result.DONE:
            self.end(outcome, observation)
        elif self._running is not None and not held:
            self._report(self._running.command, Result.DONE, '', 0, loop.step_m)
            if not self._parameters.closed_loop.hold:
                self._running = self._loop = None

    def _stop_beyond_soft_limit(self, observation: Observation) -> bool:
        """End steps that lead out of the soft limits, or begin beyond them; tell whether."""
        limits, running, loop = self._parameters.limits, self._running, self._loop
        if running is None or not limits.has_soft_limits:
            return False
        direction = running.direction if loop is None else loop.goal.direction
        if direction > 0 and observation.position_m > limits.soft_max:
            side = f'above limits.soft_max {limits.soft_max:g} m'
        elif direction < 0 and observation.position_m < limits.soft_min:
            side = f'below limits.soft_min {limits.soft_min:g} m'
        else:
            return False
        why = f'{observation.position_m:.6g} m is {side}'
        # A wave that has not begun yet has made no ramp, whatever the one before it made.
        cycles = 0 if self.is_new else observation.cycles
        self.end(Outcome(Result.RANGE_LIMIT_REACHED, why), observation._replace(cycles=cycles))
        return True


def _continues(running: Identity, command: Identity) -> bool:
    """Return whether a command is of the topic and the sender of the running one."""
    return (running.name, running.tag) == (command.name, command.tag)
