# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip fit``: fit parameters of the drive to recordings and tables, with error bars."""

import argparse
import shlex

from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.lab.cli.chosen import chosen_for, chosen_look, chosen_parameters
from stickslip_ros.lab.cli.experiment import shown_tables
from stickslip_ros.lab.cli.printing import CHECK_FAILED, Answer
from stickslip_ros.lab.fitting.fit import FitOptions, fit
from stickslip_ros.lab.fitting.free import Free
from stickslip_ros.lab.fitting.report import as_object, check_output, write_fit
from stickslip_ros.parameters import parse_assignments, spec_of
from stickslip_ros.progress import shown_progress
from stickslip_ros.sections import Section


def fit_verb(arguments: argparse.Namespace) -> Answer:
    """Fit the parameters; write the files and draw the figure."""
    for path in arguments.output:
        check_output(path)
    look = chosen_look(arguments)
    options = FitOptions(**chosen_for(FitOptions, arguments))
    fitted = fit(
        arguments.files,
        chosen_free(arguments),
        parameters=chosen_parameters(arguments),
        options=options,
        report=shown_tables(arguments),
        progress=not arguments.json,
    )
    origin = ', '.join(path.name for path in arguments.files)
    content = as_object(fitted)
    for path in arguments.output:
        write_fit(path, fitted, content, origin, shlex.join(['stickslip', *arguments.words]))
    files = [*arguments.output]
    if arguments.figure:
        # slow imports
        from stickslip_ros.lab.figures.plotting import looking, save_figure  # noqa: PLC0415
        from stickslip_ros.lab.fitting.figure import draw_fit  # noqa: PLC0415

        with shown_progress('drawing', quiet=arguments.json), looking(**look):
            save_figure(draw_fit(fitted), arguments.figure)
        files.append(arguments.figure)
    parts: list[Section | str] = [*fitted.sections(), *(f'file    {path}' for path in files)]
    return Answer(content, parts, 0 if fitted.holds else CHECK_FAILED)


def chosen_free(arguments: argparse.Namespace) -> list[Free]:
    """Return the free parameters of a command line; refuse values of other parameters."""
    names = [name.strip() for name in ','.join(arguments.free).split(',') if name.strip()]
    starts, known = arguments.start or {}, arguments.known or {}
    bounds = parse_assignments(arguments.bounds, '--bounds NAME=LOW:HIGH')
    for flag, given in (('--start', starts), ('--bounds', bounds), ('--known', known)):
        for name in given:
            spec_of(name)
            if name not in names:
                hint = f'add it to --free, or set it with --set {name}=VALUE'
                raise OutOfRange(f'parameter of {flag}', name, '', 'not free', hint)
    free = []
    for name in names:
        low, colon, high = bounds.get(name, ':').partition(':')
        if not colon:
            what = f'bounds of {name}'
            raise WrongKind(what, low, 'LOW:HIGH', f'write --bounds {name}=LOW:HIGH')
        free.append(Free(name, starts.get(name), low or None, high or None, known.get(name)))
    return free
