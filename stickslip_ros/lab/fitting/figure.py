"""The picture of a fit: what was measured, the model, and what it misses."""

from collections.abc import Sequence
from pathlib import PurePath
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stickslip_ros.arrays import Array
from stickslip_ros.lab.experiments.experiment import Experiment, SawtoothSteps, Seen
from stickslip_ros.lab.experiments.predict import Prediction, predict
from stickslip_ros.lab.fitting.result import FitResult
from stickslip_ros.lab.runs.batch import pool_of
from stickslip_ros.lab.runs.plotting import (
    BLACK,
    GREY,
    as_it_is,
    curve_style,
    decimated,
    new_figure,
    styled,
)
from stickslip_ros.units import MN, NM, display_unit

CURVE_POINTS = 41
_PIXELS = 1500  # points of a curve are no more than a picture can show
_WORDS = {
    'force_n': 'generated force',
    'step_length_m': 'step length',
    'position_m': 'position',
    'foot_position_m': 'position of a foot',
}


@styled()
def draw_fit(fit: FitResult, workers: int = 0) -> Figure:
    """Draw a fit: each trace and each quantity of steps, and below what the model misses."""
    traces = fit.sensors
    kinds = [
        quantity
        for quantity in ('force_n', 'step_length_m')
        if any(
            isinstance(one.drive, SawtoothSteps) and one.seen[0].quantity == quantity
            for one in fit.experiments
        )
    ]
    rows = len(traces) + len(kinds)
    figure = new_figure(8.5, 1.0 + 5.0 * rows if rows == 1 else 4.2 * rows)
    panels = figure.subplots(2 * rows, 1, height_ratios=(3.0, 1.0) * rows)
    for number, (one, each, sensor) in enumerate(traces):
        _draw_trace(fit, one, each, sensor, panels[2 * number], panels[2 * number + 1])
    for number, quantity in enumerate(kinds, len(traces)):
        _draw_numbers(fit, quantity, workers, panels[2 * number], panels[2 * number + 1])
    return figure


def _draw_trace(
    fit: FitResult, one: Experiment, each: Seen, sensor: dict[str, float], top: Axes, bottom: Axes
) -> None:
    """Draw a trace without the zero and drift of its sensor, the model, and what is left."""
    number = fit.experiments.index(one)
    model = fit.predicted[number][one.seen.index(each)].values
    drifting = sensor['drift_per_s'] * (each.time_s - each.time_s.mean())
    measured = each.values - sensor['zero'] - drifting
    factor, unit = display_unit(each.unit)
    name = as_it_is(PurePath(one.origin).name)
    for values, label, style in (
        (measured, f'measured, {name}', {'linewidth': 1.8, **curve_style(0)}),
        (model, 'model', {'linewidth': 0.9, **curve_style(1)}),
    ):
        top.plot(*decimated(each.time_s, factor * values, _PIXELS), label=label, **style)
    missed = factor * (model - measured)
    bottom.plot(*decimated(each.time_s, missed, _PIXELS), linewidth=0.8, color=BLACK)
    for sign in (-1.0, 1.0):
        bottom.axhline(sign * factor * sensor['noise'], color=GREY, linewidth=0.8, linestyle='--')
    for axes in (top, bottom):
        axes.set_xlim(float(each.time_s[0]), float(each.time_s[-1]))
    top.tick_params(labelbottom=False)
    top.set_ylabel(f'{_WORDS[each.quantity]} ({unit})')
    top.legend()
    bottom.set(xlabel='time (s); dashed: noise', ylabel=f'model −\nmeasured ({unit})')


def _draw_numbers(fit: FitResult, quantity: str, workers: int, top: Axes, bottom: Axes) -> None:
    """Draw numbers against the stroke, a curve of the model for each preload and frequency."""
    points = [
        (one, one.drive, found[0], noises[0])
        for one, found, noises in zip(
            fit.experiments, fit.predicted, fit.problem.noise.values, strict=True
        )
        if isinstance(one.drive, SawtoothSteps) and one.seen[0].quantity == quantity
    ]
    factor, unit = (MN, 'mN') if quantity == 'force_n' else (NM, 'nm')
    is_known = fit.problem.noise.known
    settings = {(one.settings['stand.preload'], drive.frequency_hz) for one, drive, *_ in points}
    for number, at in enumerate(sorted(settings)):
        style, label = curve_style(number), '{:g} N, {:g} Hz'.format(*at)
        dots = {**style, 'linestyle': '', 'marker': 'o'}
        here = [
            each
            for each in points
            if (each[0].settings['stand.preload'], each[1].frequency_hz) == at
        ]
        stroke_nm = NM * np.array([drive.amplitude_m for _, drive, *_ in here])
        measured = factor * np.array([one.seen[0].values[0] for one, *_ in here])
        missed = factor * np.array([found.values[0] for *_, found, _ in here]) - measured
        bars = factor * np.array([noise for *_, noise in here]) if is_known else None
        bar: dict[str, Any] = {'yerr': bars, 'capsize': 2.0, **dots}
        top.errorbar(stroke_nm, measured, label=f'measured, {label}', **bar)
        bottom.plot(stroke_nm, missed if bars is None else missed / bars, **dots)
        grid_nm: Array = np.linspace(stroke_nm.min(), stroke_nm.max(), CURVE_POINTS)
        curve = _curve(fit, [one for one, *_ in here], grid_nm / NM, workers)
        model = factor * np.array([each.values[0] for [each] in curve])
        top.plot(grid_nm, model, linewidth=1.0, label=f'model, {label}', **style)
    top.set_ylabel(f'{_WORDS[quantity]} ({unit})')
    top.legend()
    missed_label = '(model −\nmeasured)/σ' if is_known else f'model −\nmeasured ({unit})'
    bottom.set(xlabel='stroke of the feet (nm)', ylabel=missed_label)
    bottom.axhline(0.0, color=GREY, linewidth=0.8)


def _curve(
    fit: FitResult, points: Sequence[Experiment], strokes_m: Array, workers: int
) -> list[list[Prediction]]:
    """Return what the fitted stand shows between points of one preload and frequency."""
    drives = [one.drive for one in points if isinstance(one.drive, SawtoothSteps)]
    longest = max(drives, key=lambda drive: drive.steps)
    asked = [
        Experiment('', points[0].settings, longest._replace(amplitude_m=stroke_m), points[0].seen)
        for stroke_m in strokes_m.tolist()
    ]
    with pool_of(workers) as pool:
        return predict(fit.parameters, asked, pool=pool)
