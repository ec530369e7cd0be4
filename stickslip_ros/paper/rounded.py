"""Generated force under a saw-tooth with rounded corners."""

import math
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.paper.readings import (
    AMPLITUDE_MAX_M,
    FORCE_FREQUENCY_HZ,
    stand_at,
    zero_by_onset_m,
)
from stickslip_ros.paper.rounded_run import run_rounded
from stickslip_ros.paper.study_figure import Case, StudyFigure, assumed
from stickslip_ros.paper.table import Table
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.journal import Row
from stickslip_ros.study.plotting import label_axes
from stickslip_ros.units import MN, NM

PRELOADS_N = (0.1, 0.5, 1.0)
BANDWIDTHS_HZ = (math.inf, 1e6, 300e3, 100e3, 30e3, 10e3)
LEGEND_ROOM = 1.35
COLUMNS = (
    'preload_n',
    'bandwidth_hz',
    'amplitude_m',
    'force_mean_n',
    'steady',
    'zero_onset_m',
)


def _force_n(parameters: Parameters, bandwidth_hz: float, amplitude_m: float) -> float:
    return run_rounded(parameters, amplitude_m, FORCE_FREQUENCY_HZ, bandwidth_hz)[0]


def _row(parameters: Parameters, bandwidth_hz: float, amplitude_m: float) -> Row:
    """Return the row of one run; that of the full stroke has the onset of the curve, too."""
    force_n, _, steady = run_rounded(parameters, amplitude_m, FORCE_FREQUENCY_HZ, bandwidth_hz)
    zero_m = math.nan
    if amplitude_m == AMPLITUDE_MAX_M:
        zero_m = zero_by_onset_m(parameters, partial(_force_n, parameters, bandwidth_hz))
    return {
        'preload_n': parameters.stand.preload,
        'bandwidth_hz': bandwidth_hz,
        'amplitude_m': amplitude_m,
        'force_mean_n': force_n,
        'steady': steady,
        'zero_onset_m': zero_m,
    }


def _cases(parameters: Parameters, points: int) -> list[Case]:
    amplitudes_m = np.linspace(0.0, AMPLITUDE_MAX_M, points + 1)[1:]
    return [
        partial(_row, stand_at(parameters, preload_n), bandwidth_hz, float(amplitude_m))
        for preload_n in PRELOADS_N
        for bandwidth_hz in BANDWIDTHS_HZ
        for amplitude_m in amplitudes_m
    ]


def _draw(table: Table, figure: Figure) -> None:
    panels = figure.subplots(2, len(PRELOADS_N), sharex=True)
    for column, preload_n in enumerate(PRELOADS_N):
        here = table.where(preload_n=preload_n)
        ideal_mn = here.where(bandwidth_hz=math.inf).column('force_mean_n') * MN
        force, lost = panels[:, column]
        for index, bandwidth_hz in enumerate(BANDWIDTHS_HZ):
            rows = here.where(bandwidth_hz=bandwidth_hz)
            amplitudes_nm = rows.column('amplitude_m') * NM
            forces_mn = rows.column('force_mean_n') * MN
            colour = 'black' if math.isinf(bandwidth_hz) else f'C{index - 1}'
            onset_nm = rows.column('zero_onset_m')[-1] * NM
            onset = 'no onset' if math.isnan(onset_nm) else f'from {onset_nm:.0f} nm'
            label = f'{_name(bandwidth_hz)}: {onset}'
            force.plot(amplitudes_nm, forces_mn, colour, label=label)
            lost.plot(amplitudes_nm, ideal_mn - forces_mn, colour)
        label_axes(force, '', '', f'preload {preload_n:g} N')
        label_axes(lost, 'amplitude before rounding (nm)', '')
        force.legend(fontsize='small', loc='upper left')
        force.set_xlim(0.0, AMPLITUDE_MAX_M * NM)
        force.set_ylim(0.0, LEGEND_ROOM * ideal_mn.max())
    panels[0, 0].set_ylabel('generated force (mN)')
    panels[1, 0].set_ylabel('ideal less rounded (mN)')


def _name(bandwidth_hz: float) -> str:
    if math.isinf(bandwidth_hz):
        return 'ideal'
    mega_hz = bandwidth_hz * 1e-6
    return f'{mega_hz:g} MHz' if mega_hz >= 1.0 else f'{bandwidth_hz * 1e-3:g} kHz'


def _caption(parameters: Parameters) -> str:
    return (
        'The voltage passes a first-order low-pass behind the slewing amplifier: both corners of '
        'the saw-tooth are rounded, its mean stays. Legend: bandwidth, and the amplitude from '
        'which force is generated. Rough contacts. The wave is cut into straight pieces; twice as '
        f'many change the force by less than 2e-4. {assumed(parameters)}'
    )


ROUNDED = StudyFigure(
    'rounded', 'Rounded saw-tooth', COLUMNS, 32, _cases, _draw, _caption, (12.0, 8.4)
)
