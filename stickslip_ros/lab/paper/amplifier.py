# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The effect of slew rate and bandwidth of the amplifier on steps and forces."""

import math
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.lab.measurements.sweep_table import Row
from stickslip_ros.lab.paper.curves import (
    AMPLITUDE_MAX_M,
    PRELOADS_N,
    SLOPE_MIN,
    STEP_FREQUENCY_HZ,
    STEP_RUN_STEPS,
    preload_style,
    stand_at,
    zero_by_steps_m,
)
from stickslip_ros.lab.paper.figure import PaperFigure, Table, assumed, surface
from stickslip_ros.lab.runs.courses import Course
from stickslip_ros.lab.runs.sawtooth_run import drive_course
from stickslip_ros.lab.runs.zero_amplitude import onset_course
from stickslip_ros.parameters import Parameters
from stickslip_ros.units import MICRO, MN, NM

SLEW_MIN_V_PER_S, SLEW_MAX_V_PER_S = 5e6, 300e6
TICKS_V_PER_US = (5, 10, 25, 50, 100, 150, 300)
EDELER_V_PER_US = {25.0: 'no usable step below (Edeler)', 150.0: '0-amplitude least (Edeler)'}
"""Slew rates in Edeler's thesis, measured on a stand of the same family."""
BANDWIDTHS_HZ = (math.inf, 1e6, 300e3, 100e3, 30e3, 10e3)
_STEP_S = 2e-6  # longest time step behind a low-pass; half of it changes no force by 1e-3
LEGEND_ROOM = 1.55


def _slew_row(parameters: Parameters) -> Course[Row]:
    free = parameters.updated({'load_cell.contact': 'absent'})
    run = yield from drive_course(free, AMPLITUDE_MAX_M, STEP_FREQUENCY_HZ, STEP_RUN_STEPS)
    zero_m, slope = yield from zero_by_steps_m(parameters, STEP_FREQUENCY_HZ)
    return {
        'preload_n': parameters.stand.preload,
        'slew_rate_v_per_s': parameters.amplifier.slew_rate,
        'step_length_m': run.step_length_m,
        'zero_steps_m': zero_m,
        'step_slope': slope,
    }


def _draw_slew(table: Table, figure: Figure) -> None:
    step, zero = panels = figure.subplots(1, 2)
    for axes, name in ((step, 'step_length_m'), (zero, 'zero_steps_m')):
        for preload_n, rows in table.by_preload():
            rates = rows.column('slew_rate_v_per_s') * MICRO
            values_nm = rows.column(name) * NM
            how = preload_style(preload_n)
            axes.plot(rates, values_nm, marker='o', label=f'preload {preload_n:g} N', **how)
    step.set_ylabel(f'step length at {AMPLITUDE_MAX_M * NM:g} nm (nm)')
    zero.set(ylabel='0-amplitude, step length extrapolated (nm)', ylim=(0.0, None))
    step.axhline(0.0, color='0.3', linewidth=0.8)
    for axes in panels:
        axes.set(xlabel='slew rate (V/us)', xscale='log')
        axes.set_xticks(TICKS_V_PER_US, [str(tick) for tick in TICKS_V_PER_US])
        axes.minorticks_off()
        for (rate, label), line in zip(EDELER_V_PER_US.items(), (':', '--'), strict=True):
            axes.axvline(rate, color='0.3', linestyle=line, label=label)
    step.legend(loc='lower right')


def _slew_caption(parameters: Parameters) -> str:
    return (
        f'Free runner, {surface(parameters, "rough")}. {STEP_FREQUENCY_HZ:g} Hz, '
        f'{STEP_RUN_STEPS} steps, mean of the last 10; both assumed, and damping c = '
        f'{parameters.runner.damping:g} N s/m. A negative step goes against the drive. '
        '0-amplitude: line through the step lengths at 100 to 160 nm, left out where its slope '
        f'is below {SLOPE_MIN:g}. Vertical lines: measured by Edeler on a stand of the same '
        'family.'
    )


SLEW = PaperFigure(
    'slew',
    'Unloaded step over slew rate',
    31,
    lambda parameters, points: [
        partial(_slew_row, stand_at(parameters, preload_n, {'amplifier.slew_rate': float(rate)}))
        for preload_n in PRELOADS_N
        for rate in np.geomspace(SLEW_MIN_V_PER_S, SLEW_MAX_V_PER_S, points)
    ],
    _draw_slew,
    _slew_caption,
    (11.0, 5.0),
)


def rounded_stand(parameters: Parameters, preload_n: float, bandwidth_hz: float) -> Parameters:
    """Return a stand with this amplifier bandwidth; infinity is no low-pass."""
    if math.isinf(bandwidth_hz):
        return stand_at(parameters, preload_n, {'amplifier.bandwidth': 0.0})
    step_s = min(parameters.sim.dt, _STEP_S)
    changes = {'amplifier.bandwidth': bandwidth_hz, 'sim.dt': step_s}
    return stand_at(parameters, preload_n, changes)


def _rounded_row(stand: Parameters, bandwidth_hz: float, amplitude_m: float) -> Course[Row]:
    """Return the row of a run; at full stroke, with the onset of force."""
    run, zero_m = (yield from drive_course(stand, amplitude_m, stand.step.frequency)), math.nan
    if amplitude_m == AMPLITUDE_MAX_M:
        zero_m = yield from onset_course(stand, stand.step.frequency)
    return {
        'preload_n': run.preload_n,
        'bandwidth_hz': bandwidth_hz,
        'amplitude_m': amplitude_m,
        'force_mean_n': run.force_mean_n,
        'steady': run.steady,
        'zero_onset_m': zero_m,
    }


def _draw_rounded(table: Table, figure: Figure) -> None:
    panels = figure.subplots(2, len(PRELOADS_N), sharex=True)
    for (force, lost), preload_n in zip(panels.T, PRELOADS_N, strict=True):
        here = table.where(preload_n=preload_n)
        ideal_mn = here.where(bandwidth_hz=math.inf).column('force_mean_n') * MN
        for bandwidth_hz in BANDWIDTHS_HZ:
            rows = here.where(bandwidth_hz=bandwidth_hz)
            amplitudes_nm = rows.column('amplitude_m') * NM
            forces_mn = rows.column('force_mean_n') * MN
            onset_nm = rows.column('zero_onset_m')[-1] * NM
            onset = 'no onset' if math.isnan(onset_nm) else f'from {onset_nm:.0f} nm'
            prefix, unit = (1e-6, 'MHz') if bandwidth_hz >= 1e6 else (1e-3, 'kHz')
            ideal = math.isinf(bandwidth_hz)
            name = 'ideal' if ideal else f'{bandwidth_hz * prefix:g} {unit}'
            force.plot(amplitudes_nm, forces_mn, label=f'{name}: {onset}')
            lost.plot(amplitudes_nm, ideal_mn - forces_mn)
        force.set(title=f'preload {preload_n:g} N', ylim=(0.0, LEGEND_ROOM * ideal_mn.max()))
        lost.set(xlabel='amplitude before rounding (nm)', xlim=(0.0, AMPLITUDE_MAX_M * NM))
        force.legend(loc='upper left')
    panels[0, 0].set_ylabel('generated force (mN)')
    panels[1, 0].set_ylabel('ideal less rounded (mN)')


def _rounded_caption(parameters: Parameters) -> str:
    step_us = min(parameters.sim.dt, _STEP_S) / MICRO
    return (
        'The voltage passes a first-order low-pass behind the slewing amplifier: both corners of '
        'the saw-tooth are rounded, its mean stays. Legend: bandwidth, and the amplitude from '
        'which force is generated. Rough contacts. Behind the low-pass the time step is '
        f'{step_us:g} us. {assumed(parameters)}'
    )


ROUNDED = PaperFigure(
    'rounded',
    'Rounded saw-tooth',
    32,
    lambda parameters, points: [
        partial(_rounded_row, stand, bandwidth_hz, amplitude_m)
        for preload_n in PRELOADS_N
        for bandwidth_hz in BANDWIDTHS_HZ
        for stand in [rounded_stand(parameters, preload_n, bandwidth_hz)]
        for amplitude_m in np.linspace(0.0, AMPLITUDE_MAX_M, points + 1)[1:].tolist()
    ],
    _draw_rounded,
    _rounded_caption,
    (12.0, 7.8),
)
