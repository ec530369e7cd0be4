# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Start ``stickslip``: handle Ctrl-C and completion before slow imports."""

import gc
import os
import sys

from stickslip_ros.process.signals import run

# ruff: noqa: PLC0415 - slow imports come last

_SELDOM = 20_000
"""New objects between two garbage collections: a start makes 200 000 that stay."""


def stickslip() -> int:
    """Run a verb, or complete its command line; return the exit status."""
    if '_ARGCOMPLETE' in os.environ:
        from stickslip_ros.lab.cli.main import complete

        complete()
    return run('stickslip', _run_verb, is_node=sys.argv[1:2] in (['drive'], ['twin']))


def _run_verb() -> int:
    gc.set_threshold(_SELDOM)
    # Waiting threads of OpenBLAS spin, and would take the cores from those of a fit.
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    from stickslip_ros.lab.cli.main import main

    return main()
