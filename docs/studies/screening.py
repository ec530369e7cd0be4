# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Measurements that matter most: the study of docs/studies/screening.md."""

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pandas as pd
from SALib.analyze import morris as effects
from SALib.sample import morris as ways

from stickslip_ros import Parameters, force_onset_m, run_drive

FULL = os.environ.get('STUDIES') == 'full'  # make studies
PRELOAD_N, STROKE_M = 0.5, 160e-9
UNKNOWNS = {
    'damping c': ('runner.damping', 0.0, 100.0),
    'frequency f': ('step.frequency', 100.0, 2000.0, 'log'),
    'load-cell stiffness k': ('load_cell.stiffness', 3e4, 3e5, 'log'),
    'guide and cable': ('guide', 0.0, 1e4),
    'friction coefficient': ('contact.friction', 0.25, 0.35),
    'moving mass': ('runner.mass', 3e-3, 5e-3),
    'weight of the runner': ('stand.weight', 0.0, 1.0),
    'piezo resonance': ('actuator.resonance', 50e3, 1e6, 'log'),
    'its damping ratio': ('actuator.damping_ratio', 0.02, 0.7, 'log'),
    'amplifier bandwidth': ('amplifier.bandwidth', 100e3, 3e6, 'log'),
    'amplifier current': ('amplifier.current_max', 0.25, 0.75),
    'piezo hysteresis': ('actuator.hysteresis', 0.0, 0.2),
    'piezo creep': ('actuator.creep', 0.0, 0.02),
    'scatter of the gains': ('actuator.gain_tolerance', 0.0, 0.1),
    'threshold of the onset': ('threshold', 1e-3, 15e-3, 'log'),
}
NAMES = ['force (mN)', 'free step (nm)', '0-amplitude (nm)'][: 3 if FULL else 2]


def unknowns():
    """Return the unknowns and their ranges as a table."""
    return pd.DataFrame(
        [(*row, '')[:4] for row in UNKNOWNS.values()],
        UNKNOWNS,
        ['parameter', 'low', 'high', 'scale'],
    )


def value(place, low, high, scale=''):
    """Return the value at a place between 0 and 1 of a range."""
    return low * (high / low) ** place if scale else low + (high - low) * place


def readings(places):
    """Read force, free step and, in full, 0-amplitude at a place of the hypercube."""
    values = {
        parameter: float(value(place, *limits))
        for place, (parameter, *limits) in zip(places, UNKNOWNS.values(), strict=True)
    }
    guide_n_per_m, threshold_n = values.pop('guide'), values.pop('threshold')
    cell_n_per_m = values['load_cell.stiffness']
    share = cell_n_per_m / (cell_n_per_m + guide_n_per_m)
    values |= {
        'load_cell.stiffness': cell_n_per_m / share,
        'stand.weight': values['stand.weight'] > 0.5,
    }
    stand = Parameters().updated({'stand.preload': PRELOAD_N, **values})
    free, frequency_hz = stand.updated({'load_cell.contact': 'absent'}), stand.step.frequency
    step_nm = 1e9 * run_drive(free, STROKE_M, frequency_hz, 120).step_length_m
    force_mn = (
        1e3 * share * run_drive(stand, STROKE_M, frequency_hz, 0 if FULL else 60).force_mean_n
    )
    if not FULL:  # the onset takes ten runs
        return force_mn, step_nm
    onset_m = force_onset_m(stand.updated({'sim.dt': 1e-5}), frequency_hz, threshold_n / share)
    return force_mn, step_nm, 1e9 * np.nan_to_num(onset_m, nan=STROKE_M)


def screen():
    """Return the mean effect of each unknown and its error, the largest first."""
    problem = {
        'num_vars': len(UNKNOWNS),
        'names': list(UNKNOWNS),
        'bounds': [[0.0, 1.0]] * len(UNKNOWNS),
    }
    places = ways.sample(problem, 20 if FULL else 4, num_levels=4, seed=1)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        found = np.array(list(pool.map(readings, places)))
    table = pd.DataFrame(index=UNKNOWNS)
    for name, column in zip(NAMES, found.T, strict=True):
        told = effects.analyze(problem, places, column, num_levels=4, seed=1)
        table[name], table[f'± {name}'] = told['mu_star'], told['mu_star_conf']
    order = (table[NAMES] / table[NAMES].max()).sum(axis=1).sort_values(ascending=False).index
    return table.loc[order]


def draw(table):
    """Draw the effects, the largest on top."""
    upwards = table.iloc[::-1]
    upwards[NAMES].plot.barh(
        xerr=upwards[[f'± {name}' for name in NAMES]].T.to_numpy(),
        subplots=True,
        layout=(1, -1),
        sharey=True,
        legend=False,
        figsize=(12, 5),
    )
