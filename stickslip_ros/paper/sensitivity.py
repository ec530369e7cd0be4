"""What the paper leaves open: force and 0-amplitude over damping, frequency, cell, slew rate."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stickslip_ros.contact.profile import Array
from stickslip_ros.paper.readings import (
    AMPLITUDE_MAX_M,
    FORCE_FREQUENCY_HZ,
    ONSET_SHARE,
    STEP_FREQUENCY_HZ,
    max_presliding_m,
    quasi_static_zero_m,
    stand_at,
    zero_by_steps_m,
    zero_of_force_m,
)
from stickslip_ros.paper.study_figure import Case, StudyFigure, assumed
from stickslip_ros.paper.table import Table
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.drive_run import run_drive
from stickslip_ros.study.journal import Row
from stickslip_ros.study.plotting import label_axes
from stickslip_ros.units import MN, NM

PRELOAD_N, AMPLITUDE_M = 0.7, 130e-9
SOFT_PRELOAD_N, LAST_RISE_M = 0.1, 20e-9
"""Saturation is read at this preload, over the last stretch of amplitudes of this length."""
COLUMNS = (
    'varied',
    'value',
    'force_mean_n',
    'steady',
    'zero_steps_m',
    'zero_onset_m',
    'max_presliding_lower_m',
    'zero_quasi_static_m',
    'last_rise',
)


@dataclass(frozen=True)
class Varied:
    """What is varied: name and unit in table and figure, values, scale of the figure."""

    name: str
    label: str
    values: Callable[[int], Array]
    scale: float = 1.0


def _even_ratios(low: float, high: float, points: int) -> Array:
    return np.geomspace(low, high, points, dtype=np.float64)


def _with_zero(low: float, high: float, points: int) -> Array:
    return np.concatenate(([0.0], _even_ratios(low, high, points - 1)))


DAMPING = Varied('damping_n_s_per_m', 'damping c (N s/m)', partial(_with_zero, 1.0, 1000.0))
FREQUENCY = Varied('frequency_hz', 'frequency f (Hz)', partial(_even_ratios, 100.0, 5000.0))
CELL = Varied('cell_n_per_m', 'load-cell stiffness k (N/m)', partial(_even_ratios, 1e4, 1e7))
SLEW = Varied(
    'slew_rate_v_per_s', 'slew rate (V/us)', partial(_even_ratios, 10e6, 300e6), scale=1e-6
)
ALL_VARIED = (DAMPING, FREQUENCY, CELL, SLEW)
PARAMETER_OF = {
    DAMPING: 'runner__damping',
    CELL: 'load_cell__stiffness',
    SLEW: 'amplifier__slew_rate',
}


def _row(parameters: Parameters, varied: Varied, value: float) -> Row:
    change = {PARAMETER_OF[varied]: value} if varied in PARAMETER_OF else {}
    force_hz, step_hz = FORCE_FREQUENCY_HZ, STEP_FREQUENCY_HZ
    if varied is FREQUENCY:
        force_hz = step_hz = value
    stand = stand_at(parameters, PRELOAD_N, **change)
    soft = stand_at(parameters, SOFT_PRELOAD_N, **change)
    run = run_drive(stand, AMPLITUDE_M, force_hz)
    before_n, full_n = (
        run_drive(soft, amplitude_m, force_hz).force_mean_n
        for amplitude_m in (AMPLITUDE_MAX_M - LAST_RISE_M, AMPLITUDE_MAX_M)
    )
    return {
        'varied': varied.name,
        'value': value,
        'force_mean_n': run.force_mean_n,
        'steady': run.steady,
        'zero_steps_m': zero_by_steps_m(stand, step_hz)[0],
        'zero_onset_m': zero_of_force_m(stand, force_hz),
        'max_presliding_lower_m': max_presliding_m(stand)[0],
        'zero_quasi_static_m': quasi_static_zero_m(stand),
        'last_rise': full_n / before_n - 1.0,
    }


def _cases(parameters: Parameters, points: int) -> list[Case]:
    return [
        partial(_row, parameters, varied, float(value))
        for varied in ALL_VARIED
        for value in varied.values(points)
    ]


def _draw(table: Table, figure: Figure) -> None:
    panels = figure.subplots(3, len(ALL_VARIED), sharex='col', sharey='row')
    for column, varied in enumerate(ALL_VARIED):
        rows = table.where(varied=varied.name)
        values = rows.column('value') * varied.scale
        force, zero, rise = panels[:, column]
        force.plot(values, rows.column('force_mean_n') * MN, 'tab:blue', marker='.')
        _draw_zero(zero, rows, values)
        rise.plot(values, rows.column('last_rise') * 100.0, 'tab:green', marker='.')
        for axes in (force, zero, rise):
            label_axes(axes, '', '')
        rise.set_xlabel(varied.label)
        if varied is DAMPING:
            rise.set_xscale('symlog', linthresh=1.0)
        else:
            rise.set_xscale('log')
    first = panels[:, 0]
    first[0].set_ylabel(f'force at {PRELOAD_N:g} N, {AMPLITUDE_M * NM:g} nm (mN)')
    first[1].set_ylabel(f'0-amplitude at {PRELOAD_N:g} N (nm)')
    first[2].set_ylabel(f'rise of force at {SOFT_PRELOAD_N:g} N\nfrom 140 to 160 nm (%)')
    panels[0, 0].set_ylim(bottom=0.0)
    panels[1, 0].set_ylim(bottom=0.0)
    panels[1, 0].legend(fontsize='small', loc='lower left')


def _draw_zero(axes: Axes, rows: Table, values: Array) -> None:
    line = rows.column('max_presliding_lower_m') * NM
    axes.plot(values, line, 'black', label='$u_{x,max}(F_{n2})$')
    line = rows.column('zero_quasi_static_m') * NM
    axes.plot(values, line, 'tab:purple', linestyle=':', label='without rebound')
    line = rows.column('zero_steps_m') * NM
    axes.plot(values, line, 'tab:red', marker='.', label='0-amplitude from steps')
    line = rows.column('zero_onset_m') * NM
    axes.plot(values, line, 'tab:blue', marker='.', label='0-amplitude from force')


def _caption(parameters: Parameters) -> str:
    return (
        'Each column varies one number that the paper does not give (or, slew rate, gives as 150 '
        'V/us); rough contacts. 0-amplitude from steps: free runner, which has no k, at '
        f'{STEP_FREQUENCY_HZ:g} Hz or the varied frequency; from force: where it exceeds k A/2 by '
        f'{ONSET_SHARE * 100:g} % of the friction limit. Bottom: 0 is saturation. The lines only '
        'join the points: over the frequency the ringing comes in and out of '
        'phase with the falls. '
        f'{assumed(parameters)} Below k = 3e4 N/m the force approaches its end so slowly that '
        'this rule stops it up to 1 % too early; above 1e6 N/m k comes near the stiffness of the '
        'contacts, and much of the force is elastic following.'
    )


SENSITIVITY = StudyFigure(
    'sensitivity',
    'Sensitivity to what the paper does not give',
    COLUMNS,
    25,
    _cases,
    _draw,
    _caption,
    (12.5, 9.4),
)
