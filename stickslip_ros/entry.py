"""The executables: each heeds Ctrl-C, and answers --help, before it imports what takes long."""

import gc
import os
import sys
from importlib import import_module
from itertools import takewhile

from stickslip_ros.process.signals import run

# ruff: noqa: PLC0415 - that is what this module is for

SELDOM = 20_000
"""New objects after which a verb looks for garbage: a start makes 200 000 that stay."""


def drive() -> int:
    """Run the node; return its exit status."""
    return run('drive', lambda: _run_node('drive', 'node'), is_node=True)


def position_controller() -> int:
    """Run the controller; return its exit status."""
    name = 'position_controller'
    return run(name, lambda: _run_node(name, name), is_node=True)


def _run_node(name: str, module: str) -> int:
    if {'-h', '--help'} & set(takewhile(lambda word: word != '--ros-args', sys.argv)):
        from stickslip_ros.ros.help import help_of

        sys.stdout.write(help_of(name))
        return 0
    gc.disable()  # until the node is made, see ``run_node``: a seventh of its start
    return int(import_module(f'stickslip_ros.ros.{module}').main())


def stickslip() -> int:
    """Run a verb, or complete what is typed of one; return its exit status."""
    if '_ARGCOMPLETE' in os.environ:
        from stickslip_ros.cli.main import complete

        complete()
    return run('stickslip', _run_verb, is_node=sys.argv[1:2] == ['drive'])


def _run_verb() -> int:
    gc.set_threshold(SELDOM)
    from stickslip_ros.cli.main import main

    return main()
