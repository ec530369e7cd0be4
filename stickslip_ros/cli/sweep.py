"""``stickslip sweep``: the drive at every combination of values, in one table."""

import argparse
from pathlib import Path
from typing import Any

from stickslip_ros.cli.common import (
    add_json,
    add_parameters,
    add_workers,
    chosen_parameters,
    print_json,
    print_table,
    to_path,
)
from stickslip_ros.cli.progress import shown_progress
from stickslip_ros.parameters import spec_of
from stickslip_ros.study.journal import Journal, Row
from stickslip_ros.study.sweep import (
    AMPLITUDE,
    FREQUENCY,
    STEADY_RULE,
    Axis,
    Sweep,
    parse_axis,
    parse_varied,
    run_sweep,
    stop_rule,
)
from stickslip_ros.study.sweep_table import check_table_path, write_table

VALUES = 'VALUES'


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'sweep',
        description='Run the drive alone, without sensors, at every combination of values. '
        'VALUES are a list, 0.1,0.4, or a range start:stop:count with both ends, 0:160e-9:33; '
        'one that begins with a minus needs an equals sign before it, --frequency=-500,500. '
        f'A run ends when it is steady: {STEADY_RULE}; --steps sets a number instead. Finished '
        'runs are kept in FILE.journal: after Ctrl-C or a crash the same command goes on.',
    )
    parser.add_argument('--preload', metavar=VALUES, help='varies stand.preload, N')
    parser.add_argument(
        '--amplitude', metavar=VALUES, required=True, help='strokes of the feet, m'
    )
    parser.add_argument(
        '--frequency',
        metavar=VALUES,
        default=str(FREQUENCY.default),
        help='steps per second (default: %(default)s)',
    )
    parser.add_argument(
        '--vary',
        action='append',
        default=[],
        metavar='GROUP.NAME=VALUES',
        help='vary any parameter; may be repeated; the first one is the slowest',
    )
    parser.add_argument(
        '--steps', type=int, default=0, metavar='N', help='steps (default: until steady)'
    )
    parser.add_argument(
        '--free', action='store_true', help='no load cell: sets load_cell.contact=absent'
    )
    parser.add_argument(
        '-o', '--output', type=to_path, required=True, metavar='FILE', help='.csv or .parquet'
    )
    _add_who(parser)
    add_parameters(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def _add_who(parser: argparse.ArgumentParser) -> None:
    """Add who does the work, and whether it begins anew."""
    who = parser.add_mutually_exclusive_group()
    add_workers(who)
    who.add_argument(
        '--scheduler',
        default='',
        metavar='ADDRESS',
        help='run on a Dask cluster instead, as tcp://HOST:8786; needs: pip install distributed',
    )
    parser.add_argument('--fresh', action='store_true', help='forget what FILE.journal holds')


def run(arguments: argparse.Namespace) -> int:
    """Sweep, write and print."""
    check_table_path(arguments.output)
    sweep = chosen_sweep(arguments)
    journal_path = arguments.output.with_name(f'{arguments.output.name}.journal')
    with Journal(journal_path, sweep.identity(), fresh=arguments.fresh) as journal:
        resumed = len(journal.rows)
        rows = _run(sweep, journal, arguments)
        write_table(rows, arguments.output, sweep.parameters)
        journal.remove()
    if arguments.json:
        file = str(arguments.output)
        print_json({'file': file, 'stop_rule': stop_rule(sweep.steps), 'rows': rows})
    else:
        _print(rows, resumed, sweep, arguments.output)
    return 0


def chosen_sweep(arguments: argparse.Namespace) -> Sweep:
    """
    Return the sweep that a command line asks for.

    Raises
    ------
    StickSlipError
        If a name, a value or a combination is refused.

    """
    parameters = chosen_parameters(arguments)
    axes = parse_varied(arguments.vary)
    if arguments.free:
        axes.append(Axis('load_cell.contact', ('absent',)))
    if arguments.preload is not None:
        axes.append(parse_axis('stand.preload', arguments.preload, spec_of('stand.preload')))
    return Sweep(
        parameters=parameters,
        varied=tuple(axes),
        frequencies_hz=_floats('frequency', arguments.frequency, FREQUENCY),
        amplitudes_m=_floats('amplitude', arguments.amplitude, AMPLITUDE),
        steps=arguments.steps,
    )


def _floats(name: str, text: str, spec: Any) -> tuple[float, ...]:
    return tuple(float(value) for value in parse_axis(name, text, spec).values)


def _run(sweep: Sweep, journal: Journal, arguments: argparse.Namespace) -> list[Row]:
    with shown_progress('runs', quiet=arguments.json, resumes=True) as progress:
        return run_sweep(
            sweep,
            journal=journal,
            workers=arguments.workers,
            scheduler=arguments.scheduler,
            progress=progress,
        )


def _print(rows: list[Row], resumed: int, sweep: Sweep, path: Path) -> None:
    steady = sum(bool(row['steady']) for row in rows)
    table = [
        ('runs', str(len(rows))),
        ('of these taken from the journal', str(resumed)),
        ('steady', str(steady)),
        ('largest energy residual', f'{max(abs(float(r["energy_residual"])) for r in rows):.2e}'),
    ]
    print_table('sweep', table)
    print(f'stop    {stop_rule(sweep.steps)}')
    print(f'table   {path}')
