# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The Bode plot of the stuck drive and its table: closed form and measurement."""

from typing import Protocol

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from stickslip_ros.arrays import Array
from stickslip_ros.lab.figures.plotting import GREY, new_figure, styled
from stickslip_ros.lab.linear.sampled import Complex
from stickslip_ros.lab.measurements.sweep_table import Row
from stickslip_ros.units import NM

BAND = 0.02, 3.0  # default range of frequencies, in multiples of the resonance
_SOURCES = ('voltage', 'V'), ('load', 'N')
LEAD_RAD = 0.1  # largest lead, from rounding and creep; other phases lag
_LINE_POINTS = 2000


class Drawable(Protocol):
    """A linear drive: the transfer matrix of its outputs, of which the runner is the first."""

    @property
    def resonance_hz(self) -> float: ...

    def matrix(self, frequency_hz: ArrayLike) -> Complex: ...


class Measured(Protocol):
    """A measured response, beside the linear drive that it is of."""

    @property
    def linear(self) -> Drawable: ...

    @property
    def frequency_hz(self) -> Array: ...

    @property
    def response(self) -> tuple[Complex, Complex]: ...

    @property
    def voltage_amplitude_v(self) -> Array: ...

    @property
    def load_amplitude_n(self) -> Array: ...


@styled()
def draw_bode(linear: Drawable, measured: Measured | None = None) -> Figure:
    """Draw gain and phase from voltage and load to position, and measured points."""
    marks = np.array(BAND) * linear.resonance_hz if measured is None else measured.frequency_hz
    grid: Array = np.geomspace(marks.min(), marks.max(), _LINE_POINTS)
    figure = new_figure(10.0, 6.0)
    panels = figure.subplots(2, 2, sharex=True)
    curves = [(grid, *closed_form(linear, grid), '-', 'closed form')]
    if measured is not None:
        curves.append((marks, *sines(measured), 's', 'swept sine'))
    for k, (source, unit) in enumerate(_SOURCES):
        gain, phase = panels[:, k]
        for frequency_hz, response, phase_deg, style, label in curves:
            gain.loglog(frequency_hz, np.abs(response[:, k]) * NM, style, label=label)
            phase.semilogx(frequency_hz, phase_deg[:, k], style)
        gain.set(title=f'{source} to position', ylabel=f'position (nm/{unit})')
        phase.set(xlabel='frequency (Hz)', ylabel='phase (degrees)')
        for axes in (gain, phase):
            axes.axvline(linear.resonance_hz, color=GREY, linestyle=':', label='resonance')
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, ncols=3, loc='outside lower center')
    return figure


def closed_form(linear: Drawable, frequency_hz: Array) -> tuple[Complex, Array]:
    """Return response (m/V, m/N) and phase (degrees), shape (n, 2); each lag is below one turn."""
    matrix = linear.matrix(frequency_hz)
    foot, response = matrix[:, 1, 0], matrix[:, 0]
    factors = np.column_stack((response[:, 0] / foot, response[:, 1], foot))
    lags_rad = LEAD_RAD - np.mod(LEAD_RAD - np.angle(factors), 2.0 * np.pi)
    lags_rad[:, 0] += lags_rad[:, 2]
    return response, np.degrees(lags_rad[:, :2])


def sines(measured: Measured) -> tuple[Complex, Array]:
    """Return what was measured, as ``closed_form`` does, at the nearest turn."""
    response, phase_deg = closed_form(measured.linear, measured.frequency_hz)
    found = np.column_stack(measured.response)
    return found, phase_deg + np.degrees(np.angle(found / response))


def bode_rows(measured: Measured) -> list[Row]:
    """Return a row per frequency: gains and phases, closed form and measured."""
    columns: dict[str, Array] = {'frequency_hz': measured.frequency_hz}
    both = closed_form(measured.linear, measured.frequency_hz), sines(measured)
    for k, (source, unit) in enumerate(_SOURCES):
        for (response, phase_deg), name in zip(both, ('', 'measured_'), strict=True):
            gain = f'{name or "position_"}m_per_{unit.lower()}'
            columns[gain] = np.abs(response[:, k])
            columns[f'{name}{source}_phase_deg'] = phase_deg[:, k]
    columns['voltage_amplitude_v'] = measured.voltage_amplitude_v
    columns['load_amplitude_n'] = measured.load_amplitude_n
    values = zip(*(column.tolist() for column in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in values]
