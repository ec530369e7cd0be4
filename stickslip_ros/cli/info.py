"""``stickslip info``: what is in a recording."""

import argparse
import dataclasses
from pathlib import Path
from typing import Any

from stickslip_ros.cli.common import add_json, print_json, print_table, to_path
from stickslip_ros.parameters import parse_yaml
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.run_file import PARAMETERS_FILE, RUN_RECORD


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'info',
        description='Say what is in an MCAP file, a bag directory, or a run in parts.',
    )
    parser.add_argument('file', type=to_path, help='a file, a bag directory, or a run in parts')
    add_json(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Read and print."""
    result = describe_recording(Recording(arguments.file))
    if arguments.json:
        print_json(result)
    else:
        _print(arguments.file, result)
    return 0


def describe_recording(recording: Recording) -> dict[str, Any]:
    """Return topics, changed parameters, metadata and attachments of a recording."""
    changed: dict[str, Any] = {}
    if PARAMETERS_FILE in recording.attachments:
        text = recording.attachments[PARAMETERS_FILE][1].decode()
        changed = parse_yaml(text, PARAMETERS_FILE).changed()
    return {
        'topics': [
            {**dataclasses.asdict(channel), 'rate_hz': channel.rate_hz}
            for channel in recording.channels
        ],
        'changed_parameters': changed,
        'run': recording.metadata.get(RUN_RECORD, {}),
        'attachments': {name: len(data) for name, (_, data) in recording.attachments.items()},
    }


def _print(file: Path, result: dict[str, Any]) -> None:
    rows = [
        (
            topic['topic'],
            topic['type_name'].rpartition('/')[2],
            str(topic['messages']),
            f'{topic["rate_hz"]:.1f}' if topic['rate_hz'] else '-',
            str(topic['gaps']),
        )
        for topic in result['topics']
    ]
    header = ('topic', 'type', 'messages', 'rate (Hz)', 'missing')
    print_table(str(file), rows, header)
    if result['run']:
        print_table('run', list(result['run'].items()))
    changed = [(name, str(value)) for name, value in result['changed_parameters'].items()]
    print_table(
        'parameters that differ from the default', changed or [('none', 'the stand of the paper')]
    )
