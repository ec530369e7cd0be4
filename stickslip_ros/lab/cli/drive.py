# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip drive``: the node."""

import argparse
import sys

from stickslip_ros.lab.cli.chosen import chosen_parameters
from stickslip_ros.lab.cli.printing import Answer, print_json
from stickslip_ros.parameters import format_value, parse_assignments, spec_of
from stickslip_ros.ros.node import main


def drive_verb(arguments: argparse.Namespace) -> Answer:
    """Run the node; with ``--json`` its parameters are printed first."""
    parameters = chosen_parameters(arguments)
    if arguments.json:
        print_json(parameters.flat())
        sys.stdout.flush()  # now: the node runs until it is ended
    return Answer(None, status=main(ros_arguments(arguments)))


def ros_arguments(arguments: argparse.Namespace) -> list[str]:
    """Return the command line as ROS wants it: parameter file, then single parameters."""
    words = ['stickslip', *arguments.ros_arguments, '--ros-args']
    for path in arguments.params:
        words += ['--params-file', str(path)]
    for name, value in parse_assignments(arguments.assignments).items():
        words += ['-p', f'{name}:={format_value(spec_of(name).check(name, value))}']
    return words
