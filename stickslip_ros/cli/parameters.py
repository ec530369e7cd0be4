"""``stickslip parameters``: every parameter as a ROS parameter file."""

import argparse
from typing import Any

from stickslip_ros.cli.common import add_json, add_parameters, chosen_parameters, print_json
from stickslip_ros.parameters import dump_yaml

HEADING = """\
The test stand of Nguyen, Teidelt, Popov, Fatikow, Physical Mesomechanics (2014),
as ROS 2 parameters. SI units. In brackets: place in that paper, or "assumed".
Written by: stickslip parameters > config/test_stand.yaml
"""


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'parameters',
        description='Print a ROS parameter file with every parameter, its unit and its source.',
    )
    add_parameters(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print the parameters."""
    parameters = chosen_parameters(arguments)
    if arguments.json:
        print_json(parameters.flat())
    else:
        print(dump_yaml(parameters, HEADING), end='')
    return 0
