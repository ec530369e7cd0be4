"""A measured frequency response as a table, and as a Bode plot beside the closed form."""

from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.contact.profile import Array
from stickslip_ros.linear.linearise import Complex, LinearDrive, Response
from stickslip_ros.linear.swept_sine import MeasuredResponse
from stickslip_ros.runs.journal import Row
from stickslip_ros.runs.plotting import GREY, curve_style, label_axes, new_figure
from stickslip_ros.units import NM

BAND = 0.02, 3.0  # frequencies that are shown by default, as multiples of the resonance
LINE_POINTS = 2000
LEAD_RAD = 0.1  # phases are lags but for rounding and creep; none leads by more


class BodeCurve(NamedTuple):
    """From one input to the position, in closed form at some frequencies."""

    source: str  # input, and its unit
    unit: str
    response: Complex  # in metres per unit, shape (n,)
    phase_rad: Array  # without jumps by a turn, shape (n,)

    def phase_deg(self, measured: Complex | None = None) -> Array:
        """Return the phase, or what was measured near it, in degrees."""
        if measured is None:
            return np.degrees(self.phase_rad)
        return np.degrees(self.phase_rad + np.angle(measured / self.response))


def bode_rows(measured: MeasuredResponse) -> list[Row]:
    """Return a row for each frequency: gains and phases in closed form and as measured."""
    columns: dict[str, Array] = {'frequency_hz': measured.frequency_hz}
    curves = _curves(measured.linear, measured.frequency_hz)
    for curve, points in zip(curves, measured.response, strict=True):
        unit = curve.unit.lower()
        columns |= {
            f'position_m_per_{unit}': np.abs(curve.response),
            f'{curve.source}_phase_deg': curve.phase_deg(),
            f'measured_m_per_{unit}': np.abs(points),
            f'measured_{curve.source}_phase_deg': curve.phase_deg(points),
        }
    columns['voltage_amplitude_v'] = measured.voltage_amplitude_v
    columns['load_amplitude_n'] = measured.load_amplitude_n
    values = zip(*(column.tolist() for column in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in values]


def draw_bode(linear: LinearDrive, frequencies: Array, response: Response | None = None) -> Figure:
    """Draw gain and phase from voltage and from load to position, and what was measured."""
    grid: Array = np.geomspace(frequencies.min(), frequencies.max(), LINE_POINTS)
    closed, sines = curve_style(0).line, curve_style(1).points
    figure = new_figure(10.0, 6.0)
    panels = figure.subplots(2, 2, sharex=True)
    lines, curves = _curves(linear, grid), _curves(linear, frequencies)
    for (gain, phase), line, curve, points in zip(
        panels.T, lines, curves, response or (None, None), strict=True
    ):
        gain.loglog(grid, np.abs(line.response) * NM, **closed, label='closed form')
        phase.semilogx(grid, line.phase_deg(), **closed)
        if points is not None:
            gain.loglog(frequencies, np.abs(points) * NM, **sines, label='swept sine')
            phase.semilogx(frequencies, curve.phase_deg(points), **sines)
        label_axes(gain, '', f'position (nm/{line.unit})', f'{line.source} to position')
        label_axes(phase, 'frequency (Hz)', 'phase (degrees)')
        for axes in (gain, phase):
            axes.axvline(linear.resonance_hz, color=GREY, linestyle=':')
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, fontsize='small', ncols=2, loc='outside lower center')
    return figure


def _curves(linear: LinearDrive, frequencies: Array) -> tuple[BodeCurve, BodeCurve]:
    """Return both curves; the stages before the feet and the runner lag by less than a turn."""
    matrix = linear.matrix(frequencies)
    from_voltage, from_load = matrix[:, 0].T
    foot = matrix[:, 1, 0]
    lag_rad = _lag_rad(foot) + _lag_rad(from_voltage / foot)
    return (
        BodeCurve('voltage', 'V', from_voltage, lag_rad),
        BodeCurve('load', 'N', from_load, _lag_rad(from_load)),
    )


def _lag_rad(response: Complex) -> Array:
    lag_rad: Array = np.mod(LEAD_RAD - np.angle(response), 2.0 * np.pi)
    return LEAD_RAD - lag_rad
