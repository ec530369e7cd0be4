"""
Normal motion of the feet, which is not modelled: a preload that changes in step with the voltage.

An experiment on the spring bank. Feet on shear piezos tilt and lift as they go, so the normal
force varies within a step. Here the preload follows the voltage: by a share of itself over the
full stroke, peak to peak, higher (or lower) at the end of the ramp than after the fall.

"""

import math
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import Record
from stickslip_ros.drive.advance import RAMP_MEAN, advance
from stickslip_ros.drive.build import friction_limit_n, plant_of, start_clock, state_at_rest
from stickslip_ros.drive.feet import switch_all_to_springs
from stickslip_ros.drive.waveform import sawtooth
from stickslip_ros.paper.figure import Case, PaperFigure, Table, assumed
from stickslip_ros.paper.readings import (
    AMPLITUDE_MAX_M,
    ONSET_SHARE,
    PRELOADS_N,
    first_amplitude_m,
    stand_at,
)
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.journal import Row
from stickslip_ros.study.plotting import draw_legend, label_axes
from stickslip_ros.study.sawtooth_run import step_length_m, voltage_for
from stickslip_ros.units import NM

SHARES = (0.0, 0.2, -0.2, 0.05, -0.05, 0.01, -0.01)
"""Change of the preload over the full stroke; positive: higher at the end of the ramp."""
CYCLES = 200
BEYOND_N = 1.0
"""The preload that is aimed at lies beyond, so that it never arrives and the springs stay."""


def modulated_ramps(
    parameters: Parameters, amplitude_m: float, share: float, cycles: int = CYCLES
) -> Array:
    """
    Return the log of the ramps of a saw-tooth with a preload in step with the voltage.

    Parameters
    ----------
    parameters : Parameters
        The stand.
    amplitude_m : float
        Stroke of the feet, m.
    share : float
        Peak-to-peak change of the preload over the full stroke, per preload.
    cycles : int
        Steps made.

    Returns
    -------
    array, shape (cycles, 3)
        Position after the fall, mean and final position of each ramp, m.

    """
    voltage_v, frequency_hz = voltage_for(parameters, amplitude_m), parameters.step.frequency
    period_s = 1.0 / frequency_hz
    fall_s = voltage_v / (parameters.amplifier.slew_rate + voltage_v * frequency_hz)
    preload_n = parameters.stand.preload
    swing_n = 0.5 * share * preload_n * amplitude_m / AMPLITUDE_MAX_M
    plants, wave = plant_of(parameters), sawtooth(0.0, voltage_v, frequency_hz, cycles)
    states = state_at_rest(plants, preload_n)
    switch_all_to_springs(plants, states)
    start_clock(states)
    ramps = np.empty((cycles, 3))
    for _ in range(cycles):
        for lasts_s, wanted_n in (
            (fall_s, preload_n - swing_n),
            (period_s - fall_s, preload_n + swing_n),
        ):
            _aim_at(plants, states, wanted_n, lasts_s)
            advance(plants, states, wave, 0.0, lasts_s, ramps)
    advance(plants, states, wave, 0.0, 1e-9, ramps)
    return ramps


def _aim_at(plants: Record, states: Record, wanted_n: float, lasts_s: float) -> None:
    """Let the preload go straight to a value within a time."""
    change_n = wanted_n - float(states['preload_n'].item())
    plants['contacts']['preload_n'] = wanted_n + math.copysign(BEYOND_N, change_n)
    plants['contacts']['preload_n_per_s'] = abs(change_n) / lasts_s


def _row(parameters: Parameters, preload_n: float, share: float) -> Row:
    stand = stand_at(parameters, preload_n)
    cell_n_per_m = stand.load_cell.stiffness

    def net_n(amplitude_m: float) -> float:
        mean_m = modulated_ramps(stand, amplitude_m, share)[-1, RAMP_MEAN]
        return float(cell_n_per_m * (mean_m - 0.5 * amplitude_m))

    free = stand.updated({'load_cell.contact': 'absent'})
    return {
        'preload_n': preload_n,
        'change_per_stroke': share,
        'force_net_n': net_n(AMPLITUDE_MAX_M),
        'zero_onset_m': first_amplitude_m(net_n, ONSET_SHARE * friction_limit_n(stand)),
        'step_length_m': step_length_m(modulated_ramps(free, AMPLITUDE_MAX_M, share)),
    }


def _cases(parameters: Parameters, points: int) -> list[Case]:
    shares = sorted(SHARES[:points])
    return [partial(_row, parameters, n, share) for n in PRELOADS_N for share in shares]


READ = {
    'force_net_n': 'net force at 160 nm',
    'zero_onset_m': 'onset of force',
    'step_length_m': 'free step at 160 nm',
}


def _draw(table: Table, figure: Figure) -> None:
    panels = figure.subplots(1, len(READ), sharey=True)
    for axes, (name, label) in zip(panels, READ.items(), strict=True):
        for preload_n, rows, style in table.by_preload():
            unchanged = rows.where(change_per_stroke=0.0).column(name)[0]
            axes.plot(
                rows.column('change_per_stroke') * 100.0,
                (rows.column(name) / unchanged - 1.0) * 100.0,
                label=f'{preload_n:g} N',
                **style.line_and_points,
            )
        label_axes(axes, 'change of the preload over the stroke (%)', '', label)
    panels[0].set_ylabel('change against a constant preload (%)')
    draw_legend(panels[0], 'best', 'preload')


def _caption(parameters: Parameters) -> str:
    return (
        'An experiment on the spring bank, not a feature: the preload follows the voltage, by so '
        'much of itself over the full stroke, peak to peak; a positive change is a higher '
        f'preload at the end of the ramp. {CYCLES} steps. Onset: the net force exceeds '
        f'{ONSET_SHARE * 100:g} % of the friction limit. Stroke {AMPLITUDE_MAX_M * NM:g} nm. '
        f'{assumed(parameters)}'
    )


NORMAL_MOTION = PaperFigure(
    'normal_motion',
    'A preload that changes in step with the voltage',
    len(SHARES),
    _cases,
    _draw,
    _caption,
    (12.5, 4.4),
)
