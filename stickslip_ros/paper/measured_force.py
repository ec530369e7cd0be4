"""
Forces of two drives in the text of Edeler's thesis, beside our prediction.

A. Edeler, Modellierung und Validierung der Krafterzeugung mit Stick-Slip-Antrieben, Oldenburg.

"""

import math
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.drive.build import friction_limit_n
from stickslip_ros.paper.figure import Case, PaperFigure, Table, assumed, surface
from stickslip_ros.paper.readings import (
    AMPLITUDE_MAX_M,
    stand_at,
    zero_of_force_m,
)
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.journal import Row
from stickslip_ros.study.plotting import draw_legend, label_axes
from stickslip_ros.study.sawtooth_run import run_drive
from stickslip_ros.units import MN, NM

QUARTER_N = 0.25
"""A preload of Edeler's stand, N."""
LEAST_AT_QUARTER_N, MOST_AT_QUARTER_N = 0.75 * 150e-3, 140e-3
"""Set forces of up to 150 mN are met to 25 %; the axis of the measured force ends at 140 mN."""
SL_2040_SHARE = 2.7 / 3.0
"""SmarAct SL-2040: largest generated force over holding force."""
HOLDING_AMPLITUDES = 2.0
"""Its full amplitude, in units of that at which its force begins."""
HELD_PRELOADS_N = (0.1, QUARTER_N, 0.5, 1.0)
VOLTAGE_MAX_V = 600.0
"""Twice that of the stand: room for twice the onset at 1 N."""
DAMPING_MAX_N_S_PER_M = 300.0


def _force_row(parameters: Parameters) -> Row:
    onset_m = zero_of_force_m(parameters, parameters.step.frequency)
    full = run_drive(parameters, AMPLITUDE_MAX_M, parameters.step.frequency)
    double_n = math.nan
    if not math.isnan(onset_m):
        double_m = HOLDING_AMPLITUDES * onset_m
        double_n = run_drive(parameters, double_m, parameters.step.frequency).force_mean_n
    return {
        'preload_n': parameters.stand.preload,
        'damping_n_s_per_m': parameters.runner.damping,
        'onset_m': onset_m,
        'force_at_full_n': full.force_mean_n,
        'double_onset_share': double_n / friction_limit_n(parameters),
    }


def _force_cases(parameters: Parameters, points: int) -> list[Case]:
    roomy = parameters.updated({'amplifier.voltage_max': VOLTAGE_MAX_V})
    return [
        partial(_force_row, stand_at(roomy, preload_n, {'runner.damping': float(damping)}))
        for preload_n in HELD_PRELOADS_N
        for damping in np.linspace(0.0, DAMPING_MAX_N_S_PER_M, points)
    ]


def _draw_force(table: Table, figure: Figure) -> None:
    force, share = figure.subplots(1, 2)
    at_quarter = table.where(preload_n=QUARTER_N)
    force.plot(
        at_quarter.column('damping_n_s_per_m'),
        at_quarter.column('force_at_full_n') * MN,
        label=f'predicted, preload {QUARTER_N:g} N',
    )
    band_mn = (LEAST_AT_QUARTER_N * MN, MOST_AT_QUARTER_N * MN)
    force.axhspan(*band_mn, color='0.8', label='measured: between these')
    for preload_n, rows, style in table.by_preload():
        damping, shares = rows.column('damping_n_s_per_m'), rows.column('double_onset_share')
        share.plot(damping, shares, **style.line, label=f'predicted, preload {preload_n:g} N')
    share.axhline(SL_2040_SHARE, color='0.3', linewidth=2.5, label='measured: SL-2040')
    full_nm = AMPLITUDE_MAX_M * NM
    label_axes(force, 'damping c (N s/m)', f'generated force at {full_nm:g} nm (mN)')
    label_axes(share, 'damping c (N s/m)', 'force at twice the onset/holding force')
    for axes in (force, share):
        axes.set_ylim(bottom=0.0)
        draw_legend(axes)


def _force_caption(parameters: Parameters) -> str:
    return (
        f'{surface(parameters, "rough")}. {assumed(parameters)} The damping is varied. Measured: '
        "statements in the text of Edeler's thesis, no points of its figures."
    )


MEASURED_FORCE = PaperFigure(
    'measured_force',
    "Forces in Edeler's thesis",
    16,
    _force_cases,
    _draw_force,
    _force_caption,
    (11.0, 4.6),
)
