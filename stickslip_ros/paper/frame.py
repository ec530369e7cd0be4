"""
A frame that gives way, and whether it makes one slew rate the best.

An experiment, not a feature. The frame that holds the feet is a mass on a spring. Feet and piezos
that accelerate push it back, and it goes on swinging:
y'' + 2 D w y' + w^2 y = -r x_s'', with r the moving mass per mass of the frame. What the feet do
is x_s + y; as a periodic wave this is a table of voltages.

"""

import math
from functools import partial
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.contact.profile import Array
from stickslip_ros.drive.advance import RAMP_END, RAMP_MEAN
from stickslip_ros.drive.build import plant_of, start_clock, state_at_rest
from stickslip_ros.drive.waveform import table as table_wave
from stickslip_ros.paper.figure import Case, PaperFigure, Table, assumed
from stickslip_ros.paper.readings import AMPLITUDE_MAX_M, stand_at
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.journal import Row
from stickslip_ros.study.plotting import curve_style, draw_shared_legend, label_axes
from stickslip_ros.study.sawtooth_run import advance_cycles, voltage_for
from stickslip_ros.units import MICRO, MN, NM

PRELOAD_N = 0.5
CYCLES, MEAN_CYCLES = 200, 20
DAMPING_RATIO = 0.01
RAMP_ROWS, FALL_ROWS = 1500, 12
SWING_SHARE = 0.3
"""Room for the swing, as a share of the stroke beyond the range, and of the slew rate."""
SLEWS_V_PER_S = (10e6, 300e6)


class Frame(NamedTuple):
    """A frame: its resonance, and the mass of what accelerates per mass of the frame."""

    resonance_hz: float
    mass_ratio: float

    @property
    def label(self) -> str:
        """As the legend has it."""
        if not self.mass_ratio:
            return 'rigid frame'
        return f'{self.resonance_hz * 1e-3:g} kHz, mass ratio {self.mass_ratio:g}'


FRAMES = (
    Frame(10e3, 0.0),
    Frame(2e3, 0.02),
    Frame(10e3, 0.02),
    Frame(10e3, 0.1),
    Frame(50e3, 0.1),
)


def swinging_rows(
    voltage_v: float, frequency_hz: float, slew_v_per_s: float, frame: Frame
) -> Array:
    """
    Return one cycle of the saw-tooth with the swing of the frame, from the end of a fall on.

    Parameters
    ----------
    voltage_v, frequency_hz, slew_v_per_s : float
        The saw-tooth: amplitude, V, steps per second, and slew rate of its fall, V/s.
    frame : Frame
        What swings.

    Returns
    -------
    array, shape (rows, 2)
        Time, s, and voltage, V. The end joins the beginning.

    """
    period_s, rise_v_per_s = 1.0 / frequency_hz, voltage_v * frequency_hz
    jump_v_per_s = slew_v_per_s + rise_v_per_s
    fall_s = voltage_v / jump_v_per_s
    ramp_s = period_s - fall_s
    times_s = np.concatenate(
        (
            np.linspace(0.0, ramp_s, RAMP_ROWS),
            np.linspace(ramp_s, period_s, FALL_ROWS)[1:],
        )
    )
    low_v = rise_v_per_s * fall_s
    straight_v = np.interp(times_s, (0.0, ramp_s, period_s), (low_v, voltage_v, low_v))
    omega_per_s = 2.0 * math.pi * frame.resonance_hz
    rate = omega_per_s * complex(-DAMPING_RATIO, math.sqrt(1.0 - DAMPING_RATIO**2))

    def answer_s(since_s: Array) -> Array:
        """Return what is left of all past unit jumps of the velocity, one each period."""
        past = np.exp(rate * (since_s % period_s)) / (1.0 - np.exp(rate * period_s))
        return np.asarray(past.imag / rate.imag)

    swing_v = answer_s(times_s - ramp_s) - answer_s(times_s)
    swing_v[-1] = swing_v[0]
    return np.column_stack((times_s, straight_v + frame.mass_ratio * jump_v_per_s * swing_v))


def _ramps(stand: Parameters, rows: Array) -> Array:
    """Return the log of the cycles of a drive under rows that repeat, from rest."""
    plants = plant_of(stand.updated({'amplifier.voltage_initial': float(rows[0, 1])}))
    states = state_at_rest(plants, stand.stand.preload)
    start_clock(states)
    return advance_cycles(plants, states, table_wave(rows, CYCLES), CYCLES)


def _row(stand: Parameters, frame: Frame) -> Row:
    slew_v_per_s, frequency_hz = stand.amplifier.slew_rate, stand.step.frequency
    voltage_v = voltage_for(stand, AMPLITUDE_MAX_M)
    rows = swinging_rows(voltage_v, frequency_hz, slew_v_per_s, frame)
    room_v = SWING_SHARE * voltage_v
    roomy = stand.updated(
        {
            'amplifier.voltage_min': stand.amplifier.voltage_min - room_v,
            'amplifier.voltage_max': stand.amplifier.voltage_max + room_v,
            'amplifier.slew_rate': (1.0 + SWING_SHARE) * slew_v_per_s,
        }
    )
    held = _ramps(roomy, rows)
    free = _ramps(roomy.updated({'load_cell.contact': 'absent'}), rows)
    step_m = (free[-1, RAMP_END] - free[-1 - MEAN_CYCLES, RAMP_END]) / MEAN_CYCLES
    return {
        'resonance_hz': frame.resonance_hz,
        'mass_ratio': frame.mass_ratio,
        'slew_rate_v_per_s': slew_v_per_s,
        'force_mean_n': float(stand.load_cell.stiffness * held[-MEAN_CYCLES:, RAMP_MEAN].mean()),
        'step_length_m': float(step_m),
    }


def _cases(parameters: Parameters, points: int) -> list[Case]:
    return [
        partial(_row, stand_at(parameters, PRELOAD_N, {'amplifier.slew_rate': float(slew)}), frame)
        for frame in FRAMES
        for slew in np.geomspace(*SLEWS_V_PER_S, points)
    ]


def _draw(table: Table, figure: Figure) -> None:
    force, step = figure.subplots(1, 2)
    for number, frame in enumerate(FRAMES):
        curve = table.where(**frame._asdict())
        rates, style = curve.column('slew_rate_v_per_s') * MICRO, curve_style(number)
        look = {'label': frame.label, **style.line_and_points}
        force.plot(rates, curve.column('force_mean_n') * MN, **look)
        step.plot(rates, curve.column('step_length_m') * NM, **look)
    label_axes(force, 'slew rate (V/us)', 'force at 160 nm (mN)')
    label_axes(step, 'slew rate (V/us)', 'free step at 160 nm (nm)')
    for axes in (force, step):
        axes.set_xscale('log')
        axes.axhline(0.0, color='0.3', linewidth=0.8)
    draw_shared_legend(figure, step)


def _caption(parameters: Parameters) -> str:
    return (
        f'An experiment: preload {PRELOAD_N:g} N, a frame that swings when feet and piezos '
        f'accelerate, damping ratio {DAMPING_RATIO:g}; mass ratio: what accelerates per mass of '
        f'the frame. {CYCLES} steps, mean of the last {MEAN_CYCLES}. {assumed(parameters)} The '
        'slew rate is varied.'
    )


FRAME = PaperFigure(
    'frame', 'Slew rate, on a frame that gives way', 16, _cases, _draw, _caption, (11.0, 4.6)
)
