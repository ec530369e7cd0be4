"""
Every loop over time comes to its end: its passes are counted, and beyond a bound the drive stops.

Whoever proposes a stretch or a step of time takes care that it moves the clock. Should one of them
not do so, the loops end all the same, and the drive fails with the state that led there.

"""

import math

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.record import Record
from stickslip_ros.errors import StickSlipError

PASSES_MIN = 100_000
"""Passes that any stretch of time may take, however short: its longest falls have a hundredth."""
PASSES_PER_STEP = 1_000
"""Passes that it may take besides, for each of the longest steps that it holds."""
PASSES_PER_ROW = 4
"""Passes that it may take besides, for each row of a waveform's table: 2 are needed."""


@kernel
def allow_passes(plant: Record, state: Record, rows: int, duration_s: float) -> None:
    """Say how many passes a duration may take; none, if the drive has given up."""
    if state.passes_left >= 0:
        steps = int(min(duration_s / plant.dt_s, 1e12))
        state.passes_left = PASSES_MIN + PASSES_PER_STEP * steps + PASSES_PER_ROW * rows


@kernel
def may_pass(state: Record) -> bool:
    """Count a pass; tell whether it may be made."""
    state.passes_left -= 1
    state.passes_made += 1
    return bool(state.passes_left >= 0)


def check_motion(states: Record, load_n: float) -> None:
    """
    Refuse to go on with a drive that has given up, or whose motion is not finite.

    Parameters
    ----------
    states : array of one record of STATE
        Where the drive is.
    load_n : float
        External force on the runner, N.

    Raises
    ------
    StickSlipError
        With the state that led there.

    """
    if states['passes_left'].item() < 0:
        raise StickSlipError(
            f'time stands still after {states[0].passes_made} passes, {_place(states, load_n)}; '
            'bring sim.dt, bandwidth, resonance and preload nearer to their defaults, and report '
            'this line'
        )
    if not math.isfinite(states['position_m'].item() + states['velocity_m_per_s'].item()):
        raise StickSlipError(
            f'the motion is no longer finite, {_place(states, load_n)}; lower sim.dt, or bring '
            'mass, damping and stiffnesses nearer to each other'
        )


def _place(states: Record, load_n: float) -> str:
    names = ('voltage_v', 'foot_m', 'position_m', 'velocity_m_per_s')
    voltage_v, foot_m, position_m, velocity_m_per_s = (states[name].item() for name in names)
    ramp_s, cycle, *_ = states['clock'].item()
    return (
        f'at {voltage_v!r} V, foot {foot_m!r} m, runner {position_m!r} m and '
        f'{velocity_m_per_s!r} m/s, load {load_n!r} N, {ramp_s!r} s into ramp {cycle}'
    )
