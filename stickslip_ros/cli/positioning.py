"""``stickslip positioning``: a controller brings the virtual stage to its targets, over topics."""

import argparse
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
from stickslip_ros.errors import WrongKind
from stickslip_ros.files import make_folder
from stickslip_ros.study.positioning_figure import draw_positioning, largest_errors_m
from stickslip_ros.units import NM

CHECK_FAILED = 1
TOLERANCE_M = 5e-9
"""Largest true distance from a target while it is held, for a pass."""
SETTLE_S = 0.2
"""Time after the load has come in which the controller may take it back."""


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'positioning',
        description='Drive and position_controller in lockstep, over topics: the same bytes on '
        'every machine. Goes to the targets one after the other, then an external load comes. '
        f'Passes if every target is held within {TOLERANCE_M * NM:g} nm of the true position. '
        'Try --params config/realistic.yaml. Writes DIR/positioning.mcap and .png.',
    )
    parser.add_argument(
        '--targets',
        default='100e-9,1e-6,10e-6,100e-6',
        metavar='M,M,...',
        help='positions, m (default: %(default)s)',
    )
    parser.add_argument(
        '--load', type=float, default=0.05, metavar='N', help='load at the end (default: 0.05)'
    )
    add_folder(parser)
    add_parameters(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run, judge, draw, print."""
    from stickslip_ros.testing.positioning import run_positioning  # noqa: PLC0415 - needs ROS

    recording = arguments.out / 'positioning.mcap'
    targets_m = _targets(arguments.targets)
    parameters = chosen_parameters(arguments)
    make_folder(arguments.out)
    legs = run_positioning(parameters, recording, targets_m, arguments.load)
    # A load pushes the runner away at first; from then on the target must be held again.
    holds = [
        (leg.start_s + SETTLE_S if leg.load_n else leg.arrival_s, leg.end_s, leg.target_m)
        for leg in legs
    ]
    errors_m = largest_errors_m(recording, holds)
    picture = recording.with_suffix('.png')
    draw_positioning(
        recording, [(leg.start_s, leg.end_s, leg.target_m) for leg in legs], TOLERANCE_M, picture
    )
    passed = all(error_m <= TOLERANCE_M for error_m in errors_m)
    result = [
        {
            'target_m': leg.target_m,
            'load_n': leg.load_n,
            'way_s': leg.arrival_s - leg.start_s,
            'largest_error_m': error_m,
        }
        for leg, error_m in zip(legs, errors_m, strict=True)
    ]
    if arguments.json:
        names = {'recording': str(recording), 'picture': str(picture)}
        print_json({'legs': result, 'passed': passed, **names})
    else:
        _print(result, recording, picture, passed=passed)
    return 0 if passed else CHECK_FAILED


def _targets(text: str) -> list[float]:
    try:
        return [float(word) for word in text.split(',')]
    except ValueError:
        mend = 'give positions in m, as 100e-9,1e-6'
        raise WrongKind('--targets', text, 'a list of numbers', mend) from None


def _print(legs: list[dict[str, float]], recording: Path, picture: Path, *, passed: bool) -> None:
    rows = [
        (
            f'{leg["target_m"] * NM:g} nm'
            + (f' under {leg["load_n"]:g} N' if leg['load_n'] else ''),
            '-' if leg['load_n'] else f'{leg["way_s"] * 1e3:.0f}',
            f'{leg["largest_error_m"] * NM:.2f}',
        )
        for leg in legs
    ]
    print_table('targets', rows, ('target', 'way (ms)', 'largest error in hold (nm)'))
    print(f'{"held" if passed else "NOT held"} within {TOLERANCE_M * NM:g} nm')
    print(f'recording {recording}\npicture {picture}')
