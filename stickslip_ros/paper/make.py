"""Run the figures and write them: table, pictures, caption."""

import textwrap
from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.paper.study_figure import Case, StudyFigure
from stickslip_ros.paper.table import Table
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.batch import Progress, run_batch
from stickslip_ros.study.journal import Row
from stickslip_ros.study.plotting import new_figure, save_figure

POINTS_MIN = 2
CHARACTERS_PER_INCH = 14.0
"""Width of a caption; more would be wider than the figure."""
PICTURES = ('.png', '.svg')


def make_tables(
    figures: Sequence[StudyFigure],
    parameters: Parameters,
    *,
    points: int = 0,
    workers: int = 0,
    progress: Progress | None = None,
) -> dict[str, Table]:
    """
    Run the drive for figures, all runs in one pool of threads.

    Parameters
    ----------
    figures : sequence of StudyFigure
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
        raise OutOfRange('points', points, '', limit, 'raise it, or 0 for what each figure needs')
    batches = [list(figure.cases(parameters, points or figure.points)) for figure in figures]
    cases = [case for batch in batches for case in batch]
    rows = iter(run_batch(_run, cases, workers=workers, progress=progress))
    return {
        figure.name: Table(figure.columns, [next(rows) for _ in batch])
        for figure, batch in zip(figures, batches, strict=True)
    }


def write_figure(
    figure: StudyFigure, table: Table, parameters: Parameters, folder: Path
) -> list[Path]:
    """
    Write a figure as CSV, PNG and SVG, and its caption as Markdown; return the files.

    Parameters
    ----------
    figure : StudyFigure
        How it is drawn.
    table : Table
        Its numbers.
    parameters : Parameters
        The stand that they came from, for the caption.
    folder : Path
        Where to; it is made.

    Raises
    ------
    RecordingError
        If a file cannot be written.

    """
    stem = folder / figure.name
    caption = f'{figure.caption(parameters)}{_changed(parameters)}'
    try:
        folder.mkdir(parents=True, exist_ok=True)
        table.write(stem.with_suffix('.csv'))
        page = f'# {figure.title}\n\n![{figure.title}]({figure.name}.png)\n\n{caption}\n'
        stem.with_suffix('.md').write_text(page, encoding='utf-8')
    except OSError as error:
        problem = f'cannot be written ({error.strerror})'
        raise RecordingError(folder, problem, 'choose another folder') from error
    drawn = draw_figure(figure, table, caption)
    for suffix in PICTURES:
        save_figure(drawn, stem.with_suffix(suffix))
    return [stem.with_suffix(suffix) for suffix in ('.csv', '.md', *PICTURES)]


def draw_figure(figure: StudyFigure, table: Table, caption: str) -> Figure:
    """Return the drawn figure, with its caption below the axes."""
    drawn = new_figure(*figure.inches, figure.title)
    figure.draw(table, drawn)
    width = int(figure.inches[0] * CHARACTERS_PER_INCH)
    whole = caption.replace(' = ', '\u00a0=\u00a0')  # no line ends inside 'c = 0'
    drawn.supxlabel(textwrap.fill(whole, width), x=0.01, ha='left', fontsize='small')
    return drawn


def _run(case: Case) -> Row:
    return case()


def _changed(parameters: Parameters) -> str:
    """Name what differs from the defaults, so that no figure is taken for another one."""
    changed = parameters.changed()
    if not changed:
        return ''
    return f' Changed: {", ".join(f"{name} = {value}" for name, value in changed.items())}.'
