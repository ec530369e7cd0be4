# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Steps that differ: the study of docs/studies/travel.md."""

import os
from concurrent.futures import ThreadPoolExecutor

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from stickslip_ros import Bench, Parameters, Request

FULL = os.environ.get('STUDIES') == 'full'  # make studies
STEPS, LINES = (3000, 60) if FULL else (300, 8)
HERTZ, FIRST = 200.0, 20  # first steps, which are forgotten
free = Parameters().updated(
    {
        'load_cell.contact': 'absent',
        'runner.damping': 40.0,
        'contact.profile': 'rough_line',
        'sim.block': 0.005,
    }
)
if not FULL:  # a quarter of the springs, fewer waves: lines that stay step the same to 0.1 %
    free = free.updated({'contact.line_points': 1 << 15, 'contact.cutoff_upper': 2e7})
CASES = {
    'stroke 150 nm': {},
    'stroke 110 nm': {'stroke_m': 110e-9},
    'preload 0.1 N': {'stand__preload': 0.1},
    'preload 1 N': {'stand__preload': 1.0},
    'no damping': {'runner__damping': 0.0},
    'nine tenths on the runner': {'contact__travel': 0.9},
    'half on the runner': {'contact__travel': 0.5},
}


def steps_nm(count=STEPS, stroke_m=150e-9, **changes):
    """Return the steps of a free runner, nm, without the first ones."""
    stand = free.updated({name.replace('__', '.'): value for name, value in changes.items()})
    bench, ends_m = Bench(stand), []
    requests = [Request('sawtooth', (stroke_m / stand.actuator.gain, HERTZ, 0.0))]
    while len(ends_m) < count:
        output = bench.update(bench.time_ns + stand.block_ns, requests)
        requests = []
        ends_m.extend(output.ramps[:, 2])
    return 1e9 * np.diff(ends_m)[FIRST:]


def correlation(steps):
    """Return the correlation of steps over the number of steps between them."""
    products = np.correlate(steps - steps.mean(), steps - steps.mean(), 'full')[len(steps) - 1 :]
    return products / products[0]


def length_um(steps):
    """Return the way over which the correlation falls to 1/e, um."""
    return 1e-3 * steps.mean() * np.argmax(correlation(steps) < 1 / np.e)


def drive():
    """Return steps on travelling lines by case, and a step of each line that stays, nm."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        ways = list(
            pool.map(lambda case: steps_nm(**{'contact__travel': 1.0, **case}), CASES.values())
        )
        frozen = list(
            pool.map(lambda n: steps_nm(FIRST + 3, contact__line_seed=1 + 6 * n)[-1], range(LINES))
        )
    return dict(zip(CASES, ways, strict=True)), frozen


def table_of(found):
    """Return mean, scatter and correlation length of each case."""
    return pd.DataFrame(
        {
            name: {
                'mean (nm)': steps.mean(),
                'standard deviation (nm)': steps.std(),
                'relative (%)': 100 * steps.std() / steps.mean(),
                'neighbours differ by (nm)': np.diff(steps).std(),
                'correlation length (um)': length_um(steps),
            }
            for name, steps in found.items()
        }
    ).T


def draw(found, frozen):
    """Draw the distribution of steps, and their correlation over the way."""
    steps = found['stroke 150 nm']
    _, (left, right) = plt.subplots(1, 2, figsize=(11, 3.5), layout='constrained')
    left.hist(steps, bins=30, density=True, label='steps on one line')
    left.hist(
        frozen,
        bins=10,
        density=True,
        histtype='step',
        color='black',
        label='lines that stay, one each',
    )
    left.set(xlabel='step (nm)', ylabel='density (1/nm)')
    left.legend()
    for name in ('stroke 150 nm', 'stroke 110 nm'):
        values = correlation(found[name])
        way_um = 1e-3 * found[name].mean() * np.arange(len(values))
        right.plot(way_um[way_um < 15], values[way_um < 15], label=name)
    right.axhline(1 / np.e, color='black', linestyle='--')
    right.set(xlabel='way between two steps (um)', ylabel='correlation of their lengths')
    right.legend()


def compare_means(found, frozen):
    """Compare the mean step on one line with that of lines that stay."""
    steps = found['stroke 150 nm']
    return pd.Series(
        {
            'mean on one line (nm)': steps.mean(),
            'mean of lines that stay (nm)': np.mean(frozen),
            'its standard error (nm)': np.std(frozen, ddof=1) / LINES**0.5,
            'standard deviation of lines that stay (nm)': np.std(frozen, ddof=1),
        }
    )
