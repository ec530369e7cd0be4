# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The drive with every profile and friction law: the study of docs/studies/laws.md."""

import os

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from stickslip_ros import Parameters, sweep

FULL = os.environ.get('STUDIES') == 'full'  # make studies
CHOSEN = {
    'contact.profile': ['rough', 'smooth', 'rough_line'],
    'contact.law': ['coulomb', 'dahl', 'lugre', 'epm'],
}


def forces():
    """Return the force with each profile and law over preload and amplitude."""
    values = {
        'stand.preload': [0.1, 0.5, 1.0],
        'amplitude_m': np.linspace(0.0, 160e-9, 17 if FULL else 9),
    }
    table = pd.concat(
        [
            sweep(Parameters(), {name: choices, **values}).rename(columns={name: 'profile or law'})
            for name, choices in CHOSEN.items()
        ]
    )
    table['force (mN)'] = 1e3 * table['force_mean_n']
    return table


def draw(table):
    """Draw the force over the amplitude, Coulomb's law on axes of its own."""
    _, panels = plt.subplots(
        2, 3, sharex=True, figsize=(13, 6.5), height_ratios=(1, 3), layout='constrained'
    )
    for (apart, others), (preload_n, rows) in zip(
        panels.T, table.groupby('preload_n'), strict=True
    ):
        for name, curve in rows.groupby('profile or law', sort=False):
            wide = {'linewidth': 6, 'color': '0.75'} if name == 'dahl' else {'marker': '.'}
            axes = apart if name == 'coulomb' else others
            axes.plot(1e9 * curve['amplitude_m'], curve['force (mN)'], label=name, **wide)
        apart.set_title(f'preload {preload_n:g} N')
        apart.legend(loc='lower right')
        others.set(
            xlabel='amplitude of the feet (nm)', ylabel='force, mean of the last cycle (mN)'
        )
    panels[1, 0].legend()
