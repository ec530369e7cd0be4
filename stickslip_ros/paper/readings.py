"""Quantities of the figures: generated force, 0-amplitudes, presliding."""

import math
from collections.abc import Mapping

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.drive.build import UPPER_CONTACTS, contacts_of, friction_limit_n
from stickslip_ros.parameters import Parameters
from stickslip_ros.runs.sawtooth_run import run_drive

PRELOADS_N = (0.1, 0.5, 1.0)
AMPLITUDE_MAX_M = 160e-9
STEP_FREQUENCY_HZ = 200.0
STEP_RUN_STEPS = 120
STEP_AMPLITUDES_M: Array = np.array([100e-9, 120e-9, 140e-9, 160e-9])
"""Amplitudes of Edeler's extrapolation, all above the 0-amplitude of 1 N."""
SLOPE_MIN = 0.5
"""Below this slope of step length over amplitude there is no line to extrapolate."""
PRESLIDING_HALVINGS = 50
ZERO_STEP_S = 1e-5
"""Time step of runs that only look for a 0-amplitude; a tenth of it moves none by 0.1 nm."""


def stand_at(
    parameters: Parameters, preload_n: float, changes: Mapping[str, object] | None = None
) -> Parameters:
    """Return parameters at a constant preload, with these changes."""
    preload = {'stand.preload': preload_n, 'stand.preload_end': 0.0}
    return parameters.updated({**preload, **(changes or {})})


def max_presliding_m(parameters: Parameters) -> tuple[float, float]:
    """Return u_max of a lower and of an upper contact, m (Eq. 22)."""
    contacts = contacts_of(parameters)
    return contacts[UPPER_CONTACTS].max_displacement_m, contacts[0].max_displacement_m


def zero_by_steps_m(parameters: Parameters, frequency_hz: float) -> tuple[float, float]:
    """
    Return Edeler's 0-amplitude, m, and the slope of the line through the step lengths.

    Step length of the free runner over amplitude is extrapolated to a step of zero. Where the
    slope is so small that there is no line, the 0-amplitude is not a number.

    """
    free = parameters.updated({'load_cell.contact': 'absent', 'sim.dt': ZERO_STEP_S})
    steps_m = [
        run_drive(free, float(amplitude_m), frequency_hz, STEP_RUN_STEPS).step_length_m
        for amplitude_m in STEP_AMPLITUDES_M
    ]
    offsets_m = STEP_AMPLITUDES_M - STEP_AMPLITUDES_M.mean()
    slope = float(np.sum(offsets_m * steps_m) / np.sum(offsets_m**2))
    if slope < SLOPE_MIN:
        return math.nan, slope
    return float(STEP_AMPLITUDES_M.mean() - np.mean(steps_m) / slope), slope


def quasi_static_zero_m(parameters: Parameters) -> float:
    """
    Return the 0-amplitude of a runner that comes back to rest without overshoot, m.

    The fall drags the feet along under a runner at rest, until all contacts slip at their
    limit T_max. The runner then gives way until no force is left: by Masing's rule over
    2 T_v^-1(T_max/2), T_v the virgin curve of all contacts together. What the amplitude exceeds
    that, is the step. No inertia, no rebound.

    """
    contacts = contacts_of(parameters)
    half_n = 0.5 * friction_limit_n(parameters)
    below_m, above_m = 0.0, max_presliding_m(parameters)[1]
    for _ in range(PRESLIDING_HALVINGS):
        middle_m = 0.5 * (below_m + above_m)
        force_n = sum(float(contact.tangential_force(middle_m)) for contact in contacts)
        below_m, above_m = (middle_m, above_m) if force_n < half_n else (below_m, middle_m)
    return below_m + above_m
