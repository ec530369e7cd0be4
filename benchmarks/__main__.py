"""
``python -m benchmarks [NAME ...]``: all benchmarks, or some; all of them write the results.

The long ones run only when they are named, and are written into the results by themselves. With
``--against COMMIT`` this tree is compared with a commit, beside the benchmarks that are named.

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
    in_c,
    learning,
    lugre,
    octave,
    paper,
    report,
    scaling,
    speed,
    start,
)
from benchmarks.node import busy, cpu, drift, latency, lockstep, panel, recording, soak
from benchmarks.outcome import Outcome
from benchmarks.sizes import FULL, TINY, Sizes

BENCHMARKS: dict[str, Callable[[Sizes], Outcome]] = {
    'speed': speed.run,
    'paper': paper.run_equivalent,
    'paper-line': paper.run_line,
    'octave': octave.run,
    'c': in_c.run,
    'lugre': lugre.run,
    'cycles': scaling.run_cycles,
    'reversals': scaling.run_reversals,
    'springs': scaling.run_springs,
    'threads': scaling.run_threads,
    'sweeps': scaling.run_sweeps,
    'optimise': design.run,
    'gym': learning.run,
    'start': start.run,
    'node-cpu': cpu.run_cpu,
    'node-lateness': cpu.run_lateness,
    'node-busy': busy.run,
    'node-latency': latency.run,
    'node-lockstep': lockstep.run,
    'node-drift': drift.run_short,
    'node-recording': recording.run,
    'node-panel': panel.run,
}
LONG: dict[str, Callable[[Sizes], Outcome]] = {
    'drift': drift.run_long,
    'soak': soak.run,
    'soak-recording': soak.run_recording,
    'soak-fifo': soak.run_fifo,
}
WIDTH = 160


def main(arguments: Sequence[str] | None = None) -> None:
    """Run benchmarks and print; with all of them, write results.json and the README's table."""
    known = BENCHMARKS | LONG
    parser = argparse.ArgumentParser(prog='python -m benchmarks', description=main.__doc__)
    parser.add_argument('names', nargs='*', metavar='NAME', help=', '.join(known))
    parser.add_argument('--tiny', action='store_true', help='only see whether they run')
    parser.add_argument('--out', type=Path, help='write the results to this file instead')
    parser.add_argument('--against', metavar='COMMIT', help='compare this tree with a commit')
    parser.add_argument('--kept', action='store_true', help='print the kept results')
    chosen = parser.parse_args(arguments)
    console = Console()
    if not console.is_terminal:
        console = Console(width=WIDTH)
    if chosen.kept:
        report.show_kept(console)
        return
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
    elif not chosen.tiny:
        report.keep(results, is_whole=not names)


def run(
    names: Sequence[str],
    sizes: Sizes,
    known: Mapping[str, Callable[[Sizes], Outcome]],
    console: Console,
) -> dict[str, Any]:
    """Run some benchmarks, print their tables and return the results."""
    results = report.no_results()
    for name in names:
        start_s = time.perf_counter()
        outcome = known[name](sizes)
        seconds = time.perf_counter() - start_s
        report.show(outcome, console)
        console.print(f'  {name} took {seconds:.1f} s', style='dim', highlight=False)
        entry = report.entry_of(outcome, seconds)
        if name in LONG:
            results['long'][name] = entry | report.circumstances()
        else:
            results['benchmarks'][name] = entry
    return results | report.circumstances()


if __name__ == '__main__':
    main()
