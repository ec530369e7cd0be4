# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The executable of the twin; Ctrl-C works before rclpy is imported."""

import os
import sys

from stickslip_ros.errors import StickSlipError
from stickslip_ros.extras import needs_ros
from stickslip_ros.process.signals import REFUSED, run


def twin() -> int:
    """Run the node; return its exit status."""
    return run('twin', _twin, is_node=True)


def _twin() -> int:
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')  # its waiting threads spin
    try:
        with needs_ros('the twin'):
            from stickslip_ros.lab.twin.node import main  # noqa: PLC0415 - slow import
    except StickSlipError as error:
        sys.stderr.write(f'twin: {error}\n')
        return REFUSED
    return main()
