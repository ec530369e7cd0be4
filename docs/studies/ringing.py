# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Piezos that ring: the study of docs/studies/ringing.md."""

import os
from concurrent.futures import ThreadPoolExecutor
from itertools import product

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from stickslip_ros import Parameters, force_onset_m, presliding, run_drive

FULL = os.environ.get('STUDIES') == 'full'  # make studies
STROKE_M, FREQUENCY_HZ = 160e-9, 1000.0
PRELOADS_N = (0.1, 0.5, 1.0) if FULL else (0.5,)
RESONANCES_HZ = np.geomspace(50e3, 1e6, 15 if FULL else 5)
VARIANTS = {  # damping ratio, and the current into the piezos (0: any)
    'D = 0.02': (0.02, 0.0),
    'D = 0.1': (0.1, 0.0),
    'D = 0.3': (0.3, 0.0),
    'D = 0.7': (0.7, 0.0),
    'D = 0.1, 0.25 A': (0.1, 0.25),
}
NAMES = 'stand.preload', 'actuator.resonance', 'actuator.damping_ratio', 'amplifier.current_max'
SLEWS_V_PER_S = np.geomspace(10e6, 300e6, 31 if FULL else 5)
RINGS = {
    'massless': (0.0, 0.1),
    '150 kHz, D = 0.02': (150e3, 0.02),
    '150 kHz, D = 0.1': (150e3, 0.1),
    '150 kHz, D = 0.3': (150e3, 0.3),
    '500 kHz, D = 0.1': (500e3, 0.1),
}


def readings(changes):
    """Read force, step, saturation and, in full, the onset of a stand."""
    stand = Parameters().updated(changes)
    free = stand.updated({'load_cell.contact': 'absent'})
    run, before = (run_drive(stand, stroke_m, FREQUENCY_HZ) for stroke_m in (STROKE_M, 140e-9))
    lower = presliding(stand, normal_force_n=np.sqrt(2) / 4 * stand.stand.preload)
    onset_m = force_onset_m(stand, FREQUENCY_HZ) if FULL else np.nan
    return {
        **changes,
        'force (mN)': 1e3 * run.force_mean_n,
        'free step (nm)': 1e9 * run_drive(free, STROKE_M, 200.0, 120).step_length_m,
        'rise of net force, last 20 nm (%)': 100 * (run.force_net_n / before.force_net_n - 1),
        'onset / presliding': onset_m / lower.max_displacement_m,
    }


def study(stands):
    """Read several stands at once."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return pd.DataFrame(list(pool.map(readings, stands))).dropna(axis='columns')


def over_resonance():
    """Return readings of massless piezos at each preload, and of all that ring."""
    rung = [
        (n, hz, *variant)
        for n, variant, hz in product(PRELOADS_N, VARIANTS.values(), RESONANCES_HZ)
    ]
    massless = study(dict(zip(NAMES, (n, 0.0, 0.1, 0.0), strict=True)) for n in PRELOADS_N)
    table = study([dict(zip(NAMES, map(float, row), strict=True)) for row in rung])
    return massless, table


def read_of(table):
    """Return the names of the readings of a table."""
    return [name for name in table if name not in NAMES]


def draw_resonance(massless, table):
    """Draw the readings over the resonance."""
    read = read_of(table)
    _, panels = plt.subplots(
        len(read),
        len(PRELOADS_N),
        squeeze=False,
        sharex=True,
        layout='constrained',
        figsize=(4 + 3 * len(PRELOADS_N), 8),
    )
    for (row, name), (column, preload_n) in product(enumerate(read), enumerate(PRELOADS_N)):
        axes = panels[row, column]
        for label, variant in VARIANTS.items():
            rows = table[(table[[NAMES[0], *NAMES[2:]]] == (preload_n, *variant)).all(axis=1)]
            axes.semilogx(rows[NAMES[1]] / 1e3, rows[name], marker='.', label=label)
        axes.axhline(massless[name][column], color='black', label='massless')
        axes.set(xlabel='resonance (kHz)', ylabel=name, title=f'{preload_n:g} N')
    panels[0, 0].legend(fontsize='small')


def draw_slew(read):
    """Drive and draw the readings over the slew rate."""
    _, panels = plt.subplots(1, len(read), figsize=(4 * len(read), 4), layout='constrained')
    for label, (resonance_hz, ratio) in RINGS.items():
        rings = {'actuator.resonance': resonance_hz, 'actuator.damping_ratio': ratio}
        over_slew = study(
            [{**rings, 'amplifier.slew_rate': float(slew)} for slew in SLEWS_V_PER_S]
        )
        for axes, name in zip(panels, read, strict=True):
            if name in over_slew:
                axes.semilogx(SLEWS_V_PER_S / 1e6, over_slew[name], marker='.', label=label)
            axes.set(xlabel='slew rate (V/us)', ylabel=name)
    panels[0].legend(fontsize='small')
