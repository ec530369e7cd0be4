# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The 0-amplitude: the stroke of the feet below which a free runner does not advance.

Three methods: Edeler's line through step length against amplitude, extrapolated to a step of zero;
the smallest amplitude with a net step; and, with a load cell, the onset of generated force.

"""

import math
from collections.abc import Generator
from dataclasses import dataclass
from functools import partial

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.build import friction_limit_n
from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.drive.long_step import LANES
from stickslip_ros.errors import OutOfRange
from stickslip_ros.lab.runs.batch import Progress, run_courses
from stickslip_ros.lab.runs.courses import Course, bundle_for, run_course
from stickslip_ros.lab.runs.sawtooth_run import drive_course, full_stroke_m
from stickslip_ros.parameters import Parameters, checked_arguments
from stickslip_ros.progress import progress_of
from stickslip_ros.sections import NotebookView, Section, report_field, rows_of

WITHOUT_CELL = {'load_cell.contact': 'absent'}  # changes for a free runner
_STEPS_MIN = 10
STEP_MIN_M = 1e-10  # smallest net step, the resolution of the interferometer
SCAN_POINTS = 32  # amplitudes up to the full stroke in the search for the first net step
BISECTIONS = 10  # halvings of the found interval: 5 nm become 5 pm
FIT_POINTS = 17  # amplitudes of the line, over the upper half of the stepping range
RUNS = SCAN_POINTS + BISECTIONS + FIT_POINTS  # at most
ONSET_SHARE = 0.01  # force without elastic following that counts, as a share of the friction limit
ONSET_HALVINGS = 9  # halvings of the amplitude range: 160 nm become 0.3 nm


@dataclass(frozen=True, kw_only=True)
class ZeroAmplitude(NotebookView):
    """
    The 0-amplitude of a drive.

    Attributes
    ----------
    zero_amplitude_m : float
        By Edeler's extrapolation.
    slope : float
        Step length per amplitude along the line.
    method : str
        Methods and amplitudes.
    zero_amplitude_direct_m : float
        Smallest amplitude with a net step above ``step_min_m``.
    max_presliding_lower_m : float
        u_max of the contact with the least friction, in the paper a lower one (Eq. 22); the
        largest, if several have it.
    fit_from_m, fit_to_m : float
        Range of the fitted line, with ``fit_points`` amplitudes.
    fit_rms_m : float
        Rms deviation from the line.
    step_min_m : float
        Threshold of a net step.

    """

    zero_amplitude_m: float = report_field("0-amplitude, Edeler's extrapolation", '.3f')
    slope: float = report_field('slope of step length', '.4f')
    method: str
    zero_amplitude_direct_m: float = report_field('0-amplitude, first net step', '.3f')
    max_presliding_lower_m: float = report_field('u_max of a lower contact', '.3f')
    preload_n: float
    frequency_hz: float
    fit_from_m: float = report_field('line fitted from', '.2f')
    fit_to_m: float = report_field('line fitted up to', '.2f')
    fit_rms_m: float = report_field('rms deviation from that line', '.4f')
    fit_points: int = report_field('amplitudes of the line', '.0f')
    steps: int
    step_min_m: float

    def sections(self) -> list[Section]:
        title = f'preload {self.preload_n:g} N, {self.frequency_hz:g} Hz, {self.steps} steps'
        return [Section(title, rows_of(self))]


@checked_arguments
def zero_amplitude(
    parameters: Parameters,
    frequency_hz: float = 200.0,
    *,
    steps: int = 120,
    workers: int = 0,
    progress: bool | Progress = False,
) -> ZeroAmplitude:
    """
    Find the 0-amplitude of a drive, without its load cell.

    Parameters
    ----------
    parameters : Parameters
        The stand.
    frequency_hz : float
        Steps per second, negative backwards.
    steps : int
        Steps of each run; its step length is the mean of the last ten.
    workers : int
        Runs at once; 0 is one per core.
    progress : bool or callable
        Show the progress, or call this with runs done and in total.

    Raises
    ------
    StickSlipError
        If the frequency is refused, or the runner steps at no amplitude.

    """
    asked, done = _asked(parameters, frequency_hz, steps), 0
    step_m = partial(_step_course, parameters, frequency_hz, steps)
    with progress_of(progress, 'runs') as show:

        def count(new: int, _: int) -> None:
            show(done + new, RUNS)

        found, bundle = next(asked), bundle_for(parameters.updated(WITHOUT_CELL))
        while not isinstance(found, ZeroAmplitude):
            steps_m = run_courses(step_m, found.tolist(), bundle, workers=workers, progress=count)
            done += len(steps_m)
            found = asked.send(np.array(steps_m))
        show(RUNS, RUNS)
    return found


def zero_amplitude_course(
    parameters: Parameters, frequency_hz: float, steps: int
) -> Course[ZeroAmplitude]:
    """Return the course of ``zero_amplitude``, with its runs in sequence."""
    asked = _asked(parameters, frequency_hz, steps)
    found = next(asked)
    while not isinstance(found, ZeroAmplitude):
        steps_m = list[float]()
        for amplitude_m in found.tolist():
            steps_m.append((yield from _step_course(parameters, frequency_hz, steps, amplitude_m)))
        found = asked.send(np.array(steps_m))
    return found


def _step_course(
    parameters: Parameters, frequency_hz: float, steps: int, amplitude_m: float
) -> Course[float]:
    """Return the course of the step length in the direction of the drive, m."""
    free = parameters.updated(WITHOUT_CELL)
    run = yield from drive_course(free, amplitude_m, frequency_hz, steps)
    return run.step_length_m if frequency_hz > 0.0 else -run.step_length_m


def _asked(
    parameters: Parameters, frequency_hz: float, steps: int
) -> Generator[Array | ZeroAmplitude, Array, None]:
    """Request step lengths at arrays of amplitudes; yield the 0-amplitude at last."""
    if steps < _STEPS_MIN:
        limit = f'below the minimum {_STEPS_MIN} (the first steps are irregular)'
        raise OutOfRange('steps', steps, '', limit, 'raise it')
    free = parameters.updated(WITHOUT_CELL)
    full_m = full_stroke_m(free)
    direct_m = yield from _first_step_m(full_m)
    middle_m = 0.5 * (direct_m + full_m)
    amplitudes_m: Array = np.linspace(middle_m, full_m, FIT_POINTS, dtype=np.float64)
    steps_m = yield amplitudes_m
    centre_m, mean_m = amplitudes_m.mean(), steps_m.mean()
    offsets_m = amplitudes_m - centre_m
    slope = float(np.sum(offsets_m * steps_m) / np.sum(offsets_m**2))
    if not slope > 0.0:
        hint = 'look at step lengths with: stickslip sweep --no-load-cell'
        raise OutOfRange('slope of step length', slope, '', 'not above 0', hint)
    least = min(contacts_of(free), key=lambda own: (own.max_force_n, -own.max_displacement_m))
    missed_m = steps_m - mean_m - slope * offsets_m
    method = (
        f"Edeler's extrapolation: straight line through the step lengths of a free runner at "
        f'{FIT_POINTS} amplitudes, {amplitudes_m[0]:.4g} to {full_m:.4g} m, the upper half of '
        f'those that step; direct: smallest amplitude with a net step above {STEP_MIN_M:g} m'
    )
    yield ZeroAmplitude(
        zero_amplitude_m=float(centre_m - mean_m / slope),
        slope=slope,
        method=method,
        zero_amplitude_direct_m=direct_m,
        max_presliding_lower_m=least.max_displacement_m,
        preload_n=free.stand.preload,
        frequency_hz=frequency_hz,
        fit_from_m=float(amplitudes_m[0]),
        fit_to_m=full_m,
        fit_rms_m=float(np.sqrt(np.mean(missed_m**2))),
        fit_points=FIT_POINTS,
        steps=steps,
        step_min_m=STEP_MIN_M,
    )


@checked_arguments
def force_onset_m(parameters: Parameters, frequency_hz: float, threshold_n: float = 0.0) -> float:
    """
    Return the amplitude from which force is generated, m; NaN without force.

    Parameters
    ----------
    parameters : Parameters
        The stand, with a load cell.
    frequency_hz : float
        Steps per second.
    threshold_n : float
        Net force, without elastic following, that counts as force, N; 0 is 1 % of the friction
        limit. The amplitude is found by bisection to 1/512 of the largest stroke.

    Examples
    --------
    >>> onset_m = force_onset_m(Parameters(), frequency_hz=200.0)
    >>> f'{1e9 * onset_m:.0f} nm'
    '69 nm'

    """
    return run_course(onset_course(parameters, frequency_hz, threshold_n))


def onset_course(
    parameters: Parameters, frequency_hz: float, threshold_n: float = 0.0
) -> Course[float]:
    """Return the course of ``force_onset_m``."""
    wanted_n = threshold_n or ONSET_SHARE * friction_limit_n(parameters)
    below_m, above_m = 0.0, full_stroke_m(parameters)
    run = yield from drive_course(parameters, above_m, frequency_hz)
    if not run.force_net_n > wanted_n:
        return math.nan
    for _ in range(ONSET_HALVINGS):
        middle_m = 0.5 * (below_m + above_m)
        run = yield from drive_course(parameters, middle_m, frequency_hz)
        has_begun = run.force_net_n > wanted_n
        below_m, above_m = (below_m, middle_m) if has_begun else (middle_m, above_m)
    return above_m


def _first_step_m(full_m: float) -> Generator[Array | ZeroAmplitude, Array, float]:
    """Request step lengths; return the smallest amplitude with a net step, m."""
    grid_m: Array = np.linspace(0.0, full_m, SCAN_POINTS + 1, dtype=np.float64)
    for first in range(0, SCAN_POINTS, LANES):
        stepping = np.flatnonzero((yield grid_m[1 + first : 1 + first + LANES]) > STEP_MIN_M)
        if len(stepping):
            break
    else:
        limit = f'too small for a step: none above {STEP_MIN_M:g} m'
        raise OutOfRange('stroke', full_m, 'm', limit, 'lower stand.preload')
    below_m, above_m = grid_m[first + stepping[0]], grid_m[first + stepping[0] + 1]
    for _ in range(BISECTIONS):
        middle_m = 0.5 * (below_m + above_m)
        if (yield np.array([middle_m]))[0] > STEP_MIN_M:
            above_m = middle_m
        else:
            below_m = middle_m
    return float(above_m)
