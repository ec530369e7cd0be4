"""The executables: each heeds Ctrl-C, and says what it can, before it imports what takes long."""

import sys

from stickslip_ros.ros.ending import leave_on_signals

# ruff: noqa: PLC0415 - that is what this module is for


def drive() -> int:
    """Run the node; return its exit status."""
    leave_on_signals('drive', is_well=True)
    from stickslip_ros.ros.command_line import DRIVE, answer

    status = answer(DRIVE, sys.argv[1:])
    if status is not None:
        return status
    from stickslip_ros.ros.node import main

    return main()


def position_controller() -> int:
    """Run the controller; return its exit status."""
    leave_on_signals('position_controller', is_well=True)
    from stickslip_ros.ros.command_line import CONTROLLER, answer

    status = answer(CONTROLLER, sys.argv[1:])
    if status is not None:
        return status
    from stickslip_ros.ros.position_controller import main

    return main()


def stickslip() -> int:
    """Run a verb; return its exit status."""
    runs_node = sys.argv[1:2] == ['drive']
    leave_on_signals('stickslip', is_well=runs_node)
    from stickslip_ros.cli.program import REFUSED, has_streams, run_verb

    if not has_streams():
        return REFUSED
    if runs_node:
        from stickslip_ros.ros.command_line import DRIVE, answer, of_verb

        status = answer(DRIVE._replace(name='stickslip'), of_verb(sys.argv[2:]))
        if status is not None:
            return status
    from stickslip_ros.cli.main import VERBS, main, module_of

    for verb in VERBS.keys() & set(sys.argv[1:2]):
        module_of(verb)
    return main() if runs_node else run_verb(main)
