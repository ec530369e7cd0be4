"""Quantities of the figures: generated force, 0-amplitudes, presliding."""

import math
from collections.abc import Callable, Mapping

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.drive.build import UPPER_CONTACTS, contacts_of, friction_limit_n
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.sawtooth_run import RunResult, run_drive

PRELOADS_N = (0.1, 0.5, 1.0)
AMPLITUDE_MAX_M = 160e-9
STEP_FREQUENCY_HZ = 200.0
STEP_RUN_STEPS = 120
STEP_AMPLITUDES_M: Array = np.array([100e-9, 120e-9, 140e-9, 160e-9])
"""Amplitudes of Edeler's extrapolation, all above the 0-amplitude of 1 N."""
SLOPE_MIN = 0.5
"""Below this slope of step length over amplitude there is no line to extrapolate."""
ONSET_SHARE = 0.01
"""Force begins where it exceeds the elastic following by this share of the friction limit."""
LAST_RISE_M = 20e-9
"""Saturation is read over the last stretch of amplitudes of this length."""
ONSET_HALVINGS = 9
"""Halvings of the range of amplitudes: 160 nm become 0.3 nm."""
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


def last_rise(parameters: Parameters, frequency_hz: float, full: RunResult | None = None) -> float:
    """
    Return by which share the net force rises over the last amplitudes; 0 is saturation.

    Not a number where more than half of the mean force is elastic following. ``full`` is the run
    over AMPLITUDE_MAX_M where it is there already.

    """
    full = full or run_drive(parameters, AMPLITUDE_MAX_M, frequency_hz)
    before = run_drive(parameters, AMPLITUDE_MAX_M - LAST_RISE_M, frequency_hz)
    if full.force_net_n < 0.5 * full.force_mean_n:
        return math.nan
    return full.force_net_n / before.force_net_n - 1.0


def zero_of_force_m(
    parameters: Parameters,
    frequency_hz: float,
    step_s: float = ZERO_STEP_S,
    threshold_n: float = 0.0,
) -> float:
    """
    Return the amplitude at which force begins to be generated, m, with runs of this time step.

    Below it the runner follows the feet elastically, and the mean force is about k A/2; for a
    stiff load cell less, as the sticking contacts give way. What exceeds it must reach a
    threshold: ONSET_SHARE of the friction limit unless one is given. The amplitude is found by
    bisection; not a number if no force is generated at the largest one.

    """
    quick = parameters.updated({'sim.dt': step_s})
    threshold_n = threshold_n or ONSET_SHARE * friction_limit_n(parameters)
    stick_n_per_m = sum(c.stick_stiffness_n_per_m for c in contacts_of(parameters))
    cell_n_per_m = parameters.load_cell.stiffness
    following_n_per_m = 0.5 / (1.0 / cell_n_per_m + 1.0 / stick_n_per_m)

    def net_n(amplitude_m: float) -> float:
        force_n = run_drive(quick, amplitude_m, frequency_hz).force_mean_n
        return force_n - following_n_per_m * amplitude_m

    return first_amplitude_m(net_n, threshold_n)


def first_amplitude_m(force_n: Callable[[float], float], threshold_n: float) -> float:
    """Return the amplitude from which a force exceeds a threshold, m, by bisection; or nan."""
    below_m, above_m = 0.0, AMPLITUDE_MAX_M
    if not force_n(above_m) > threshold_n:
        return math.nan
    for _ in range(ONSET_HALVINGS):
        middle_m = 0.5 * (below_m + above_m)
        has_begun = force_n(middle_m) > threshold_n
        below_m, above_m = (below_m, middle_m) if has_begun else (middle_m, above_m)
    return above_m


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
