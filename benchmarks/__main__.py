"""``python -m benchmarks [NAME ...]``: all benchmarks, or some; all of them write the results."""

import argparse
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from rich.console import Console

from benchmarks import lugre, octave, paper, report, scaling, speed, start
from benchmarks.outcome import Outcome
from benchmarks.sizes import FULL, TINY, Sizes

BENCHMARKS: dict[str, Callable[[Sizes], Outcome]] = {
    'speed': speed.run,
    'paper': paper.run_equivalent,
    'paper-line': paper.run_line,
    'octave': octave.run,
    'lugre': lugre.run,
    'cycles': scaling.run_cycles,
    'reversals': scaling.run_reversals,
    'springs': scaling.run_springs,
    'threads': scaling.run_threads,
    'start': start.run,
}
WIDTH = 140


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
    elif not chosen.names and not chosen.tiny:
        report.write_results(results, report.RESULTS)
        report.write_readme(results)


def run(names: Sequence[str], sizes: Sizes) -> dict[str, object]:
    """Run some benchmarks, print their tables and return the results."""
    console = Console()
    if not console.is_terminal:
        console = Console(width=WIDTH)
    outcomes: dict[str, Outcome] = {}
    seconds: dict[str, float] = {}
    for name in names:
        start_s = time.perf_counter()
        outcomes[name] = BENCHMARKS[name](sizes)
        seconds[name] = time.perf_counter() - start_s
        report.show(outcomes[name], console)
        console.print(f'  {name} took {seconds[name]:.1f} s', style='dim', highlight=False)
    return report.results_of(outcomes, seconds)


if __name__ == '__main__':
    main()
