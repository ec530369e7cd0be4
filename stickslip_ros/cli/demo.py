"""``stickslip demo``: node and operator as two processes, topics between them, a recording."""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from stickslip_ros.cli.common import (
    add_folder,
    add_json,
    add_parameters,
    chosen_parameters,
    print_json,
    print_table,
)
from stickslip_ros.files import make_folder
from stickslip_ros.study.run_figure import plot_run

CHECK_FAILED = 1


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'demo',
        description='Start the node as a process of its own; from here, over topics: a saw-tooth '
        'burst, a direct-voltage ramp, an external load. Writes DIR/demo.mcap and DIR/demo.png.',
    )
    add_folder(parser)
    add_parameters(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run the demo, print its table, draw its picture."""
    from stickslip_ros.testing.demo import run_demo  # noqa: PLC0415 - other verbs do without ROS

    parameters = chosen_parameters(arguments)
    make_folder(arguments.out)
    summary = run_demo(parameters, arguments.out, _say_unless(arguments.json))
    picture = arguments.out / 'demo.png'
    title = 'Saw-tooth burst, direct-voltage ramp and external load on the virtual stand'
    plot_run(Path(summary.recording), picture, title=title, with_step=True)
    if arguments.json:
        print_json(summary)
    else:
        _print(summary, picture)
    return 0 if summary.passed else CHECK_FAILED


def _say_unless(quiet: bool) -> Callable[[str], None]:
    """Return what says on standard error what is being done."""
    return (lambda _: None) if quiet else (lambda line: print(line, file=sys.stderr, flush=True))


def _print(summary: Any, picture: Path) -> None:
    rows = [
        ('steps made', str(summary.steps), ''),
        ('mean step of the burst', f'{summary.mean_step_m * 1e9:.2f}', 'nm'),
        ('first step', f'{summary.first_step_m * 1e9:.2f}', 'nm'),
        ('generated force at the end of the burst', f'{summary.force_n * 1e3:.2f}', 'mN'),
        ('motion by the external load', f'{summary.load_motion_m * 1e9:.2f}', 'nm'),
        ('real-time factor', f'{summary.real_time_factor:.4f}', ''),
        ('lateness mean', f'{summary.lateness_mean_us:.0f}', 'us'),
        ('lateness 99 %', f'{summary.lateness_p99_us:.0f}', 'us'),
        ('lateness max', f'{summary.lateness_max_us:.0f}', 'us'),
        ('overruns', str(summary.overruns), ''),
        ('messages dropped by the recorder', str(summary.dropped), ''),
        (
            'positions equal on topic and in file',
            f'{summary.positions_equal} of {summary.positions_recorded}',
            '',
        ),
        ('positions altered on the way', str(summary.positions_altered), ''),
        ('node ended with status', str(summary.exit_status), ''),
    ]
    print_table('The drive, commanded over topics', rows)
    counts = [
        (key, str(count), str(summary.received.get(key, 0)))
        for key, count in summary.published.items()
    ]
    print_table('messages', counts, ('topic', 'in the recording', 'at the operator'))
    print(f'recording {summary.recording}\npicture   {picture}')
