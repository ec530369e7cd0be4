# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Slow and rounded falls of the voltage: the study of docs/studies/amplifier.md."""

import os

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from stickslip_ros import Parameters, force_onset_m, run_drive, sweep

FULL = os.environ.get('STUDIES') == 'full'  # make studies
PRELOADS_N = (0.1, 0.5, 1.0) if FULL else (0.5,)
STROKES_M = np.array([100e-9, 120e-9, 140e-9, 160e-9])
SLEWS_V_PER_S = np.geomspace(5e6, 300e6, 31 if FULL else 5)
EDELER_V_PER_US = {25.0: 'no usable step below (Edeler)', 150.0: '0-amplitude least (Edeler)'}
SLOPE_MIN = 0.5  # of the step length over the stroke; below, no line is extrapolated
BANDWIDTHS_HZ = (0.0, 1e6, 300e3, 100e3, 30e3, 10e3) if FULL else (0.0, 100e3, 30e3)
LOW_PASS_STEP_S = 2e-6  # half of it changes no force by 1e-3


def over_slew():
    """Return step length and 0-amplitude of the free runner, 200 Hz, over the slew rate."""
    free = Parameters().updated({'load_cell.contact': 'absent'})
    values = {'amplifier.slew_rate': SLEWS_V_PER_S, 'stand.preload': PRELOADS_N}
    runs = sweep(free, {**values, 'amplitude_m': STROKES_M, 'frequency_hz': 200.0}, steps=120)
    rows = []
    keys = ['amplifier.slew_rate [V/s]', 'preload_n']
    for (slew_v_per_s, preload_n), each in runs.groupby(keys):
        slope, at_0_m = np.polyfit(each['amplitude_m'], each['step_length_m'], 1)
        zero_m = -at_0_m / slope if slope > SLOPE_MIN else np.nan
        step_m = each['step_length_m'].iloc[-1]
        rows.append((slew_v_per_s / 1e6, preload_n, 1e9 * step_m, 1e9 * zero_m))
    names = 'slew rate (V/us)', 'preload (N)', 'step at 160 nm (nm)', '0-amplitude (nm)'
    return pd.DataFrame(rows, columns=names)


def draw_slew(table):
    """Draw both over the slew rate, with what Edeler measured."""
    _, panels = plt.subplots(1, 2, figsize=(11, 5), layout='constrained')
    for axes, name in zip(panels, table.columns[2:], strict=True):
        for preload_n, rows in table.groupby('preload (N)'):
            axes.semilogx(rows['slew rate (V/us)'], rows[name], marker='.', label=f'{preload_n} N')
        for (rate, words), line in zip(EDELER_V_PER_US.items(), (':', '--'), strict=True):
            axes.axvline(rate, color='0.3', linestyle=line, label=words)
        axes.set(xlabel='slew rate (V/us)', ylabel=name)
    panels[0].legend()


def rounded_stand(preload_n, bandwidth_hz):
    """Return the stand behind a low-pass of the amplifier; 0 Hz is none."""
    changes = {'stand.preload': preload_n, 'amplifier.bandwidth': bandwidth_hz}
    return Parameters().updated(changes | {'sim.dt': LOW_PASS_STEP_S} if bandwidth_hz else changes)


def rounded_forces():
    """Return force at 160 nm and onset of force over the bandwidth, at 1 kHz."""
    rows = []
    for preload_n in PRELOADS_N:
        for bandwidth_hz in BANDWIDTHS_HZ:
            stand = rounded_stand(preload_n, bandwidth_hz)
            force_n = run_drive(stand, 160e-9, 1000.0).force_mean_n
            onset_m = force_onset_m(stand, 1000.0)
            rows.append((bandwidth_hz / 1e3, preload_n, 1e3 * force_n, 1e9 * onset_m))
    names = 'bandwidth (kHz), 0: ideal', 'preload (N)', 'force (mN)', 'onset (nm)'
    return pd.DataFrame(rows, columns=names)
