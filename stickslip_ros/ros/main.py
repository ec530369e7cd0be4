"""The executable ``drive``."""

import sys
from collections.abc import Sequence

from stickslip_ros.contact.kernel import leave_out_blas
from stickslip_ros.ros.executable import run_node
from stickslip_ros.ros.node import StickSlipDrive
from stickslip_ros.ros.timeliness import Keeper


def main(arguments: Sequence[str] | None = None) -> int:
    """
    Run the node until SIGINT or SIGTERM.

    Parameters
    ----------
    arguments : sequence of str, optional
        ROS arguments, such as ``--ros-args -p stand.preload:=0.25``; the command line if None.

    Returns
    -------
    int
        0 after a clean end, 2 if a parameter was refused.

    """
    leave_out_blas()
    return run_node('drive', make_drive, arguments)


def make_drive() -> StickSlipDrive:
    """Return the drive; what it consists of is kept from garbage collection."""
    node = StickSlipDrive()
    node.add_managed_entity(Keeper())
    return node


if __name__ == '__main__':
    sys.exit(main())
