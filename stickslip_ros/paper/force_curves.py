"""Figures 2 and 6: generated force over actuation amplitude."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.paper.readings import (
    AMPLITUDE_MAX_M,
    FORCE_COLUMNS,
    force_row,
    friction_limit_n,
    stand_at,
)
from stickslip_ros.paper.study_figure import PRELOAD_COLOURS, Case, StudyFigure, assumed, surface
from stickslip_ros.paper.table import Table
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.plotting import label_axes
from stickslip_ros.units import MN, NM

POINTS = 65


def _cases(
    profile: str, preloads_n: Sequence[float], parameters: Parameters, points: int
) -> list[Case]:
    stands = [stand_at(parameters, p, contact__profile=profile) for p in preloads_n]
    amplitudes_m = np.linspace(0.0, AMPLITUDE_MAX_M, points)
    return [partial(force_row, stand, float(a)) for stand in stands for a in amplitudes_m]


def _draw(table: Table, figure: Figure) -> None:
    axes = figure.subplots()
    groups = zip(table.groups('preload_n'), PRELOAD_COLOURS, strict=False)
    for (preload_n, rows), colour in groups:
        amplitudes_nm = rows.column('amplitude_m') * NM
        forces_mn = rows.column('force_mean_n') * MN
        axes.plot(amplitudes_nm, forces_mn, colour, label=f'{preload_n:g} N')
        axes.annotate(
            f'{forces_mn[-1]:.0f}',
            (amplitudes_nm[-1], forces_mn[-1]),
            xytext=(4, 0),
            textcoords='offset points',
            color=colour,
            va='center',
            annotation_clip=False,
        )
    label_axes(axes, 'actuation amplitude (nm)', 'generated force, mean of the last cycle (mN)')
    axes.set_xlim(0.0, AMPLITUDE_MAX_M * NM)
    axes.set_ylim(bottom=0.0)
    axes.legend(title='preload')


def _caption(shows: str, profile: str, preloads_n: Sequence[float], parameters: Parameters) -> str:
    stands = [stand_at(parameters, p, contact__profile=profile) for p in preloads_n]
    limits = ', '.join(f'{friction_limit_n(stand) * MN:.0f}' for stand in stands)
    return (
        f'{shows} Simulated, no measured points: {surface(parameters, profile)}. The numbers at '
        f'the right are the force at the full stroke, in mN; all contacts together can hold '
        f'{limits} mN. Below the 0-amplitude the runner follows the feet elastically, with a mean '
        f'force of about k A/2. {assumed(parameters)}'
    )


def _figure(name: str, title: str, shows: str, profile: str, *preloads_n: float) -> StudyFigure:
    return StudyFigure(
        name,
        title,
        FORCE_COLUMNS,
        POINTS,
        partial(_cases, profile, preloads_n),
        _draw,
        partial(_caption, shows, profile, preloads_n),
    )


FIG2 = _figure(
    'fig2',
    'Generated force over actuation amplitude, rough contacts',
    "The drive at the preloads of the paper's Fig. 2, which shows an experiment.",
    'rough',
    0.1,
    0.4,
    0.7,
    1.0,
)
FIG6A = _figure(
    'fig6a',
    'Generated force over actuation amplitude, rough contacts',
    "The simulated curves of the paper's Fig. 6a.",
    'rough',
    0.1,
    0.5,
    1.0,
)
FIG6B = _figure(
    'fig6b',
    'Generated force over actuation amplitude, smooth contacts',
    "The simulated curves of the paper's Fig. 6b.",
    'smooth',
    0.1,
    0.5,
    1.0,
)
