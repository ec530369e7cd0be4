"""How long the first things take as whole processes, with and without compiled kernels."""

import os
import resource
import shutil
import subprocess
import sys
import tempfile
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
from stickslip_ros.entry import stickslip
sys.exit(stickslip())
"""
NODE = f"""{ALONE}
import os
sys.argv = ['drive', '--ros-args', '--log-level', 'error']
from stickslip_ros.entry import drive
from stickslip_ros.ros import executable
executable.spin_until_stopped = lambda node, _: node.session and os._exit(0)
drive()
os._exit(1)
"""
"""Until the drive is active."""
COLD_ROUNDS = 2
NOTE = 'ratio of the seconds to the first row; the empty cache is a fresh NUMBA_CACHE_DIR'


class ProgramError(Exception):
    """A program has failed; the message is the last line that it said."""


class Process:
    """
    A Python program that is run again and again.

    Parameters
    ----------
    code : str
        The program.
    cache : Path or None
        Its kernel cache; that of the package if None.
    is_cold : bool
        Whether the cache is emptied before every run.

    Attributes
    ----------
    processor_s : list of float
        Processor seconds of every run.

    """

    def __init__(self, code: str, cache: Path | None, *, is_cold: bool = False) -> None:
        self._code = code
        self._cache = cache
        self._is_cold = is_cold
        self.processor_s: list[float] = []

    def __call__(self) -> None:
        """Run the program and wait for its end."""
        if self._is_cold and self._cache is not None:
            shutil.rmtree(self._cache, ignore_errors=True)
        self.processor_s.append(run_python(self._code, ROOT, self._cache)[0])


def run_python(code: str, tree: Path, cache: Path | None) -> tuple[float, str]:
    """
    Run a program with the modules of a tree; return its processor seconds and what it printed.

    Parameters
    ----------
    code : str
        The program.
    tree : Path
        Where ``stickslip_ros`` and ``benchmarks`` are taken from.
    cache : Path or None
        The kernel cache; that of the tree if None.

    Raises
    ------
    ProgramError
        If it fails.

    """
    environment = os.environ | {'PYTHONPATH': str(tree)}
    if cache is not None:
        environment['NUMBA_CACHE_DIR'] = str(cache)
    command = [sys.executable, '-c', code]
    before_s = _processor_s_of_children()
    done = subprocess.run(
        command, cwd=tree, env=environment, check=False, capture_output=True, text=True
    )
    if done.returncode:
        said = done.stderr.strip().splitlines() or ['']
        raise ProgramError(f'status {done.returncode}: {said[-1]}')
    return _processor_s_of_children() - before_s, done.stdout


def run(sizes: Sizes) -> Outcome:
    """Time whole processes."""
    # A node that has just ended may still be writing its log
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        kept = Path(folder, 'kept') if sizes.cold else None
        emptied = Path(folder, 'emptied')
        processes = {
            'stickslip simulate, kernels cached': Process(SIMULATE, kept),
            'import numpy and numba': Process(IMPORTS, kept),
            'import rclpy and numba': Process(ROS_IMPORTS, kept),
            'node until active, kernels cached': Process(NODE, kept),
        }
        if sizes.cold:
            processes |= {
                'stickslip simulate, empty cache': Process(SIMULATE, emptied, is_cold=True),
                'node until active, empty cache': Process(NODE, emptied, is_cold=True),
            }
        programs = [Program(process, 1.0) for process in processes.values()]
        times = in_turn(programs, Sizes(rounds=min(sizes.rounds, COLD_ROUNDS), least_s=0.0))
    rows: list[Row] = [
        {
            'process': name,
            'processor_seconds': float(np.median(process.processor_s[1:])),
            'seconds': times.median(i),
            **times.ratio(i),
        }
        for i, (name, process) in enumerate(processes.items())
    ]
    return Outcome(
        'Whole processes: the standard case from the command line, and the node',
        rows,
        [],
        [NOTE],
    )


def _processor_s_of_children() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
