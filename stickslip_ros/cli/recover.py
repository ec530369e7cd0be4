"""``stickslip recover``: make the rest of a broken recording readable."""

import argparse
from typing import Any

from stickslip_ros.cli.common import add_json, print_json, print_table, to_path
from stickslip_ros.files import make_folder
from stickslip_ros.recording.recover import Recovery, recover
from stickslip_ros.units import NS_PER_S


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'recover',
        description='Copy what can be read of an MCAP file or a bag into a finished, indexed one. '
        'The original is only read; nothing is overwritten.',
    )
    parser.add_argument(
        'file', type=to_path, help='an MCAP file, a bag directory, or a run in parts'
    )
    parser.add_argument(
        '-o',
        '--out',
        type=to_path,
        metavar='OUT',
        help='the copy; FILE.recovered.mcap if not given',
    )
    add_json(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Recover and print."""
    if arguments.out:
        make_folder(arguments.out.parent)
    recoveries, written = recover(arguments.file, arguments.out)
    if arguments.json:
        files = [each.to_json() for each in recoveries]
        print_json({'written': str(written or ''), 'files': files})
        return 0
    for recovery in recoveries:
        _print(recovery)
    print(f'wrote {written}' if written else f'{arguments.file} is whole: nothing was written')
    return 0


def _print(recovery: Recovery) -> None:
    if recovery.is_whole:
        print(f'{recovery.source} is whole: {recovery.messages} messages')
        return
    rows = [
        (each.topic, str(each.messages), *_seconds(each.first_ns, each.last_ns), str(each.gaps))
        for each in recovery.topics
    ]
    header = ('topic', 'messages', 'first (s)', 'last (s)', 'missing')
    print_table(f'read of {recovery.source}', rows, header)
    losses = [
        (
            str(loss.offset),
            str(loss.size_bytes),
            *_seconds(loss.first_ns, loss.last_ns),
            loss.problem,
        )
        for loss in recovery.losses
    ]
    if losses:
        header = ('at byte', 'bytes', 'first (s)', 'last (s)', 'problem')
        print_table(f'lost: {recovery.lost_bytes} of {recovery.size_bytes} bytes', losses, header)
    if recovery.unchecked:
        print(f'{recovery.unchecked} messages are covered by no checksum')
    for note in recovery.notes:
        print(note)


def _seconds(*times_ns: int | None) -> list[str]:
    return ['-' if each is None else f'{each / NS_PER_S:.6f}' for each in times_ns]
