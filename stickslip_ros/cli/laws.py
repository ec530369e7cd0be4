"""``stickslip laws``: every profile and every friction law in the drive, in one figure."""

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
from stickslip_ros.cli.progress import shown_progress
from stickslip_ros.errors import OutOfRange
from stickslip_ros.files import make_folder
from stickslip_ros.paper.figure import Table, write_figure
from stickslip_ros.paper.laws import LAWS
from stickslip_ros.paper.make import make_tables
from stickslip_ros.paper.readings import AMPLITUDE_MAX_M, PRELOADS_N
from stickslip_ros.units import MN


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'laws',
        description='Run the drive with every contact profile and every friction law at '
        '0.1, 0.5 and 1 N. Writes DIR/laws.csv and DIR/laws.png. The laws take their '
        'stiffness and limit from the contact model, unless friction_law.* says otherwise.',
    )
    add_folder(parser)
    parser.add_argument(
        '--amplitudes', type=int, default=LAWS.points, metavar='N', help='default: %(default)s'
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
        tables = make_tables([LAWS], parameters, points=arguments.amplitudes, progress=progress)
    table = tables[LAWS.name]
    files = write_figure(LAWS, table, parameters, arguments.out, ('.csv', '.png'))
    if arguments.json:
        print_json({'points': table.rows})
    else:
        _print(table, files)
    return 0


def _print(table: Table, files: list[Path]) -> None:
    largest = table.where(amplitude_m=AMPLITUDE_MAX_M)
    forces: dict[str, list[str]] = {}
    for row in largest.rows:
        forces.setdefault(str(row['variant']), []).append(f'{float(row["force_mean_n"]) * MN:.1f}')
    header = ('profile or law', *(f'{n:g} N' for n in PRELOADS_N))
    rows = [(name, *texts) for name, texts in forces.items()]
    print_table('generated force at 160 nm (mN)', rows, header)
    print(f'table   {files[0]}\nfigure  {files[1]}')
