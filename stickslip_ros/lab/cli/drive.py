# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip drive`` and ``twin``: nodes."""

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
        sys.stdout.flush()  # now, as the node runs until its end
    return Answer(None, status=main(ros_arguments(arguments)))


def twin_verb(arguments: argparse.Namespace) -> Answer:
    """Run the node of a twin."""
    from stickslip_ros.lab.twin.node import main as run_twin  # noqa: PLC0415 - a slow import

    chosen_parameters(arguments)  # refuses impossible values
    words = ros_arguments(arguments)
    if arguments.headers:
        words += ['-p', f"twin.map:='{', '.join(map('='.join, arguments.headers.items()))}'"]
    return Answer(None, status=run_twin(words))


def ros_arguments(arguments: argparse.Namespace) -> list[str]:
    """Return the command line for ROS: parameter files, then single parameters."""
    words = ['stickslip', *arguments.ros_arguments, '--ros-args']
    for path in arguments.params:
        words += ['--params-file', str(path)]
    for name, value in parse_assignments(arguments.assignments).items():
        words += ['-p', f'{name}:={format_value(spec_of(name).check(name, value))}']
    return words
