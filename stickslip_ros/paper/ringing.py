"""Ringing of piezo and feet, which the paper does not mention: force, onset and step over it."""

from functools import partial
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.contact.profile import Array
from stickslip_ros.paper.figure import Case, PaperFigure, Table
from stickslip_ros.paper.readings import (
    AMPLITUDE_MAX_M,
    PRELOADS_N,
    STEP_FREQUENCY_HZ,
    STEP_RUN_STEPS,
    last_rise,
    max_presliding_m,
    stand_at,
    zero_of_force_m,
)
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.journal import Row
from stickslip_ros.study.plotting import (
    BLACK,
    curve_style,
    draw_legend,
    draw_shared_legend,
    label_axes,
)
from stickslip_ros.study.sawtooth_run import run_drive
from stickslip_ros.units import MICRO, MN, NM

RESONANCES_HZ = (50e3, 1e6)
IDEAL_HZ = 0.0
"""The massless piezo."""


class Variant(NamedTuple):
    """What is drawn as one curve: damping ratio, and the current into the piezos (0: any)."""

    damping_ratio: float
    current_a: float

    @property
    def label(self) -> str:
        """As the legend has it."""
        current = f', {self.current_a:g} A' if self.current_a else ''
        return f'D = {self.damping_ratio:g}{current}'


VARIANTS = (
    Variant(0.02, 0.0),
    Variant(0.1, 0.0),
    Variant(0.3, 0.0),
    Variant(0.7, 0.0),
    Variant(0.1, 0.25),
)


def _row(stand: Parameters) -> Row:
    frequency_hz = stand.step.frequency
    run = run_drive(stand, AMPLITUDE_MAX_M, frequency_hz)
    free = stand.updated({'load_cell.contact': 'absent'})
    step = run_drive(free, AMPLITUDE_MAX_M, STEP_FREQUENCY_HZ, STEP_RUN_STEPS)
    return {
        'preload_n': stand.stand.preload,
        'resonance_hz': stand.actuator.resonance,
        'damping_ratio': stand.actuator.damping_ratio,
        'current_a': stand.amplifier.current_max,
        'slew_rate_v_per_s': stand.amplifier.slew_rate,
        'force_mean_n': run.force_mean_n,
        'force_net_n': run.force_net_n,
        'steady': run.steady,
        'step_length_m': step.step_length_m,
        'zero_onset_m': zero_of_force_m(stand, frequency_hz),
        'max_presliding_lower_m': max_presliding_m(stand)[0],
        'last_rise': last_rise(stand, frequency_hz, run),
    }


def _cases(parameters: Parameters, points: int) -> list[Case]:
    resonances_hz = np.geomspace(*RESONANCES_HZ, points).tolist()
    rung = [(VARIANTS[0], IDEAL_HZ)]
    rung += [(variant, hz) for variant in VARIANTS for hz in resonances_hz]
    return [
        partial(
            _row,
            stand_at(
                parameters,
                preload_n,
                {
                    'actuator.resonance': resonance_hz,
                    'actuator.damping_ratio': variant.damping_ratio,
                    'amplifier.current_max': variant.current_a,
                },
            ),
        )
        for preload_n in PRELOADS_N
        for variant, resonance_hz in rung
    ]


def _draw(table: Table, figure: Figure) -> None:
    panels = figure.subplots(3, len(PRELOADS_N), sharex=True)
    for column, preload_n in zip(panels.T, PRELOADS_N, strict=True):
        here = table.where(preload_n=preload_n)
        rows = Table([row for row in here.rows if row['resonance_hz']])
        ideal = here.where(resonance_hz=IDEAL_HZ)
        for number, variant in enumerate(VARIANTS):
            curve = rows.where(**variant._asdict())
            style = curve_style(number).line_and_points
            kilohertz = curve.column('resonance_hz') * 1e-3
            for axes, values in zip(column, _shown(curve), strict=True):
                axes.plot(kilohertz, values, label=variant.label, **style)
        for axes, values in zip(column, _shown(ideal), strict=True):
            axes.axhline(values[0], color=BLACK, linewidth=1.0, label='massless piezo')
            axes.set_xscale('log')
            axes.set_ylim(bottom=0.0)
            label_axes(axes, '', '')
        column[0].set_title(f'preload {preload_n:g} N', fontsize='medium')
        column[-1].set_xlabel('resonance of the piezo (kHz)')
    for axes, label in zip(
        panels[:, 0],
        ('force at 160 nm (mN)', 'onset of force / $u_{x,max}$', 'free step at 160 nm (nm)'),
        strict=True,
    ):
        axes.set_ylabel(label)
    draw_shared_legend(figure, panels[-1, -1])


def _shown(rows: Table) -> tuple[Array, ...]:
    """Return force, mN, onset over u_max, and free step, nm."""
    return (
        rows.column('force_mean_n') * MN,
        rows.column('zero_onset_m') / rows.column('max_presliding_lower_m'),
        rows.column('step_length_m') * NM,
    )


def _caption(parameters: Parameters) -> str:
    capacitance_nf = parameters.actuator.capacitance * 1e9
    return (
        'The piezo under each foot rings at its resonance when the voltage falls, with the '
        'damping ratio D; one curve with a current into the piezos that limits the slew rate to '
        f'{VARIANTS[-1].current_a / parameters.actuator.capacitance * 1e-6:g} V/us '
        f'({capacitance_nf:g} nF), the others with '
        f'{parameters.amplifier.slew_rate * 1e-6:g} V/us. Force: mean, '
        f'{parameters.step.frequency:g} Hz, steady state; onset: 1 % of the friction limit beyond '
        f'k A/2; free step: {STEP_FREQUENCY_HZ:g} Hz. Rough contacts, damping c = '
        f'{parameters.runner.damping:g} N s/m. All of it is assumed: the paper gives none.'
    )


RINGING = PaperFigure('ringing', 'Ringing of the piezos', 15, _cases, _draw, _caption, (12.5, 8.6))


SLEWS_V_PER_S = (10e6, 300e6)
TICKS_V_PER_US = (10, 25, 50, 100, 150, 300)
SLEW_PRELOAD_N = 0.5
SLEW_RINGS = ((IDEAL_HZ, 0.1), (150e3, 0.02), (150e3, 0.1), (150e3, 0.3), (500e3, 0.1))
"""Resonance and damping ratio of each curve."""


def _slew_cases(parameters: Parameters, points: int) -> list[Case]:
    return [
        partial(
            _row,
            stand_at(
                parameters,
                SLEW_PRELOAD_N,
                {
                    'actuator.resonance': resonance_hz,
                    'actuator.damping_ratio': damping_ratio,
                    'amplifier.slew_rate': float(slew_v_per_s),
                },
            ),
        )
        for resonance_hz, damping_ratio in SLEW_RINGS
        for slew_v_per_s in np.geomspace(*SLEWS_V_PER_S, points)
    ]


def _draw_slew(table: Table, figure: Figure) -> None:
    panels = figure.subplots(1, 3)
    for number, (resonance_hz, damping_ratio) in enumerate(SLEW_RINGS):
        curve = table.where(resonance_hz=resonance_hz, damping_ratio=damping_ratio)
        name = (
            f'{resonance_hz * 1e-3:g} kHz, D = {damping_ratio:g}' if resonance_hz else 'massless'
        )
        style = curve_style(number).line_and_points
        rates = curve.column('slew_rate_v_per_s') * MICRO
        for axes, values in zip(panels, _shown(curve), strict=True):
            axes.plot(rates, values, label=name, **style)
    labels = ('force (mN)', 'onset of force / $u_{x,max}$', 'free step (nm)')
    for axes, label in zip(panels, labels, strict=True):
        axes.set_xscale('log')
        axes.set_xticks(TICKS_V_PER_US, [str(tick) for tick in TICKS_V_PER_US])
        axes.minorticks_off()
        axes.set_ylim(bottom=0.0)
        label_axes(axes, 'slew rate (V/us)', label)
    draw_legend(panels[2], 'lower right')


def _slew_caption(parameters: Parameters) -> str:
    return (
        f'Preload {SLEW_PRELOAD_N:g} N; force and free step at {AMPLITUDE_MAX_M * NM:g} nm. The '
        'piezos are massless, or ring at a resonance with the damping ratio D. Onset: 1 % of the '
        f'friction limit beyond k A/2, left out where there is none. Force: '
        f'{parameters.step.frequency:g} Hz; free step: {STEP_FREQUENCY_HZ:g} Hz. Rough contacts, '
        f'damping c = {parameters.runner.damping:g} N s/m.'
    )


RINGING_SLEW = PaperFigure(
    'ringing_slew',
    'Slew rate, with piezos that ring',
    31,
    _slew_cases,
    _draw_slew,
    _slew_caption,
    (13.0, 4.6),
)
