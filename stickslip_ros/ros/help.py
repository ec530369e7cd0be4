# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The help text of the executable, without slow imports."""

from stickslip_ros.parameters import describe, format_value, specs

HELP = """\
usage: drive [-h] [--stage STAGE]
             [--ros-args [-p NAME:=VALUE] [--params-file FILE] [-r FROM:=TO] ...]

The virtual stick-slip drive, a lifecycle node that configures and activates itself.
It runs until Ctrl-C, SIGTERM or SIGHUP (a closed terminal). Exit status: 0 ended so, 2 a parameter
was refused, 3 closing was cut short.

  -h, --help           print this and exit
  --stage STAGE        another kind of stage, a file of config/stages, as clamp
  -p NAME:=VALUE       a parameter of the list below, in SI units
  --params-file FILE   a ROS parameter file, such as config/realistic.yaml
  -r FROM:=TO          another name, as in: -r __ns:=/left
  --log-level LEVEL    debug, info, warn, error

parameters, with their defaults:
"""


def help_text() -> str:
    """Return the help text."""
    return HELP + ''.join(
        f'  {each}:={format_value(spec.default)}\n      {describe(spec)}\n'
        for each, spec in specs().items()
    )
