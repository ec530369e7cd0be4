"""``stickslip panel``: the front panel in the browser."""

import argparse
import json
from pathlib import Path

from stickslip_ros.cli.options import option, to_path, verb
from stickslip_ros.cli.printing import Answer


@verb(
    'Serve the front panel of a running drive, or of a recording, to a browser on this host, '
    'until Ctrl-C.',
    option('file', 'a recording to play; none: attach to a drive', to_path, nargs='?'),
    option('--namespace', 'of the drive, as /left', metavar='NAME', default=''),
    option('--port', 'TCP port on 127.0.0.1; 0 takes a free one', int, default=8040),
)
def panel_verb(arguments: argparse.Namespace) -> Answer:
    """Serve the panel."""
    from stickslip_ros.panel.run import run_panel  # noqa: PLC0415 - help does without ROS

    def say(address: str) -> None:
        words = f'the panel is at {address}; Ctrl-C ends it'
        print(json.dumps({'address': address}) if arguments.json else words, flush=True)

    file: Path | None = arguments.file
    run_panel(file, arguments.namespace, arguments.port, say)
    return Answer(None)
