"""
Every loop over time comes to its end: its passes are counted, and beyond a bound the drive stops.

Whoever proposes a stretch or a step of time takes care that it moves the clock. Should one of them
not do so, the loops end all the same, and the drive fails with the state that led there.

"""

import math

import numpy as np

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.profile import Array
from stickslip_ros.drive.records import DriveHistory, Plant, State
from stickslip_ros.errors import StickSlipError

LEFT, MADE = 0, 1
"""Columns of ``DriveHistory.passes``: passes that the loops may still make, below 0 once the drive
has given up; passes made since the start."""
PASSES_MIN = 100_000
"""Passes that any stretch of time may take, however short: its longest falls have a hundredth."""
PASSES_PER_STEP = 1_000
"""Passes that it may take besides, for each of the longest steps that it holds."""
PASSES_PER_ROW = 4
"""Passes that it may take besides, for each row of a waveform's table: 2 are needed."""


def fresh_passes() -> Array:
    """Return the count of a drive that has not begun, shape (2,)."""
    return np.array([PASSES_MIN, 0], dtype=np.int64)


@kernel
def allow_passes(plant: Plant, history: DriveHistory, rows: int, duration_s: float) -> None:
    """Say how many passes a duration may take; none, if the drive has given up."""
    passes = history.passes
    if passes[LEFT] >= 0:
        steps = int(min(duration_s / plant.dt_s, 1e12))
        passes[LEFT] = PASSES_MIN + PASSES_PER_STEP * steps + PASSES_PER_ROW * rows


@kernel
def may_pass(history: DriveHistory) -> bool:
    """Count a pass; tell whether it may be made."""
    history.passes[LEFT] -= 1
    history.passes[MADE] += 1
    return bool(history.passes[LEFT] >= 0)


@kernel
def has_given_up(history: DriveHistory) -> bool:
    """Tell whether the loops have made more passes than they may."""
    return bool(history.passes[LEFT] < 0)


def check_motion(history: DriveHistory, state: State, load_n: float) -> None:
    """
    Refuse to go on with a drive that has given up, or whose motion is not finite.

    Parameters
    ----------
    history : DriveHistory
        Holds the count of passes.
    state : State
        Where the drive is.
    load_n : float
        External force on the runner, N.

    Raises
    ------
    StickSlipError
        With the state that led there.

    """
    if history.passes[LEFT] < 0:
        raise StickSlipError(
            f'time stands still after {history.passes[MADE]} passes, {_place(state, load_n)}; '
            'bring sim.dt, bandwidth, resonance and preload nearer to their defaults, and report '
            'this line'
        )
    if not math.isfinite(state.position_m + state.velocity_m_per_s):
        raise StickSlipError(
            f'the motion is no longer finite, {_place(state, load_n)}; lower sim.dt, or bring '
            'mass, damping and stiffnesses nearer to each other'
        )


def _place(state: State, load_n: float) -> str:
    return (
        f'at {state.voltage_v!r} V, foot {state.foot_m!r} m, runner {state.position_m!r} m and '
        f'{state.velocity_m_per_s!r} m/s, load {load_n!r} N, {state.clock.ramp_s!r} s into ramp '
        f'{state.clock.cycle}'
    )
