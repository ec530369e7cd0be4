"""Figure 7: maximal presliding and 0-amplitude over preload."""

from functools import partial

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.paper.figure import Case, PaperFigure, Table, surface
from stickslip_ros.paper.readings import (
    STEP_FREQUENCY_HZ,
    STEP_RUN_STEPS,
    ZERO_STEP_S,
    max_presliding_m,
    quasi_static_zero_m,
    stand_at,
    zero_by_steps_m,
)
from stickslip_ros.parameters import Parameters
from stickslip_ros.runs.journal import Row
from stickslip_ros.runs.plotting import (
    BLACK,
    BLUE,
    GREY,
    PURPLE,
    VERMILION,
    draw_legend,
    label_axes,
)
from stickslip_ros.runs.zero_amplitude import ONSET_SHARE, force_onset_m
from stickslip_ros.units import NM

PRELOAD_MIN_N, PRELOAD_MAX_N = 0.1, 1.0
PROFILES = ('rough', 'smooth')
CURVES = {
    'max_presliding_upper_m': (GREY, '', '--', '$u_{x,max}$ of an upper contact, $F_{n1}$'),
    'max_presliding_lower_m': (BLACK, '', '-', '$u_{x,max}$ of a lower contact, $F_{n2}$'),
    'zero_quasi_static_m': (PURPLE, '', ':', '0-amplitude without rebound, closed form'),
    'zero_steps_m': (VERMILION, 'o', '', '0-amplitude, step length extrapolated'),
    'zero_onset_m': (BLUE, 'x', '', '0-amplitude, onset of generated force'),
}
"""Colour, marker, line and label of each column."""


def _row(parameters: Parameters) -> Row:
    lower_m, upper_m = max_presliding_m(parameters)
    quick = parameters.updated({'sim.dt': ZERO_STEP_S})
    zero_m, slope = zero_by_steps_m(parameters, STEP_FREQUENCY_HZ)
    return {
        'profile': parameters.contact.profile,
        'preload_n': parameters.stand.preload,
        'max_presliding_lower_m': lower_m,
        'max_presliding_upper_m': upper_m,
        'zero_quasi_static_m': quasi_static_zero_m(parameters),
        'zero_steps_m': zero_m,
        'step_slope': slope,
        'zero_onset_m': force_onset_m(quick, STEP_FREQUENCY_HZ),
    }


def _cases(parameters: Parameters, points: int) -> list[Case]:
    return [
        partial(_row, stand_at(parameters, float(preload_n), {'contact.profile': profile}))
        for profile in PROFILES
        for preload_n in np.linspace(PRELOAD_MIN_N, PRELOAD_MAX_N, points)
    ]


def _draw(table: Table, figure: Figure) -> None:
    panels = figure.subplots(1, len(PROFILES), sharey=True)
    for axes, profile in zip(panels, PROFILES, strict=True):
        rows = table.where(profile=profile)
        preloads_n = rows.column('preload_n')
        for name, (colour, marker, line, label) in CURVES.items():
            values_nm = rows.column(name) * NM
            axes.plot(preloads_n, values_nm, colour, marker=marker, linestyle=line, label=label)
        label_axes(axes, 'preload (N)', '', profile)
        axes.set_xlim(0.0, None)
        axes.set_ylim(0.0, None)
    panels[0].set_ylabel('displacement (nm)')
    draw_legend(panels[0], 'upper left')


def _caption(parameters: Parameters) -> str:
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
    'Maximal presliding and 0-amplitude over preload',
    19,
    _cases,
    _draw,
    _caption,
    (11.0, 5.6),
)
