"""Kernels of a node: those that it runs with, and the others, which are compiled beside it."""

import subprocess
import sys
import threading
from collections.abc import Callable

from stickslip_ros.contact.kernel_cache import are_all_kept, cache_folders
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.compilation import (
    IDEAL_KERNELS,
    KERNELS,
    compile_ideal_kernels,
    compile_kernels,
    needs_all_kernels,
)
from stickslip_ros.parameters import Parameters

BEYOND_IDEAL = frozenset(('preload', 'fault'))
"""Requests for which an ideal drive has no kernels."""
IN_ORDER = BEYOND_IDEAL | {'clear_faults', 'reset'}
"""Requests that do not overtake one of these while it waits for kernels."""
NICE = 10
COMPILE = f"""
import os, sys
os.nice({NICE})
sys.argv = ['stickslip', 'compile']
from stickslip_ros.entry import stickslip
sys.exit(stickslip())
"""


def kernels_for(parameters: Parameters) -> int:
    """Return how many kernels a drive waits for if none is compiled yet."""
    is_restored = bool(parameters.sim.checkpoint)
    needs_all = cache_folders().write is None or is_restored or needs_all_kernels(parameters)
    return KERNELS if needs_all else IDEAL_KERNELS


class Kernels:
    """
    The kernels of one drive.

    An ideal drive begins as soon as it has its own. A process of its own compiles those for
    preload commands and faults meanwhile, and hands them over by the disk; where there is no
    place for them, and where the stand needs all, all are compiled first. ``on_ready`` is called,
    in any thread, when no request has to wait any more: then ``are_ready`` is true.

    """

    def __init__(self, parameters: Parameters, on_ready: Callable[[], object]) -> None:
        self.are_ready = are_all_kept() or kernels_for(parameters) == KERNELS
        self._on_ready = on_ready
        self._process: subprocess.Popen[bytes] | None = None
        self._is_released = False
        if self.are_ready:
            compile_kernels()
            return
        compile_ideal_kernels()
        self._process = subprocess.Popen(
            [sys.executable, '-c', COMPILE],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # a Ctrl-C is for the drive, which then ends it
        )
        threading.Thread(
            target=self._follow, args=(self._process,), name='stickslip kernels', daemon=True
        ).start()

    def must_wait(self, request: Request | None, after: bool) -> bool:
        """Return whether a request must wait; ``after`` says whether one before it does."""
        if self.are_ready or request is None:
            return False
        return request.name in (IN_ORDER if after else BEYOND_IDEAL)

    def release(self) -> None:
        """End the process: nobody waits for it any more."""
        self._is_released = True
        if self._process is not None:
            self._process.terminate()

    def _follow(self, process: 'subprocess.Popen[bytes]') -> None:
        """Load what the process has compiled; compile what it could not."""
        process.wait()
        if not self._is_released:
            compile_kernels()
            self.are_ready = True
            self._on_ready()
