# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""How long the first things take as whole processes, with and without compiled kernels."""

import os
import resource
import shutil
import subprocess
import sys
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.clock import Program, in_turn
from benchmarks.outcome import Outcome, Row
from benchmarks.sizes import Sizes

ROOT = Path(__file__).resolve().parent.parent
ALONE = "import sys; sys.modules['coverage'] = None\n"
"""Where coverage is installed, numba imports it."""
IMPORTS = f'{ALONE}import numpy, numba'
ROS_IMPORTS = f'{ALONE}import rclpy, numba'
SIMULATE = f"""{ALONE}
sys.argv = 'stickslip simulate --preload=0.7 --amplitude=130e-9 --steps=200 --json'.split()
from stickslip_ros.lab.cli.start import stickslip
sys.exit(stickslip())
"""
NODE = f"""{ALONE}
import os
sys.argv = ['drive', '--ros-args', '--log-level', 'error']
from stickslip_ros.ros.start import drive
from stickslip_ros.ros import executable
executable.spin_until_stopped = lambda node: node.session and os._exit(0)
drive()
os._exit(1)
"""
"""Until the drive is active."""
COLD_ROUNDS = 2


def run_python(code: str, cache: Path | None) -> float:
    """Run a program, with a kernel cache of its own if one is named; return processor seconds."""
    environment = os.environ if cache is None else os.environ | {'NUMBA_CACHE_DIR': str(cache)}
    before_s = _processor_s_of_children()
    command = [sys.executable, '-c', code]
    subprocess.run(command, cwd=ROOT, env=environment, check=True, stdout=subprocess.DEVNULL)
    return _processor_s_of_children() - before_s


def run(sizes: Sizes) -> Outcome:
    """Time whole processes."""
    processor_s: dict[str, list[float]] = {}
    # A node that has just ended may still be writing its log
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        kept, emptied = Path(folder, 'kept'), Path(folder, 'emptied')
        programs = {
            'stickslip simulate, kernels cached': (SIMULATE, kept),
            'import numpy and numba': (IMPORTS, kept),
            'import rclpy and numba': (ROS_IMPORTS, kept),
            'node until active, kernels cached': (NODE, kept),
        }
        if sizes.cold:
            programs['stickslip simulate, empty cache'] = SIMULATE, emptied
            programs['node until active, empty cache'] = NODE, emptied

        def process(name: str) -> None:
            code, cache = programs[name]
            shutil.rmtree(emptied, ignore_errors=True)
            used_s = run_python(code, cache if sizes.cold else None)
            processor_s.setdefault(name, []).append(used_s)

        few = replace(sizes, rounds=min(sizes.rounds, COLD_ROUNDS), least_s=0.0)
        times = in_turn([Program(partial(process, name), 1.0) for name in programs], few)
    rows: list[Row] = [
        {
            'process': name,
            'processor_seconds': float(np.median(processor_s[name][1:])),
            'seconds': times.median(i),
            **times.ratio(i),
        }
        for i, name in enumerate(programs)
    ]
    return Outcome(
        'Whole processes: the standard case from the command line, and the node',
        rows,
        notes=['ratio of the seconds to the first row; the empty cache is a fresh folder'],
    )


def _processor_s_of_children() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
