"""The drive in step mode: the velocity of a free runner over frequency, amplitude and load."""

import itertools
from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.contact.profile import Array
from stickslip_ros.drive.build import friction_limit_n
from stickslip_ros.errors import OutOfRange
from stickslip_ros.instrument.checks import check_load
from stickslip_ros.parameters import Parameters
from stickslip_ros.progress import shown_progress
from stickslip_ros.runs.batch import run_courses
from stickslip_ros.runs.courses import Course, bundle_for
from stickslip_ros.runs.journal import Row
from stickslip_ros.runs.plotting import curve_style, draw_legend, label_axes, new_figure
from stickslip_ros.runs.sawtooth_run import drive_course
from stickslip_ros.runs.sweep import Sweep
from stickslip_ros.units import FACTORS, MN, NM

if TYPE_CHECKING:
    from pandas import DataFrame


def step_map(
    parameters: Parameters,
    *,
    frequency_hz: Iterable[float] | float,
    amplitude_m: Iterable[float] | float,
    load_n: Iterable[float] | float = 0.0,
    steps: int = 120,
    workers: int = 0,
    progress: bool = False,
) -> 'DataFrame':
    """
    Find how fast a free runner steps, at every combination of frequency, amplitude and load.

    The load cell of the stand is taken away.

    Parameters
    ----------
    parameters : Parameters
        The stand.
    frequency_hz : float or several
        Steps per second; negative ones go backwards.
    amplitude_m : float or several
        Strokes of the feet, m.
    load_n : float or several
        Constant external forces on the runner along +x, N; negative ones hold a forward runner
        back.
    steps : int
        Steps of each run, of which the last ten count.
    workers : int
        Runs at once; 0 is one per core.
    progress : bool
        Whether to show how far it has come.

    Returns
    -------
    DataFrame
        One row per run: ``load_n``, ``frequency_hz``, ``amplitude_m``, ``step_length_m``,
        ``velocity_m_per_s``. Its ``attrs`` hold the parameters.

    Raises
    ------
    StickSlipError
        If a value is refused, or a load is above what friction holds.

    """
    free = parameters.updated({'load_cell.contact': 'absent'})
    frequencies_hz, amplitudes_m, loads_n = (
        tuple(np.atleast_1d(np.asarray(given, dtype=np.float64)).tolist())
        for given in (frequency_hz, amplitude_m, load_n)
    )
    Sweep(free, (), frequencies_hz, amplitudes_m, steps)
    friction_n = friction_limit_n(free)
    for each_n in loads_n:
        if abs(check_load(free, each_n)) >= friction_n:
            limit = f'not below the {friction_n:.4g} N that friction holds'
            hint = 'lower it or raise stand.preload'
            raise OutOfRange('load', each_n, 'N', limit, hint)
    cases = list(itertools.product(loads_n, frequencies_hz, amplitudes_m))
    import pandas as pd  # noqa: PLC0415 - what has no table does without

    with shown_progress('runs', quiet=not progress) as show:
        task = partial(_row, free, steps)
        bundle = bundle_for(free)
        rows = run_courses(task, cases, bundle, workers=workers, progress=show)
        frame: DataFrame = pd.DataFrame(rows)
    frame.attrs['parameters'] = free.flat()
    return frame


def draw_step_map(table: 'DataFrame') -> Figure:
    """Draw velocity over amplitude: a panel for each load of a step map, a curve per frequency."""
    loads_n: Array = np.unique(table['load_n'])
    figure = new_figure(4.0 * len(loads_n), 3.5)
    panels = np.atleast_1d(figure.subplots(1, len(loads_n), sharey=True))
    for axes, load_n in zip(panels, loads_n, strict=True):
        at_load = table[table['load_n'] == load_n]
        for number, frequency_hz in enumerate(np.unique(at_load['frequency_hz'])):
            curve = at_load[at_load['frequency_hz'] == frequency_hz]
            axes.plot(
                curve['amplitude_m'] * NM,
                curve['velocity_m_per_s'] * FACTORS['um'],
                **curve_style(number).line_and_points,
                label=f'{frequency_hz:g} Hz',
            )
        label_axes(axes, 'stroke of the feet (nm)', '', f'load {load_n * MN:g} mN')
    panels[0].set_ylabel('velocity (um/s)')
    draw_legend(panels[0])
    return figure


def _row(free: Parameters, steps: int, case: tuple[float, float, float]) -> Course[Row]:
    load_n, frequency_hz, amplitude_m = case
    run = yield from drive_course(free, amplitude_m, frequency_hz, steps, load_n=load_n)
    return {
        'load_n': load_n,
        'frequency_hz': frequency_hz,
        'amplitude_m': amplitude_m,
        'step_length_m': run.step_length_m,
        'velocity_m_per_s': run.step_length_m * abs(frequency_hz),
    }
