# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""One unknown at a time: the study of docs/studies/unknowns.md."""

import os
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from stickslip_ros import Parameters, force_onset_m, load_yaml, run_drive, sweep

FULL = os.environ.get('STUDIES') == 'full'  # make studies
STROKE_M = 160e-9
RINGS = {'actuator.damping_ratio': 0.1}
UNKNOWNS = {
    'default': {},
    'piezos ring at 150 kHz, D = 0.1': {'actuator.resonance': 150e3, **RINGS},
    'piezos ring at 500 kHz, D = 0.1': {'actuator.resonance': 500e3, **RINGS},
    'damping c, 25 N s/m': {'runner.damping': 25.0},
    'damping c, 80 N s/m': {'runner.damping': 80.0},
    'frequency f, 500 Hz': {'step.frequency': 500.0},
    'frequency f, 2 kHz': {'step.frequency': 2e3},
    'friction coefficient, 0.25': {'contact.friction': 0.25},
    'friction coefficient, 0.35': {'contact.friction': 0.35},
    'weight of the runner': {'stand.weight': True},
    'moving mass, 4 g': {'runner.mass': 4e-3},
    'moving mass, 5 g': {'runner.mass': 5e-3},
    'load cell k, 30 kN/m': {'load_cell.stiffness': 3e4},
    'load cell k, 300 kN/m': {'load_cell.stiffness': 3e5},
    'guide and cable, 1 kN/m': {'guide': 1e3},
    'guide and cable, 10 kN/m': {'guide': 1e4},
    'amplifier bandwidth, 100 kHz': {'amplifier.bandwidth': 1e5},
    'amplifier bandwidth, 1 MHz': {'amplifier.bandwidth': 1e6},
    'piezo hysteresis, 10 %': {'actuator.hysteresis': 0.1},
    'piezo hysteresis, 20 %': {'actuator.hysteresis': 0.2},
    'scatter of the gains, 5 %': {'actuator.gain_tolerance': 0.05},
    'scatter of the gains, 10 %': {'actuator.gain_tolerance': 0.1},
    'six rough lines, seed 1': {'contact.profile': 'rough_line', 'contact.line_seed': 1},
    'six rough lines, seed 101': {'contact.profile': 'rough_line', 'contact.line_seed': 101},
}
POINTS = 25 if FULL else 9
RANGES = {
    'runner.damping': np.append(0.0, np.geomspace(1.0, 1e3, POINTS - 1)),
    'frequency_hz': np.geomspace(100.0, 5000.0, POINTS),
    'load_cell.stiffness': np.geomspace(1e4, 1e6, POINTS),
    'amplifier.slew_rate': np.geomspace(10e6, 300e6, POINTS),
}
COARSE = {} if FULL else {'contact.line_points': 1 << 15, 'contact.cutoff_upper': 2e7}
CONFIG = Path(__file__).parents[2] / 'config'
ASSUMED = {
    'frame.mass': (0.01, 0.1, 1.0),
    'frame.resonance': (600.0, 6000.0),
    'frame.damping_ratio': (0.005, 0.1),
    'load_cell.resonance': (500.0, 5000.0),
    'load_cell.restitution': (0.0, 0.9),
    'actuator.stiffness': (1.1e7, 1e8),
    'actuator.resonance': (75e3, 300e3),
    'actuator.damping_ratio': (0.03, 0.3),
}


def readings(changes):
    """Read force, onset and free step; a guide is a spring beside the load cell."""
    guide_n_per_m = changes.get('guide', 0.0)
    stand = Parameters().updated({name: each for name, each in changes.items() if name != 'guide'})
    cell_n_per_m = stand.load_cell.stiffness
    stand = stand.updated({'load_cell.stiffness': cell_n_per_m + guide_n_per_m})
    share, frequency_hz = cell_n_per_m / stand.load_cell.stiffness, stand.step.frequency
    row = {}
    for preload_n in (0.1, 0.5, 1.0):
        run = run_drive(stand.updated({'stand.preload': preload_n}), STROKE_M, frequency_hz)
        row[f'force at {preload_n:g} N (mN)'] = 1e3 * share * run.force_mean_n
    free = stand.updated({'load_cell.contact': 'absent'})
    row['free step at 0.5 N (nm)'] = 1e9 * run_drive(free, STROKE_M, 200.0, 120).step_length_m
    quick = stand.updated({'sim.dt': 1e-5})
    row['onset at 0.5 N (nm)'] = 1e9 * force_onset_m(quick, frequency_hz) if FULL else np.nan
    return row


def one_at_a_time():
    """Return the readings with each change."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return pd.DataFrame(list(pool.map(readings, UNKNOWNS.values())), UNKNOWNS)


def draw_changes(found):
    """Draw the changes against the default."""
    change = 100 * (found / found.iloc[0] - 1).iloc[:0:-1].dropna(axis='columns')
    axes = change.plot.barh(figsize=(9, 10), width=0.8, xlabel='change against the default (%)')
    axes.set_xscale('symlog', linthresh=10)


def draw_ranges():
    """Drive and draw the force over four ranges."""
    stand = Parameters().updated({'stand.preload': 0.7})
    _, panels = plt.subplots(1, 4, sharey=True, figsize=(13, 3.5), layout='constrained')
    for axes, (name, values) in zip(panels, RANGES.items(), strict=True):
        forces_mn = 1e3 * sweep(stand, {name: values, 'amplitude_m': 130e-9})['force_mean_n']
        axes.plot(values, forces_mn, marker='.')
        axes.set(xlabel=name, ylim=(0, None))
        axes.set_xscale('symlog' if values[0] == 0 else 'log')
    panels[0].set_ylabel('mean force (mN)')


def on_lines(share, seed):
    """Read a stand with rough lines, of which a share travels."""
    changes = {
        'contact.profile': 'rough_line',
        'contact.travel': share,
        'contact.line_seed': seed,
        **COARSE,
    }
    return {'contact.travel': share, **readings(changes)}


def over_shares():
    """Return the readings of lines of other seeds, for each share that travels."""
    places = list(
        product((0.0, 0.5, 0.9, 1.0), range(1, 181 if FULL else 13, 6))
    )  # each line takes six seeds
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        lines = pd.DataFrame(list(pool.map(lambda place: on_lines(*place), places))).dropna(
            axis='columns'
        )
    return lines.groupby('contact.travel')


def pushed_back(stand):
    """Read free step and force at three preloads."""
    row = {}
    for preload_n in (0.1, 0.5, 1.0):
        stand = stand.updated({'stand.preload': preload_n})
        free, pushing = (
            stand.updated({f'load_cell.{k}': v}) for k, v in (('contact', 'absent'), ('gap', 0.0))
        )
        row[f'free step at {preload_n:g} N (nm)'] = (
            1e9 * run_drive(free, STROKE_M, 1000.0, 60).step_length_m
        )
        row[f'force at {preload_n:g} N (mN)'] = (
            1e3 * run_drive(pushing, STROKE_M, 1000.0, 150).force_mean_n
        )
    return row


def assumed():
    """Return the readings with each number of the coupled stand lowered and raised."""
    rigid = load_yaml(CONFIG / 'realistic.yaml')
    coupled = load_yaml(CONFIG / 'realistic.yaml', CONFIG / 'coupled.yaml')
    stands = {'realistic.yaml': rigid, 'coupled.yaml on top': coupled}
    stands |= {
        f'{name} = {v:g}': coupled.updated({name: v})
        for name, values in ASSUMED.items()
        for v in values
    }
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return pd.DataFrame(list(pool.map(pushed_back, stands.values())), stands)
