# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Every kernel that a stand may need, compiled before it runs; and how far that is."""

from collections.abc import Callable

from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.kernels.cache import cache_problem
from stickslip_ros.parameters import SENSORS, Parameters

KERNELS = 177 + 3 * len(SENSORS)
"""What ``compile_kernels`` compiles where nothing is compiled yet; of a sensor its loop, low-pass
and display, at least."""
RUNS_KERNELS = 25  # what runs take besides that no drive in real time needs
REPORT_EVERY = 20
"""Kernels after which the progress of the compilation is logged again."""


def compile_kernels() -> None:
    """
    Compile what is not compiled yet, or load it from the disk.

    A stand is led through all that has kernels of its own, on a bench that is thrown away: a run,
    another preload, a dead foot. Nothing is compiled later, while time must not stand still. The
    kernels are the same for every stand.

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
    Return a listener for ``compilation_reported`` that puts the progress into lines.

    Parameters
    ----------
    say : callable
        Receives a line at the first kernel, and after every ``REPORT_EVERY``.
    kernels : int
        How many there are to compile, at most.

    """

    def report(done: int) -> None:
        if done == 0 and (why := cache_problem()):
            say(why)
        if done % REPORT_EVERY == 0:
            say(f'compiling kernels, once: {done} of {max(kernels, done)}')

    return report
