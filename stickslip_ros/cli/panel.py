"""``stickslip panel``: the front panel in the browser."""

import argparse
import json
import os
from pathlib import Path

from stickslip_ros.cli.printing import Answer

NICENESS = 10
"""The drive goes first where both want the same core: pictures can wait, its blocks cannot."""


def panel_verb(arguments: argparse.Namespace) -> Answer:
    """Serve the panel."""
    from stickslip_ros.panel.run import run_panel  # noqa: PLC0415 - help does without ROS

    def say(address: str) -> None:
        words = f'the panel is at {address}; Ctrl-C ends it'
        print(json.dumps({'address': address}) if arguments.json else words, flush=True)

    os.nice(NICENESS)
    file: Path | None = arguments.file
    run_panel(file, arguments.namespace, arguments.port, say)
    return Answer(None)
