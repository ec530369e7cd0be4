# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The kernels that a drive lacks while it runs: compiled by a niced process, then loaded."""

import subprocess
import sys
import threading
from collections.abc import Callable

from stickslip_ros.instrument.compilation import compile_for, load_kernels
from stickslip_ros.parameters import Parameters
from stickslip_ros.process.children import bound_to_parent

COMPILE_AFTER_S = 20.0
"""Time after the start of a drive until its remaining kernels are compiled without a request: a
short run, such as the demo, does not pay for them."""
_POLL_S = 0.1
_PROGRAM = 'from stickslip_ros.instrument.compilation import compile_kernels; compile_kernels()'
_alone = threading.Lock()  # held while kernels are compiled: drives of one process share them


class RemainingKernels:
    """
    The kernels that only some requests need: loaded, or compiled without delay of the blocks.

    numba holds the interpreter while it compiles, so a process of low priority compiles. It ends
    with the drive; what it has compiled is kept. ``are_loaded`` tells whether nothing is missing.

    """

    def __init__(
        self, parameters: Parameters, say: Callable[[str], None], on_loaded: Callable[[], None]
    ) -> None:
        self.are_loaded = compile_for(parameters)
        self._say, self._on_loaded = say, on_loaded
        self._begin, self._end = threading.Event(), threading.Event()
        self._begin.set()

    def load(self) -> None:
        """Load the kernels, if the disk has all of them."""
        self.are_loaded = self.are_loaded or load_kernels()

    def start(self) -> None:
        """Load the kernels; if the disk lacks some, compile them later."""
        self.load()
        if not self.are_loaded:
            own = self._begin, self._end = threading.Event(), threading.Event()
            threading.Thread(target=self._run, args=own, name='kernels', daemon=True).start()

    def stop(self) -> None:
        """End the compilation; `start` begins it again."""
        self._end.set()
        self._begin.set()

    def hurry(self, *, is_wanted: bool) -> None:
        """Compile now if a request waits."""
        if is_wanted and not self._begin.is_set():
            self._begin.set()
            self._say('preload, friction, faults wait for kernels, compiled once: 15 s of a core')

    def _run(self, begin: threading.Event, end: threading.Event) -> None:
        begin.wait(COMPILE_AFTER_S)
        with _alone:
            if not (end.is_set() or load_kernels()):
                self._compile(end)
                load_kernels()
        if not end.is_set():
            self.are_loaded = True
            self._on_loaded()

    def _compile(self, end: threading.Event) -> None:
        """Compile kernels, until the drive ends."""
        command = bound_to_parent(['nice', sys.executable, '-c', _PROGRAM])
        with subprocess.Popen(command, stdin=subprocess.DEVNULL, start_new_session=True) as child:
            while child.poll() is None:
                if end.wait(_POLL_S):
                    child.terminate()
        if child.returncode and not end.is_set():
            why = f'the process that compiles kernels ended with status {child.returncode}'
            self._say(f'{why}; the drive compiles them itself, and its blocks are late')
