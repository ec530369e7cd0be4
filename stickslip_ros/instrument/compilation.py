"""Every kernel that a stand may need, compiled before it runs; and how far that is."""

from collections.abc import Callable

from stickslip_ros.contact.kernel_cache import why_not_kept
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.parameters import Parameters

KERNELS = 117
"""What ``compile_kernels`` compiles where nothing is compiled yet."""
TOLD_EVERY = 20
"""Kernels after which it is told again how far the compilation is."""


def compile_kernels() -> None:
    """
    Compile what is not compiled yet, or load it from the disk.

    A stand is led through all that has kernels of its own, on a bench that is thrown away: a run,
    another preload, a dead foot, the ledger. Nothing is compiled later, while time must not stand
    still. The kernels are the same for every stand.

    """
    parameters = Parameters()
    bench = Bench(parameters)
    bench.update(parameters.block_ns)
    for request in (
        Request('preload', (parameters.stand.preload,)),
        Request('fault', settings=(('fault.dead_foot', 1),)),
    ):
        bench.accept(request)
    bench.update(2 * parameters.block_ns)
    _ = bench.ledger


def told(say: Callable[[str], None]) -> Callable[[int], None]:
    """
    Return what to tell of compiled kernels, as ``compilation_told`` does, to put it into words.

    Parameters
    ----------
    say : callable
        Receives a line at the first kernel, and after every ``TOLD_EVERY``.

    """

    def tell(done: int) -> None:
        if done == 0 and (why := why_not_kept()):
            say(why)
        if done % TOLD_EVERY == 0:
            say(f'compiling kernels, once: {done} of {max(KERNELS, done)}')

    return tell
