# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Position control of a stick-slip stage: coarse steps, then a fine scan, then hold.

The loop turns position readings into steps or voltages, and does not depend on drive or node. The
built-in closed loop runs it inside the instrument.

"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from stickslip_ros.parameters import Parameters

_REACH = 1.3
"""Largest error for a scan, per remaining stroke. At its end, a jump to the middle often leaves
the runner nearer to the target than a step."""
CENTRES_MAX = 2
"""Largest number of jumps to the middle between two steps; a sticking runner returns each time."""
COARSE_SHARE = 0.9
"""Share of the way covered by a burst of steps, as step lengths are estimates."""
LEARN_STEPS = 5
"""Least number of steps to learn the step length; the first starts from another voltage."""
SCAN_MAX = 0.05
"""Largest voltage change of an update of the scan, per range; a jump that is short compared with
the presliding displacement does not slip."""
_MARGIN = 0.08
"""Share of the range at either end in which the loop does not rest, as creep would soon bring the
piezo to its end."""
BURST_MAX = 2**31 - 1
"""Most steps of a burst, as a message is limited."""
STEP_LEAST = 0.05
"""Least accepted step length, per stroke."""


@dataclass(frozen=True)
class Steps:
    """Action: make a number of steps; the sign is the direction."""

    count: int


@dataclass(frozen=True)
class Level:
    """Action: go to a voltage, V."""

    voltage_v: float


@dataclass(frozen=True)
class LoopSettings:
    """Settings of the loop."""

    gain_m_per_v: float  # foot displacement per volt, m/V
    # range of the scan, V
    voltage_min_v: float
    voltage_max_v: float
    step_v: float  # amplitude of a step from ``voltage_min_v``, V
    share: float  # share of the error that an update of the scan corrects, 0 to 1
    deadband_m: float  # error that is accepted when the piezo is at its end, m


def loop_settings(parameters: Parameters) -> LoopSettings:
    """Return the settings for a stand, with an update in each block."""
    amplifier, closed_loop = parameters.amplifier, parameters.closed_loop
    return LoopSettings(
        gain_m_per_v=parameters.actuator.gain,
        voltage_min_v=amplifier.voltage_min,
        voltage_max_v=amplifier.voltage_max,
        step_v=min(parameters.step.amplitude, amplifier.range_v),
        share=min(1.0, closed_loop.gain * parameters.sim.block),
        deadband_m=closed_loop.tolerance,
    )


class PositionLoop:
    """Choose the next action from each position reading."""

    REMEMBERED: ClassVar[Mapping[str, Any]] = {
        'voltage_v': float,
        'is_coarse': bool,
        'learned_m': float | None,
        '_step_m': float,
        '_burst': range(-BURST_MAX, BURST_MAX + 1),
        '_before_m': float,
        '_centres': int,
        '_rests': bool,
    }
    _centres: int
    _rests: bool

    def __init__(self, settings: LoopSettings, voltage_v: float) -> None:
        self.settings = settings
        self.voltage_v = voltage_v  # expected at the piezo
        self.is_coarse = True  # whether the last action was steps or a jump, not a scan
        self.learned_m: float | None = None  # step length of the last long burst
        self._step_m = self._stroke_m(settings.step_v)
        self._burst = 0
        self._before_m = 0.0
        self.reset_attempts()

    def recall(self, values: dict[str, Any]) -> None:
        """Restore values from a checkpoint; the stroke may differ."""
        vars(self).update(values)
        self.rescale(self.settings)

    def rescale(self, settings: LoopSettings) -> None:
        """Take other settings; the expected step stays within the stroke."""
        self.settings = settings
        self._set_step(self._step_m)

    def update(self, target_m: float, position_m: float) -> Steps | Level:
        """Return the next action after the end of the last action."""
        self._learn(position_m)
        error_m = target_m - position_m
        self.is_coarse = not self._may_scan(error_m)
        may_centre = self._centres < CENTRES_MAX and abs(error_m) <= _REACH * self._half_scan_m()
        if not self.is_coarse and abs(error_m) <= self.settings.deadband_m:
            self.is_coarse = may_centre and not self._rests and self._is_near_end()
            self._rests = not self.is_coarse
        if not self.is_coarse:
            return self._scan(error_m)
        return self.centre() if may_centre else self._step(error_m, position_m)

    def has_overshot(self, target_m: float, position_m: float) -> bool:
        """Return whether a burst is a stroke beyond its target; then double the step length."""
        error_m = target_m - position_m
        stroke_m = self._stroke_m(self.settings.step_v)
        if self._burst * error_m >= 0.0 or abs(error_m) <= stroke_m:
            return False
        self._burst = 0
        self._step_m = min(2.0 * self._step_m, stroke_m)
        return True

    def overshoots(self, target_m: float) -> bool:
        """Return whether the present burst is expected to end beyond a new target."""
        end_m = self._before_m + self._burst * self._step_m
        return self._burst * (target_m - end_m) < 0.0

    def abort_burst(self, voltage_v: float) -> None:
        """Abort the present burst at a voltage, without learning from it."""
        self._burst = 0
        self.voltage_v = voltage_v

    def reset_attempts(self) -> None:
        self._centres = 0
        self._rests = False

    def centre(self) -> Level:
        """Jump to the middle of the range; the runner slips, or moves along and needs a step."""
        self._centres += 1
        self.voltage_v = 0.5 * (self.settings.voltage_min_v + self.settings.voltage_max_v)
        return Level(self.voltage_v)

    def _stroke_m(self, voltage_v: float) -> float:
        return self.settings.gain_m_per_v * voltage_v

    def _may_scan(self, error_m: float) -> bool:
        """Return whether a scan can correct an error; a started scan continues."""
        settings = self.settings
        end_v = settings.voltage_max_v if error_m > 0.0 else settings.voltage_min_v
        room_m = self._stroke_m(abs(end_v - self.voltage_v))
        if not self.is_coarse and room_m > 0.0:
            return abs(error_m) <= 2.0 * self._half_scan_m()
        return abs(error_m) <= max(_REACH * room_m, settings.deadband_m)

    def _is_near_end(self) -> bool:
        low_v, high_v = self.settings.voltage_min_v, self.settings.voltage_max_v
        return min(self.voltage_v - low_v, high_v - self.voltage_v) < _MARGIN * (high_v - low_v)

    def _half_scan_m(self) -> float:
        """Return the reach of a scan from the middle, m."""
        settings = self.settings
        return 0.5 * self._stroke_m(settings.voltage_max_v - settings.voltage_min_v)

    def _scan(self, error_m: float) -> Level:
        settings = self.settings
        largest_v = SCAN_MAX * (settings.voltage_max_v - settings.voltage_min_v)
        change_v = settings.share * error_m / settings.gain_m_per_v
        wanted_v = self.voltage_v + min(max(change_v, -largest_v), largest_v)
        self.voltage_v = min(max(wanted_v, settings.voltage_min_v), settings.voltage_max_v)
        return Level(self.voltage_v)

    def _step(self, error_m: float, position_m: float) -> Steps:
        self.reset_attempts()
        settings = self.settings
        way_m = COARSE_SHARE * (abs(error_m) - self._half_scan_m())
        count = max(1, math.floor(min(way_m / self._step_m, BURST_MAX)))
        forwards = error_m > 0.0
        self.voltage_v = settings.voltage_min_v + (0.0 if forwards else settings.step_v)
        self._burst = count if forwards else -count
        self._before_m = position_m
        return Steps(self._burst)

    def _learn(self, position_m: float) -> None:
        """Learn the step length from the finished burst, unless the runner was pushed back."""
        burst, self._burst = self._burst, 0
        way_m = position_m - self._before_m
        if abs(burst) < LEARN_STEPS or way_m * burst <= 0.0:
            return
        self.learned_m = way_m / burst
        self._set_step(self.learned_m)

    def _set_step(self, step_m: float) -> None:
        stroke_m = self._stroke_m(self.settings.step_v)
        self._step_m = min(max(step_m, STEP_LEAST * stroke_m), stroke_m)
