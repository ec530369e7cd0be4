"""The executables: each heeds Ctrl-C before it imports what takes a second or more."""

import sys

from stickslip_ros.ros.ending import heed_signals_as_usual, leave_on_signals

# ruff: noqa: PLC0415 - that is what this module is for


def drive() -> int:
    """Run the node; return its exit status."""
    leave_on_signals('drive', is_well=True)
    from stickslip_ros.ros.main import main

    return main()


def position_controller() -> int:
    """Run the controller; return its exit status."""
    leave_on_signals('position_controller', is_well=True)
    from stickslip_ros.ros.position_controller import main

    return main()


def stickslip() -> int:
    """Run a verb; return its exit status."""
    runs_node = sys.argv[1:2] == ['drive']
    leave_on_signals('stickslip', is_well=runs_node)
    from stickslip_ros.cli.main import main

    if not runs_node:
        heed_signals_as_usual()
    return main()
