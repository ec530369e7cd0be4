# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip panel``: the front panel in the browser."""

import argparse
import json
import os
from pathlib import Path

from stickslip_ros.extras import load_extra
from stickslip_ros.lab.cli.printing import Answer

NICENESS = 4
"""The drive has priority on a shared core: pictures can wait, its blocks cannot. At 10 the drive
is no more punctual, and with other busy programs the panel almost stops."""

# ruff: noqa: PLC0415 - help needs no extra, a recording no ROS, a drive no reader


def panel_verb(arguments: argparse.Namespace) -> Answer:
    """Serve the panel of a recording or of a drive until Ctrl-C."""
    load_extra('the panel', 'tornado')
    from stickslip_ros.lab.panel.controls import lamps, sheet
    from stickslip_ros.lab.panel.model import Source
    from stickslip_ros.lab.panel.server import serve

    def say(address: str) -> None:
        words = f'the panel is at {address}; Ctrl-C ends it'
        print(json.dumps({'address': address}) if arguments.json else words, flush=True)

    if hasattr(os, 'nice'):
        os.nice(NICENESS)
    file: Path | None = arguments.file
    source: Source
    if file is None:
        from stickslip_ros.lab.panel.link import Link

        source, first = Link(arguments.namespace, name=arguments.node), sheet()
    else:
        from stickslip_ros.lab.panel.player import Player

        source = player = Player(file, arguments.headers or {}, arguments.window_s)
        first = {'kind': 'recording', **lamps(), 'run': player.overview()}
    serve(source, first, arguments.port, say)
    return Answer(None)
