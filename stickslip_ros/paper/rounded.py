"""Generated force under a saw-tooth with rounded corners: the amplifier has a bandwidth."""

import math
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.paper.figure import Case, PaperFigure, Table, assumed
from stickslip_ros.paper.readings import (
    AMPLITUDE_MAX_M,
    PRELOADS_N,
    stand_at,
)
from stickslip_ros.parameters import Parameters
from stickslip_ros.runs.journal import Row
from stickslip_ros.runs.plotting import (
    curve_style,
    draw_legend,
    label_axes,
)
from stickslip_ros.runs.sawtooth_run import run_drive
from stickslip_ros.runs.zero_amplitude import force_onset_m
from stickslip_ros.units import MICRO, MN, NM

BANDWIDTHS_HZ = (math.inf, 1e6, 300e3, 100e3, 30e3, 10e3)
STEP_S = 2e-6
"""Longest time step behind a low-pass: half of it changes no force at the full stroke by 1e-3."""
LEGEND_ROOM = 1.55


def rounded_stand(parameters: Parameters, preload_n: float, bandwidth_hz: float) -> Parameters:
    """Return a stand whose amplifier has this bandwidth; infinity leaves the corners sharp."""
    if math.isinf(bandwidth_hz):
        return stand_at(parameters, preload_n, {'amplifier.bandwidth': 0.0})
    step_s = min(parameters.sim.dt, STEP_S)
    changes = {'amplifier.bandwidth': bandwidth_hz, 'sim.dt': step_s}
    return stand_at(parameters, preload_n, changes)


def _row(stand: Parameters, bandwidth_hz: float, amplitude_m: float) -> Row:
    """Return the row of one run; that of the full stroke has the onset of the curve, too."""
    run = run_drive(stand, amplitude_m, stand.step.frequency)
    is_full = amplitude_m == AMPLITUDE_MAX_M
    zero_m = math.nan
    if is_full:
        zero_m = force_onset_m(stand, stand.step.frequency)
    return {
        'preload_n': run.preload_n,
        'bandwidth_hz': bandwidth_hz,
        'amplitude_m': amplitude_m,
        'force_mean_n': run.force_mean_n,
        'steady': run.steady,
        'zero_onset_m': zero_m,
    }


def _cases(parameters: Parameters, points: int) -> list[Case]:
    amplitudes_m = np.linspace(0.0, AMPLITUDE_MAX_M, points + 1)[1:].tolist()
    stands = [
        (rounded_stand(parameters, preload_n, bandwidth_hz), bandwidth_hz)
        for preload_n in PRELOADS_N
        for bandwidth_hz in BANDWIDTHS_HZ
    ]
    return [partial(_row, *stand, a) for stand in stands for a in amplitudes_m]


def _draw(table: Table, figure: Figure) -> None:
    panels = figure.subplots(2, len(PRELOADS_N), sharex=True)
    for (force, lost), preload_n in zip(panels.T, PRELOADS_N, strict=True):
        here = table.where(preload_n=preload_n)
        ideal_mn = here.where(bandwidth_hz=math.inf).column('force_mean_n') * MN
        for index, bandwidth_hz in enumerate(BANDWIDTHS_HZ):
            rows = here.where(bandwidth_hz=bandwidth_hz)
            amplitudes_nm = rows.column('amplitude_m') * NM
            forces_mn = rows.column('force_mean_n') * MN
            style = curve_style(index).line_and_points | {'markevery': (index, len(BANDWIDTHS_HZ))}
            onset_nm = rows.column('zero_onset_m')[-1] * NM
            onset = 'no onset' if math.isnan(onset_nm) else f'from {onset_nm:.0f} nm'
            label = f'{_name(bandwidth_hz)}: {onset}'
            force.plot(amplitudes_nm, forces_mn, label=label, **style)
            lost.plot(amplitudes_nm, ideal_mn - forces_mn, **style)
        label_axes(force, '', '', f'preload {preload_n:g} N')
        label_axes(lost, 'amplitude before rounding (nm)', '')
        draw_legend(force, 'upper left')
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
    step_us = min(parameters.sim.dt, STEP_S) / MICRO
    return (
        'The voltage passes a first-order low-pass behind the slewing amplifier: both corners of '
        'the saw-tooth are rounded, its mean stays. Legend: bandwidth, and the amplitude from '
        'which force is generated. Rough contacts. Behind the low-pass the time step is '
        f'{step_us:g} us. {assumed(parameters)}'
    )


ROUNDED = PaperFigure('rounded', 'Rounded saw-tooth', 32, _cases, _draw, _caption, (12.0, 7.8))
