# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Moves of the piezo: the wave of the amplifier, and the end of every move."""

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
    Result.CORNER_LIMIT_REACHED: Status(0),
    Result.TIMEOUT: Status(0),
    Result.NO_SENSOR: Status(0),
    Result.AMPLIFIER_DISABLED: Status(0),
}
"""Results of a failed move, and the bit that each sets in addition to MOVEMENT_FAILED."""
RAMP_FIELDS = slice(3)
"""Fields of a wave that define its ramps; jogs at different rates differ in these."""
_SET_POINTS = ('voltage', 'position')
"""Moves to a set point; a next set point of the same topic replaces it without an event."""
_HOLD = 'hold'
"""Name of the end of a hold in its event."""


@dataclass(frozen=True)
class Running:
    """The running move."""

    command: Identity  # its command
    wave: Wave | None  # its wave; None in closed loop
    steps: int = 0  # steps of a jog at earlier rates
    # position reading at its start, m; None without a reading, or if steps differ in length
    start_m: float | None = None

    @property
    def direction(self) -> int:
        """+1 or -1 for steps, else 0; soft limits stop steps."""
        rise_v = 0.0 if self.wave is None else self.wave.rise_v
        return (rise_v > 0.0) - (rise_v < 0.0)

    @property
    def is_cyclic(self) -> bool:
        """Whether its ramps or cycles are counted."""
        return self.direction != 0 or (self.wave is not None and repeats(self.wave))


Report = Callable[[Identity, Result, str, int, float | None], None]
"""Receives the end of a move: command, result, reason, number of steps and their length, m."""


class Motion:
    """The moves of one drive."""

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
        self.replaced = 0  # set points replaced by the next one of their topic
        self.reset(float(parameters.amplifier.voltage_initial))

    def reset(self, voltage_v: float) -> None:
        """Drop every move and hold a voltage."""
        self._running: Running | None = None
        self._loop: ClosedLoop | None = None
        self._renewed_ns = 0
        self._failed = Status(0)
        self._follow(level(voltage_v))

    def recall(self, values: dict[str, Any]) -> None:
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
        """Whether the move may end before its wave: closed loop, jog, soft limits."""
        return self._is_jog or self._loop is not None or self._parameters.limits.has_soft_limits

    @property
    def status_bits(self) -> int:
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
        """For a trajectory: set point and reading of the last block; safe in other threads."""
        loop = self._loop
        return None if loop is None else loop.followed

    def start(self, command: Identity, wave: Wave, observation: Observation) -> None:
        """Replace the running move by a wave; a table waits for the end of a table's cycle."""
        before, has_begun = self.wave, not self.is_new or self.wave.lead_s > 0.0
        repeating = has_begun and repeats(before) and observation.cycles < before.cycles
        if len(wave.rows) and repeating:
            wave = after(before, observation.ramp_s, wave)
        self._end_previous(command, observation)
        self._running = Running(command, wave, start_m=observation.reading_m)
        self._follow(wave)
        self._stop_beyond_soft_limit(observation)

    def approach(self, command: Identity, goal: Goal, observation: Observation) -> None:
        """Replace the running move by a goal of the closed loop."""
        self._end_previous(command, observation)
        self._close_loop(command, goal, observation)

    def pursue(self, command: Identity, goal: Goal, observation: Observation) -> None:
        """Change the goal of this command's closed loop, or start it."""
        running, loop = self._running, self._loop
        if running is None or loop is None or not _continues(running.command, command):
            self._end_previous(command, observation)
            self._close_loop(command, goal, observation)
        else:
            was_holding = loop.holds
            if loop.pursue(goal, observation):
                self.replaced += not was_holding
                self._running = replace(running, command=command)
        self._renewed_ns = observation.time_ns
        self._stop_beyond_soft_limit(observation)

    def change_parameters(self, parameters: Parameters, observation: Observation) -> None:
        """Change live parameters; end a move to a target that they exclude."""
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
        """Forget the start position of the running move, because the zero has changed."""
        if self._running is not None:
            self._running = replace(self._running, start_m=None)

    def _close_loop(self, command: Identity, goal: Goal, observation: Observation) -> None:
        self._running = Running(command, None)
        self._loop = ClosedLoop(self._parameters, goal, observation)
        self._follow(level(observation.voltage_v))

    def jog(self, command: Identity, wave: Wave | None, observation: Observation) -> None:
        """Start a jog, or renew it and change its rate; without a wave, end it."""
        running = self._running
        if running is None or running.command.name != command.name:
            if wave is None:
                self._report(command, Result.DONE, 'no jog was running', 0, None)
                return
            self._end_previous(command, observation)
            self._running = Running(command, wave, start_m=observation.reading_m)
            self._follow(wave)
        elif wave is None:
            self._finish(f'ended by command {command.number}', observation)
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
        """Continue or end the move after a block."""
        if self._running is None:
            return
        if self._stop_beyond_soft_limit(observation):
            return
        loop, is_jog = self._loop, self._is_jog
        needs_renewal = is_jog or (loop is not None and loop.goal.direction != 0)
        timeout_ns = to_nanoseconds(self._parameters.jog.timeout)
        if needs_renewal and observation.time_ns >= self._renewed_ns + timeout_ns:
            self._finish('jog.timeout passed without a new command', observation)
        elif loop is not None:
            self._continue_loop(loop, observation)
        elif not is_jog and observation.arrived:
            self.end(Outcome(Result.DONE), observation)

    def end(self, outcome: Outcome, observation: Observation) -> None:
        """End the running move, if any, and hold its present voltage."""
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

    def _end_previous(self, command: Identity, observation: Observation) -> None:
        """End the running move; without an event if its sender replaces a set point."""
        running, loop = self._running, self._loop
        is_next = running is not None and _continues(running.command, command)
        # A stream of set points would otherwise give an event for each message.
        if not is_next or command.name not in _SET_POINTS:
            why = f'replaced by command {command.number}'
            self.end(Outcome(Result.ABORTED, why), observation)
        else:
            self.replaced += loop is None or not loop.holds
            self._running = self._loop = None
        self._failed = Status(0)

    def _follow(self, wave: Wave) -> None:
        self.wave = wave  # of the amplifier
        self.is_new = True  # its clock must be started

    def _finish(self, why: str, observation: Observation) -> None:
        self._follow(level(observation.voltage_v))
        self.end(Outcome(Result.DONE, why), observation)

    def _continue_loop(self, loop: ClosedLoop, observation: Observation) -> None:
        was_holding = loop.holds
        wave, outcome = loop.update(observation)
        if wave is not None:
            self._follow(wave)
        if outcome is None:
            return
        if outcome.result is not Result.DONE:
            self.end(outcome, observation)
        elif self._running is not None and not was_holding:
            self._report(self._running.command, Result.DONE, '', 0, loop.step_m)
            if not self._parameters.closed_loop.hold:
                self._running = self._loop = None

    def _stop_beyond_soft_limit(self, observation: Observation) -> bool:
        """End steps that leave the soft limits or start beyond them; return whether ended."""
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
        # A new wave has made no ramp yet; the observed cycles are those of the previous wave.
        cycles = 0 if self.is_new else observation.cycles
        self.end(Outcome(Result.RANGE_LIMIT_REACHED, why), observation._replace(cycles=cycles))
        return True


def _continues(running: Identity, command: Identity) -> bool:
    """Return whether a command has the topic and the sender of the running command."""
    return (running.name, running.tag) == (command.name, command.tag)
