"""
Which unknown matters most: a screening of all that is assumed at once, by Morris's method.

A trajectory begins anywhere among the unknowns and changes one after the other by a large step;
what a change does to a reading, per whole range of the unknown, is an elementary effect. Many
trajectories tell the mean size of the effects of an unknown, and by their scatter how far they
depend on the others (Morris, Technometrics 33, 1991).

"""

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.contact.profile import Array
from stickslip_ros.paper.figure import Case, PaperFigure, Table
from stickslip_ros.paper.readings import (
    AMPLITUDE_MAX_M,
    STEP_RUN_STEPS,
    ZERO_STEP_S,
    first_amplitude_m,
)
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.journal import Row
from stickslip_ros.study.plotting import BLACK, BLUE, label_axes
from stickslip_ros.study.sawtooth_run import run_drive
from stickslip_ros.units import MN, NM

LEVELS = 4
STEP = LEVELS / (2.0 * (LEVELS - 1.0))
"""Change of an unknown, per range: with this one all levels are equally likely (Morris)."""
GUIDE, THRESHOLD = 'guide', 'threshold'
"""What is no parameter: a spring beside the load cell, and the net force that counts as onset."""


class Factor(NamedTuple):
    """An unknown: the name of its column, what it sets, its label, and its range."""

    name: str
    sets: str
    label: str
    low: float
    high: float
    is_log: bool = False

    def value(self, place: float) -> float:
        """Return the value at a place from 0 to 1 of the range."""
        if self.is_log:
            return float(self.low * (self.high / self.low) ** place)
        return self.low + (self.high - self.low) * place


FACTORS = (
    Factor('damping_n_s_per_m', 'runner.damping', 'damping c', 0.0, 100.0),
    Factor('frequency_hz', 'step.frequency', 'frequency f', 100.0, 2000.0, True),
    Factor('cell_n_per_m', 'load_cell.stiffness', 'load-cell stiffness k', 3e4, 3e5, True),
    Factor('guide_n_per_m', GUIDE, 'guide and cable', 0.0, 1e4),
    Factor('friction', 'contact.friction', 'friction coefficient', 0.25, 0.35),
    Factor('mass_kg', 'runner.mass', 'moving mass', 3e-3, 5e-3),
    Factor('weight', 'stand.weight', 'weight of the runner', 0.0, 1.0),
    Factor('resonance_hz', 'actuator.resonance', 'piezo resonance', 50e3, 1e6, True),
    Factor('damping_ratio', 'actuator.damping_ratio', 'its damping ratio', 0.02, 0.7, True),
    Factor('bandwidth_hz', 'amplifier.bandwidth', 'amplifier bandwidth', 100e3, 3e6, True),
    Factor('current_a', 'amplifier.current_max', 'amplifier current', 0.25, 0.75),
    Factor('hysteresis', 'actuator.hysteresis', 'piezo hysteresis', 0.0, 0.2),
    Factor('creep', 'actuator.creep', 'piezo creep', 0.0, 0.02),
    Factor('gain_tolerance', 'actuator.gain_tolerance', 'scatter of the gains', 0.0, 0.1),
    Factor('threshold_n', THRESHOLD, 'threshold of the onset', 1e-3, 15e-3, True),
)
READ = {
    'force_mean_n': (MN, 'force at 160 nm (mN)'),
    'zero_onset_m': (NM, '0-amplitude (nm)'),
    'step_length_m': (NM, 'free step at 160 nm (nm)'),
}
"""Columns that are read, their factors and labels."""


class Effect(NamedTuple):
    """
    What an unknown does to a reading, in units of the reading per whole range.

    Attributes
    ----------
    size : float
        Mean magnitude of the elementary effects.
    error : float
        Standard error of this mean.
    scatter : float
        Standard deviation of the effects: of an unknown that acts alone and evenly it is 0.

    """

    size: float
    error: float
    scatter: float


def trajectory(rng: np.random.Generator) -> Iterator[tuple[str, float, Array]]:
    """Return the places of a trajectory, each with what was changed and by how much of a range."""
    places = rng.integers(0, LEVELS // 2, len(FACTORS)) / (LEVELS - 1.0)
    signs = rng.choice((-1.0, 1.0), len(FACTORS))
    places = np.where(signs > 0.0, places, places + STEP)
    yield '', 0.0, places.copy()
    for number in rng.permutation(len(FACTORS)):
        places[number] += signs[number] * STEP
        yield FACTORS[number].name, float(signs[number] * STEP), places.copy()


def _row(parameters: Parameters, number: int, changed: str, step: float, places: Array) -> Row:
    values = {f.sets: f.value(place) for f, place in zip(FACTORS, places, strict=True)}
    told = dict(zip((f.name for f in FACTORS), values.values(), strict=True))
    guide_n_per_m, threshold_n = values.pop(GUIDE), values.pop(THRESHOLD)
    cell_n_per_m = values['load_cell.stiffness']
    both_n_per_m = cell_n_per_m + guide_n_per_m
    changes = {'load_cell.stiffness': both_n_per_m, 'stand.weight': values['stand.weight'] > 0.5}
    stand = parameters.updated({**values, **changes})
    quick = stand.updated({'sim.dt': ZERO_STEP_S})
    frequency_hz, share = stand.step.frequency, cell_n_per_m / both_n_per_m
    free = quick.updated({'load_cell.contact': 'absent'})
    onset_m = first_amplitude_m(
        lambda amplitude_m: share * run_drive(quick, amplitude_m, frequency_hz).force_net_n,
        threshold_n,
    )
    step_m = run_drive(free, AMPLITUDE_MAX_M, frequency_hz, STEP_RUN_STEPS).step_length_m
    return {
        'trajectory': number,
        'changed': changed,
        'change': step,
        **told,
        'force_mean_n': share * run_drive(stand, AMPLITUDE_MAX_M, frequency_hz).force_mean_n,
        'zero_onset_m': AMPLITUDE_MAX_M if np.isnan(onset_m) else onset_m,
        'step_length_m': step_m,
    }


def _cases(parameters: Parameters, points: int) -> list[Case]:
    rng = np.random.default_rng(parameters.sim.seed)
    return [
        partial(_row, parameters, number, *place)
        for number in range(points)
        for place in trajectory(rng)
    ]


def effects_of(table: Table) -> dict[str, dict[str, Effect]]:
    """Return what each unknown does to each reading; the one that matters most comes first."""
    found = {
        factor.name: {name: _effect(table, factor.name, name) for name in READ}
        for factor in FACTORS
    }
    largest = {name: max(found[f.name][name].size for f in FACTORS) for name in READ}

    def rank(factor: str) -> float:
        return sum(found[factor][name].size / largest[name] for name in READ)

    return {factor: found[factor] for factor in sorted(found, key=rank, reverse=True)}


def _effect(table: Table, factor: str, reading: str) -> Effect:
    pairs = zip(table.rows, table.rows[1:], strict=False)
    each = np.array(
        [
            (float(row[reading]) - float(before[reading])) / float(row['change'])
            for before, row in pairs
            if row['changed'] == factor
        ]
    )
    sizes, spare = np.abs(each), min(1, len(each) - 1)
    error = sizes.std(ddof=spare) / np.sqrt(len(each))
    return Effect(float(sizes.mean()), float(error), float(each.std(ddof=spare)))


def _draw(table: Table, figure: Figure) -> None:
    effects = effects_of(table)
    labels = {factor.name: factor.label for factor in FACTORS}
    places = np.arange(len(effects))
    panels = figure.subplots(1, len(READ), sharey=True)
    for axes, (name, (scale, label)) in zip(panels, READ.items(), strict=True):
        sizes, errors, scatters = (
            scale * np.array(c) for c in zip(*(e[name] for e in effects.values()), strict=True)
        )
        axes.barh(places, sizes, xerr=errors, color=BLUE, height=0.7, label='mean size')
        axes.plot(scatters, places, 'D', color=BLACK, fillstyle='none', label='scatter')
        label_axes(axes, f'effect on {label}', '')
    panels[0].set_yticks(places, [labels[name] for name in effects])
    panels[0].invert_yaxis()
    panels[-1].legend(loc='lower right', fontsize='small')


def _caption(parameters: Parameters) -> str:
    ranges = '; '.join(f'{f.label} {f.low:g} to {f.high:g}' for f in FACTORS)
    return (
        f'Preload {parameters.stand.preload:g} N, seed {parameters.sim.seed}. Elementary effects '
        'of Morris per whole range of an unknown: mean size, with its standard error, and '
        'scatter, which says how far it depends on the other unknowns. The unknown that matters '
        'most for all three together stands first. Force: mean of the load cell; 0-amplitude: '
        'onset of net force at the threshold, 160 nm where there is none. Ranges, SI, all '
        f'assumed, damping c = 0 included: {ranges}. Weight: off below 0.5, else on.'
    )


SCREENING = PaperFigure(
    'screening',
    'Which unknown matters most',
    20,
    _cases,
    _draw,
    _caption,
    (13.0, 6.0),
)
