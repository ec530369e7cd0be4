"""``stickslip replay``: a recording, or a measured voltage, through the virtual stand again."""

import argparse
import dataclasses
import tempfile
from pathlib import Path
from typing import Any

from stickslip_ros.cli.common import (
    add_json,
    add_parameters,
    chosen_values,
    print_json,
    print_table,
    to_path,
)
from stickslip_ros.cli.progress import shown_progress
from stickslip_ros.errors import WrongKind
from stickslip_ros.files import make_room
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.replay import (
    Replay,
    is_run,
    read_drive_input,
    replay,
    replay_input,
)
from stickslip_ros.units import NANO

CHECK_FAILED = 1


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'replay',
        description='Without --set, the requests of a recording give the same data again, byte '
        'for byte; the exit status is 1 if they do not. With --set or --params they answer what '
        'another stand would have done. A table of voltages or strokes over time (CSV, Parquet, '
        'or a topic of an MCAP file) is played as a waveform.',
    )
    parser.add_argument('file', type=to_path, help='recording, or table with time_s and voltage_v')
    parser.add_argument('-o', '--output', type=to_path, metavar='FILE', help='recording to write')
    parser.add_argument(
        '--topic', default='', metavar='NAME', help='topic of an MCAP file that gives the voltage'
    )
    parser.add_argument(
        '--field', default='', metavar='NAME', help='field or column of that topic, as voltage'
    )
    parser.add_argument(
        '--stroke', action='store_true', help='the topic gives a stroke in m, not a voltage'
    )
    parser.add_argument(
        '--from-rest',
        action='store_true',
        help='replay a recording that began in the middle of a run from rest: not the same run',
    )
    add_parameters(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Replay and print."""
    if arguments.output is None:
        with tempfile.TemporaryDirectory() as folder:
            return _run(arguments, Path(folder) / 'replay.mcap', is_kept=False)
    make_room(arguments.output, is_new=True)
    return _run(arguments, arguments.output, is_kept=True)


def _run(arguments: argparse.Namespace, output: Path, *, is_kept: bool) -> int:
    changes = chosen_values(arguments)
    with shown_progress('simulated ms', quiet=arguments.json) as progress:

        def show(now_ns: int, end_ns: int) -> None:
            progress(now_ns // 1_000_000, end_ns // 1_000_000)

        if not arguments.topic and is_run(arguments.file):
            result = replay(
                arguments.file, output, changes, from_rest=arguments.from_rest, progress=show
            )
        else:
            if not is_kept:
                mend = 'give the recording to write with -o'
                raise WrongKind('--output', 'nothing', 'a file', mend)
            stand = Parameters().updated(changes)
            given = read_drive_input(
                arguments.file, stand, arguments.topic, arguments.field, is_stroke=arguments.stroke
            )
            result = replay_input(given, output, stand, progress=show)
    if arguments.json:
        print_json({**dataclasses.asdict(result), 'output': str(output) if is_kept else ''})
    else:
        _print(result, str(output) if is_kept else 'not kept')
    is_same_run = not result.changed and not arguments.from_rest
    return CHECK_FAILED if is_same_run and result.identical is False else 0


def _print(result: Replay, output: str) -> None:
    rows = [
        ('requests carried out again', str(result.requests)),
        ('simulated time', f'{result.simulated_s:g} s'),
        ('position at the end', f'{result.position_m / NANO:.3f} nm'),
        ('force at the end', f'{result.force_n * 1e3:.4f} mN'),
        ('SHA-256 of the data', result.digest[:16] + '...'),
        ('recording', output),
    ]
    rows += [(f'changed {name}', str(value)) for name, value in result.changed.items()]
    print_table(f'replay of {result.source}', rows)
    if result.identical:
        print('the data section is identical, byte for byte')
    elif result.changed:
        print(f'see what changed: stickslip compare {result.source} {output}')
    elif result.difference is not None:
        where = result.difference
        print(
            f'the data differ from message {where.message} on: {where.what} of {where.topic} '
            f'at {where.time_s:g} s'
        )
        if result.other_sources:
            print('the recording was computed by other sources, which may round differently')
