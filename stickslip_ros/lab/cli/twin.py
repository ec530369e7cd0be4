# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip twin``: a fitted stand beside a rig."""

import argparse

from stickslip_ros.lab.cli.chosen import chosen_parameters
from stickslip_ros.lab.cli.drive import ros_arguments
from stickslip_ros.lab.cli.printing import Answer
from stickslip_ros.lab.twin.node import main


def twin_verb(arguments: argparse.Namespace) -> Answer:
    """Run the node."""
    chosen_parameters(arguments)  # refuses what cannot be
    words = ros_arguments(arguments)
    if arguments.headers:
        words += ['-p', f"twin.map:='{', '.join(map('='.join, arguments.headers.items()))}'"]
    return Answer(None, status=main(words))
