# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Compile all kernels of a stand before it runs, and report the progress."""

from collections.abc import Callable

from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.kernels.cache import cache_problem
from stickslip_ros.parameters import SENSORS, Parameters

KERNELS = 194 + 3 * len(SENSORS)
"""Kernels that ``compile_kernels`` compiles, with at least loop, low-pass and display of each
sensor."""
RUNS_KERNELS = 24  # further kernels of offline runs
REPORT_EVERY = 20
"""Kernels after which the progress of the compilation is logged again."""


def compile_kernels() -> None:
    """
    Compile all kernels, or load them from the disk, so that nothing is compiled in real time.

    A temporary bench executes everything with its own kernels: a run, another preload, a dead
    foot. The kernels are the same for every stand.

    """
    bench = Bench(Parameters().updated({row.switch: True for row in SENSORS if row.switch}))
    bench.update(bench.parameters.block_ns)
    for request in (
        Request('preload', (bench.parameters.stand.preload,)),
        Request('fault', settings=(('fault.dead_foot', 1),)),
    ):
        bench.accept(request)
    bench.update(2 * bench.parameters.block_ns)


def progress_reporter(
    say: Callable[[str], None], kernels: int = KERNELS + RUNS_KERNELS
) -> Callable[[int], None]:
    """
    Return a listener for ``compilation_reported`` that reports the progress in lines.

    Parameters
    ----------
    say : callable
        Receives a line at the first kernel, and after every ``REPORT_EVERY``.
    kernels : int
        Largest number of kernels to compile.

    """

    def report(done: int) -> None:
        if done == 0 and (why := cache_problem()):
            say(why)
        if done % REPORT_EVERY == 0:
            say(f'compiling kernels, once: {done} of {max(kernels, done)}')

    return report
