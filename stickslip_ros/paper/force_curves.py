"""Figures 2 and 6: generated force over actuation amplitude."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.drive.build import friction_limit_n
from stickslip_ros.paper.figure import Case, PaperFigure, Table, assumed, surface
from stickslip_ros.paper.readings import (
    AMPLITUDE_MAX_M,
    PRELOADS_N,
    stand_at,
)
from stickslip_ros.parameters import Parameters
from stickslip_ros.runs.journal import Row
from stickslip_ros.runs.plotting import (
    draw_legend,
    label_axes,
    label_end,
)
from stickslip_ros.runs.sawtooth_run import run_drive
from stickslip_ros.units import MN, NM


def _row(parameters: Parameters, amplitude_m: float) -> Row:
    run = run_drive(parameters, amplitude_m, parameters.step.frequency)
    return {
        'profile': parameters.contact.profile,
        'preload_n': run.preload_n,
        'amplitude_m': amplitude_m,
        'force_mean_n': run.force_mean_n,
        'force_net_n': run.force_net_n,
        'steady': run.steady,
        'steps': run.steps,
    }


def _stands(profile: str, preloads_n: Sequence[float], parameters: Parameters) -> list[Parameters]:
    return [stand_at(parameters, n, {'contact.profile': profile}) for n in preloads_n]


def _draw(table: Table, figure: Figure) -> None:
    axes = figure.subplots()
    for preload_n, rows, style in table.by_preload():
        amplitudes_nm = rows.column('amplitude_m') * NM
        forces_mn = rows.column('force_mean_n') * MN
        axes.plot(amplitudes_nm, forces_mn, **style.line, label=f'{preload_n:g} N')
        label_end(axes, amplitudes_nm, forces_mn, f'{forces_mn[-1]:.0f} mN', style.color)
    label_axes(axes, 'actuation amplitude (nm)', 'generated force, mean of the last cycle (mN)')
    axes.set_xlim(0.0, AMPLITUDE_MAX_M * NM)
    axes.set_ylim(bottom=0.0)
    draw_legend(axes, 'upper left', 'preload')


def _figure(name: str, shows: str, profile: str, preloads_n: Sequence[float]) -> PaperFigure:
    stands = partial(_stands, profile, preloads_n)

    def cases(parameters: Parameters, points: int) -> list[Case]:
        amplitudes_m = np.linspace(0.0, AMPLITUDE_MAX_M, points)
        return [
            partial(_row, stand, float(a)) for stand in stands(parameters) for a in amplitudes_m
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

    title = f'Generated force over actuation amplitude, {profile} contacts'
    return PaperFigure(name, title, 65, cases, _draw, caption, (8.5, 5.4))


FIG2 = _figure(
    'fig2',
    "The drive at the preloads of the paper's Fig. 2, which shows an experiment.",
    'rough',
    (0.1, 0.4, 0.7, 1.0),
)
FIG6A = _figure('fig6a', "The simulated curves of the paper's Fig. 6a.", 'rough', PRELOADS_N)
FIG6B = _figure('fig6b', "The simulated curves of the paper's Fig. 6b.", 'smooth', PRELOADS_N)
