# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Four parameters learned from a few hundredths of a second of motion, by ours and by scipy."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numba
import numpy as np
from scipy.optimize import least_squares

from benchmarks.clock import Program, in_turn
from benchmarks.outcome import Outcome, Row
from benchmarks.rival import HALVES, Springs, equal_springs
from benchmarks.sizes import Sizes
from stickslip_ros.arrays import Array
from stickslip_ros.lab.experiments.experiment import Experiment, Readout, Voltage
from stickslip_ros.lab.experiments.predict import predict
from stickslip_ros.lab.fitting.fit import FitOptions, fit
from stickslip_ros.parameters import Parameters

TRUE = {
    'contact.friction': 0.25,
    'runner.mass': 3.4e-3,
    'runner.damping': 15.0,
    'actuator.gain': 5e-10,
}
START = Parameters().updated({'load_cell.contact': 'absent', 'runner.damping': 20.0})
RATE_HZ, NOISE_M, SEED = 50e3, 1.5e-9, 1
SPRINGS, STEP_S = 80, 1e-6
"""Of the model that scipy fits; finer ones move its estimates by less than their errors."""
ROUNDS_MAX = 3
SHARE = 1e-3  # by which scipy changes a parameter for a slope


def run(sizes: Sizes) -> Outcome:
    """Time whole fits, and say how many runs of the drive they need and what they find."""
    seen = _experiment(max(sizes.cycles // 20, 2))
    compiled = numba.njit()(_move)
    fits: list[tuple[str, Callable[[], tuple[int, float]]]] = [
        ('stickslip_ros.fit', partial(_ours, seen)),
        ('scipy, springs compiled', partial(_scipy, seen, compiled)),
        ('scipy, springs in numpy', partial(_scipy, seen, _move)),
    ]
    found = dict[str, tuple[int, float]]()

    def keep(name: str, call: Callable[[], tuple[int, float]]) -> None:
        found[name] = call()

    few = replace(sizes, rounds=min(sizes.rounds, ROUNDS_MAX), least_s=0.0)
    times = in_turn([Program(partial(keep, *each), 1.0) for each in fits], few)
    rows: list[Row] = []
    for i, (name, _) in enumerate(fits):
        (evaluations, friction), seconds = found[name], times.median(i)
        rows.append(
            {
                'program': name,
                'seconds': seconds,
                'evaluations': evaluations,
                'evaluations_per_s': evaluations / seconds,
                'friction_error': friction / TRUE['contact.friction'] - 1.0,
                **{key.replace('ratio', 'ratio_to_ours'): x for key, x in times.ratio(i).items()},
            }
        )
    return Outcome(
        f'A fit of {", ".join(TRUE)} to {seen.lasts_s:.3g} s of motion',
        rows,
        notes=[
            f'position at {RATE_HZ:g} Hz with noise of {NOISE_M:g} m; one search from one start',
            'ours also tells noise, clock, errors, and what the stand may lack; scipy a minimum',
            f'{SPRINGS} springs of half a contact, steps of {STEP_S:g} s',
        ],
    )


def _experiment(cycles: int) -> Experiment:
    """Return a triangle and saw-teeth of 300 V, 600 Hz, and what a drive makes of them."""
    stand = START.updated(TRUE)
    fall_s = 300.0 / stand.amplifier.slew_rate
    rows = [(0.0, 0.0), (1e-3, 0.0), (2e-3, 60.0), (3e-3, 0.0)]
    for _ in range(cycles):
        end_s = rows[-1][0] + 1.0 / 600.0
        rows += [(end_s - fall_s, 300.0), (end_s, 0.0)]
    rows.append((rows[-1][0] + 1e-3, 0.0))
    time_s = np.arange(0.0, rows[-1][0], 1.0 / RATE_HZ, dtype=np.float64)
    asked = Experiment(
        'benchmark',
        {},
        Voltage(np.array(rows)),
        (Readout('position_m', np.zeros_like(time_s), time_s),),
    )
    [[shown]] = predict(stand, [asked])
    noise_m = np.random.default_rng(SEED).normal(0.0, NOISE_M, len(time_s))
    return replace(asked, observed=(Readout('position_m', shown.values + noise_m, time_s),))


def _ours(seen: Experiment) -> tuple[int, float]:
    """Return the runs of a fit, and the friction coefficient that it finds."""
    found = fit(seen, list(TRUE), parameters=START, options=FitOptions(starts=1, workers=1))
    return found.evaluations, found.estimates[0].value


def _scipy(seen: Experiment, move: Callable[..., Array]) -> tuple[int, float]:
    """Do so by least squares on springs, of the logarithms of the parameters."""
    [readings], drive = seen.observed, seen.drive
    assert isinstance(drive, Voltage)
    steps = round(drive.lasts_s / STEP_S)
    voltage_v = np.interp(STEP_S * np.arange(steps + 1), *drive.rows.T)
    springs, every = equal_springs(START, SPRINGS, HALVES), round(1.0 / (RATE_HZ * STEP_S))
    begun = {name: float(START.flat()[name]) for name in TRUE}
    runs = 0

    def missed(place: Array) -> Array:
        nonlocal runs
        runs += 1
        scale = dict(zip(TRUE, np.exp(place), strict=True))
        value = {name: begun[name] * scale[name] for name in TRUE}
        pressed = Springs(springs.shear_n_per_m, springs.limit_n * scale['contact.friction'])
        foot_m = voltage_v * value['actuator.gain']
        moved_m = move(*pressed, foot_m, value['runner.mass'], value['runner.damping'], every)
        left = (moved_m[: len(readings.values)] - readings.values) / NOISE_M
        return np.asarray(left - np.mean(left))

    found = least_squares(missed, np.zeros(len(TRUE)), diff_step=SHARE, x_scale=0.1)
    return runs, begun['contact.friction'] * float(np.exp(found.x[0]))


def _move(
    shear: Array, limit: Array, foot_m: Array, mass_kg: float, damping: float, every: int
) -> Array:
    """Return where a free runner is after each so many small steps, m; numba compiles it too."""
    q, x, v, share = np.zeros_like(shear), 0.0, 0.0, 0.5 * damping * STEP_S / mass_kg
    out = np.zeros((len(foot_m) - 1) // every + 1)
    for k in range(1, len(foot_m)):
        x += v * STEP_S
        du = v * STEP_S - (foot_m[k] - foot_m[k - 1])
        q = np.minimum(np.maximum(q + shear * du, -limit), limit)
        v = (v * (1.0 - share) - q.sum() * STEP_S / mass_kg) / (1.0 + share)
        if k % every == 0:
            out[k // every] = x
    return out
