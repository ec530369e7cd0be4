# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Equivalent profile against rough lines: the study of docs/studies/roughness.md."""

import os
from concurrent.futures import ThreadPoolExecutor

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from stickslip_ros import Parameters, presliding

FULL = os.environ.get('STUDIES') == 'full'  # make studies
LINES = 1000 if FULL else 20
PER_DECADE = 6 if FULL else 2
PRESSED_N = np.logspace(-4.0, 0.5, int(4.5 * PER_DECADE) + 1)
SHOWN = slice(2 * PER_DECADE, 4 * PER_DECADE + 1)
LOADS_N = PRESSED_N[SHOWN]
# A quarter of the springs and five waves per octave fewer: quicker, and the same to 5 %
COARSE = {} if FULL else {'contact.line_points': 1 << 15, 'contact.cutoff_upper': 2e7}


def pressed(stand):
    """Return depth, presliding and full-stick stiffness under each load."""
    each = [presliding(stand, normal_force_n=float(load_n)) for load_n in PRESSED_N]
    return np.array(
        [
            [one.indentation.depth_m, one.max_displacement_m, one.stick_stiffness_n_per_m]
            for one in each
        ]
    ).T


def press():
    """Press lines and the equivalent body; return ratios of shape (lines, loads) by their name."""
    line = Parameters().updated({'contact.profile': 'rough_line', **COARSE})
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        lines = np.array(
            list(
                pool.map(
                    lambda n: pressed(line.updated({'contact.line_seed': n + 1})), range(LINES)
                )
            )
        )
    body = pressed(Parameters())[:, SHOWN]
    # Force at the depths of the equivalent body, on each line's own curve, straight in logarithms
    forces_n = np.array(
        [np.exp(np.interp(np.log(body[0]), np.log(one[0]), np.log(PRESSED_N))) for one in lines]
    )
    return {
        'F_n at equal depth': forces_n / LOADS_N,
        'presliding': lines[:, 1, SHOWN] / body[1],
        'full-stick stiffness': lines[:, 2, SHOWN] / body[2],
    }


def table_of(ratios):
    """Return mean and standard deviation of the ratios, as text, by load."""
    return pd.DataFrame(
        {
            name: [
                f'{mean:.3f} ± {spread:.3f}'
                for mean, spread in zip(each.mean(axis=0), each.std(axis=0, ddof=1), strict=True)
            ]
            for name, each in ratios.items()
        },
        pd.Index(LOADS_N.round(4), name='F_n (N)'),
    )


def draw(ratios):
    """Draw mean and standard deviation of the ratios over the load."""
    _, panels = plt.subplots(1, 3, figsize=(12, 3.5), sharey=True, layout='constrained')
    for axes, (name, each) in zip(panels, ratios.items(), strict=True):
        mean, spread = each.mean(axis=0), each.std(axis=0, ddof=1)
        axes.semilogx(LOADS_N, mean, marker='o')
        axes.fill_between(LOADS_N, mean - spread, mean + spread, alpha=0.25)
        axes.axhline(1.0, color='black', linestyle='--')
        axes.set(xlabel='normal force (N)', title=f'{name}: lines / equivalent')
