"""How long ``stickslip simulate`` takes as a whole process, with and without compiled kernels."""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.clock import Program, in_turn
from benchmarks.outcome import Outcome, Row
from benchmarks.sizes import Sizes

ROOT = Path(__file__).resolve().parent.parent
CODE = 'import sys; from stickslip_ros.cli.main import main; sys.exit(main(sys.argv[1:]))'
WORDS = ['simulate', '--preload=0.7', '--amplitude=130e-9', '--steps=200', '--json']
COLD_ROUNDS = 3


def simulate(cache: Path | None = None) -> str:
    """Run ``stickslip simulate`` in a process with a kernel cache; return what it prints."""
    return _process(['-c', CODE, *WORDS], cache)


def run(sizes: Sizes) -> Outcome:
    """Time whole processes."""
    with tempfile.TemporaryDirectory() as folder:
        kept = Path(folder, 'kept') if sizes.cold else None
        emptied = Path(folder, 'emptied')

        def cold() -> str:
            shutil.rmtree(emptied, ignore_errors=True)
            return simulate(emptied)

        names = ['stickslip simulate, kernels cached', 'import numpy and numba']
        programs = [
            Program(lambda: simulate(kept), 1.0),
            Program(lambda: _process(['-c', 'import numpy, numba'], kept), 1.0),
        ]
        if sizes.cold:
            names.append('stickslip simulate, empty cache')
            programs.append(Program(cold, 1.0))
        times = in_turn(programs, Sizes(rounds=min(sizes.rounds, COLD_ROUNDS), least_s=0.0))
    rows: list[Row] = [
        {'process': name, 'seconds': times.median(i), **times.ratio(i)}
        for i, name in enumerate(names)
    ]
    return Outcome(
        'Whole processes: the standard case from the command line',
        rows,
        [],
        ['ratio to the run with cached kernels; the empty cache is a fresh NUMBA_CACHE_DIR'],
    )


def _process(arguments: list[str], cache: Path | None) -> str:
    environment = os.environ | ({'NUMBA_CACHE_DIR': str(cache)} if cache else {})
    command = [sys.executable, *arguments]
    done = subprocess.run(
        command, cwd=ROOT, env=environment, check=True, stdout=subprocess.PIPE, text=True
    )
    return done.stdout
