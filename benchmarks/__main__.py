# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
``python -m benchmarks [NAME ...]``: all benchmarks, or some; all of them write the results.

With ``--against COMMIT`` this tree is compared with a commit, beside what is named.

"""

import argparse
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console

from benchmarks import (
    against,
    design,
    fit,
    in_c,
    learning,
    lugre,
    paper,
    report,
    speed,
    start,
    sweeps,
    twin,
)
from benchmarks.node import cpu, latency, lockstep, recording
from benchmarks.outcome import Outcome
from benchmarks.sizes import FULL, TINY, Sizes

BENCHMARKS: dict[str, Callable[[Sizes], Outcome]] = {
    'speed': speed.run,
    'paper': paper.run_equivalent,
    'paper-line': paper.run_line,
    'c': in_c.run,
    'lugre': lugre.run,
    'sweeps': sweeps.run,
    'optimise': design.run,
    'fit': fit.run,
    'gym': learning.run,
    'twin': twin.run,
    'start': start.run,
    'node-cpu': cpu.run_cpu,
    'node-lateness': cpu.run_lateness,
    'node-latency': latency.run,
    'node-lockstep': lockstep.run,
    'node-recording': recording.run,
}
WIDTH = 160


def main(arguments: Sequence[str] | None = None) -> None:
    """Run benchmarks and print; with all of them, write results.json and the README's table."""
    known = BENCHMARKS
    parser = argparse.ArgumentParser(prog='python -m benchmarks', description=main.__doc__)
    parser.add_argument('names', nargs='*', metavar='NAME', help=', '.join(known))
    parser.add_argument('--tiny', action='store_true', help='only see whether they run')
    parser.add_argument('--out', type=Path, help='write the results to this file instead')
    parser.add_argument('--against', metavar='COMMIT', help='compare this tree with a commit')
    chosen = parser.parse_args(arguments)
    console = Console()
    if not console.is_terminal:
        console = Console(width=WIDTH)
    for name in chosen.names:
        if name not in known:
            parser.error(f'no benchmark {name}; there are {", ".join(known)}')
    names = chosen.names
    if chosen.against is not None:
        try:
            commit = against.commit_of(chosen.against)
        except subprocess.CalledProcessError:
            parser.error(f'no commit {chosen.against}')
        known = {**known, 'against': partial(against.run, commit)}
        names = [*names, 'against']
    sizes = TINY if chosen.tiny else FULL
    results = run(names or list(BENCHMARKS), sizes, known, console)
    if chosen.out is not None:
        report.write_results(results, chosen.out)
    elif not (names or chosen.tiny):
        report.write_results(results, report.RESULTS)
        report.write_readme(results)


def run(
    names: Sequence[str],
    sizes: Sizes,
    known: Mapping[str, Callable[[Sizes], Outcome]],
    console: Console,
) -> dict[str, Any]:
    """Run some benchmarks, print their tables and return the results."""
    entries = {}
    for name in names:
        start_s = time.perf_counter()
        outcome = known[name](sizes)
        seconds = time.perf_counter() - start_s
        report.show(outcome, console)
        console.print(f'  {name} took {seconds:.1f} s', style='dim', highlight=False)
        entries[name] = report.entry_of(outcome, seconds)
    return report.circumstances() | {'benchmarks': entries}


if __name__ == '__main__':
    main()
