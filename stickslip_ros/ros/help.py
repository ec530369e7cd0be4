"""The help of the executables, before anything is imported that takes long."""

from stickslip_ros.parameters import (
    ControllerParameters,
    declared_by,
    describe,
    format_value,
    specs,
)

HELP = """\
usage: {name} [-h] [--ros-args [-p NAME:=VALUE] [--params-file FILE] [-r FROM:=TO] ...]

{text}
It runs until Ctrl-C, SIGTERM or SIGHUP (a closed terminal). Exit status: 0 ended so, 2 a parameter
was refused, 3 closing was cut short.

  -h, --help           print this and exit
  -p NAME:=VALUE       a parameter of the list below, in SI units
  --params-file FILE   a ROS parameter file, such as config/realistic.yaml
  -r FROM:=TO          another name, as in: -r __ns:=/left
  --log-level LEVEL    debug, info, warn, error

parameters, with their defaults:
"""
PROGRAMS = {
    'drive': (
        'The virtual stick-slip drive, a lifecycle node that configures and activates itself.',
        specs(),
    ),
    'position_controller': (
        'Brings the runner of a drive to the last ~/target and holds it there, over topics only.',
        declared_by(ControllerParameters),
    ),
}
"""What each executable is, and its parameters."""


def help_of(name: str) -> str:
    """Return the help of an executable."""
    text, declared = PROGRAMS[name]
    return HELP.format(name=name, text=text) + ''.join(
        f'  {each}:={format_value(spec.default)}\n      {describe(spec)}\n'
        for each, spec in declared.items()
    )
