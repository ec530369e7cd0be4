"""Step length of the unloaded runner over the slew rate of the amplifier."""

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stickslip_ros.paper.readings import (
    AMPLITUDE_MAX_M,
    SLOPE_MIN,
    STEP_FREQUENCY_HZ,
    STEP_RUN_STEPS,
    stand_at,
    zero_by_steps_m,
)
from stickslip_ros.paper.study_figure import PRELOAD_COLOURS, Case, StudyFigure, surface
from stickslip_ros.paper.table import Table
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.drive_run import run_drive
from stickslip_ros.study.journal import Row
from stickslip_ros.study.plotting import label_axes
from stickslip_ros.units import NM

PRELOADS_N = (0.1, 0.5, 1.0)
SLEW_MIN_V_PER_S, SLEW_MAX_V_PER_S = 5e6, 300e6
V_PER_US = 1e-6
EDELER_V_PER_US = {25.0: 'no usable step below (Edeler)', 150.0: '0-amplitude least (Edeler)'}
"""Slew rates that Edeler's thesis names, from measurements on a stand of the same family."""
COLUMNS = ('preload_n', 'slew_rate_v_per_s', 'step_length_m', 'zero_steps_m', 'step_slope')


def _row(parameters: Parameters) -> Row:
    free = parameters.updated({'load_cell.contact': 'absent'})
    run = run_drive(free, AMPLITUDE_MAX_M, STEP_FREQUENCY_HZ, STEP_RUN_STEPS)
    zero_m, slope = zero_by_steps_m(parameters, STEP_FREQUENCY_HZ)
    return {
        'preload_n': parameters.stand.preload,
        'slew_rate_v_per_s': parameters.amplifier.slew_rate,
        'step_length_m': run.step_length_m,
        'zero_steps_m': zero_m,
        'step_slope': slope,
    }


def _cases(parameters: Parameters, points: int) -> list[Case]:
    rates = np.geomspace(SLEW_MIN_V_PER_S, SLEW_MAX_V_PER_S, points)
    return [
        partial(_row, stand_at(parameters, preload_n, amplifier__slew_rate=float(rate)))
        for preload_n in PRELOADS_N
        for rate in rates
    ]


def _draw(table: Table, figure: Figure) -> None:
    panels = figure.subplots(1, 2)
    _curves(panels[0], table, 'step_length_m')
    _curves(panels[1], table, 'zero_steps_m')
    label_axes(panels[0], 'slew rate (V/us)', f'step length at {AMPLITUDE_MAX_M * NM:g} nm (nm)')
    label_axes(panels[1], 'slew rate (V/us)', '0-amplitude, step length extrapolated (nm)')
    panels[0].axhline(0.0, color='0.3', linewidth=0.8)
    panels[1].set_ylim(bottom=0.0)
    for axes in panels:
        axes.set_xscale('log')
        axes.set_xticks([5, 10, 25, 50, 100, 150, 300], minor=False)
        axes.set_xticklabels(['5', '10', '25', '50', '100', '150', '300'])
        axes.minorticks_off()
        for (rate, label), style in zip(EDELER_V_PER_US.items(), (':', '--'), strict=True):
            axes.axvline(rate, color='0.3', linestyle=style, label=label)
    panels[0].legend(fontsize='small', loc='lower right')


def _curves(axes: Axes, table: Table, name: str) -> None:
    groups = zip(table.groups('preload_n'), PRELOAD_COLOURS, strict=False)
    for (preload_n, rows), colour in groups:
        rates = rows.column('slew_rate_v_per_s') * V_PER_US
        values_nm = rows.column(name) * NM
        axes.plot(rates, values_nm, colour, marker='.', label=f'preload {preload_n:g} N')


def _caption(parameters: Parameters) -> str:
    return (
        f'Free runner, {surface(parameters, "rough")}. {STEP_FREQUENCY_HZ:g} Hz, '
        f'{STEP_RUN_STEPS} steps, mean of the last 10; both assumed, and damping c = '
        f'{parameters.runner.damping:g} N s/m. A negative step goes against the drive. '
        '0-amplitude: line through the step lengths at 100 to 160 nm, left out where its slope '
        f'is below {SLOPE_MIN:g}. Vertical lines: measured by Edeler on a stand of the same '
        'family.'
    )


SLEW = StudyFigure(
    'slew', 'Unloaded step over slew rate', COLUMNS, 31, _cases, _draw, _caption, (11.0, 6.0)
)
