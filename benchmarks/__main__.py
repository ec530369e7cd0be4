# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``python -m benchmarks [NAME ...]``: all benchmarks, or some; all of them write the results."""

import argparse
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from benchmarks import accuracy, fit, memory, paper, report, speed, start, sweeps, twin
from benchmarks.node import axes, commands, cpu, lockstep, recording
from benchmarks.outcome import Outcome
from benchmarks.sizes import FULL, TINY, Sizes

BENCHMARKS: dict[str, Callable[[Sizes], Outcome]] = {
    'speed': speed.run,
    'paper': paper.run_equivalent,
    'paper-line': paper.run_line,
    'sweeps': sweeps.run,
    'fit': fit.run,
    'twin': twin.run,
    'start': start.run,
    'memory': memory.run,
    'node-cpu': cpu.run_cpu,
    'node-lateness': cpu.run_lateness,
    'node-lockstep': lockstep.run,
    'node-recording': recording.run,
    'node-axes': axes.run,
    'node-commands': commands.run,
    'accuracy': accuracy.run,
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Run benchmarks and print; with all of them, write results.json and the README's table."""
    parser = argparse.ArgumentParser(prog='python -m benchmarks', description=main.__doc__)
    parser.add_argument('names', nargs='*', metavar='NAME', help=', '.join(BENCHMARKS))
    parser.add_argument('--tiny', action='store_true', help='only see whether they run')
    parser.add_argument('--out', type=Path, help='write the results to this file instead')
    chosen = parser.parse_args(arguments)
    for name in chosen.names:
        if name not in BENCHMARKS:
            parser.error(f'no benchmark {name}; there are {", ".join(BENCHMARKS)}')
    results = run(chosen.names or list(BENCHMARKS), TINY if chosen.tiny else FULL)
    if chosen.out is not None:
        report.write_results(results, chosen.out)
    elif not (chosen.names or chosen.tiny):
        report.write_results(results, report.RESULTS)
        report.write_readme(results)


def run(names: Sequence[str], sizes: Sizes) -> dict[str, Any]:
    """Run some benchmarks, print their tables and return the results."""
    entries = {}
    for name in names:
        start_s = time.perf_counter()
        outcome = BENCHMARKS[name](sizes)
        seconds = time.perf_counter() - start_s
        report.show(outcome)
        print(f'{name} took {seconds:.1f} s', flush=True)
        entries[name] = report.entry_of(outcome, seconds)
    return report.circumstances() | {'benchmarks': entries}


if __name__ == '__main__':
    main()
