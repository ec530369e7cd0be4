"""Step length of the unloaded runner over the slew rate of the amplifier."""

from functools import partial

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.paper.figure import Case, PaperFigure, Table, surface
from stickslip_ros.paper.readings import (
    AMPLITUDE_MAX_M,
    PRELOADS_N,
    SLOPE_MIN,
    STEP_FREQUENCY_HZ,
    STEP_RUN_STEPS,
    stand_at,
    zero_by_steps_m,
)
from stickslip_ros.parameters import Parameters
from stickslip_ros.runs.journal import Row
from stickslip_ros.runs.plotting import (
    draw_legend,
    label_axes,
)
from stickslip_ros.runs.sawtooth_run import run_drive
from stickslip_ros.units import MICRO, NM

SLEW_MIN_V_PER_S, SLEW_MAX_V_PER_S = 5e6, 300e6
TICKS_V_PER_US = (5, 10, 25, 50, 100, 150, 300)
EDELER_V_PER_US = {25.0: 'no usable step below (Edeler)', 150.0: '0-amplitude least (Edeler)'}
"""Slew rates that Edeler's thesis names, from measurements on a stand of the same family."""


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
        partial(_row, stand_at(parameters, preload_n, {'amplifier.slew_rate': float(rate)}))
        for preload_n in PRELOADS_N
        for rate in rates
    ]


def _draw(table: Table, figure: Figure) -> None:
    step, zero = panels = figure.subplots(1, 2)
    for axes, name in ((step, 'step_length_m'), (zero, 'zero_steps_m')):
        for preload_n, rows, style in table.by_preload():
            rates = rows.column('slew_rate_v_per_s') * MICRO
            values_nm = rows.column(name) * NM
            label = f'preload {preload_n:g} N'
            axes.plot(rates, values_nm, **style.line_and_points, label=label)
    label_axes(step, 'slew rate (V/us)', f'step length at {AMPLITUDE_MAX_M * NM:g} nm (nm)')
    label_axes(zero, 'slew rate (V/us)', '0-amplitude, step length extrapolated (nm)')
    step.axhline(0.0, color='0.3', linewidth=0.8)
    zero.set_ylim(bottom=0.0)
    for axes in panels:
        axes.set_xscale('log')
        axes.set_xticks(TICKS_V_PER_US, [str(tick) for tick in TICKS_V_PER_US])
        axes.minorticks_off()
        for (rate, label), line in zip(EDELER_V_PER_US.items(), (':', '--'), strict=True):
            axes.axvline(rate, color='0.3', linestyle=line, label=label)
    draw_legend(step, 'lower right')


def _caption(parameters: Parameters) -> str:
    return (
        f'Free runner, {surface(parameters, "rough")}. {STEP_FREQUENCY_HZ:g} Hz, '
        f'{STEP_RUN_STEPS} steps, mean of the last 10; both assumed, and damping c = '
        f'{parameters.runner.damping:g} N s/m. A negative step goes against the drive. '
        '0-amplitude: line through the step lengths at 100 to 160 nm, left out where its slope '
        f'is below {SLOPE_MIN:g}. Vertical lines: measured by Edeler on a stand of the same '
        'family.'
    )


SLEW = PaperFigure(
    'slew', 'Unloaded step over slew rate', 31, _cases, _draw, _caption, (11.0, 5.0)
)
