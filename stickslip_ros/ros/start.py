# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The executable of the node: it handles Ctrl-C and --help before it imports rclpy."""

import gc
import sys
from collections.abc import Sequence
from itertools import takewhile

from stickslip_ros.errors import UnknownName
from stickslip_ros.extras import MissingRos, needs_ros
from stickslip_ros.parameters import describe, format_value, specs
from stickslip_ros.parameters.stages import stage_file
from stickslip_ros.process.signals import REFUSED, run

# ruff: noqa: PLC0415 - late imports are the purpose of this module

HELP = """\
usage: drive [-h] [--stage STAGE]
             [--ros-args [-p NAME:=VALUE] [--params-file FILE] [-r FROM:=TO] ...]

The virtual stick-slip drive, a lifecycle node that configures and activates itself.
It runs until Ctrl-C, SIGTERM or SIGHUP (a closed terminal). Exit status: 0 after these, 2 if a
parameter was refused, 3 if closing was cut short.

  -h, --help           print this and exit
  --stage STAGE        another kind of stage, a file of config/stages, such as clamp
  -p NAME:=VALUE       a parameter of the list below, in SI units
  --params-file FILE   a ROS parameter file, such as config/realistic.yaml
  -r FROM:=TO          another name, as in: -r __ns:=/left
  --log-level LEVEL    debug, info, warn, error

parameters, with their defaults:
"""


def drive() -> int:
    """Run the node; return its exit status."""
    return run('drive', _drive, is_node=True)


def _drive() -> int:
    if {'-h', '--help'} & set(takewhile(lambda word: word != '--ros-args', sys.argv)):
        sys.stdout.write(HELP)
        for each, spec in specs().items():
            sys.stdout.write(f'  {each}:={format_value(spec.default)}\n      {describe(spec)}\n')
        return 0
    gc.disable()  # until the node is made, see ``run_node``: saves a seventh of its start
    try:
        words = with_stage(sys.argv)
        with needs_ros('the drive'):
            from stickslip_ros.ros.node import main
    except (MissingRos, UnknownName) as error:
        sys.stderr.write(f'drive: {error}\n')
        return REFUSED
    return main(words)


def with_stage(words: Sequence[str]) -> list[str]:
    """Return a command line with the file of its ``--stage`` in place of the stage, for ROS."""
    own = [*takewhile(lambda word: word != '--ros-args', words)]
    if '--stage' not in own:
        return list(words)
    at = own.index('--stage')
    file = stage_file(next(iter(own[at + 1 :]), ''))
    return [*own[:at], '--ros-args', '--params-file', str(file), '--', *words[at + 2 :]]
