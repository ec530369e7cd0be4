# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""All figures of the paper, run in one pool of threads."""

from collections.abc import Sequence

from stickslip_ros.errors import OutOfRange, UnknownName
from stickslip_ros.lab.measurements.sweep_table import Row
from stickslip_ros.lab.paper.curves import FIG2, FIG6A, FIG6B, FIG7
from stickslip_ros.lab.paper.figure import PaperFigure
from stickslip_ros.lab.runs.batch import Progress, run_courses
from stickslip_ros.lab.runs.courses import bundle_for
from stickslip_ros.parameters import Parameters

FIGURES = {figure.name: figure for figure in (FIG2, FIG6A, FIG6B, FIG7)}
POINTS_MIN = 2


def chosen_figures(names: Sequence[str] | None = None) -> list[PaperFigure]:
    """Return the named figures, all for None; refuse unknown names."""
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
) -> dict[str, list[Row]]:
    """Run the drive for figures; return the rows of their tables by name."""
    if points and points < POINTS_MIN:
        limit = f'below {POINTS_MIN}, the fewest that make a line'
        hint = 'raise it, or 0 for what each figure needs'
        raise OutOfRange('points', points, '', limit, hint)
    batches = [figure.cases(parameters, points or figure.points) for figure in figures]
    cases = [case for batch in batches for case in batch]
    bundle, how = bundle_for(parameters), {'workers': workers, 'progress': progress}
    rows = iter(run_courses(lambda case: case(), cases, bundle, **how))
    return {
        figure.name: [next(rows) for _ in batch]
        for figure, batch in zip(figures, batches, strict=True)
    }
