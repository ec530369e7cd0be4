# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip figures`` and ``validate``: the paper's figures, and checks against references."""

import argparse
from typing import Any

from stickslip_ros.files import make_folder
from stickslip_ros.lab.cli.chosen import chosen_for, chosen_parameters
from stickslip_ros.lab.cli.printing import CHECK_FAILED, Answer
from stickslip_ros.lab.paper.figure import write_figure
from stickslip_ros.lab.paper.make import chosen_figures, make_tables
from stickslip_ros.lab.validation.report import as_objects, report_sections, write_report
from stickslip_ros.lab.validation.self_test import failed, validate
from stickslip_ros.progress import shown_progress
from stickslip_ros.sections import Section


def figures_verb(arguments: argparse.Namespace) -> Answer:
    """Run the drive, and write the figures."""
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
            content[figure.name] = {'files': [str(path) for path in files], 'rows': runs}
    rows = [(figure.name, figure.title, len(tables[figure.name])) for figure in figures]
    shown = Section('figures', rows, ('name', 'shows', 'rows'))
    return Answer(content, [shown, f'folder {arguments.output}'])


def validate_verb(arguments: argparse.Namespace) -> Answer:
    """Compare this installation with the references; write the report."""
    make_folder(arguments.output)
    with shown_progress('families', quiet=arguments.json) as progress:
        outcomes = validate(progress=progress)
        files = write_report(outcomes, arguments.output)
    is_well = not failed(outcomes)
    paths = [str(path) for path in files]
    content = {'passed': is_well, 'checks': as_objects(outcomes), 'files': paths}
    status = 0 if is_well else CHECK_FAILED
    return Answer(content, [next(report_sections(outcomes)), *paths], status)
