"""The picture of a fit: measured forces with error bars, the model, and what it misses."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from stickslip_ros.contact.profile import Array
from stickslip_ros.fitting.fit import Fit
from stickslip_ros.fitting.problem import model_force_n
from stickslip_ros.runs.batch import run_batch
from stickslip_ros.runs.plotting import (
    GREY,
    CurveStyle,
    check_picture,
    curve_style,
    draw_legend,
    label_axes,
    new_figure,
    save_figure,
)
from stickslip_ros.units import MN, NM

CURVE_POINTS = 41


def draw_fit(fit: Fit, picture: Path, title: str = '', workers: int = 0) -> None:
    """
    Draw a fit as PNG, SVG or PDF: the points with error bars, the model, and what it misses.

    Raises
    ------
    UnknownName
        If the picture is to be of another kind.

    """
    check_picture(picture)
    figure = new_figure(8.5, 7.0, title)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.0))
    for number, (label, at) in enumerate(_curves(fit)):
        style = curve_style(number)
        _draw_points(top, bottom, fit, at, style, label)
        _draw_curve(top, fit, at, style, f'model, {label}', workers)
    label_axes(top, '', 'generated force (mN)')
    draw_legend(top)
    known = fit.problem.points.sigma_n is not None
    missed = '(model - measured)/σ' if known else 'model - measured (mN)'
    label_axes(bottom, 'stroke of the feet (nm)', missed)
    bottom.axhline(0.0, color=GREY, linewidth=0.8)
    save_figure(figure, picture)


def _curves(fit: Fit) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Give each preload and frequency: its label and which points belong to it."""
    points = fit.problem.points
    pairs = list(zip(points.preload_n.tolist(), points.frequency_hz.tolist(), strict=True))
    for preload_n, frequency_hz in sorted(set(pairs)):
        at = (points.preload_n == preload_n) & (points.frequency_hz == frequency_hz)
        yield f'{preload_n:g} N, {frequency_hz:g} Hz', at


def _draw_points(
    top: Axes, bottom: Axes, fit: Fit, at: NDArray[np.bool_], style: CurveStyle, label: str
) -> None:
    """Draw the measured forces, and below what the model misses, in standard errors if known."""
    points = fit.problem.points
    amplitudes_nm, forces_mn = NM * points.amplitude_m[at], MN * points.force_n[at]
    missed, bars = MN * fit.model_n[at] - forces_mn, None
    if points.sigma_n is not None:
        bars = MN * points.sigma_n[at]
        missed = missed / bars
    name = f'measured, {label}'
    top.errorbar(amplitudes_nm, forces_mn, yerr=bars, capsize=2.0, label=name, **style.points)
    bottom.plot(amplitudes_nm, missed, **style.points)


def _draw_curve(
    axes: Axes, fit: Fit, at: NDArray[np.bool_], style: CurveStyle, label: str, workers: int
) -> None:
    points = fit.problem.points
    amplitudes_m = points.amplitude_m[at]
    grid_m: Array = np.linspace(amplitudes_m.min(), amplitudes_m.max(), CURVE_POINTS)
    task = partial(
        model_force_n,
        fit.parameters,
        float(points.preload_n[at][0]),
        frequency_hz=float(points.frequency_hz[at][0]),
        cycles=int(np.max(np.array(fit.problem.cycles)[at])),
    )
    forces_n = np.array(run_batch(task, grid_m.tolist(), workers=workers))
    axes.plot(NM * grid_m, MN * forces_n, linewidth=1.0, label=label, **style.line)
