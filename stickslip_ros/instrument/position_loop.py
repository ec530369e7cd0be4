# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
How a stick-slip stage is brought to a position: coarse steps, then a fine scan, then hold.

The loop sees position readings and asks for steps or voltages; it knows neither drive nor node.
The built-in closed loop runs it inside the instrument.

"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from stickslip_ros.parameters import Parameters

_REACH = 1.3
"""A scan is tried up to so many times the stroke that is left: at its end, a jump back to the
middle often leaves the runner nearer to the target than a step would."""
CENTRES_MAX = 2
"""Jumps to the middle between two steps: a runner that sticks comes back with every one."""
COARSE_SHARE = 0.9
"""Share of the way that a burst of steps goes: step lengths are estimates."""
LEARN_STEPS = 5
"""Shortest burst that teaches the step length: its first step starts from another voltage."""
SCAN_MAX = 0.05
"""Largest voltage change of one update of the scan, per range: a jump that is short against the
presliding displacement does not slip."""
_MARGIN = 0.08
"""Share of the range at either end where the loop does not like to rest: creep would soon take
the piezo to its end."""
BURST_MAX = 2**31 - 1
"""Most steps of one burst: what a message can carry."""
STEP_LEAST = 0.05
"""Least step length that the loop believes, per stroke."""


@dataclass(frozen=True)
class Steps:
    """Make so many steps; the sign is the direction."""

    count: int


@dataclass(frozen=True)
class Level:
    """Go to a voltage, V."""

    voltage_v: float


@dataclass(frozen=True)
class LoopSettings:
    """
    What the loop knows of the stage.

    Attributes
    ----------
    gain_m_per_v : float
        Foot displacement per volt, m/V.
    voltage_min_v, voltage_max_v : float
        Range of the scan, V.
    step_v : float
        Amplitude of a step, V, from ``voltage_min_v`` on.
    share : float
        Share of the error that one update of the scan takes back, 0 to 1.
    deadband_m : float
        Error that is left alone when the piezo is at its end, m.

    """

    gain_m_per_v: float
    voltage_min_v: float
    voltage_max_v: float
    step_v: float
    share: float
    deadband_m: float


def loop_settings(parameters: Parameters) -> LoopSettings:
    """Return what the parameters of a stand say of its stage; one update per block."""
    amplifier, closed_loop = parameters.amplifier, parameters.closed_loop
    return LoopSettings(
        gain_m_per_v=parameters.actuator.gain,
        voltage_min_v=amplifier.voltage_min,
        voltage_max_v=amplifier.voltage_max,
        step_v=parameters.step.amplitude,
        share=min(1.0, closed_loop.gain * parameters.sim.block),
        deadband_m=closed_loop.tolerance,
    )


class PositionLoop:
    """
    Decide what to do next, from one reading after the other.

    Attributes
    ----------
    voltage_v : float
        Voltage at the piezo as the loop believes, V.
    is_coarse : bool
        Whether the last decision was a burst of steps or a jump, no scan.
    learned_m : float or None
        Way of the reading per step of the last burst that was long enough, m; None before.

    """

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
        self.voltage_v = voltage_v
        self.is_coarse = True
        self.learned_m: float | None = None
        self._step_m = self._stroke_m(settings.step_v)
        self._burst = 0
        self._before_m = 0.0
        self.start_anew()

    def recall(self, values: dict[str, Any]) -> None:
        """Remember what was read from a file; the stroke may be another one now."""
        vars(self).update(values)
        self._set_step(self._step_m)

    def update(self, target_m: float, position_m: float) -> Steps | Level:
        """
        Return what to do now; to be called when what was asked for before is over.

        Parameters
        ----------
        target_m, position_m : float
            Where the runner shall be, and the reading that says where it is, m.

        """
        self._learn(position_m)
        error_m = target_m - position_m
        self.is_coarse = not self._may_scan(error_m)
        may_centre = self._centres < CENTRES_MAX and abs(error_m) <= _REACH * self._half_scan_m()
        if not self.is_coarse and abs(error_m) <= self.settings.deadband_m:
            self.is_coarse = may_centre and not self._rests and self._is_at_an_end()
            self._rests = not self.is_coarse
        if not self.is_coarse:
            return self._scan(error_m)
        return self.centre() if may_centre else self._step(error_m, position_m)

    def passes(self, target_m: float, position_m: float) -> bool:
        """Return whether a burst is a stroke beyond its target: steps are longer than thought."""
        error_m = target_m - position_m
        stroke_m = self._stroke_m(self.settings.step_v)
        if self._burst * error_m >= 0.0 or abs(error_m) <= stroke_m:
            return False
        self._burst = 0
        self._step_m = min(2.0 * self._step_m, stroke_m)
        return True

    def leads_beyond(self, target_m: float) -> bool:
        """Return whether the burst under way is expected to end beyond another target."""
        end_m = self._before_m + self._burst * self._step_m
        return self._burst * (target_m - end_m) < 0.0

    def break_off(self, voltage_v: float) -> None:
        """Forget the burst under way, of which nothing is learned: it ends at this voltage."""
        self._burst = 0
        self.voltage_v = voltage_v

    def start_anew(self) -> None:
        """Forget what was tried for the last target."""
        self._centres = 0
        self._rests = False

    def centre(self) -> Level:
        """Jump to the middle: the runner slips under it, or comes along and needs another step."""
        self._centres += 1
        self.voltage_v = 0.5 * (self.settings.voltage_min_v + self.settings.voltage_max_v)
        return Level(self.voltage_v)

    def _stroke_m(self, voltage_v: float) -> float:
        return self.settings.gain_m_per_v * voltage_v

    def _may_scan(self, error_m: float) -> bool:
        """Return whether an error can be scanned away; a scan that has begun is continued."""
        settings = self.settings
        end_v = settings.voltage_max_v if error_m > 0.0 else settings.voltage_min_v
        room_m = self._stroke_m(abs(end_v - self.voltage_v))
        if not self.is_coarse and room_m > 0.0:
            return abs(error_m) <= 2.0 * self._half_scan_m()
        return abs(error_m) <= max(_REACH * room_m, settings.deadband_m)

    def _is_at_an_end(self) -> bool:
        """Return whether the piezo has hardly any way left on one side."""
        low_v, high_v = self.settings.voltage_min_v, self.settings.voltage_max_v
        return min(self.voltage_v - low_v, high_v - self.voltage_v) < _MARGIN * (high_v - low_v)

    def _half_scan_m(self) -> float:
        """Return how far a scan can go from the middle, m."""
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
        self.start_anew()
        settings = self.settings
        far_m = COARSE_SHARE * (abs(error_m) - self._half_scan_m())
        count = max(1, math.floor(min(far_m / self._step_m, BURST_MAX)))
        forwards = error_m > 0.0
        self.voltage_v = settings.voltage_min_v + (0.0 if forwards else settings.step_v)
        self._burst = count if forwards else -count
        self._before_m = position_m
        return Steps(self._burst)

    def _learn(self, position_m: float) -> None:
        """Take the step length from the burst that is over, unless something pushed it back."""
        burst, self._burst = self._burst, 0
        way_m = position_m - self._before_m
        if abs(burst) < LEARN_STEPS or way_m * burst <= 0.0:
            return
        self.learned_m = way_m / burst
        self._set_step(self.learned_m)

    def _set_step(self, step_m: float) -> None:
        stroke_m = self._stroke_m(self.settings.step_v)
        self._step_m = min(max(step_m, STEP_LEAST * stroke_m), stroke_m)
