"""The executables: each handles Ctrl-C, help and refusals before it imports what takes long."""

import os
import sys
from importlib import import_module

from stickslip_ros.ros.ending import leave_on_signals

# ruff: noqa: PLC0415 - that is what this module is for


def drive() -> int:
    """Run the node; return its exit status."""
    return _run_node('drive', 'stickslip_ros.ros.node')


def position_controller() -> int:
    """Run the controller; return its exit status."""
    return _run_node('position_controller', 'stickslip_ros.ros.position_controller')


def _run_node(name: str, module: str) -> int:
    leave_on_signals(name, is_well=True)
    from stickslip_ros.ros.command_line import PROGRAMS, help_or_refuse

    status = help_or_refuse(PROGRAMS[name], sys.argv[1:])
    return int(import_module(module).main()) if status is None else status


def stickslip() -> int:
    """Run a verb, or complete what is typed of one; return its exit status."""
    if '_ARGCOMPLETE' in os.environ:
        from stickslip_ros.cli.completion import complete

        complete()
    runs_node = sys.argv[1:2] == ['drive']
    leave_on_signals('stickslip', is_well=runs_node)
    from stickslip_ros.cli.program import REFUSED, has_streams, run_verb

    if not has_streams():
        return REFUSED
    if runs_node:
        from stickslip_ros.ros.command_line import DRIVE, help_or_refuse, of_verb

        status = help_or_refuse(DRIVE._replace(name='stickslip'), of_verb(sys.argv[2:]))
        if status is not None:
            return status
    from stickslip_ros.cli.main import main

    return main() if runs_node else main(launch=run_verb)
