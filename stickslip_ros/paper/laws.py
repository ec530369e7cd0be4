"""Generated force of every profile and every friction law, over amplitude and preload."""

from functools import partial

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.paper.figure import Case, PaperFigure, Table
from stickslip_ros.paper.readings import AMPLITUDE_MAX_M, FORCE_FREQUENCY_HZ, PRELOADS_N
from stickslip_ros.parameters import Parameters, spec_of
from stickslip_ros.study.journal import Row
from stickslip_ros.study.plotting import label_axes
from stickslip_ros.study.sawtooth_run import run_sawtooth, voltage_for
from stickslip_ros.units import MN, NM

STYLES = {
    'rough': ('tab:blue', '-'),
    'smooth': ('tab:cyan', '-'),
    'rough_line': ('tab:green', '-'),
    'coulomb': ('0.3', '--'),
    'dahl': ('tab:orange', '--'),
    'lugre': ('tab:red', ':'),
    'epm': ('tab:purple', '-.'),
}


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
    run = run_sawtooth(parameters, voltage_v, FORCE_FREQUENCY_HZ)
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
    panels = figure.subplots(1, len(PRELOADS_N))
    for axes, preload_n in zip(panels, PRELOADS_N, strict=True):
        for name, (colour, line) in STYLES.items():
            rows = table.where(variant=name, preload_n=preload_n)
            axes.plot(
                rows.column('amplitude_m') * NM,
                rows.column('force_mean_n') * MN,
                color=colour,
                linestyle=line,
                label=name,
            )
        label_axes(axes, 'amplitude of the feet (nm)', '', f'preload {preload_n:g} N')
        axes.margins(x=0.0)
    panels[0].set_ylabel('generated force, mean of the last cycle (mN)')
    panels[0].legend(fontsize='small')


def _caption(parameters: Parameters) -> str:
    return (
        f'{FORCE_FREQUENCY_HZ:g} Hz, steady state; assumed: k = '
        f'{parameters.load_cell.stiffness:g} N/m, c = {parameters.runner.damping:g} N s/m; '
        'laws: sigma0 = full-stick stiffness, Fc = mu F_n.'
    )


LAWS = PaperFigure(
    'laws',
    'Generated force of every contact profile and friction law',
    16,
    _cases,
    _draw,
    _caption,
    (15.0, 5.0),
    points_min=1,
)
