# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Time programs in turn: A B A B ..., so that a slow moment of the machine hits all of them."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from benchmarks.outcome import Row, spread
from benchmarks.sizes import Sizes
from stickslip_ros.arrays import Array


class Program(NamedTuple):
    """Something to time: what does the work once, and how much that is, as simulated seconds."""

    run: Callable[[], object]
    work: float


@dataclass(frozen=True)
class Times:
    """Seconds per unit of work, by the clock and of the processor, shape (programs, rounds)."""

    seconds: Array
    cpu_seconds: Array

    def median(self, program: int) -> float:
        """Return the median time of a program per unit of work, s."""
        return float(np.median(self.seconds[program]))

    def ratio(self, program: int) -> Row:
        """Return how many times longer a program took than the first, as entries of a row."""
        return spread('ratio', self.seconds[program] / self.seconds[0], 'ratio_low', 'ratio_high')


def in_turn(programs: Sequence[Program], sizes: Sizes) -> Times:
    """Run programs in turn, after a first run, which compiles; quick ones are repeated."""
    for program in programs:
        program.run()
    calls = [_calls(program, sizes.least_s) for program in programs]
    seconds = np.empty((2, len(programs), sizes.rounds))
    for i in range(sizes.rounds):
        for j, program in enumerate(programs):
            cpu_s = time.process_time()
            seconds[0, j, i] = _time(program, calls[j]) / (calls[j] * program.work)
            seconds[1, j, i] = (time.process_time() - cpu_s) / (calls[j] * program.work)
    return Times(seconds[0], seconds[1])


def _calls(program: Program, least_s: float) -> int:
    return math.ceil(least_s / _time(program, 1)) if least_s > 0.0 else 1


def _time(program: Program, calls: int) -> float:
    start_s = time.perf_counter()
    for _ in range(calls):
        program.run()
    return time.perf_counter() - start_s
