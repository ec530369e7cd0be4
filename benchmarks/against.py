# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The present tree against a commit, in turn: first start, simulate, drive, sensors, node."""

import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.outcome import Outcome, Row
from benchmarks.sizes import Sizes
from benchmarks.start import NODE, ROOT, SIMULATE, ProgramError, run_python
from stickslip_ros.arrays import Array

COMPILE = """
import sys
from stickslip_ros.lab.cli.main import main
sys.exit(main(['compile', '--json']))
"""
DRIVE = """
from benchmarks.case import Ours, standard_case
WORK = 200
run = Ours(standard_case(), WORK)
"""
BENCH = """
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.parameters import Parameters
from stickslip_ros.lab.runs.sawtooth_run import voltage_for
WORK = 200
parameters = Parameters().updated({'stand.preload': 0.7})
bench = Bench(parameters)
requests = [Request('sawtooth', (voltage_for(parameters, 130e-9), 1000.0, 0.0))]
def run():
    for _ in range(WORK):
        bench.update(bench.time_ns + 1_000_000, requests)
        requests.clear()
"""
TIMED = """
import math, time
run()
def seconds(calls):
    start_s = time.process_time()
    for _ in range(calls):
        run()
    return (time.process_time() - start_s) / (calls * WORK)
calls = math.ceil({least_s} / (seconds(1) * WORK))
print(sorted(seconds(calls) for _ in range(5))[2])
"""
"""Prints the median processor time per unit of work, s; ``run`` has compiled before."""
COLD_ROUNDS, WARM_ROUNDS = 2, 5


class Measure(NamedTuple):
    """A Python program that both trees run."""

    name: str
    code: str
    empties: bool = False  # whether its kernel cache is empty; else the tree has filled it before
    prints: bool = False  # whether it prints the seconds that count; else all of its time does


def measures(sizes: Sizes) -> list[Measure]:
    """Return what is compared; without compiling unless ``sizes.cold``."""
    timed = TIMED.format(least_s=max(sizes.least_s, 1e-3))
    cold = [
        Measure('compile all kernels', COMPILE, empties=True),
        Measure('simulate, empty cache', SIMULATE, empties=True),
        Measure('node until active, empty cache', NODE, empties=True),
    ]
    return cold * sizes.cold + [
        Measure('simulate', SIMULATE),
        Measure('node until active', NODE),
        Measure('drive, default step, a cycle', DRIVE + timed, prints=True),
        Measure('Bench.update with sensors, a block of 1 ms', BENCH + timed, prints=True),
    ]


def run(commit: str, sizes: Sizes, root: Path = ROOT) -> Outcome:
    """Compare this tree, as it is, with a commit that ``commit_of`` gave."""
    rows: list[Row] = []
    notes = [
        'processor seconds, medians; ratio: of this tree to the commit, of each round',
        f'the commit: {commit} {git(root, "show", "--no-patch", "--format=%s", commit)}',
        'same environment; drive: benchmarks.case.Ours of either tree; cycles of 1 ms',
    ]
    with tempfile.TemporaryDirectory() as folder, tree_of(root, commit, Path(folder)) as other:
        for measure in measures(sizes):
            trees = {'this tree': root, 'the commit': other}
            try:
                seconds = _in_turn(measure, trees, Path(folder), sizes.rounds)
            except ProgramError as error:
                notes.append(f'{measure.name}: left out: {error}')
                continue
            ratios = seconds[:, 0] / seconds[:, 1]
            rows.append(
                {
                    'what': measure.name,
                    'this_tree_s': float(np.median(seconds[:, 0])),
                    'the_commit_s': float(np.median(seconds[:, 1])),
                    'ratio': float(np.median(ratios)),
                    'lowest': float(ratios.min()),
                    'highest': float(ratios.max()),
                }
            )
    return Outcome(f'This tree against {commit}', rows, [], notes)


def commit_of(text: str, root: Path = ROOT) -> str:
    """Return the short name of a commit; CalledProcessError if git does not know it."""
    return git(root, 'rev-parse', '--short=12', '--verify', f'{text}^{{commit}}')


def git(root: Path, *words: str) -> str:
    """Return what git says about a tree."""
    done = subprocess.run(['git', *words], cwd=root, check=True, capture_output=True, text=True)
    return done.stdout.strip()


@contextmanager
def tree_of(root: Path, commit: str, folder: Path) -> Iterator[Path]:
    """Give the files of a commit, in a worktree that git forgets afterwards."""
    tree = folder / 'tree'
    git(root, 'worktree', 'add', '--detach', '--force', str(tree), commit)
    try:
        yield tree
    finally:
        git(root, 'worktree', 'remove', '--force', str(tree))


def _in_turn(measure: Measure, trees: dict[str, Path], folder: Path, rounds: int) -> Array:
    """Return processor seconds, shape (rounds, trees), of A B A B ..."""
    rounds = min(rounds, COLD_ROUNDS if measure.empties else WARM_ROUNDS)
    seconds = np.empty((rounds, len(trees)))
    for i in range(rounds if measure.empties else rounds + 1):
        for j, (name, tree) in enumerate(trees.items()):
            cache = folder / f'cache-{j}'
            if measure.empties:
                shutil.rmtree(cache, ignore_errors=True)
            try:
                processor_s, printed = run_python(measure.code, tree, cache)
                # The first warm round fills the cache; the next one overwrites it.
                seconds[i % rounds, j] = float(printed) if measure.prints else processor_s
            except ProgramError as error:
                raise ProgramError(f'{name}: {error}') from None
    return seconds
