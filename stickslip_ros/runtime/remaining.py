# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The kernels that a drive lacks while it runs: compiled by a niced process, then loaded."""

import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress

from stickslip_ros.instrument.compilation import compile_kernels, load_kernels
from stickslip_ros.process.children import bound_to_parent

COMPILE_AFTER_S = 20.0
"""Time after the start of a drive until its remaining kernels are compiled without a request: a
short run, such as the demo, does not pay for them."""
_POLL_S = 0.1
_PROGRAM = 'from stickslip_ros.instrument.compilation import compile_kernels; compile_kernels()'
_COMMAND = ['nice', sys.executable, '-c', _PROGRAM]
_alone = threading.Lock()
"""Held while kernels are compiled: drives of one process share them."""


class RemainingKernels:
    """
    Loads the kernels that only some requests need, without delay of the drive's blocks.

    numba holds the interpreter while it compiles, so another process compiles, of low priority. It
    ends with the drive; the kernels that it has compiled are kept.

    Attributes
    ----------
    are_loaded : bool
        Whether the drive can carry out every request.

    """

    def __init__(
        self, are_loaded: bool, say: Callable[[str], None], on_loaded: Callable[[], None]
    ) -> None:
        self.are_loaded = are_loaded
        self._say, self._on_loaded = say, on_loaded
        self._begin, self._end = threading.Event(), threading.Event()

    def start(self) -> None:
        """Load the kernels; if the disk lacks some, compile them later."""
        self.are_loaded = self.are_loaded or load_kernels()
        if not self.are_loaded:
            self._begin, self._end = threading.Event(), threading.Event()
            own = self._begin, self._end
            threading.Thread(target=self._run, args=own, name='kernels', daemon=True).start()

    def stop(self) -> None:
        """End the compilation; `start` begins it again."""
        self._end.set()
        self._begin.set()

    def hurry(self, request: str) -> None:
        """Compile now, because a request waits for it."""
        self._begin.set()
        self._say(f'{request} waits until its kernels are compiled, once, which takes seconds')

    def _run(self, begin: threading.Event, end: threading.Event) -> None:
        begin.wait(COMPILE_AFTER_S)
        with suppress(KeyboardInterrupt), _alone:  # the process is asked to end
            if not (end.is_set() or load_kernels()):
                self._compile(end)
            self.are_loaded = not end.is_set()
        if self.are_loaded:
            self._on_loaded()

    def _compile(self, end: threading.Event) -> None:
        """Compile and load kernels, unless the drive ends before."""
        command = bound_to_parent(_COMMAND)
        with subprocess.Popen(command, stdin=subprocess.DEVNULL, start_new_session=True) as child:
            while child.poll() is None:
                if end.wait(_POLL_S):
                    child.terminate()
        if not (end.is_set() or load_kernels()):
            why = f'the process that compiles kernels ended with status {child.returncode}'
            self._say(f'{why}; the drive compiles them itself, and its blocks are late')
            compile_kernels()
