# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A server of the panel on a thread beside a test."""

import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Any

import pytest
from waiting import GIVE_UP_S

from stickslip_ros.lab.panel import server
from stickslip_ros.lab.panel.model import Source


@contextmanager
def served(source: Source, sheet: Mapping[str, Any]) -> Iterator[str]:
    """Serve a source; give the address of the page."""
    ends, started = threading.Event(), threading.Event()
    addresses: list[str] = []

    def heed() -> None:
        if ends.is_set():
            raise KeyboardInterrupt

    def start(address: str) -> None:
        addresses.append(address)
        started.set()

    def run() -> None:
        try:
            with suppress(KeyboardInterrupt):
                server.serve(source, sheet, 0, start)
        finally:
            started.set()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(server, 'stop_if_asked', heed)
        thread = threading.Thread(target=run)
        thread.start()
        try:
            assert started.wait(GIVE_UP_S)
            yield addresses[0]
        finally:
            ends.set()
            thread.join(GIVE_UP_S)
