"""The front panel: what it costs itself and the drive, how fast its pictures and answers are."""

import asyncio
import json
import socket
import struct
import threading
import time
from contextlib import ExitStack, suppress
from typing import Any

import numpy as np
from tornado.httpclient import HTTPRequest
from tornado.websocket import WebSocketClientConnection, websocket_connect

from benchmarks.node.lateness import summary
from benchmarks.node.process import Process
from benchmarks.node.programs import Drive, Turn, in_turn, opened
from benchmarks.outcome import Outcome, Row, Verdict
from benchmarks.sizes import Sizes

PROGRAM = 'import sys; from stickslip_ros.cli.main import main; sys.exit(main())'
ALONE, WATCHED = 'the node', 'the node, with a panel and {} page(s)'
LEVELS_V = (50.0, 200.0)
"""Voltages between which it is seen how soon a page shows what it asked for."""
LATENCY_S = 5.0
START_TIMEOUT_S = 60.0


class Page:
    """What a page in a browser is to the server: it takes every picture, and draws none."""

    def __init__(self, port: int) -> None:
        self.pictures = 0
        self._port = port
        self._head: dict[str, Any] = {}
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_until_complete, args=[self._read()])
        self._connection: WebSocketClientConnection | None = None
        self._ended = False
        self._thread.start()

    async def _read(self) -> None:
        host = f'127.0.0.1:{self._port}'
        request = HTTPRequest(f'ws://{host}/socket', headers={'Origin': f'http://{host}'})
        while self._connection is None:  # the panel is still starting
            if self._ended:
                return
            with suppress(OSError):
                self._connection = await websocket_connect(request)
            await asyncio.sleep(0.1)
        while (message := await self._connection.read_message()) is not None:
            if isinstance(message, bytes):
                [size] = struct.unpack('<I', message[:4])
                self._head = json.loads(message[4 : 4 + size])
                self.pictures += 1

    def await_connection(self) -> None:
        """Wait until the panel has started, which takes long beside others."""
        end_s = time.monotonic() + START_TIMEOUT_S
        while self._connection is None and time.monotonic() < end_s:
            time.sleep(0.05)

    def wish(self, **wish: Any) -> None:
        """Tell the server something, as a click does."""
        assert self._connection is not None
        self._loop.call_soon_threadsafe(self._connection.write_message, json.dumps(wish))

    def latency_s(self, voltage_v: float) -> float:
        """Return the time from asking for a voltage until a picture shows a change."""
        before_v = self._head['figures']['voltage']
        begin_s = time.monotonic()
        self.wish(do='command', name='voltage', values=[voltage_v])
        while abs(self._head['figures']['voltage'] - before_v) < 1.0:
            if time.monotonic() - begin_s > LATENCY_S:
                return float('nan')
            time.sleep(1e-3)
        return time.monotonic() - begin_s

    def close(self) -> None:
        """Wait for the end of the server, which may not have begun."""
        self._ended = True
        self._thread.join()
        self._loop.close()


class WatchedDrive(Drive):
    """A drive with a panel, and with pages that look at it."""

    def __init__(self, name: str, pages: int) -> None:
        super().__init__(name)
        with socket.create_server(('127.0.0.1', 0)) as free:
            port = free.getsockname()[1]
        words = ['-c', PROGRAM, 'panel', '--port', str(port), '--namespace', self.lane.namespace]
        self.panel = Process(words, self.lane)
        self.pages = [Page(port) for _ in range(pages)]
        for page in self.pages:
            page.await_connection()
        self.costs: list[tuple[float, float]] = []

    def turn(self, settle_s: float, seconds: float) -> Turn:
        """Note processor time of the panel and pictures of the first page, per second."""
        begin_s, cpu_s, pictures = time.monotonic(), self.panel.cpu_s(), self.pages[0].pictures
        turn = super().turn(settle_s, seconds)
        lasted_s = time.monotonic() - begin_s
        cpu = (self.panel.cpu_s() - cpu_s) / lasted_s
        self.costs.append((cpu, (self.pages[0].pictures - pictures) / lasted_s))
        return turn

    def latencies_s(self, count: int) -> list[float]:
        """Return times from a wish to the picture that shows it, of a drive at rest."""
        self.start()
        time.sleep(1.0)
        self.pages[0].wish(do='service', name='stop')
        found = []
        for number in range(count):
            time.sleep(0.1 + 0.013 * (number % 5))
            found.append(self.pages[0].latency_s(LEVELS_V[number % 2]))
        self.stop()
        return found[1:]

    def close(self) -> None:
        """End the panel too."""
        self.panel.close()
        for page in self.pages:
            page.close()
        super().close()


def run(sizes: Sizes) -> Outcome:
    """Compare a node with one that is watched."""
    with ExitStack() as stack:
        makers = [
            lambda: Drive(ALONE),
            *(lambda n=n: WatchedDrive(WATCHED.format(n), n) for n in (1, 2)),
        ]
        programs = opened(stack, makers)
        turns = in_turn(programs, sizes.node_rounds, sizes.settle_s, sizes.turn_s)
        watched = [each for each in programs if isinstance(each, WatchedDrive)]
        latencies_s = watched[0].latencies_s(max(6, sizes.commands // 10))
    rows: list[Row] = []
    for program, its in zip(programs, turns, strict=True):
        late = summary([window for turn in its for window in turn.windows])
        costs = np.median(getattr(program, 'costs', [(np.nan, np.nan)]), axis=0)
        rows.append(
            {
                'program': program.name,
                'cpu_percent': 100.0 * float(np.median([turn.cpu for turn in its])),
                'panel_cpu_percent': 100.0 * float(costs[0]),
                'pictures_per_s': float(costs[1]),
                'p99_late_us': late['p99_us'],
                'overruns': late['overruns'],
                'ticks': late['ticks'],
            }
        )
    median_s, slowest_s = float(np.nanmedian(latencies_s)), float(np.nanmax(latencies_s))
    one = rows[1]
    return Outcome(
        'The front panel beside the node at 1 kHz, 50 kS/s, a saw-tooth of 50 Hz',
        rows,
        [
            Verdict('pictures per second of one page', 24.0, float(one['pictures_per_s'])),
            Verdict(
                '% of a core of the panel', 25.0, float(one['panel_cpu_percent']), at_most=True
            ),
            Verdict('slowest picture after a click, s', 0.3, slowest_s, at_most=True),
        ],
        [
            f'{sizes.node_rounds} turns of {sizes.turn_s:g} s',
            'a page here takes every picture and draws none: a browser needs its own time',
            f'from a click to its picture: {1e3 * median_s:.0f} ms (median of {len(latencies_s)})',
        ],
    )
