# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Rigs with random parameters, and their recordings: the study of docs/studies/learned_rigs.md."""

import os
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from stickslip_ros import FitOptions, StickSlipError, fit

sys.path.append(str(Path(__file__).parents[2] / 'test' / 'lab' / 'fitting'))
from spring_rig import Rig, voltage

FULL = os.environ.get('STUDIES') == 'full'  # make studies
RIGS = 50 if FULL else 1  # of each kind
KINDS = ('ideal', 'realistic') if FULL else ('ideal',)
FASTEST_HZ = 600.0
ROWS = voltage((-60.0, 250.0, 1), (-170.0, 200.0, 1), (280.0, 300.0, 5), (300.0, FASTEST_HZ, 8))
PARAMETERS = {
    'contact.friction': 'friction',
    'contact.prefactor': 'prefactor',
    'runner.mass': 'mass_kg',
    'runner.damping': 'damping_n_s_per_m',
    'actuator.gain': 'gain_m_per_v',
}
CONTACT = ('contact.radius', 'contact.young_runner', 'contact.young_sphere')
EXACT = dict.fromkeys((*CONTACT, 'stand.preload', 'scale', 'feet', 'load'), '+-0%')


def rig_of(kind, chance):
    """Draw a rig."""
    known = {
        'preload_n': chance.uniform(0.2, 0.8),
        'friction': chance.uniform(0.2, 0.4),
        'prefactor': chance.uniform(3e-4, 6e-4),
        'mass_kg': chance.uniform(2.4e-3, 3.8e-3),
        'damping_n_s_per_m': chance.uniform(10.0, 30.0),
        'gain_m_per_v': chance.uniform(4.8e-10, 5.8e-10),
    }
    if kind == 'ideal':
        return Rig(**known)
    gains = 1.0 + 0.01 * chance.normal(size=6)
    return Rig(
        **known,
        gains=tuple(gains / (np.array([2, 2, 1, 1, 1, 1]) @ gains / 8.0)),
        noise_m=chance.uniform(0.5e-9, 5e-9),
        low_pass_hz=np.exp(chance.uniform(np.log(5e3), np.log(5e4))),
        late_s=chance.uniform(-4e-3, 4e-3),
        filters_readings=bool(chance.integers(2)),
    )


def table_of(kind, rig, chance):
    """Record a rig; return its table over time, and its commands if the monitor is slow."""
    time_s, position_m = rig.positions(ROWS, 50e3, int(chance.integers(1 << 30)))
    table = pd.DataFrame({'time_s': time_s, 'position_m': position_m})
    rate_hz = 50e3 if kind == 'ideal' else chance.uniform(5e3, 20e3)
    at_s = np.arange(0.0, ROWS[-1, 0], 1.0 / rate_hz)
    noise_v = chance.normal(0.0, 0.0 if kind == 'ideal' else 0.1, len(at_s))
    monitor = pd.DataFrame({'time_s': at_s, 'voltage_v': np.interp(at_s, *ROWS.T) + noise_v})
    both = table.round({'time_s': 9}), monitor.round({'time_s': 9})
    commands = pd.DataFrame({'time_s': ROWS[:, 0], 'voltage_v': ROWS[:, 1]})
    is_slow = rate_hz < 10.0 * FASTEST_HZ
    return both[0].merge(both[1], on='time_s', how='outer'), commands if is_slow else None


def learned(kind, number):
    """Learn a rig; return a row for each parameter, or why it was refused."""
    chance = np.random.default_rng([number, kind == 'ideal'])
    rig = rig_of(kind, chance)
    about = {'kind': kind, 'rig': number}
    table, commands = table_of(kind, rig, chance)
    try:
        options = FitOptions(
            commands=commands, preloads_n=(rig.preload_n,), workers=1, assume=EXACT
        )
        found = fit(table, list(PARAMETERS), options=options)
    except StickSlipError as refusal:
        return [{**about, 'refused': str(refusal)}]
    rows = []
    for each in found.estimates:
        true = getattr(rig, PARAMETERS[each.name])
        rows.append(
            {
                **about,
                'parameter': each.name,
                # What the fit itself says: no interval holds, or none is given for this one.
                'told': not found.holds,
                'undetermined': each.undetermined,
                'holds': each.low <= true <= each.high,
                'standard errors off': np.log(each.value / true)
                * each.value
                / each.standard_error,
                'standard error (%)': 100.0 * each.standard_error / each.value,
                'chi-square per reading': found.reduced_chi_square,
                'seconds': found.wall_s,
            }
        )
    return rows


def learn():
    """Learn every rig; return a row for each parameter."""
    return pd.DataFrame(
        [row for k in range(1, RIGS + 1) for kind in KINDS for row in learned(kind, k)]
    )


def counted(kept):
    """Count the intervals, and those that hold the truth, by parameter and kind of rig."""
    held = kept.pivot_table(
        index='parameter', columns='kind', values='holds', aggfunc=['size', 'sum']
    )
    held.loc['all'] = held.sum()
    return held
