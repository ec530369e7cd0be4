"""One unknown at a time: what each does to force, 0-amplitude and step, in per cent."""

from collections.abc import Mapping
from functools import partial
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.paper.figure import Case, PaperFigure, Table
from stickslip_ros.paper.readings import (
    AMPLITUDE_MAX_M,
    PRELOADS_N,
    STEP_FREQUENCY_HZ,
    STEP_RUN_STEPS,
    stand_at,
    zero_of_force_m,
)
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.journal import Row
from stickslip_ros.study.plotting import curve_style, draw_shared_legend, label_axes
from stickslip_ros.study.sawtooth_run import run_drive

STEP_PRELOAD_N = 0.5
"""Preload of the onset and of the free step."""
ROUGH: Mapping[str, object] = {'contact.profile': 'rough_line'}
"""Contacts that scatter: six different random lines in place of six equal profiles."""


class Unknown(NamedTuple):
    """What is unknown, one value of it, and the parameters that stand for this value."""

    name: str
    value: str
    changes: Mapping[str, object]
    guide_n_per_m: float = 0.0
    """Stiffness of guide and cable, on which the runner presses beside the load cell."""


def _each(name: str, parameter: str, values: Mapping[str, float]) -> list[Unknown]:
    return [Unknown(name, text, {parameter: value}) for text, value in values.items()]


def _ringing(resonance_hz: float) -> Unknown:
    changes = {'actuator.resonance': resonance_hz, 'actuator.damping_ratio': 0.1}
    return Unknown('ringing of the piezos, D = 0.1', f'{resonance_hz * 1e-3:g} kHz', changes)


UNKNOWNS = (
    Unknown('default', '', {}),
    _ringing(150e3),
    _ringing(500e3),
    *_each('damping c', 'runner.damping', {'25 N s/m': 25.0, '80 N s/m': 80.0}),
    *_each('frequency f', 'step.frequency', {'500 Hz': 500.0, '2 kHz': 2e3}),
    *_each('friction coefficient', 'contact.friction', {'0.25': 0.25, '0.35': 0.35}),
    Unknown('weight of the runner', 'on', {'stand.weight': True}),
    *_each('moving mass', 'runner.mass', {'4 g': 4e-3, '5 g': 5e-3}),
    *_each('load cell k', 'load_cell.stiffness', {'30 kN/m': 3e4, '300 kN/m': 3e5}),
    Unknown('guide and cable', '1 kN/m', {}, 1e3),
    Unknown('guide and cable', '10 kN/m', {}, 1e4),
    *_each('amplifier bandwidth', 'amplifier.bandwidth', {'100 kHz': 1e5, '1 MHz': 1e6}),
    *_each('piezo hysteresis', 'actuator.hysteresis', {'10 %': 0.1, '20 %': 0.2}),
    *_each('scatter of the gains', 'actuator.gain_tolerance', {'5 %': 0.05, '10 %': 0.1}),
    *(
        Unknown('six rough lines', f'seed {seed}', {**ROUGH, 'contact.line_seed': seed})
        for seed in (1, 101)
    ),
)


def _row(parameters: Parameters, unknown: Unknown) -> Row:
    """Return what is read with one unknown; a guide is a spring beside the load cell."""
    cell_n_per_m = parameters.updated(unknown.changes).load_cell.stiffness
    both_n_per_m = cell_n_per_m + unknown.guide_n_per_m
    changes = {**unknown.changes, 'load_cell.stiffness': both_n_per_m}
    stands = {n: stand_at(parameters, n, changes) for n in PRELOADS_N}
    frequency_hz = stands[STEP_PRELOAD_N].step.frequency
    runs = {n: run_drive(stand, AMPLITUDE_MAX_M, frequency_hz) for n, stand in stands.items()}
    free = stands[STEP_PRELOAD_N].updated({'load_cell.contact': 'absent'})
    step = run_drive(free, AMPLITUDE_MAX_M, STEP_FREQUENCY_HZ, STEP_RUN_STEPS)
    onset_m = zero_of_force_m(stands[STEP_PRELOAD_N], frequency_hz)
    return {
        'unknown': unknown.name,
        'its_value': unknown.value,
        **{
            f'force_at_{n:g}_n': run.force_mean_n * cell_n_per_m / both_n_per_m
            for n, run in runs.items()
        },
        'steady': all(run.steady for run in runs.values()),
        'zero_onset_m': onset_m,
        'step_length_m': step.step_length_m,
    }


READ = {
    **{f'force_at_{n:g}_n': f'force at {n:g} N, 160 nm' for n in PRELOADS_N},
    'zero_onset_m': f'onset of force at {STEP_PRELOAD_N:g} N',
    'step_length_m': f'free step at {STEP_PRELOAD_N:g} N, 160 nm',
}
"""Columns that are drawn, and their labels."""


def _cases(parameters: Parameters, points: int) -> list[Case]:
    return [partial(_row, parameters, unknown) for unknown in UNKNOWNS[:points]]


def _draw(table: Table, figure: Figure) -> None:
    axes = figure.subplots()
    default, rows = Table(table.rows[:1]), Table(table.rows[1:])
    places = np.arange(len(rows.rows))
    for number, (name, label) in enumerate(READ.items()):
        per_cent = 100.0 * (rows.column(name) / default.column(name)[0] - 1.0)
        shifts = places + 0.13 * (number - 2)
        axes.plot(per_cent, shifts, label=label, **curve_style(number).points)
    names = [f'{row["unknown"]}: {row["its_value"]}' for row in rows.rows]
    axes.set_yticks(places, names)
    axes.invert_yaxis()
    axes.axvline(0.0, color='0.3', linewidth=0.8)
    axes.set_xscale('symlog', linthresh=10.0)
    ticks = (-50, -20, -10, -5, 0, 5, 10, 20, 50, 100)
    axes.set_xticks(ticks, [f'{tick:+d}' if tick else '0' for tick in ticks])
    axes.minorticks_off()
    label_axes(axes, 'change against the default (%)', '')
    draw_shared_legend(figure, axes)


def _caption(parameters: Parameters) -> str:
    return (
        'One unknown at a time, the others as by default: damping c = '
        f'{parameters.runner.damping:g} N s/m, {parameters.step.frequency:g} Hz, k = '
        f'{parameters.load_cell.stiffness * 1e-3:g} kN/m, massless piezos, equal feet. Force: '
        'mean of the load cell; onset: 1 % of the friction limit beyond k A/2; free step: '
        f'{STEP_FREQUENCY_HZ:g} Hz. Guide and cable: a spring beside the load cell, which takes '
        'its part of the force. The axis is linear up to 10 % and logarithmic beyond.'
    )


UNKNOWNS_FIGURE = PaperFigure(
    'unknowns', 'One unknown at a time', len(UNKNOWNS), _cases, _draw, _caption, (11.0, 9.0)
)
