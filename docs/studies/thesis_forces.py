# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Forces in Edeler's thesis: the study of docs/studies/thesis_forces.md."""

import os
from concurrent.futures import ThreadPoolExecutor
from itertools import product

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from stickslip_ros import Parameters, force_onset_m, run_drive

FULL = os.environ.get('STUDIES') == 'full'  # make studies
STROKE_M, FREQUENCY_HZ = 160e-9, 1000.0
# Twice the voltage of the stand: room for twice the onset at 1 N
ROOMY = Parameters().updated({'amplifier.voltage_max': 600.0})


def readings(preload_n, damping):
    """Read onset, force at the full stroke and share of the holding force at twice the onset."""
    stand = ROOMY.updated({'stand.preload': preload_n, 'runner.damping': damping})
    onset_m = force_onset_m(stand.updated({'sim.dt': 1e-5}), FREQUENCY_HZ)
    double_n = run_drive(stand, 2 * onset_m, FREQUENCY_HZ).force_mean_n
    return {
        'preload_n': preload_n,
        'damping_n_s_per_m': damping,
        'onset_m': onset_m,
        'force_at_full_n': run_drive(stand, STROKE_M, FREQUENCY_HZ).force_mean_n,
        'double_onset_share': double_n / (0.3 * 2 * np.sqrt(2) * preload_n),
    }


def predicted():
    """Return the readings over preload and damping."""
    places = product((0.1, 0.25, 0.5, 1.0), np.linspace(0.0, 300.0, 16 if FULL else 6).tolist())
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return pd.DataFrame(pool.map(lambda place: readings(*place), places))


def draw(table):
    """Draw force and share over the damping, beside the measured values."""
    _, (force, share) = plt.subplots(1, 2, figsize=(11, 4), layout='constrained')
    quarter = table[table['preload_n'] == 0.25].set_index('damping_n_s_per_m')
    (1e3 * quarter['force_at_full_n']).plot(
        ax=force, ylabel='force at 160 nm, 0.25 N (mN)', ylim=(0, None)
    )
    force.axhspan(112.5, 140.0, color='0.8', label='measured: between these')
    shares = table.pivot(
        index='damping_n_s_per_m', columns='preload_n', values='double_onset_share'
    )
    shares.plot(ax=share, ylabel='force at twice the onset / holding force', ylim=(0, 1))
    share.axhline(0.9, color='black', label='measured: SL-2040')
    force.legend()
    share.legend()


def by_frequency():
    """Return the force at 0.25 N over the frequency, for dampings near the bound, mN."""
    frequencies_hz = (100.0, 200.0, 300.0, 500.0, 700.0, 1000.0, 1500.0, 2000.0)
    at_quarter = Parameters().updated({'stand.preload': 0.25})
    return pd.DataFrame(
        {
            f'c = {damping:g} N s/m': [
                1e3
                * run_drive(
                    at_quarter.updated({'runner.damping': damping}), STROKE_M, f
                ).force_mean_n
                for f in frequencies_hz
            ]
            for damping in (0.0, 11.0, 13.0, 15.0, 25.0)
        },
        pd.Index(frequencies_hz, name='frequency (Hz)'),
    )
