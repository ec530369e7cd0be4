# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Figures 2, 6 and 7 of the paper: force, 0-amplitudes, presliding."""

import math
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure
from pandas import DataFrame

from stickslip_ros.arrays import Array
from stickslip_ros.drive.build import friction_limit_n
from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.errors import OutOfRange
from stickslip_ros.lab.figures.plotting import (
    BLACK,
    BLUE,
    GREY,
    PURPLE,
    VERMILION,
    curve_style,
    label_end,
)
from stickslip_ros.lab.measurements.sweep_table import Row
from stickslip_ros.lab.paper.figure import PaperFigure, RowRuns, assumed, surface
from stickslip_ros.lab.runs.courses import Course
from stickslip_ros.lab.runs.sawtooth_run import drive_course
from stickslip_ros.lab.runs.zero_amplitude import ONSET_SHARE, onset_course
from stickslip_ros.parameters import FeetParameters, Parameters
from stickslip_ros.units import MN, NM

PRELOADS_N = (0.1, 0.5, 1.0)
FIG2_PRELOADS_N = (0.1, 0.4, 0.7, 1.0)
AMPLITUDE_MAX_M = 160e-9
STEP_FREQUENCY_HZ = 200.0
STEP_RUN_STEPS = 120
STEP_AMPLITUDES_M: Array = np.array([100e-9, 120e-9, 140e-9, 160e-9])
"""Amplitudes of Edeler's extrapolation, above the 0-amplitude of 1 N."""
SLOPE_MIN = 0.5  # smallest slope of step length over amplitude for an extrapolation
PRESLIDING_HALVINGS = 50
ZERO_STEP_S = 1e-5  # time step for 0-amplitudes; a tenth of it changes none by 0.1 nm
PRELOAD_MIN_N, PRELOAD_MAX_N = 0.1, 1.0
PROFILES = ('rough', 'smooth')
_DRAWN_N = dict.fromkeys((*PRELOADS_N, *FIG2_PRELOADS_N))
_STYLES = {preload_n: number for number, preload_n in enumerate(_DRAWN_N)}  # of all figures
_CURVES = {
    'max_presliding_upper_m': (GREY, '', '--', '$u_{x,max}$ of an upper contact, $F_{n1}$'),
    'max_presliding_lower_m': (BLACK, '', '-', '$u_{x,max}$ of a lower contact, $F_{n2}$'),
    'zero_quasi_static_m': (PURPLE, '', ':', '0-amplitude without rebound, closed form'),
    'zero_steps_m': (VERMILION, 'o', '', '0-amplitude, step length extrapolated'),
    'zero_onset_m': (BLUE, 'x', '', '0-amplitude, onset of generated force'),
}
"""Colour, marker, line and label of each column."""


def stand_at(
    parameters: Parameters, preload_n: float, changes: Mapping[str, object] | None = None
) -> Parameters:
    """Return a stand at a constant preload, with changes."""
    preload = {'stand.preload': preload_n, 'stand.preload_end': 0.0}
    return parameters.updated({**preload, **(changes or {})})


def max_presliding_m(parameters: Parameters) -> tuple[float, float]:
    """Return u_max of a lower and of an upper contact of the paper, m (Eq. 22); refuse others."""
    if parameters.feet != FeetParameters():
        limit = 'not of the two upper and four lower feet of the paper, which Fig. 7 compares'
        hint = 'leave feet.* out, or draw other figures'
        raise OutOfRange('feet.count', list(parameters.feet.count), '', limit, hint)
    contacts = contacts_of(parameters)
    return contacts[-1].max_displacement_m, contacts[0].max_displacement_m


def zero_by_steps_m(parameters: Parameters, frequency_hz: float) -> Course[tuple[float, float]]:
    """Return Edeler's 0-amplitude, m (NaN below SLOPE_MIN), and the slope of its line."""
    free = parameters.updated({'load_cell.contact': 'absent', 'sim.dt': ZERO_STEP_S})
    steps_m = []
    for amplitude_m in STEP_AMPLITUDES_M.tolist():
        run = yield from drive_course(free, amplitude_m, frequency_hz, STEP_RUN_STEPS)
        steps_m.append(run.step_length_m)
    offsets_m = STEP_AMPLITUDES_M - STEP_AMPLITUDES_M.mean()
    slope = float(np.sum(offsets_m * steps_m) / np.sum(offsets_m**2))
    if slope < SLOPE_MIN:
        return math.nan, slope
    return float(STEP_AMPLITUDES_M.mean() - np.mean(steps_m) / slope), slope


def quasi_static_zero_m(parameters: Parameters) -> float:
    """
    Return the 0-amplitude of a runner that returns to rest without overshoot, m.

    The fall drags all contacts to their limit T_max under a resting runner, which then gives way
    until no force is left: by Masing's rule over 2 T_v^-1(T_max/2), T_v the virgin curve of all
    contacts. The rest of the amplitude is the step. No inertia, no rebound.

    """
    contacts = contacts_of(parameters)
    half_n = 0.5 * friction_limit_n(parameters)
    below_m, above_m = 0.0, max_presliding_m(parameters)[1]
    for _ in range(PRESLIDING_HALVINGS):
        middle_m = 0.5 * (below_m + above_m)
        each_n = {contact: float(contact.tangential_force(middle_m)) for contact in set(contacts)}
        force_n = sum(each_n[contact] for contact in contacts)
        below_m, above_m = (middle_m, above_m) if force_n < half_n else (below_m, middle_m)
    return below_m + above_m


def _force_row(parameters: Parameters, amplitude_m: float) -> Course[Row]:
    run = yield from drive_course(parameters, amplitude_m, parameters.step.frequency)
    return {
        'profile': parameters.contact.profile,
        'preload_n': run.preload_n,
        'amplitude_m': amplitude_m,
        'force_mean_n': run.force_mean_n,
        'force_net_n': run.force_net_n,
        'steady': run.steady,
        'steps': run.steps,
    }


def _draw_forces(table: DataFrame, figure: Figure) -> None:
    axes = figure.subplots()
    for preload_n in table['preload_n'].unique().tolist():
        rows = table[table['preload_n'] == preload_n]
        amplitudes_nm = rows['amplitude_m'].to_numpy() * NM
        forces_mn = rows['force_mean_n'].to_numpy() * MN
        how = curve_style(_STYLES[preload_n])
        [line] = axes.plot(amplitudes_nm, forces_mn, label=f'{preload_n:g} N', **how)
        label_end(axes, line, f'{forces_mn[-1]:.0f} mN')
    axes.set(xlabel='actuation amplitude (nm)', xlim=(0.0, AMPLITUDE_MAX_M * NM))
    axes.set(ylabel='generated force, mean of the last cycle (mN)', ylim=(0.0, None))
    axes.legend(loc='upper left', title='preload')


def _figure(name: str, shows: str, profile: str, preloads_n: Sequence[float]) -> PaperFigure:
    def stands(parameters: Parameters) -> list[Parameters]:
        return [stand_at(parameters, n, {'contact.profile': profile}) for n in preloads_n]

    def cases(parameters: Parameters, points: int) -> list[RowRuns]:
        amplitudes_m = np.linspace(0.0, AMPLITUDE_MAX_M, points)
        return [
            partial(_force_row, stand, float(a))
            for stand in stands(parameters)
            for a in amplitudes_m
        ]

    def caption(parameters: Parameters) -> str:
        limits = ', '.join(f'{friction_limit_n(s) * MN:.0f}' for s in stands(parameters))
        return (
            f'{shows} Simulated, no measured points: {surface(parameters, profile)}. The numbers '
            'at the right are the force at the full stroke; all contacts together can hold '
            f'{limits} mN. Below the 0-amplitude the runner follows the feet elastically, with a '
            f'mean force of about k A/2; the table has the net force without it, too. '
            f'{assumed(parameters)}'
        )

    number = name.removeprefix('fig')
    title = f'Fig. {number}: generated force over actuation amplitude, {profile} contacts'
    title += f', {len(preloads_n)} preloads'
    return PaperFigure(name, title, 65, cases, _draw_forces, caption, (8.5, 5.4))


FIG2 = _figure(
    'fig2',
    "The drive at the preloads of the paper's Fig. 2, which shows an experiment.",
    'rough',
    FIG2_PRELOADS_N,
)
FIG6A = _figure('fig6a', "The simulated curves of the paper's Fig. 6a.", 'rough', PRELOADS_N)
FIG6B = _figure('fig6b', "The simulated curves of the paper's Fig. 6b.", 'smooth', PRELOADS_N)


def _presliding_row(parameters: Parameters) -> Course[Row]:
    lower_m, upper_m = max_presliding_m(parameters)
    quick = parameters.updated({'sim.dt': ZERO_STEP_S})
    zero_m, slope = yield from zero_by_steps_m(parameters, STEP_FREQUENCY_HZ)
    onset_m = yield from onset_course(quick, STEP_FREQUENCY_HZ)
    return {
        'profile': parameters.contact.profile,
        'preload_n': parameters.stand.preload,
        'max_presliding_lower_m': lower_m,
        'max_presliding_upper_m': upper_m,
        'zero_quasi_static_m': quasi_static_zero_m(parameters),
        'zero_steps_m': zero_m,
        'step_slope': slope,
        'zero_onset_m': onset_m,
    }


def _draw_presliding(table: DataFrame, figure: Figure) -> None:
    panels = figure.subplots(1, len(PROFILES), sharey=True)
    for axes, profile in zip(panels, PROFILES, strict=True):
        rows = table[table['profile'] == profile]
        for name, (colour, marker, line, label) in _CURVES.items():
            points = rows['preload_n'].to_numpy(), rows[name].to_numpy() * NM
            axes.plot(*points, colour, marker=marker, linestyle=line, label=label)
        axes.set(title=profile, xlabel='preload (N)', xlim=(0.0, None), ylim=(0.0, None))
    panels[0].set_ylabel('displacement (nm)')
    panels[0].legend(loc='upper left')


def _presliding_caption(parameters: Parameters) -> str:
    return (
        f"The paper's Fig. 7 without its measured points: {surface(parameters, 'rough')}, and the "
        'smooth sphere. Extrapolated: step length of the free runner at 100 to 160 nm, '
        f'{STEP_FREQUENCY_HZ:g} Hz, {STEP_RUN_STEPS} steps. Onset: force exceeds k A/2 by '
        f'{ONSET_SHARE * 100:g} % of the friction limit, same frequency, k = '
        f'{parameters.load_cell.stiffness * 1e-3:g} kN/m. Without rebound: 2 T_v^-1(T_max/2). '
        'Assumed, as the paper does not say: frequency, number of steps, k, '
        f'damping c = {parameters.runner.damping:g} N s/m. The runner still rings '
        'when the next fall comes, which scatters single values by some nm.'
    )


FIG7 = PaperFigure(
    'fig7',
    'Fig. 7: maximal presliding and 0-amplitude over preload',
    19,
    lambda parameters, points: [
        partial(
            _presliding_row, stand_at(parameters, float(preload_n), {'contact.profile': profile})
        )
        for profile in PROFILES
        for preload_n in np.linspace(PRELOAD_MIN_N, PRELOAD_MAX_N, points)
    ],
    _draw_presliding,
    _presliding_caption,
    (11.0, 5.6),
)
