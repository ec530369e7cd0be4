"""Drift of simulated time against the wall clock, against loops with and without deadlines."""

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import lru_cache, partial

import numpy as np

from benchmarks.node.lateness import summary
from benchmarks.node.programs import BareLoop, Drive, Program, opened
from benchmarks.outcome import Outcome, Row, Verdict
from benchmarks.sizes import Sizes
from stickslip_ros.units import MICRO

DRIVE = 'the node'
BLOCK_US = 1000.0
RIVALS = {
    'bare loop, absolute deadlines': 'absolute',
    'bare loop, sleeps a period per tick': 'relative',
    'bare loop, rclpy timer': 'timer',
}
"""They publish the position only, so that all can run at the same time."""
SETTLES = 4
"""Settling times to wait: more programs begin at once than in a turn."""
END_SHARE, END_MAX = 0.1, 100
"""Share of the run, and most tenths of a second, at either end: there the least delay counts."""


def run_short(sizes: Sizes) -> Outcome:
    """Measure over seconds."""
    return _run(sizes, sizes.drift_s)


def run_long(sizes: Sizes) -> Outcome:
    """Measure over minutes."""
    return _run(sizes, sizes.long_drift_s)


def drift_of(delays_s: Sequence[float]) -> tuple[float, float]:
    """
    Return the drift (s) of a clock from the least delay of every tenth of a second, with spread.

    A message can only be late, so the least delay of all is nearest to the offset of the clocks.
    The spread is the standard deviation of the least delays at both ends.

    """
    delays = np.array(delays_s)
    count = max(1, min(END_MAX, int(END_SHARE * len(delays))))
    first, last = delays[:count], delays[-count:]
    deviations = np.concatenate((first - np.median(first), last - np.median(last)))
    return float(np.min(last) - np.min(first)), float(np.std(deviations))


@lru_cache
def _run(sizes: Sizes, seconds: float) -> Outcome:
    """Run all at once; the tiny long run is the short one."""
    makers: list[Callable[[], Program]] = [lambda: Drive(DRIVE)]
    makers += [
        partial(BareLoop, name, '--pace', pace, '--topics', 'position')
        for name, pace in RIVALS.items()
    ]
    with ExitStack() as stack:
        programs = opened(stack, makers)
        for program in programs:
            program.start()
        time.sleep(SETTLES * sizes.settle_s)
        for program in programs:
            program.reset()
        time.sleep(seconds)
        rows = [_row(program, seconds) for program in programs]
    return Outcome(
        f'Drift of simulated time against the wall clock over {seconds:g} s at 1 kHz',
        rows,
        [
            Verdict(
                'drift of the node, us: under one block',
                BLOCK_US,
                abs(float(rows[0]['drift_us'])),
                at_most=True,
            )
        ],
        [
            (
                'all at the same time; positive: simulated time falls behind; from the least '
                'delay between stamp and arrival at both ends; a drift below the spread of these '
                'delays is not known; bare loops publish the position only'
            ),
        ],
    )


def _row(program: Program, seconds: float) -> Row:
    heard = program.listener.ask('report')
    if not heard['delays_s']:
        raise program.process.fail(f'no position of {program.name} was heard in {seconds:g} s')
    lateness = summary(program.windows())
    program.stop()
    drift_s, spread_s = drift_of(heard['delays_s'])
    return {
        'program': program.name,
        'drift_us': drift_s / MICRO,
        'spread_us': spread_s / MICRO,
        'drift_ppm': drift_s / MICRO / seconds,
        'positions': heard['counts']['position'],
        'missing': heard['missing'],
        'max_lateness_us': lateness['max_us'],
    }
