"""Time programs in turn: A B A B ..., so that a slow moment of the machine hits all of them."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.sizes import Sizes

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Program:
    """
    Something to time.

    Attributes
    ----------
    run : callable
        Does the work once.
    work : float
        How much work that is: simulated seconds, moves, ...; times are given per unit of it.

    """

    run: Callable[[], object]
    work: float


@dataclass(frozen=True)
class Times:
    """
    Times of several programs that ran in turn.

    Attributes
    ----------
    seconds : array, shape (programs, rounds)
        Wall-clock seconds per unit of work.
    cpu_seconds : array, shape (programs, rounds)
        Processor seconds of this process, all threads together, per unit of work.

    """

    seconds: Array
    cpu_seconds: Array

    def median(self, program: int) -> float:
        """Return the median time of a program per unit of work, s."""
        return float(np.median(self.seconds[program]))

    def cores(self, program: int) -> float:
        """Return how many cores a program was given; fewer than it has threads if others ran."""
        return float(np.median(self.cpu_seconds[program] / self.seconds[program]))

    def ratios(self, program: int, other: int = 0) -> Array:
        """Return how many times longer a program took than another, in each round."""
        return np.asarray(self.seconds[program] / self.seconds[other])

    def ratio(self, program: int, other: int = 0) -> dict[str, float]:
        """Return median, least and largest of ``ratios`` as entries of a row."""
        ratios = self.ratios(program, other)
        return {
            'ratio': float(np.median(ratios)),
            'ratio_low': float(np.min(ratios)),
            'ratio_high': float(np.max(ratios)),
        }


def in_turn(programs: Sequence[Program], sizes: Sizes) -> Times:
    """
    Run programs in turn.

    Each is run once beforehand, which compiles it, and a second time, if ``sizes.least_s`` is not
    0, to find out how often it must be repeated to take that long.

    """
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
