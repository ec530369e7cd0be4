"""``stickslip demo`` and ``stickslip positioning``: the instrument at work, over topics."""

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.table import Table

from stickslip_ros.cli.chosen import chosen_parameters, to_numbers
from stickslip_ros.cli.printing import CHECK_FAILED, Answer, number, table
from stickslip_ros.files import make_folder
from stickslip_ros.progress import shown_progress
from stickslip_ros.runs.positioning_figure import draw_positioning, largest_errors_m
from stickslip_ros.runs.run_figure import plot_run
from stickslip_ros.units import MILLI, NM

PARTS = 3
"""Things that the demo begins."""
TOLERANCE_M = 5e-9
"""Largest true distance from a target while it is held, for a pass."""
SETTLE_S = 0.2
"""Time after the load has come in which the controller may take it back."""


def demo_verb(arguments: argparse.Namespace) -> Answer:
    """Run the demo, draw its picture."""
    from stickslip_ros.testing.demo import run_demo  # noqa: PLC0415 - help does without ROS

    parameters = chosen_parameters(arguments)
    make_folder(arguments.output)
    picture = arguments.output / 'demo.png'
    title = 'Stick and slip of the free runner, then force against the load cell'
    with _told(quiet=arguments.json) as say:
        summary = run_demo(parameters, arguments.output, say)
        say('drawing its recording')
        plot_run(Path(summary.recording), picture, title=title, with_steps=True)
    return Answer(summary, _demo_parts(summary, picture), 0 if summary.passed else CHECK_FAILED)


@contextmanager
def _told(*, quiet: bool) -> Iterator[Callable[[str], None]]:
    """Give what says on standard error which part of the demo begins, and shows how many are."""
    with shown_progress('parts', quiet=quiet) as progress:
        begun = 0

        def say(line: str) -> None:
            nonlocal begun
            progress(begun, PARTS)
            begun += 1
            if not quiet:
                print(line, file=sys.stderr, flush=True)

        yield say


def _demo_parts(summary: Any, picture: Path) -> Iterator[str | Table]:
    equal = f'{summary.positions_equal} of {summary.positions_recorded}'
    rows = [
        ('steps made', summary.steps),
        number('step of the free runner', summary.free_step_m, '.2f', 'nm'),
        number('force against the load cell', summary.force_n, '.2f', 'mN'),
        number('the same under a load that pulls back', summary.loaded_force_n, '.2f', 'mN'),
        number('real-time factor', summary.real_time_factor, '.4f'),
        ('lateness of ticks in the worst second: mean', f'{summary.lateness_mean_us:.0f}', 'us'),
        ('  of 99 in 100, less than', f'{summary.lateness_p99_us:.0f}', 'us'),
        ('  largest', f'{summary.lateness_max_us:.0f}', 'us'),
        ('ticks that began more than a period late', summary.overruns),
        ('messages dropped by the recorder', summary.dropped),
        ('positions on the topic that equal the recorded ones', equal),
        ('positions on the topic that differ from them', summary.positions_altered),
        ('node ended with status', summary.exit_status),
    ]
    yield table('The drive, commanded over topics', rows)
    counts = [
        (topic, count, summary.received.get(topic, 0))
        for topic, count in summary.published.items()
    ]
    title = 'Messages; the operator listens a little longer'
    yield table(title, counts, ('topic', 'in the recording', 'at the operator'))
    yield f'recording {summary.recording}\npicture   {picture}\n\n{summary.verdict}'


def positioning_verb(arguments: argparse.Namespace) -> Answer:
    """Run, judge, draw."""
    from stickslip_ros.testing.positioning import (  # noqa: PLC0415 - help does without ROS
        run_positioning,
    )

    recording = arguments.output / 'positioning.mcap'
    picture = recording.with_suffix('.png')
    targets_m = to_numbers('--target', arguments.target, 'm')
    parameters = chosen_parameters(arguments)
    make_folder(arguments.output)
    with shown_progress('targets', quiet=arguments.json) as progress:
        legs = run_positioning(parameters, recording, targets_m, arguments.load, progress)
    # A load pushes the runner away at first; from then on the target must be held again.
    holds = [
        (leg.start_s + SETTLE_S if leg.load_n else leg.arrival_s, leg.end_s, leg.target_m)
        for leg in legs
    ]
    errors_m = largest_errors_m(recording, holds)
    draw_positioning(
        recording, [(leg.start_s, leg.end_s, leg.target_m) for leg in legs], TOLERANCE_M, picture
    )
    result = {
        'legs': [
            {
                'target_m': leg.target_m,
                'load_n': leg.load_n,
                'way_s': leg.arrival_s - leg.start_s,
                'largest_error_m': error_m,
            }
            for leg, error_m in zip(legs, errors_m, strict=True)
        ],
        'passed': all(error_m <= TOLERANCE_M for error_m in errors_m),
        'recording': str(recording),
        'picture': str(picture),
    }
    return Answer(result, _positioning_parts(result), 0 if result['passed'] else CHECK_FAILED)


def _positioning_parts(result: dict[str, Any]) -> Iterator[str | Table]:
    rows = [
        (
            f'{leg["target_m"] * NM:g} nm'
            + (f' under {leg["load_n"]:g} N' if leg['load_n'] else ''),
            '-' if leg['load_n'] else f'{leg["way_s"] / MILLI:.0f}',
            f'{leg["largest_error_m"] * NM:.2f}',
        )
        for leg in result['legs']
    ]
    yield table('targets', rows, ('target', 'way (ms)', 'largest error in hold (nm)'))
    yield f'{"held" if result["passed"] else "NOT held"} within {TOLERANCE_M * NM:g} nm'
    yield f'recording {result["recording"]}\npicture {result["picture"]}'
