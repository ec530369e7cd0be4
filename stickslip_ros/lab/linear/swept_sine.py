# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The frequency response of the stuck drive, measured sine by sine."""

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from stickslip_ros.arrays import Array
from stickslip_ros.drive.advance import advance
from stickslip_ros.drive.build import start_clock
from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.drive.waveform import level, table
from stickslip_ros.errors import OutOfRange
from stickslip_ros.instrument.commands import Request, check_request
from stickslip_ros.kernels.record import Record
from stickslip_ros.lab.figures.plottable import Plottable
from stickslip_ros.lab.linear.linearise import (
    INPUTS,
    LinearDrive,
    Response,
    closed_form,
    drive_at,
    linear_drive,
    smooth,
)
from stickslip_ros.lab.linear.sampled import Complex
from stickslip_ros.lab.measurements.sweep_table import Row
from stickslip_ros.lab.runs.batch import run_batch
from stickslip_ros.parameters import Parameters, checked_arguments
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.progress import shown_progress
from stickslip_ros.sections import Section, si_row
from stickslip_ros.units import NM

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SLIDING_SHARE = 2e-3  # sliding amplitude per maximal presliding of the first contact to slip
VOLTAGE_SHARE = 2.5e-3  # largest voltage amplitude per range: no play of the hysteresis moves
_BELOW = 0.9  # measurement and closed form are compared below this share of the resonance
_POINTS = 128  # corners of a sine, and averaged readings, per cycle
_CYCLES_MIN, _CYCLES_MAX, _BEATS = 6, 80, 4.0
"""Cycles of rise, and again of evaluation: _BEATS beats with the nearest resonance, limited."""


@dataclass(frozen=True, eq=False, repr=False)
class MeasuredResponse(Plottable):
    """The frequency response to sines of small amplitude; arrays of shape (n,)."""

    frequency_hz: Array
    response: Response  #: from voltage and from load to the runner
    linear: LinearDrive  #: the same drive in closed form
    voltage_amplitude_v: Array  #: the sliding is at most SLIDING_SHARE of the maximal presliding
    load_amplitude_n: Array
    softening: float  #: share of the contact stiffness lost by partial slip

    @property
    def largest_deviation(self) -> float | None:
        """The largest ``deviation`` below the resonance; None without frequencies there."""
        below = self.frequency_hz <= _BELOW * self.linear.resonance_hz
        found = np.abs(np.array(self.deviation)[:, below])
        return float(found.max()) if found.size else None

    def sections(self) -> list[Section]:
        """Return the drive in closed form, and the deviation of the measurement."""
        [linear], lowest_hz = self.linear.sections(), self.frequency_hz.min()
        per_v, per_n = (abs(column[0]) for column in self.linear.response(lowest_hz))
        rows = [
            *linear.rows,
            (f'position per voltage at {lowest_hz:.4g} Hz', f'{per_v * NM:.5f}', 'nm/V'),
            (f'position per load at {lowest_hz:.4g} Hz', f'{per_n * NM:.5f}', 'nm/N'),
            si_row('stiffness lost by partial slip', self.softening, '.2e'),
        ]
        if self.largest_deviation is not None:
            words = f'largest deviation up to {_BELOW:g} of the resonance'
            rows.append((words, f'{self.largest_deviation:.2%}', ''))
        return [linear._replace(rows=rows, draw=self._draw)]

    def _draw(self) -> 'Figure':
        from stickslip_ros.lab.linear.bode import draw_bode  # noqa: PLC0415 - takes long

        shown = self.frequency_hz, *_sines(self)
        return draw_bode(self.linear.resonance_hz, partial(closed_form, self.linear), shown)

    def __repr__(self) -> str:
        first_hz, last_hz = self.frequency_hz.min(), self.frequency_hz.max()
        span = f'{len(self.frequency_hz)} frequencies from {first_hz:.5g} to {last_hz:.5g} Hz'
        return f'MeasuredResponse: {span}, of {self.linear}'

    @property
    def deviation(self) -> Response:
        """Measured response relative to the closed form, minus 1."""
        expected = self.linear.response(self.frequency_hz)
        return Response(*(a / b - 1.0 for a, b in zip(self.response, expected, strict=True)))


def bode_rows(measured: MeasuredResponse) -> list[Row]:
    """Return a row per frequency: gains and phases, closed form and measured."""
    columns: dict[str, Array] = {'frequency_hz': measured.frequency_hz}
    both = closed_form(measured.linear, measured.frequency_hz), _sines(measured)
    for k, name_of_input in enumerate(INPUTS):
        source, _, unit = name_of_input.partition('_')
        for (response, phase_deg), name in zip(both, ('', 'measured_'), strict=True):
            columns[f'{name or "position_"}m_per_{unit}'] = np.abs(response[:, k])
            columns[f'{name}{source}_phase_deg'] = phase_deg[:, k]
    columns['voltage_amplitude_v'] = measured.voltage_amplitude_v
    columns['load_amplitude_n'] = measured.load_amplitude_n
    values = zip(*(column.tolist() for column in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in values]


def _sines(measured: MeasuredResponse) -> tuple[Complex, Array]:
    """Return what was measured, as ``closed_form`` does, at the nearest turn."""
    response, phase_deg = closed_form(measured.linear, measured.frequency_hz)
    found = np.column_stack(measured.response)
    return found, phase_deg + np.degrees(np.angle(found / response))


@checked_arguments
def measure_response(
    parameters: Parameters,
    frequency_hz: ArrayLike,
    at_voltage_v: float | None = None,
    *,
    workers: int = 0,
    progress: bool = False,
) -> MeasuredResponse:
    """
    Shake the drive with sines of voltage and of load, and read the true position of the runner.

    Parameters
    ----------
    parameters : Parameters
        The stand, at ``stand.preload``.
    frequency_hz : array-like, shape (n,)
        Frequencies above 0, Hz.
    at_voltage_v : float, optional
        As in ``linearise``.
    workers : int
        Sines at once; 0 is one per core.
    progress : bool
        Show the progress.

    Raises
    ------
    StickSlipError
        If a frequency is not above 0, the amplifier cannot give the voltage and the sine about
        it, or the contacts obey another friction law.

    """
    frequencies = np.atleast_1d(np.asarray(frequency_hz, float))
    for each in frequencies:
        if not 0.0 < each < np.inf:
            raise OutOfRange('frequency', float(each), 'Hz', 'not above 0', 'raise it')
    at_v, plants, states = drive_at(parameters, at_voltage_v)
    linear = linear_drive(parameters, at_v, plants, states)
    contacts = contacts_of(parameters)
    sliding_m = SLIDING_SHARE * min(contact.max_displacement_m for contact in contacts)
    force_n = sum(float(contact.tangential_force(sliding_m)) for contact in contacts)
    stuck_n = sliding_m * sum(contact.stick_stiffness_n_per_m for contact in contacts)
    matrix = linear.matrix(frequencies)
    gains = np.unique(parameters.feet.gain)[:, np.newaxis]  # 0: a guide
    ways = np.abs(matrix[:, 0, np.newaxis] - gains * matrix[:, 1, np.newaxis])
    sliding_m_per_v, sliding_m_per_n = ways.max(axis=1).T
    largest_v = VOLTAGE_SHARE * parameters.amplifier.range_v
    for side in (-1.0, 1.0):
        check_request(Request('voltage', (linear.at_voltage_v + side * largest_v,)), parameters)
    amplitudes = (
        sliding_m / np.maximum(sliding_m_per_v, sliding_m / largest_v),
        sliding_m / sliding_m_per_n,
    )
    cases = [
        (name, float(hertz), float(amplitude))
        for name, column in zip(INPUTS, amplitudes, strict=True)
        for hertz, amplitude in zip(frequencies, column, strict=True)
    ]
    task = partial(response_to_sine, plants, states, linear)
    with shown_progress('sines', quiet=not progress) as show:
        found = run_batch(task, cases, workers=workers, progress=show)
    voltage, load = np.array(found).reshape(2, -1)
    response, softening = Response(voltage, load), 1.0 - force_n / stuck_n
    return MeasuredResponse(frequencies, response, linear, *amplitudes, softening)


def response_to_sine(
    plants: Record, states: Record, linear: LinearDrive, case: tuple[str, float, float]
) -> complex:
    """Return the response of the runner to a sine."""
    name, frequency_hz, amplitude = case
    poles_hz = np.abs(np.linalg.eigvals(linear.A).imag) / (2.0 * np.pi)
    beat_hz = float(np.abs(frequency_hz - poles_hz).min())
    beat_cycles = _BEATS * frequency_hz / max(beat_hz, 1e-9 * frequency_hz)
    cycles = int(np.clip(np.ceil(beat_cycles), _CYCLES_MIN, _CYCLES_MAX))

    def sine(points: Array) -> Array:
        steady: Array = amplitude * np.sin(2.0 * np.pi * points / _POINTS)
        return smooth(points / (_POINTS * cycles)) * steady

    corners = np.arange(2 * cycles * _POINTS + 1, dtype=float)
    dt_s, ramps = 1.0 / (_POINTS * frequency_hz), np.zeros((1, 3))
    wave, loads_n = level(linear.at_voltage_v), sine(corners[:-1] + 0.5)
    rounded = np.sinc(1.0 / _POINTS)
    if name == 'voltage_v':
        wave = table(np.column_stack((corners * dt_s, linear.at_voltage_v + sine(corners))))
        loads_n, rounded = np.zeros(len(loads_n)), rounded**2
    moving, integral_m_s = states.copy(), np.empty(len(corners))
    integrals = moving['sums']['position_m_s']
    integral_m_s[0] = integrals.item()
    start_clock(moving)
    for i, load_n in enumerate(loads_n, start=1):
        stop_if_asked()
        advance(plants, moving, wave, float(load_n), dt_s, ramps)
        integral_m_s[i] = integrals.item()
    seen = rounded * np.sinc(1.0 / _POINTS)
    # Complex amplitude of the last cycles, m; a smooth window suppresses slow drift.
    last = cycles * _POINTS
    position_m, middle = np.diff(integral_m_s)[-last:] / dt_s, np.arange(last) + 0.5
    weights = (1.0 - np.cos(2.0 * np.pi * middle / last)) ** 2
    turns = np.exp(-2j * np.pi * middle / _POINTS)
    phasor_m = complex(2.0 * np.mean(weights * position_m * turns) / np.mean(weights))
    return phasor_m / complex(0.0, -amplitude * seen)
