# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The Bode plot of the stuck drive: closed form and measurement."""

from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.arrays import Array
from stickslip_ros.lab.figures.plotting import GREY, new_figure, styled
from stickslip_ros.lab.linear.sampled import Complex
from stickslip_ros.units import NM

BAND = 0.02, 3.0  # default range of frequencies, in multiples of the resonance
_SOURCES = ('voltage', 'V'), ('load', 'N')
_LINE_POINTS = 2000


@styled()
def draw_bode(
    resonance_hz: float,
    closed_form: Callable[[Array], tuple[Complex, Array]],
    sines: tuple[Array, Complex, Array] | None = None,
) -> Figure:
    """
    Draw gain and phase from voltage and load to position, and measured points.

    ``closed_form`` returns response (m/V, m/N) and phase (degrees) at frequencies, each of shape
    (n, 2); ``sines`` are frequencies, Hz, and what was measured there.

    """
    marks = np.array(BAND) * resonance_hz if sines is None else sines[0]
    grid: Array = np.geomspace(marks.min(), marks.max(), _LINE_POINTS)
    figure = new_figure(10.0, 6.0)
    panels = figure.subplots(2, 2, sharex=True)
    curves = [(grid, *closed_form(grid), '-', 'closed form')]
    if sines is not None:
        curves.append((*sines, 's', 'swept sine'))
    for k, (source, unit) in enumerate(_SOURCES):
        gain, phase = panels[:, k]
        for frequency_hz, response, phase_deg, style, label in curves:
            gain.loglog(frequency_hz, np.abs(response[:, k]) * NM, style, label=label)
            phase.semilogx(frequency_hz, phase_deg[:, k], style)
        gain.set(title=f'{source} to position', ylabel=f'position (nm/{unit})')
        phase.set(xlabel='frequency (Hz)', ylabel='phase (degrees)')
        for axes in (gain, phase):
            axes.axvline(resonance_hz, color=GREY, linestyle=':', label='resonance')
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, ncols=3, loc='outside lower center')
    return figure
