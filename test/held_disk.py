# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A disk that stands still until a test lets it go on: the writer of a run waits in fsync."""

import os
from threading import Event

import pytest
from waiting import wait_until


class HeldDisk:
    """Holds each ``fsync`` of this process between `hold` and `release`."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._free, self._waits, self._sync = Event(), Event(), os.fsync
        self._free.set()
        monkeypatch.setattr(os, 'fsync', self._sync_later)

    def hold(self) -> None:
        """Hold what is written from now on."""
        self._free.clear()
        self._waits.clear()

    def wait_for_writer(self) -> None:
        """Wait until a writer stands still."""
        wait_until(self._waits.is_set, 'a writer at the disk')

    def release(self) -> None:
        """Let the disk go on."""
        self._free.set()

    def _sync_later(self, file: int) -> None:
        if not self._free.is_set():
            self._waits.set()
            self._free.wait()
        self._sync(file)
