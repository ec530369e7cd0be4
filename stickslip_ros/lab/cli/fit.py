# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip fit``: parameters of the drive from recordings and tables, with error bars."""

import argparse
import shlex
from collections.abc import Iterator

from stickslip_ros.errors import OutOfRange
from stickslip_ros.lab.cli.chosen import chosen_look, chosen_parameters
from stickslip_ros.lab.cli.experiment import said_of_tables
from stickslip_ros.lab.cli.printing import CHECK_FAILED, Answer
from stickslip_ros.lab.fitting.figure import draw_fit
from stickslip_ros.lab.fitting.fit import fit
from stickslip_ros.lab.fitting.plan import Plan, plan
from stickslip_ros.lab.fitting.report import (
    as_object,
    check_output,
    write_fit,
)
from stickslip_ros.lab.runs.plotting import looking, save_figure
from stickslip_ros.lab.runs.recorded import parse_window
from stickslip_ros.parameters import parse_assignments
from stickslip_ros.progress import shown_progress
from stickslip_ros.sections import Section


def fit_verb(arguments: argparse.Namespace) -> Answer:
    """Fit the parameters, write the files and draw the figure."""
    for path in arguments.output:
        check_output(path)
    look = chosen_look(arguments)
    if arguments.seed < 0:
        raise OutOfRange('seed', arguments.seed, '', 'below 0', 'raise it')
    names = [name.strip() for name in ','.join(arguments.free).split(',') if name.strip()]
    fitted = fit(
        arguments.files,
        names,
        **said_of_tables(arguments),
        parameters=chosen_parameters(arguments),
        start=parse_assignments(arguments.start),
        bounds=parse_assignments(arguments.bounds),
        known=parse_assignments(arguments.known),
        commands=arguments.commands,
        frequency_hz=arguments.frequency,
        frequency_max_hz=arguments.frequency_max,
        steps=arguments.steps,
        window_s=parse_window(arguments.window) if arguments.window else None,
        outliers=arguments.outliers,
        shape_m=arguments.shape,
        step_share=arguments.step_share,
        starts=arguments.starts,
        seed=arguments.seed,
        workers=arguments.workers,
        progress=not arguments.json,
    )
    origin = ', '.join(path.name for path in arguments.files)
    content = as_object(fitted)
    planned: list[Section | str] = []
    if arguments.plan:
        with shown_progress('planning', quiet=arguments.json):
            chosen = plan(fitted, arguments.plan)
        planned = list(_plan(chosen))
        content['plan'] = [
            {'words': each.words, 'commands': each.commands, 'errors': row.tolist()}
            for each, row in zip(chosen.chosen, chosen.errors, strict=True)
        ]
    for path in arguments.output:
        write_fit(path, fitted, content, origin, shlex.join(['stickslip', *arguments.words]))
    files = [*arguments.output]
    if arguments.figure:
        with shown_progress('drawing', quiet=arguments.json), looking(**look):
            save_figure(draw_fit(fitted), arguments.figure)
        files.append(arguments.figure)
    parts = [*fitted.sections(), *planned, *(f'file    {path}' for path in files)]
    return Answer(content, parts, 0 if fitted.holds else CHECK_FAILED)


def _plan(chosen: Plan) -> Iterator[Section | str]:
    """Yield what to measure next, and how."""
    names = [name.partition('.')[2] for name in chosen.names]
    rows = [('now', *(f'{100.0 * each:.3g}' for each in chosen.errors_now))]
    for number, (each, errors) in enumerate(zip(chosen.chosen, chosen.errors, strict=True), 1):
        rows.append((f'{number}. {each.words}', *(f'{100.0 * error:.3g}' for error in errors)))
    yield Section('what to measure next, and the errors expected then (%)', rows, ('', *names))
    for each in chosen.chosen:
        yield from (f'command stickslip command {line}' for line in each.commands)
