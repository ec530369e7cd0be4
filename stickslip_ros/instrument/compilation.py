# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Compile the kernels of a stand before it runs, and report the progress."""

from collections.abc import Callable

from stickslip_ros.drive.advance import takes_only_long_steps
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import FAULT, LIVE, Request
from stickslip_ros.kernels.cache import NotKept, cache_folders, cache_problem, only_loads
from stickslip_ros.parameters import SENSORS, Parameters

KERNELS = 213 + 3 * len(SENSORS)
"""Kernels that ``compile_kernels`` compiles, with at least loop, low-pass and display of each
sensor."""
RUNS_KERNELS = 27  # further kernels of offline runs
REPORT_EVERY = 20
"""Kernels after which the progress of the compilation is logged again."""
_FRICTION = 'contact.friction'


def needs_all_kernels(request: Request | None) -> bool:
    """Return whether a request may end the long steps of an ideal drive."""
    if request is None:
        return False
    return request.name in ('preload', FAULT) or _FRICTION in dict(request.settings)


def compile_for(parameters: Parameters) -> bool:
    """
    Compile the kernels that a stand runs, or load them; return whether it can need no others.

    An ideal drive needs others only if it ``needs_all_kernels`` for a request. All kernels are
    compiled for a checkpoint, for scheduled faults, and if the disk cannot keep what another
    process compiles.

    """
    if parameters.sim.checkpoint or parameters.fault.schedule or cache_folders().write is None:
        compile_kernels()
        return True
    bench = Bench(parameters.updated({'fault.command_delay': 0.0}))
    bench.update(bench.parameters.sample_ns)
    if takes_only_long_steps(bench.stand.plants, bench.stand.states):
        return False
    _take_other_steps(bench)
    return True


def compile_kernels() -> None:
    """
    Compile all kernels, or load them from the disk, so that nothing is compiled in real time.

    A temporary bench executes everything with its own kernels: a run, one with the code of losses
    and rival laws, another preload or friction, a dead foot. The kernels are the same for every
    stand.

    """
    bench = Bench(Parameters().updated({row.switch: True for row in SENSORS if row.switch}))
    for plain in (True, False):
        bench.stand.plants['plain'] = plain
        bench.update(bench.time_ns + bench.parameters.sample_ns)
    _take_other_steps(bench)


def _take_other_steps(bench: Bench) -> None:
    """Advance with another preload and friction, with a dead foot, and after a reset."""
    for request in (
        Request('preload', (bench.parameters.stand.preload,)),
        Request(LIVE, settings=((_FRICTION, 0.9 * bench.parameters.contact.friction),)),
        Request(FAULT, settings=(('fault.dead_foot', 1),)),
        Request('clear_faults'),
        Request('reset'),
    ):
        bench.update(bench.time_ns + bench.parameters.sample_ns, [request])


def load_kernels() -> bool:
    """Load all kernels from the disk; return False at the first that is missing."""
    before = only_loads.set(True)
    try:
        compile_kernels()
    except NotKept:
        return False
    finally:
        only_loads.reset(before)
    return True


def progress_reporter(
    say: Callable[[str], None], kernels: int = KERNELS + RUNS_KERNELS
) -> Callable[[int], None]:
    """Return a listener for ``compilation_reported``; it says a line every ``REPORT_EVERY``."""

    def report(done: int) -> None:
        if done == 0 and (why := cache_problem()):
            say(why)
        if done % REPORT_EVERY == 0:
            say(f'compiling kernels, once: {done} of at most {max(kernels, done)}')

    return report
