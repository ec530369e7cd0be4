"""``stickslip plot``: a quick picture of a recording."""

import argparse
import dataclasses
from pathlib import Path
from typing import Any

from stickslip_ros.cli.common import add_json, print_json, print_table, to_path
from stickslip_ros.files import make_room
from stickslip_ros.study.recorded_run import RUN_QUANTITIES, parse_window
from stickslip_ros.study.run_figure import RunPlot, plot_run
from stickslip_ros.units import with_unit


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'plot',
        description='Draw a recording: the trace where there is one, else the topics at 1 kHz; '
        'below, the status bits; dotted, the ends of commands. However many samples there are, '
        'no peak is lost.',
    )
    parser.add_argument('file', type=to_path, help='the recording')
    parser.add_argument(
        '--window',
        metavar='LENGTH@START',
        help='stretch to draw, with s, ms or us: 2ms@0.3s is 2 ms from 0.3 s on '
        '(default: the whole run)',
    )
    parser.add_argument(
        '-o',
        '--output',
        type=to_path,
        metavar='FILE',
        help='.png, .svg or .pdf (default: beside the recording, as PNG)',
    )
    add_json(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Draw and print."""
    window = None if arguments.window is None else parse_window(arguments.window)
    picture = arguments.output or arguments.file.parent / f'{arguments.file.stem}.png'
    if arguments.output:
        make_room(picture)
    plot = plot_run(arguments.file, picture, window)
    if arguments.json:
        told = dataclasses.asdict(plot)
        told['events'] = [event._asdict() for event in plot.events]
        told['status'] = [span._asdict() for span in plot.status]
        print_json({'picture': str(picture), **told})
    else:
        _print(plot, picture)
    return 0


def _print(plot: RunPlot, picture: Path) -> None:
    rows = [
        (
            RUN_QUANTITIES[each.name],
            str(each.samples),
            '' if each.smallest is None else with_unit(each.smallest, each.unit),
            '' if each.largest is None else with_unit(each.largest, each.unit),
        )
        for each in plot.quantities
    ]
    title = f'{plot.start_s:.9g} s to {plot.end_s:.9g} s'
    print_table(title, rows, ('quantity', 'samples', 'smallest', 'largest'))
    if plot.events:
        events = [(f'{each.time_s:.6f} s', each.command, each.result) for each in plot.events]
        print_table('events', events, ('time', 'command', 'result'))
    print(f'picture {picture}')
