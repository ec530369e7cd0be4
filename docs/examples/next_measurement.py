"""
Rank the next measurements after a fit by the errors that they would leave.

``python docs/examples/next_measurement.py`` fits friction and gain to steps under one preload, and
prints the best pairs of preload and voltage to measure next.

The slopes J of a prediction add J'J/s^2 to the information of the fit, the inverse of its
covariance; the best measurement leaves the smallest volume of the errors (D-optimal). Slopes are
those of the fitted stand, so the expected errors are as true as the fit.

"""

import numpy as np
import pandas as pd

from stickslip_ros import FitOptions, Parameters, fit, run_drive

FREE = Parameters().updated({'load_cell.contact': 'absent'})
NAMES = ['contact.friction', 'actuator.gain']
EXACT = ['scale', 'contact.radius', 'contact.young_runner', 'contact.young_sphere']
EXACT += ['stand.preload', 'feet', 'load', 'voltage', 'position']
CANDIDATES = [(n, v) for n in (0.1, 0.2, 0.35, 0.5, 0.7, 1.0) for v in (150.0, 225.0, 300.0)]
"""Preloads (N) and voltages (V)."""
FREQUENCY_HZ, ERROR_M = 500.0, 0.2e-9
CHANGE = 1e-3
"""Relative change of a parameter for a slope."""


def step_m(stand, preload_n, voltage_v):
    """Return the length of a step, m."""
    stand = stand.updated({'stand.preload': preload_n})
    return run_drive(stand, voltage_v * stand.actuator.gain, FREQUENCY_HZ).step_length_m


def measured(stand, pairs):
    """Return the table of steps that a stand makes."""
    rows = [(*pair, 1e9 * step_m(stand, *pair), 1e9 * ERROR_M) for pair in pairs]
    return pd.DataFrame(rows, columns=['preload (N)', 'voltage (V)', 'step (nm)', 'step std (nm)'])


def fit_steps(table):
    """Return the fit of a table of steps, with constants that are known exactly."""
    exact = dict.fromkeys(EXACT, '+-0%')
    options = FitOptions(starts=1, assume=exact, frequency_hz=FREQUENCY_HZ)
    return fit(table, NAMES, parameters=FREE, options=options)


def slopes(stand, pair):
    """Return the slopes of a step over the free parameters."""
    values = stand.flat()
    found = []
    for name in NAMES:
        low, high = (values[name] * (1.0 + way) for way in (-CHANGE, CHANGE))
        ends_m = [step_m(stand.updated({name: each}), *pair) for each in (low, high)]
        found.append((ends_m[1] - ends_m[0]) / (high - low))
    return np.array(found)


def ranked(fitted):
    """Return relative errors expected after each candidate, and the candidate, best first."""
    values = np.array([fitted.parameters.flat()[name] for name in NAMES])
    information = np.linalg.inv(fitted.covariance / np.outer(values, values))
    after = []
    for pair in CANDIDATES:
        slope = values * slopes(fitted.parameters, pair) / ERROR_M
        covariance = np.linalg.inv(information + np.outer(slope, slope))
        after.append((np.linalg.det(covariance), np.sqrt(np.diag(covariance)), pair))
    return [(errors, pair) for _, errors, pair in sorted(after, key=lambda each: each[0])]


def main():
    """Fit, rank and print; return the fit and the ranking."""
    fitted = fit_steps(measured(FREE, [(0.35, volts) for volts in (200.0, 250.0, 300.0)]))
    print(fitted)
    ranking = ranked(fitted)
    for errors, (preload_n, voltage_v) in ranking[:5]:
        left = ', '.join(f'{name} {error:.2%}' for name, error in zip(NAMES, errors, strict=True))
        print(f'{preload_n:g} N, {voltage_v:g} V leave errors of {left}')
    return fitted, ranking


if __name__ == '__main__':
    main()
