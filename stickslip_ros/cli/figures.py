"""``stickslip figures``: the paper's figures, and what the paper leaves open."""

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from stickslip_ros.cli.common import (
    add_folder,
    add_json,
    add_parameters,
    add_workers,
    chosen_parameters,
    print_json,
    print_table,
)
from stickslip_ros.cli.progress import shown_progress
from stickslip_ros.files import make_folder
from stickslip_ros.paper.figure import write_figure
from stickslip_ros.paper.make import FIGURES, chosen_figures, make_tables
from stickslip_ros.study.journal import Row


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'figures',
        description="Run the drive for the paper's Figs 2, 6 and 7, for damping, frequency, "
        'load-cell stiffness and slew rate, and for a rounded saw-tooth. Writes for each figure '
        'DIR/NAME.csv (all digits, SI), DIR/NAME.png, DIR/NAME.svg, and DIR/NAME.md with the '
        f'caption. Names: {", ".join(FIGURES)}.',
    )
    add_folder(parser, 'runs/figures')
    parser.add_argument('--only', metavar='NAME,…', help='default: all figures')
    parser.add_argument(
        '--points',
        type=int,
        default=0,
        metavar='N',
        help='points along an axis (default: what each figure needs)',
    )
    add_workers(parser)
    add_parameters(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run the drive, write the files, name them."""
    parameters = chosen_parameters(arguments)
    figures = chosen_figures(None if arguments.only is None else arguments.only.split(','))
    make_folder(arguments.out)
    with shown_progress('runs', quiet=arguments.json) as progress:
        tables = make_tables(
            figures,
            parameters,
            points=arguments.points,
            workers=arguments.workers,
            progress=progress,
        )
    files = {
        figure.name: write_figure(figure, tables[figure.name], parameters, arguments.out)
        for figure in figures
    }
    if arguments.json:
        print_json({name: _described(tables[name].rows, files[name]) for name in tables})
    else:
        rows = [
            (figure.name, figure.title, str(len(tables[figure.name].rows))) for figure in figures
        ]
        print_table('figures', rows, ('name', 'shows', 'rows'))
        print(f'folder {arguments.out}')
    return 0


def _described(rows: Sequence[Row], files: list[Path]) -> dict[str, Any]:
    """Return files and rows; JSON knows neither infinity nor what is not a number."""
    known = [{name: _known(value) for name, value in row.items()} for row in rows]
    return {'files': [str(path) for path in files], 'rows': known}


def _known(value: object) -> object:
    return None if isinstance(value, float) and not math.isfinite(value) else value
