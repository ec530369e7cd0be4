# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The Bode plot of the stuck drive: closed form and measurement."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.arrays import Array
from stickslip_ros.lab.figures.plotting import GREY, new_figure, styled
from stickslip_ros.lab.linear.curves import Complex, curves_of
from stickslip_ros.units import NM

BAND = 0.02, 3.0  # default range of frequencies, in multiples of the resonance
_LINE_POINTS = 2000


@styled()
def draw_bode(
    matrix: Callable[[Array], Complex],
    resonance_hz: float,
    frequencies: Array,
    measured: Sequence[Complex | None] = (None, None),
) -> Figure:
    """Draw gain and phase from voltage and load to position: ``matrix``, and measured points."""
    grid: Array = np.geomspace(frequencies.min(), frequencies.max(), _LINE_POINTS)
    figure = new_figure(10.0, 6.0)
    panels = figure.subplots(2, 2, sharex=True)
    lines, curves = curves_of(matrix(grid)), curves_of(matrix(frequencies))
    for (gain, phase), line, curve, points in zip(panels.T, lines, curves, measured, strict=True):
        gain.loglog(grid, np.abs(line.response) * NM, label='closed form')
        phase.semilogx(grid, line.phase_deg())
        if points is not None:
            gain.loglog(frequencies, np.abs(points) * NM, 's', label='swept sine')
            phase.semilogx(frequencies, curve.phase_deg(points), 's')
        gain.set(title=f'{line.source} to position', ylabel=f'position (nm/{line.unit})')
        phase.set(xlabel='frequency (Hz)', ylabel='phase (degrees)')
        for axes in (gain, phase):
            axes.axvline(resonance_hz, color=GREY, linestyle=':', label='resonance')
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, ncols=3, loc='outside lower center')
    return figure
