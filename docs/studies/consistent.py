# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Assumptions that meet every statement of the paper: the study of docs/studies/consistent.md."""

import os
from concurrent.futures import ThreadPoolExecutor
from itertools import product

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from stickslip_ros import Parameters, force_onset_m, presliding, run_drive

FULL = os.environ.get('STUDIES') == 'full'  # make studies
PRELOADS_N = (0.1, 0.2, 0.4, 0.5, 0.7, 1.0)


def lower_presliding_m(preload_n):
    """Return the maximal presliding of a lower contact, m."""
    return presliding(Parameters(), normal_force_n=np.sqrt(2) / 4 * preload_n).max_displacement_m


def verdict(loss_factor, frequency_hz):
    """Read the thresholds that serve and the rises of a set of assumptions, and judge it."""
    row = {'loss_factor': loss_factor, 'frequency_hz': frequency_hz}

    def net_n(preload_n, amplitude_m):
        changes = {'stand.preload': preload_n, 'contact.loss_factor': loss_factor}
        return run_drive(Parameters().updated(changes), amplitude_m, frequency_hz).force_net_n

    for tolerance in (0.05, 0.10):
        # Not reached below the presliding by the tolerance, and reached above it
        low_n = max(net_n(n, (1 - tolerance) * lower_presliding_m(n)) for n in PRELOADS_N)
        high_n = min(net_n(n, (1 + tolerance) * lower_presliding_m(n)) for n in PRELOADS_N)
        row |= {
            f'low_{tolerance:.0%}_mn': 1e3 * max(low_n, 0),
            f'high_{tolerance:.0%}_mn': 1e3 * high_n,
        }
    quarter = Parameters().updated({'stand.preload': 0.25, 'contact.loss_factor': loss_factor})
    row['thesis_mn'] = 1e3 * run_drive(quarter, 160e-9, frequency_hz).force_mean_n
    rises = [net_n(n, 160e-9) / net_n(n, 140e-9) - 1 for n in PRELOADS_N]
    if rises[0] > 0.03:
        return {**row, 'verdict': '0.1 N does not saturate'}
    if min(rises[2:]) < 0.05:
        return {**row, 'verdict': 'a preload from 0.4 N on saturates'}
    for tolerance in ('5%', '10%'):
        if row[f'low_{tolerance}_mn'] < row[f'high_{tolerance}_mn']:
            return {**row, 'verdict': f'meets all, onsets within {tolerance}'}
    return {**row, 'verdict': 'no common threshold'}


def search():
    """Judge every pair of loss factor and frequency; return a row for each."""
    losses = np.linspace(0.0, 0.5, 21) if FULL else np.array([0.0, 0.1, 0.2, 0.3])
    frequencies_hz = np.geomspace(100.0, 2000.0, 11) if FULL else np.array([200.0])
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        rows = list(
            pool.map(lambda place: verdict(*map(float, place)), product(losses, frequencies_hz))
        )
    return pd.DataFrame(rows)


MARKS = {
    'meets all, onsets within 5%': 'ko',
    'meets all, onsets within 10%': 'kd',
    'no common threshold': 'rx',
    '0.1 N does not saturate': 'b^',
    'a preload from 0.4 N on saturates': 'gv',
}


def draw(table):
    """Draw the verdicts over loss factor and frequency."""
    _, axes = plt.subplots(figsize=(8, 4))
    for name, rows in table.groupby('verdict'):
        axes.semilogy(rows['loss_factor'], rows['frequency_hz'], MARKS[name], label=name)
    axes.set(xlabel='loss factor', ylabel='frequency (Hz)')
    axes.legend(loc='upper center', bbox_to_anchor=(0.5, 1.25), ncols=2, fontsize='small')


def onsets_of(stand, threshold_n):
    """Compare the onset of a set of assumptions with the presliding at each preload."""
    onsets = pd.DataFrame(
        {
            'preload (N)': PRELOADS_N,
            'presliding (nm)': [1e9 * lower_presliding_m(n) for n in PRELOADS_N],
        }
    )
    onsets['onset (nm)'] = [
        1e9 * force_onset_m(stand.updated({'stand.preload': n}), stand.step.frequency, threshold_n)
        for n in PRELOADS_N
    ]
    onsets['onset / presliding'] = onsets['onset (nm)'] / onsets['presliding (nm)']
    return onsets
