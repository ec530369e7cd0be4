# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip figures``: the figures of the paper."""

import argparse
from typing import Any

from stickslip_ros.files import make_folder
from stickslip_ros.lab.cli.chosen import chosen_for, chosen_parameters
from stickslip_ros.lab.cli.printing import Answer
from stickslip_ros.lab.paper.figure import write_figure
from stickslip_ros.lab.paper.make import chosen_figures, make_tables
from stickslip_ros.progress import shown_progress
from stickslip_ros.sections import Section


def figures_verb(arguments: argparse.Namespace) -> Answer:
    """Run the drive, write the files."""
    parameters = chosen_parameters(arguments)
    figures = chosen_figures(None if arguments.only is None else arguments.only.split(','))
    make_folder(arguments.output)
    with shown_progress('runs', quiet=arguments.json) as progress:
        given = chosen_for(make_tables, arguments)
        tables = make_tables(figures, parameters, **given, progress=progress)
    content: dict[str, Any] = {}
    with shown_progress('figures', quiet=arguments.json) as progress:
        for figure in figures:
            progress(len(content), len(figures))
            runs = tables[figure.name]
            files = write_figure(figure, runs, parameters, arguments.output)
            content[figure.name] = {'files': [str(path) for path in files], 'rows': runs.rows}
    rows = [(figure.name, figure.title, len(tables[figure.name].rows)) for figure in figures]
    shown = Section('figures', rows, ('name', 'shows', 'rows'))
    return Answer(content, [shown, f'folder {arguments.output}'])
