"""What the paper leaves open: force and 0-amplitude over damping, frequency, cell, slew rate."""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stickslip_ros.contact.profile import Array
from stickslip_ros.paper.figure import Case, PaperFigure, Table, assumed
from stickslip_ros.paper.readings import (
    ONSET_SHARE,
    STEP_FREQUENCY_HZ,
    last_rise,
    max_presliding_m,
    quasi_static_zero_m,
    stand_at,
    zero_by_steps_m,
    zero_of_force_m,
)
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.journal import Row
from stickslip_ros.study.plotting import (
    BLACK,
    BLUE,
    GREEN,
    PURPLE,
    VERMILION,
    CurveStyle,
    draw_legend,
    label_axes,
)
from stickslip_ros.study.sawtooth_run import run_drive
from stickslip_ros.units import MICRO, MN, NM

PRELOAD_N, AMPLITUDE_M = 0.7, 130e-9
SOFT_PRELOAD_N = 0.1
"""Saturation is read at this preload."""


class Varied(NamedTuple):
    """What is varied: name in the table, parameter, range."""

    name: str
    parameter: str
    label: str
    low: float
    high: float
    with_zero: bool = False
    scale: float = 1.0

    def values(self, points: int) -> Array:
        """Return values of even ratios, with 0 before them if it belongs to the range."""
        if self.with_zero:
            return np.append(0.0, np.geomspace(self.low, self.high, points - 1))
        return np.asarray(np.geomspace(self.low, self.high, points))


ALL_VARIED = (
    Varied('damping_n_s_per_m', 'runner.damping', 'damping c (N s/m)', 1.0, 1000.0, True),
    Varied('frequency_hz', 'step.frequency', 'frequency f (Hz)', 100.0, 5000.0),
    Varied('cell_n_per_m', 'load_cell.stiffness', 'load-cell stiffness k (N/m)', 1e4, 1e7),
    Varied(
        'slew_rate_v_per_s', 'amplifier.slew_rate', 'slew rate (V/us)', 10e6, 300e6, scale=MICRO
    ),
)
ZEROS = {
    'max_presliding_lower_m': (BLACK, '', '-', '$u_{x,max}(F_{n2})$'),
    'zero_quasi_static_m': (PURPLE, '', ':', 'without rebound'),
    'zero_steps_m': (VERMILION, 'o', '-', '0-amplitude from steps'),
    'zero_onset_m': (BLUE, 'x', '--', '0-amplitude from force'),
}
"""Colour, marker, line and label of each column."""


def _row(parameters: Parameters, varied: Varied, value: float) -> Row:
    parameters = parameters.updated({varied.parameter: value})
    force_hz = parameters.step.frequency
    step_hz = value if varied.parameter == 'step.frequency' else STEP_FREQUENCY_HZ
    stand = stand_at(parameters, PRELOAD_N)
    soft = stand_at(parameters, SOFT_PRELOAD_N)
    run = run_drive(stand, AMPLITUDE_M, force_hz)
    return {
        'varied': varied.name,
        'value': value,
        'force_mean_n': run.force_mean_n,
        'steady': run.steady,
        'zero_steps_m': zero_by_steps_m(stand, step_hz)[0],
        'zero_onset_m': zero_of_force_m(stand, force_hz),
        'max_presliding_lower_m': max_presliding_m(stand)[0],
        'zero_quasi_static_m': quasi_static_zero_m(stand),
        'last_rise': last_rise(soft, force_hz),
    }


def _cases(parameters: Parameters, points: int) -> list[Case]:
    return [
        partial(_row, parameters, varied, float(value))
        for varied in ALL_VARIED
        for value in varied.values(points)
    ]


def _draw(table: Table, figure: Figure) -> None:
    panels = figure.subplots(3, len(ALL_VARIED), sharex='col', sharey='row')
    for column, varied in zip(panels.T, ALL_VARIED, strict=True):
        _draw_column(column, varied, table.where(varied=varied.name))
    force, zero, rise = panels[:, 0]
    force.set_ylabel(f'force at {PRELOAD_N:g} N, {AMPLITUDE_M * NM:g} nm (mN)')
    zero.set_ylabel(f'0-amplitude at {PRELOAD_N:g} N (nm)')
    rise.set_ylabel(f'rise of net force at {SOFT_PRELOAD_N:g} N\nfrom 140 to 160 nm (%)')
    force.set_ylim(bottom=0.0)
    zero.set_ylim(bottom=0.0)
    draw_legend(zero, 'lower left')


def _draw_column(panels: Sequence[Axes], varied: Varied, rows: Table) -> None:
    values = rows.column('value') * varied.scale
    force, zero, rise = panels
    force.plot(values, rows.column('force_mean_n') * MN, BLUE, marker='.')
    for name, (colour, marker, line, label) in ZEROS.items():
        values_nm = rows.column(name) * NM
        style = CurveStyle(colour, line, marker).line_and_points
        zero.plot(values, values_nm, label=label, **style)
    rise.plot(values, rows.column('last_rise') * 100.0, GREEN, marker='.')
    for axes in panels:
        label_axes(axes, '', '')
    rise.set_xlabel(varied.label)
    if varied.with_zero:
        rise.set_xscale('symlog', linthresh=varied.low)
    else:
        rise.set_xscale('log')


def _caption(parameters: Parameters) -> str:
    return (
        'Each column varies one number that the paper does not give (or, slew rate, gives as 150 '
        'V/us); rough contacts. 0-amplitude from steps: free runner, which has no k, at '
        f'{STEP_FREQUENCY_HZ:g} Hz or the varied frequency; from force: where it exceeds k A/2 by '
        f'{ONSET_SHARE * 100:g} % of the friction limit. Net force: mean - k A/2. Bottom: 0 is '
        'saturation; left out where k A/2 is more than half of the mean. The lines only '
        'join the points: over the frequency the ringing comes in '
        'and out of phase with the falls. '
        f'{assumed(parameters)} Below k = 3e4 N/m the force approaches its end so slowly that '
        'this rule stops it up to 1 % too early; above 1e6 N/m k comes near the stiffness of the '
        'contacts, and much of the force is elastic following.'
    )


SENSITIVITY = PaperFigure(
    'sensitivity',
    'Sensitivity to what the paper does not give',
    25,
    _cases,
    _draw,
    _caption,
    (12.5, 8.6),
)
