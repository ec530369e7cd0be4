# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Rigs with random parameters, and their recordings: the study of docs/studies/learned_rigs.md."""

import os
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from stickslip_ros import FitOptions, StickSlipError, fit, load_yaml, stage_file

sys.path.append(str(Path(__file__).parents[2] / 'test' / 'lab' / 'fitting'))
from spring_rig import Rig, voltage
from stage_rig import GRAVITY, Foot, StageRig, waves

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

HERTZ = {
    'clamp': (300.0, 600.0),
    'heavy': (100.0, 200.0),
    'rod': (300.0, 500.0),
    'three_balls': (100.0, 200.0),
    'walker': (50.0, 100.0),
}
"""Frequencies of two saw-teeth."""
DRIFT, NOISE, NOISE_HERE = {'drift_m_per_s': 5e-7}, {'noise_m': 5e-9}, {'noise_m': 3e-9}
DEFECTS = [
    *[('clamp', 11 + k, each) for k, each in enumerate((DRIFT, NOISE, {'guide': 1.6}))],
    *[('clamp', 14, {'hysteresis': 0.02}), ('clamp', 15, {'cyclic_m': 2e-9})],
    *[('clamp', 16, {'dry': 0.03}), ('clamp', 17, {'load': 0.02})],
    *[('rod', 21, DRIFT), ('rod', 22, NOISE), ('rod', 23, {'monitor_share': -0.01})],
    *[('rod', 24, {'hysteresis': 0.05}), ('rod', 25, {'cyclic_m': 3e-9})],
    *[('rod', 26, {'dry': 0.01}), ('rod', 27, {'load': 0.1})],
    *[('three_balls', 31, DRIFT), ('three_balls', 32, NOISE)],
    *[('three_balls', 33, {'hysteresis': 0.02}), ('three_balls', 34, {'cyclic_m': 1e-9})],
    *[('three_balls', 35, {'dry_n': 5e-3}), ('three_balls', 36, {'position_share': 1e-3})],
    *[('walker', 41, NOISE_HERE), ('walker', 42, {'heavier': 1.1})],
    *[('heavy', 51, NOISE_HERE), ('heavy', 52, {'guide': 2.0})],
]
"""Stages, seeds, and what a rig has that its file does not name: dry friction and load as shares
of the friction of the driven feet, the normal force of the guide and the weight as factors."""


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


def stage_rig_of(stage, seed, defect):
    """Draw a rig like a stage; return it with its preload and its rows of times and voltages."""
    on, chance = load_yaml(stage_file(stage)), np.random.default_rng(seed)

    def factor(largest):
        return float(np.exp(chance.uniform(-np.log(largest), np.log(largest))))

    mass_kg = on.runner.mass * factor(1.7)
    preload_n = on.stand.preload * factor(1.0 if stage == 'three_balls' else 1.3)
    true = {
        'radius_m': on.contact.radius * factor(1.15),
        'friction': 0.3 * chance.uniform(0.65, 1.15),
        'prefactor': on.contact.prefactor * factor(1.6),
        'mass_kg': mass_kg,
        'damping_n_s_per_m': on.runner.damping * factor(1.7),
        'gain_m_per_v': on.actuator.gain * factor(1.3),
        'load_n': on.stand.load * defect.get('heavier', 1.0),
        'moduli_pa': (on.contact.young_sphere, on.contact.young_runner),
    }
    weight_n = mass_kg * GRAVITY * on.stand.weight
    names = 'share', 'weight', 'count', 'gain', 'delay', 'friction', 'young'
    columns, feet = [getattr(on.feet, each) for each in names], []
    for share, weight, *others in zip(*columns, strict=True):
        foot = Foot(share * preload_n + weight * weight_n, *others)
        more = 1.0 if foot.gain else defect.get('guide', 1.0)
        feet.append(foot._replace(normal_n=more * foot.normal_n))
    limit_n = true['friction'] * sum(each.number * each.normal_n for each in feet if each.gain)
    true['load_n'] -= limit_n * defect.get('load', 0.0)
    true['dry_n'] = limit_n * defect.get('dry', 0.0)
    own = {name: each for name, each in defect.items() if name in StageRig.__dataclass_fields__}
    range_v, low_v = on.amplifier.range_v, on.amplifier.voltage_min
    slow_hz, fast_hz = HERTZ[stage]
    rows = waves(
        (-0.2 * range_v, 0.9 * slow_hz, 1),
        (-0.55 * range_v, 0.8 * slow_hz, 1),
        (0.93 * range_v, slow_hz, 3),
        (range_v, fast_hz, 4),
        slew_v_per_s=150e6,
        low_v=low_v,
    )
    return StageRig(tuple(feet), **{**true, **own}, seed=seed), on, preload_n, rows


def learn_stages():
    """Learn rigs that have a defect, with the file of their stage; return a row for each."""
    found = []
    for stage, seed, defect in DEFECTS if FULL else [('rod', 21, DRIFT)]:
        rig, on, preload_n, rows = stage_rig_of(stage, seed, defect)
        columns = zip(('time_s', 'voltage_v', 'position_m'), rig.recorded(rows, 50e3), strict=True)
        preloads_n = () if on.stand.weight else (preload_n,)
        options = FitOptions(preloads_n=preloads_n, starts=1, workers=1)
        result = fit(pd.DataFrame(dict(columns)), [*PARAMETERS], parameters=on, options=options)
        known = [each for each in result.estimates if not each.undetermined]
        pairs = [(each, getattr(rig, PARAMETERS[each.name])) for each in known]
        off = [
            abs(np.log(each.value / true)) * each.value / each.standard_error
            for each, true in pairs
        ]
        found.append(
            {
                'stage': stage,
                'defect': ', '.join(defect),
                'holds': result.holds,
                'intervals': len(known),
                'true': sum(each.low <= true <= each.high for each, true in pairs),
                'largest miss': round(max(off), 1),
                'named': result.missing[0].name if result.missing else '',
            }
        )
    return pd.DataFrame(found)
