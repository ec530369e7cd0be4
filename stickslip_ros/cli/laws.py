"""``stickslip laws``: every profile and every friction law in the drive, in one figure."""

import argparse
import dataclasses
from pathlib import Path
from typing import Any

from stickslip_ros.cli.common import (
    add_json,
    add_parameters,
    chosen_parameters,
    print_json,
    print_table,
    to_path,
)
from stickslip_ros.cli.progress import shown_progress
from stickslip_ros.errors import OutOfRange
from stickslip_ros.files import make_folder
from stickslip_ros.paper.law_comparison import (
    AMPLITUDE_MAX_M,
    FREQUENCY_HZ,
    Point,
    compare_laws,
    draw_points,
    write_points,
)
from stickslip_ros.parameters import Parameters


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'laws',
        description='Run the drive with every contact profile and every rival friction law at '
        '0.1, 0.5 and 1 N. Writes DIR/laws.csv and DIR/laws.png. The rival laws take their '
        'stiffness and limit from the contact model, unless friction_law.* says otherwise.',
    )
    parser.add_argument(
        '--out', type=to_path, default=Path('runs'), metavar='DIR', help='default: %(default)s'
    )
    parser.add_argument(
        '--amplitudes', type=int, default=16, metavar='N', help='default: %(default)s'
    )
    add_parameters(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run all, write the table, draw the figure."""
    parameters = chosen_parameters(arguments)
    if arguments.amplitudes < 1:
        mend = 'give the number of amplitudes up to 160 nm'
        raise OutOfRange('--amplitudes', arguments.amplitudes, '', 'below 1', mend)
    make_folder(arguments.out)
    with shown_progress('runs', quiet=arguments.json) as progress:
        points = compare_laws(parameters, arguments.amplitudes, progress)
    write_points(points, arguments.out / 'laws.csv')
    draw_points(points, arguments.out / 'laws.png', _note(parameters))
    if arguments.json:
        print_json({'points': [dataclasses.asdict(point) for point in points]})
    else:
        _print(points, arguments.out)
    return 0


def _note(parameters: Parameters) -> str:
    stiffness, damping = parameters.load_cell.stiffness, parameters.runner.damping
    return (
        f'{FREQUENCY_HZ:g} Hz, steady state; assumed: k = {stiffness:g} N/m, '
        f'c = {damping:g} N s/m; laws: sigma0 = full-stick stiffness, Fc = mu F_n'
    )


def _print(points: list[Point], folder: Path) -> None:
    largest = [p for p in points if abs(p.amplitude_m - AMPLITUDE_MAX_M) < 1e-12]
    names = list(dict.fromkeys(p.variant for p in largest))
    preloads_n = sorted({p.preload_n for p in largest})
    rows = [
        (
            name,
            *(
                f'{p.force_mean_n * 1e3:.1f}'
                for preload_n in preloads_n
                for p in largest
                if p.variant == name and p.preload_n == preload_n
            ),
        )
        for name in names
    ]
    header = ('profile or law', *(f'{preload_n:g} N' for preload_n in preloads_n))
    print_table('generated force at 160 nm (mN)', rows, header)
    print(f'table   {folder / "laws.csv"}\nfigure  {folder / "laws.png"}')
