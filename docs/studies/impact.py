# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A sphere that rebounds: the study of docs/studies/impact.md."""

import math
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from scipy.optimize import least_squares

from stickslip_ros import SpringContact, load_yaml, presliding

FULL = os.environ.get('STUDIES') == 'full'  # make studies
HERE = Path(__file__).parent
SPEED_M_PER_S, DENSITY_KG_PER_M3 = 3.9, 4000.0
ROLL = 2.5  # m R^2/I of a solid sphere
STEPS = 1000  # twice as many change no result by 2e-4 of its largest
COLUMNS = ['tangential_ratio', 'spin_rad_per_s', 'patch_angle_deg']
sphere = load_yaml(HERE / 'alumina_on_glass.yaml')
measured = pd.read_csv(HERE / 'alumina_on_glass.csv', comment='#')
measured = measured[measured['kind'] == 'measured']
SIGMA = {'spin_rad_per_s': 3.2, 'patch_angle_deg': 0.6}  # of digitising


def leaving(stand, along_m_per_s, lost_m_per_s, up_m_per_s):
    """Return the results of COLUMNS from the velocities after an impact."""
    patch_m_per_s = along_m_per_s - (1 + ROLL) * lost_m_per_s
    spin = -ROLL * lost_m_per_s / stand.contact.radius
    return (
        1 - lost_m_per_s / along_m_per_s,
        spin,
        math.degrees(math.atan2(patch_m_per_s, up_m_per_s)),
    )


def rigid_rebound(stand, angle_deg, speed_m_per_s=SPEED_M_PER_S):
    """Rebound of a contact without springs: what sticks, stays so."""
    down, along = (speed_m_per_s * f(math.radians(angle_deg)) for f in (math.cos, math.sin))
    return leaving(stand, along, min(2 * stand.contact.friction * down, along / (1 + ROLL)), down)


def rebound(stand, angle_deg, speed_m_per_s=SPEED_M_PER_S, steps=STEPS):
    """Rebound of an elastic sphere: m d'' = -F, u'' = -(1 + m R^2/I) T/m of the contact point."""
    mass_kg = 4 / 3 * math.pi * stand.contact.radius**3 * DENSITY_KG_PER_M3
    down, along = (speed_m_per_s * f(math.radians(angle_deg)) for f in (math.cos, math.sin))
    # Hertz: F = h d^1.5, so the deepest point and the time to it are known.
    hertz = 1.0 / presliding(stand, normal_force_n=1.0).indentation.depth_m ** 1.5
    deepest_m = (1.25 * mass_kg * down**2 / hertz) ** 0.4
    contact = SpringContact(stand, 1.01 * hertz * deepest_m**1.5)
    half_s = 0.5 * 2.9432 * deepest_m / down / steps
    depth_m = normal_n = tangential_n = lost = 0.0
    while depth_m >= 0.0:
        down -= half_s * normal_n / mass_kg
        lost += half_s * tangential_n / mass_kg
        depth_m += 2 * half_s * down
        normal_n = hertz * max(depth_m, 0.0) ** 1.5
        tangential_n = contact.move(2 * half_s * (along - (1 + ROLL) * lost), normal_n)
        down -= half_s * normal_n / mass_kg
        lost += half_s * tangential_n / mass_kg
    return leaving(stand, along, lost, -down)


def draw():
    """Draw prediction, rigid contact and measured points over the angle."""
    angles_deg = np.linspace(2.5, 87.5, 35 if FULL else 18)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        curve = pd.DataFrame(
            pool.map(lambda a: rebound(sphere, a), angles_deg), angles_deg, COLUMNS
        )
    rigid = pd.DataFrame([rigid_rebound(sphere, a) for a in angles_deg], angles_deg, COLUMNS)
    _, panels = plt.subplots(1, 3, figsize=(14, 4), layout='constrained')
    for axes, name in zip(panels, COLUMNS, strict=True):
        points = measured[measured['quantity'] == name]
        axes.plot(curve.index, curve[name], label='predicted')
        axes.plot(rigid.index, rigid[name], '--', color='0.5', label='rigid contact, Coulomb')
        axes.plot(
            points['angle_deg'],
            points['value'],
            'ko',
            fillstyle='none',
            label='measured, digitised',
        )
        axes.set(xlabel='impact angle to the normal (deg)', ylabel=name)
    panels[0].legend()


def missed(name, friction, law=rebound):
    """Return prediction minus measurement of a quantity, by angle."""
    stand = sphere.updated({'contact.friction': friction})
    points = measured[measured['quantity'] == name]
    found = [law(stand, angle)[COLUMNS.index(name)] for angle in points['angle_deg']]
    return pd.Series(found - points['value'].to_numpy(), points['angle_deg'])


def errors():
    """Return how far the prediction is off, and a rigid contact where the contact sticks."""
    table = pd.DataFrame(
        columns=[
            'points',
            'RMS',
            'bias',
            'share of the range',
            'RMS below 33 deg',
            'of a rigid contact',
        ]
    )
    for name in COLUMNS:
        wrong, stiff = (
            missed(name, sphere.contact.friction),
            missed(name, sphere.contact.friction, rigid_rebound),
        )
        rms, sticks = np.sqrt(np.mean(wrong**2)), wrong.index < 33
        below = [np.sqrt(np.mean(each[sticks] ** 2)) for each in (wrong, stiff)]
        span = np.ptp(measured['value'][measured['quantity'] == name])
        table.loc[name] = len(wrong), rms, wrong.mean(), rms / span, *below
    return table


def fit_friction():
    """Return the least-squares result with mu free, and its standard error."""
    found = least_squares(
        lambda mu: np.concatenate([missed(name, float(mu[0])) / SIGMA[name] for name in SIGMA]),
        [0.092],
        diff_step=0.01,
    )
    error = math.sqrt(
        2 * found.cost / (found.fun.size - 1) / float(found.jac[:, 0] @ found.jac[:, 0])
    )
    return found, error
