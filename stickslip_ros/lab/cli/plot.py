# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip plot``: draw a recording or a table, over time or by amplitude."""

import argparse
from itertools import groupby

from stickslip_ros.errors import RecordingError
from stickslip_ros.files import prepare_output
from stickslip_ros.lab.cli.chosen import chosen_look
from stickslip_ros.lab.cli.experiment import chosen_reading
from stickslip_ros.lab.cli.printing import Answer
from stickslip_ros.lab.figures.plotting import check_picture, looking, save_figure
from stickslip_ros.lab.measurements.measurement import PointTable, measured_alone
from stickslip_ros.lab.measurements.points_figure import draw_points
from stickslip_ros.lab.measurements.recorded import RUN_QUANTITIES
from stickslip_ros.lab.measurements.run_figure import RunPlot, draw_run
from stickslip_ros.lab.measurements.words import quantity_words
from stickslip_ros.recording.reader import Recording
from stickslip_ros.sections import Section, as_json
from stickslip_ros.units import with_unit


def plot_verb(arguments: argparse.Namespace) -> Answer:
    """Draw the quantities of recordings and tables."""
    first, window = arguments.files[0], arguments.window_s
    picture = arguments.output or first.parent / f'{first.stem}.png'
    check_picture(picture)
    if arguments.output:
        prepare_output(picture)
    look, reading = chosen_look(arguments), chosen_reading(arguments, arguments.files)
    run = measured_alone(arguments.files, reading)
    if isinstance(run, PointTable) and window is not None:
        problem = 'is by amplitude and has no times'
        raise RecordingError(run.side.origin, problem, 'leave out --window')
    with looking(**look):
        figure, plot = draw_points(run) if isinstance(run, PointTable) else draw_run(run, window)
        save_figure(figure, picture)
    notes = list(run.notes if isinstance(run, Recording) else run.side.notes)
    rows = [
        (
            RUN_QUANTITIES.get(each.name, quantity_words(each.name)),
            each.samples,
            '' if each.smallest is None else with_unit(each.smallest, each.unit),
            '' if each.largest is None else with_unit(each.largest, each.unit),
        )
        for each in plot.quantities
    ]
    header = 'quantity', 'samples', 'smallest', 'largest'
    parts = [Section(plot.title, rows, header, notes)]
    if isinstance(plot, RunPlot) and plot.events:
        runs = (list(group) for _, group in groupby(plot.events, key=lambda each: each[1:3]))
        events = [
            (f'{first.time_s:.6f} s', *first[1:3], 1 + len(others), first.message)
            for first, *others in runs
        ]
        parts.append(
            Section('events', events, ('first at', 'command', 'result', 'in a row', 'why'))
        )
    content = {'picture': str(picture), **as_json(plot), 'notes': notes}
    return Answer(content, [*parts, f'picture {picture}'])
