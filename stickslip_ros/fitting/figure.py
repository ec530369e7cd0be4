"""The picture of a fit: measured forces with error bars, the model, and what it misses."""

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.contact.profile import Array
from stickslip_ros.fitting.problem import model_force_n
from stickslip_ros.runs.batch import run_batch
from stickslip_ros.runs.plotting import (
    GREY,
    curve_style,
    draw_legend,
    label_axes,
    new_figure,
)
from stickslip_ros.units import MN, NM

if TYPE_CHECKING:
    from stickslip_ros.fitting.fit import Fit

CURVE_POINTS = 41


def draw_fit(fit: 'Fit', workers: int = 0) -> Figure:
    """Draw a fit: the points with error bars, the model, and what it misses."""
    figure = new_figure(8.5, 7.0)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.0))
    points = fit.problem.points
    pairs = list(zip(points.preload_n.tolist(), points.frequency_hz.tolist(), strict=True))
    for number, (preload_n, frequency_hz) in enumerate(sorted(set(pairs))):
        style, label = curve_style(number), f'{preload_n:g} N, {frequency_hz:g} Hz'
        at = (points.preload_n == preload_n) & (points.frequency_hz == frequency_hz)
        amplitudes_m, forces_mn = points.amplitude_m[at], MN * points.force_n[at]
        missed, bars = MN * fit.model_n[at] - forces_mn, None
        if points.sigma_n is not None:
            bars = MN * points.sigma_n[at]
            missed = missed / bars
        bar: dict[str, Any] = {'yerr': bars, 'capsize': 2.0, **style.points}
        top.errorbar(NM * amplitudes_m, forces_mn, label=f'measured, {label}', **bar)
        bottom.plot(NM * amplitudes_m, missed, **style.points)
        task = partial(
            model_force_n,
            fit.parameters,
            preload_n,
            frequency_hz=frequency_hz,
            cycles=int(np.max(np.array(fit.problem.cycles)[at])),
        )
        grid_m: Array = np.linspace(amplitudes_m.min(), amplitudes_m.max(), CURVE_POINTS)
        model_mn = MN * np.array(run_batch(task, grid_m.tolist(), workers=workers))
        top.plot(NM * grid_m, model_mn, linewidth=1.0, label=f'model, {label}', **style.line)
    label_axes(top, '', 'generated force (mN)')
    draw_legend(top)
    is_known = points.sigma_n is not None
    missed_label = '(model −\nmeasured)/σ' if is_known else 'model −\nmeasured (mN)'
    label_axes(bottom, 'stroke of the feet (nm)', missed_label)
    bottom.axhline(0.0, color=GREY, linewidth=0.8)
    return figure
