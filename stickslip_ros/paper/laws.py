"""Generated force of every profile and every friction law, over amplitude and preload."""

from functools import partial

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.paper.figure import Case, PaperFigure, Table
from stickslip_ros.paper.readings import AMPLITUDE_MAX_M, PRELOADS_N
from stickslip_ros.parameters import Parameters, spec_of
from stickslip_ros.study.journal import Row
from stickslip_ros.study.plotting import (
    curve_style,
    draw_legend,
    label_axes,
)
from stickslip_ros.study.sawtooth_run import run_sawtooth, voltage_for
from stickslip_ros.units import MN, NM

APART = 'coulomb'
"""Has axes of its own: on those of the others it would press them flat."""
BELOW, ABOVE = 'dahl', 'lugre'
"""These coincide unless parameters of the second say otherwise: the one is drawn as a wide ribbon,
the other on it."""
RIBBON = {'color': '0.75', 'linewidth': 6.0}
SAME_SHARE = 1e-3
"""Forces that differ by less of the largest are on one line in the picture."""


def variants() -> dict[str, dict[str, object]]:
    """Return the parameters that make every profile of the contact model, and every rival law."""
    profiles = spec_of('contact.profile').choices
    laws = [name for name in spec_of('contact.law').choices if name != 'mdr']
    return {
        **{name: {'contact.profile': name} for name in profiles},
        **{name: {'contact.law': name} for name in laws},
    }


def _row(parameters: Parameters, variant: str, amplitude_m: float) -> Row:
    voltage_v = voltage_for(parameters, amplitude_m)
    run = run_sawtooth(parameters, voltage_v, parameters.step.frequency)
    return {
        'variant': variant,
        'preload_n': run.preload_n,
        'amplitude_m': amplitude_m,
        'force_mean_n': run.force_mean_n,
        'steady': run.steady,
    }


def _cases(parameters: Parameters, points: int) -> list[Case]:
    amplitudes_m = np.linspace(0.0, AMPLITUDE_MAX_M, points + 1)[1:].tolist()
    stands = [
        (parameters.updated({**values, 'stand.preload': preload_n}), name)
        for name, values in variants().items()
        for preload_n in PRELOADS_N
    ]
    return [partial(_row, *stand, a) for stand in stands for a in amplitudes_m]


def _draw(table: Table, figure: Figure) -> None:
    panels = figure.subplots(2, len(PRELOADS_N), sharex=True, height_ratios=(1.0, 3.0))
    names = [APART, *(name for name in variants() if name != APART)]
    shown = {ABOVE: f'{ABOVE} (equals {BELOW})'} if _coincide(table) else {}
    for (apart, others), preload_n in zip(panels.T, PRELOADS_N, strict=True):
        for number, name in enumerate(names):
            rows = table.where(variant=name, preload_n=preload_n)
            style = RIBBON if name == BELOW else curve_style(number).line_and_points
            (apart if name == APART else others).plot(
                rows.column('amplitude_m') * NM,
                rows.column('force_mean_n') * MN,
                label=shown.get(name, name),
                **style,
            )
        label_axes(apart, '', '', f'preload {preload_n:g} N')
        label_axes(others, 'amplitude of the feet (nm)', '')
        apart.set_ylim(0.0, 1.3 * apart.dataLim.y1)
        draw_legend(apart, 'lower right')
    panels[0, 0].set_ylabel('force (mN)')
    panels[1, 0].set_ylabel('generated force, mean of the last cycle (mN)')
    draw_legend(panels[1, 0], 'lower right')


def _coincide(table: Table) -> bool:
    """Return whether both laws of the ribbon are one line in the picture."""
    below_n, above_n = (
        table.where(variant=name).column('force_mean_n') for name in (BELOW, ABOVE)
    )
    return bool(np.abs(above_n - below_n).max() < SAME_SHARE * np.abs(below_n).max())


def _caption(parameters: Parameters) -> str:
    return (
        'Above, on axes of its own: the law of Coulomb, under which every step counts and the '
        'force goes to the friction limit. Below: the profiles rough, smooth and rough_line of '
        "the contact model and the other laws. LuGre's law without a static friction above "
        "Coulomb's, bristle damping and viscous friction is Dahl's law: by default, so, the two "
        'coincide. Laws: sigma0 = full-stick stiffness, Fc = mu F_n. '
        f'{parameters.step.frequency:g} Hz, steady state; assumed: k = '
        f'{parameters.load_cell.stiffness:g} N/m, c = {parameters.runner.damping:g} N s/m.'
    )


LAWS = PaperFigure(
    'laws',
    'Generated force of every contact profile and friction law',
    16,
    _cases,
    _draw,
    _caption,
    (13.0, 6.4),
    points_min=1,
)
