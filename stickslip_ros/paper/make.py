"""All figures of the paper, and their runs in one pool of threads."""

from collections.abc import Sequence

from stickslip_ros.errors import OutOfRange, UnknownName
from stickslip_ros.paper.figure import Case, PaperFigure, Table
from stickslip_ros.paper.force_curves import FIG2, FIG6A, FIG6B
from stickslip_ros.paper.presliding_curves import FIG7
from stickslip_ros.paper.rounded import ROUNDED
from stickslip_ros.paper.slew import SLEW
from stickslip_ros.parameters import Parameters
from stickslip_ros.runs.batch import Progress, run_batch
from stickslip_ros.runs.journal import Row

FIGURES = {figure.name: figure for figure in (FIG2, FIG6A, FIG6B, FIG7, SLEW, ROUNDED)}
POINTS_MIN = 2


def chosen_figures(names: Sequence[str] | None = None) -> list[PaperFigure]:
    """
    Return the figures of these names; all for None.

    Raises
    ------
    UnknownName
        If there is no such figure.

    """
    chosen = dict.fromkeys(FIGURES if names is None else names)
    for name in chosen:
        if name not in FIGURES:
            raise UnknownName('figure', name, f'use {", ".join(FIGURES)}')
    return [FIGURES[name] for name in chosen]


def make_tables(
    figures: Sequence[PaperFigure],
    parameters: Parameters,
    *,
    points: int = 0,
    workers: int = 0,
    progress: Progress | None = None,
) -> dict[str, Table]:
    """
    Run the drive for figures; return their tables by name.

    Parameters
    ----------
    figures : sequence of PaperFigure
        What to compute.
    parameters : Parameters
        The stand; a figure replaces what it varies.
    points : int
        Points along an axis; 0 takes what each figure needs.
    workers : int
        Number of threads; 0 is one per core. It does not change the tables.
    progress : callable, optional
        Called with rows done and rows in all.

    Raises
    ------
    StickSlipError
        If points, workers or parameters are refused.

    """
    if points and points < POINTS_MIN:
        limit = f'below {POINTS_MIN}, the fewest that make a line'
        hint = 'raise it, or 0 for what each figure needs'
        raise OutOfRange('points', points, '', limit, hint)
    batches = [figure.cases(parameters, points or figure.points) for figure in figures]
    cases = [case for batch in batches for case in batch]
    rows = iter(run_batch(_run, cases, workers=workers, progress=progress))
    return {
        figure.name: Table([next(rows) for _ in batch])
        for figure, batch in zip(figures, batches, strict=True)
    }


def _run(case: Case) -> Row:
    return case()
