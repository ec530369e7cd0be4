"""The drive at the points of a table, to be laid beside it."""

import dataclasses
from functools import partial

import stickslip_ros
from stickslip_ros.parameters import Parameters, Scalar
from stickslip_ros.study.batch import Progress, run_batch
from stickslip_ros.study.comparison.points import (
    FREQUENCY,
    PRELOAD,
    PointTable,
    bare_name,
    points_of_rows,
)
from stickslip_ros.study.comparison.refusal import Incomparable
from stickslip_ros.study.journal import Row
from stickslip_ros.study.sweep import Case, run_case

MODEL = 'model'
"""Word that stands for the drive in place of a file."""


@dataclasses.dataclass(frozen=True)
class ModelSettings:
    """
    How the drive is run.

    Attributes
    ----------
    parameters : Parameters
        The stand; the table sets preload and what else it has columns for.
    frequency_hz : float
        Steps per second where the table has no frequency.
    steps : int
        Steps of each run; 0 goes on until the steady state.
    workers : int
        Number of threads; 0 is one per core.

    """

    parameters: Parameters
    frequency_hz: float
    steps: int = 0
    workers: int = 0


def run_model(
    table: PointTable, settings: ModelSettings, progress: Progress | None = None
) -> PointTable:
    """
    Run the drive once at each different point of a table.

    Raises
    ------
    StickSlipError
        If the stand cannot make one of the points, or a parameter is both set and a column.

    """
    columns = [name for name in table.keys if name not in {PRELOAD, FREQUENCY}]
    changed = settings.parameters.changed()
    for name in map(bare_name, columns):
        if name in changed:
            problem = f'is set, and a column of {table.side.origin} too'
            raise Incomparable(name, problem, 'take --set or the column away')
    rows = range(len(table.amplitude_m))
    cases = list(dict.fromkeys(_case(table, row, columns, settings) for row in rows))
    result = run_batch(
        partial(_row, settings, tuple(columns)),
        cases,
        workers=settings.workers,
        progress=progress,
    )
    described = {'stickslip_ros': stickslip_ros.__version__, **settings.parameters.flat()}
    return points_of_rows(result, MODEL, MODEL, described)


def _case(table: PointTable, row: int, columns: list[str], settings: ModelSettings) -> Case:
    values: list[tuple[str, Scalar]] = [('stand.preload', table.keys[PRELOAD][row])]
    values += [(bare_name(name), table.keys[name][row]) for name in columns]
    frequencies_hz = table.keys.get(FREQUENCY)
    frequency_hz = settings.frequency_hz if frequencies_hz is None else frequencies_hz[row]
    return Case(tuple(values), float(table.amplitude_m[row]), float(frequency_hz))


def _row(settings: ModelSettings, columns: tuple[str, ...], case: Case) -> Row:
    """Return the row of a case, with the table's own names for its columns."""
    row = run_case(settings.parameters, settings.steps, (), case)
    values = dict(case.values)
    return {**{name: values[bare_name(name)] for name in columns}, **row}
