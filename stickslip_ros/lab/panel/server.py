# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The server of the page, for its own pages on this host.

Other sites can send requests to this host and open a WebSocket, but cannot set Host and Origin.
Each request is checked by these headers.

"""

import asyncio
import json
import socket
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPServerRequest
from tornado.web import Application, HTTPError, RequestHandler, StaticFileHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.lab.panel.controls import read_number, read_waveform
from stickslip_ros.lab.panel.model import Source
from stickslip_ros.lab.panel.settings import read_parameter_file
from stickslip_ros.process.stopping import stop_if_asked

ADDRESS = '127.0.0.1'
HOSTS = ('127.0.0.1', 'localhost')
PERIOD_S = 0.04  # time between two pictures, s
MESSAGE_MAX_BYTES = 8 << 20  # longest message and file: a waveform of 100,000 rows
PING_S = 10.0  # time between two pings, s; a page without an answer is disconnected
PAGE = Path(__file__).parent / 'page'
FRAME_KINDS = ('state', 'twin', 'picture')
"""Kinds of news of which a page gets the newest, in the order in which they are sent."""
DEALT_WITH = 'dealt with'  # message of a page that is ready for the next one
HEADERS = {
    'Content-Security-Policy': "default-src 'none'; script-src 'self'; style-src 'self'; "
    "connect-src 'self'; img-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    'Cache-Control': 'no-store',
    'Cross-Origin-Resource-Policy': 'same-origin',
    'Referrer-Policy': 'no-referrer',
    'X-Content-Type-Options': 'nosniff',
}


def is_own(request: HTTPServerRequest, *, needs_origin: bool) -> bool:
    """Whether a request is from an own page or, unless ``needs_origin``, from no page."""
    hosts, origins = (request.headers.get_list(name) for name in ('Host', 'Origin'))
    if len(hosts) != 1 or hosts[0].rpartition(':')[0] not in HOSTS:
        return False
    return origins == [f'http://{hosts[0]}'] or not (origins or needs_origin)


class _Part(RequestHandler):
    """A part of the page; refuses requests from other sites."""

    needs_origin = False

    def prepare(self) -> None:
        if not is_own(self.request, needs_origin=self.needs_origin):
            raise HTTPError(403)

    def set_default_headers(self) -> None:
        for name, value in HEADERS.items():
            self.set_header(name, value)


class _File(_Part, StaticFileHandler):
    """A file of the page."""


class _Text(_Part):
    """A text that is made when it is asked for: the drawing of the stand, its parameters."""

    def initialize(self, make: Callable[[], str], kind: str) -> None:
        self._make, self._kind = make, kind

    def get(self) -> None:
        text = self._make()
        if not text:
            raise HTTPError(404)
        self.set_header('Content-Type', self._kind)
        self.write(text)


class _Table(_Part):
    """The samples of a picture as CSV."""

    def initialize(self, source: Source) -> None:
        self._source = source

    async def get(self, plot: str) -> None:
        try:
            times = [float(self.get_query_argument(name)) for name in ('origin', 'start', 'end')]
        except ValueError:
            raise HTTPError(400) from None
        self.set_header('Content-Type', 'text/csv')
        self.write(await asyncio.to_thread(self._source.table, plot, *times))


class _Socket(_Part, WebSocketHandler):
    """The connection to a page."""

    needs_origin = True

    def initialize(self, hub: 'Hub') -> None:
        self._hub = hub
        self._busy = 0  # messages that the page has not processed
        self._next: dict[str, str | bytes] = {}  # newest waiting state and pictures

    def check_origin(self, origin: str) -> bool:  # noqa: ARG002 - checked in prepare
        return True

    def open(self, *_: str, **__: str) -> None:
        self.set_nodelay(True)
        self._hub.join(self)

    def on_message(self, message: str | bytes) -> None:
        with suppress(ValueError, RecursionError):
            wish = json.loads(message)
            if isinstance(wish, dict) and wish.get('do') == DEALT_WITH:
                self._busy = max(0, self._busy - 1)
                self._go_on()
            elif isinstance(wish, dict):
                self._hub.source.do(wish)

    def on_close(self) -> None:
        self._hub.pages.discard(self)

    def show(self, kind: str, news: str | bytes) -> None:
        """Send the newest of a kind in FRAME_KINDS as soon as the page has processed the last."""
        self._next[kind] = news
        self._go_on()

    def send(self, message: str | bytes) -> None:
        """Send a message that no page may miss, in order."""
        with suppress(WebSocketClosedError):
            sent = self.write_message(message, binary=isinstance(message, bytes))
            self._busy += 1
            # A closed page raises here; on_close follows.
            asyncio.ensure_future(sent).add_done_callback(lambda sent: sent.exception())

    def _go_on(self) -> None:
        if not self._busy:
            news, self._next = self._next, {}
            for kind in FRAME_KINDS:
                if kind in news:
                    self.send(news[kind])


class _Upload(_Part):
    """Read an uploaded file; return its content, or why it is refused."""

    needs_origin = True

    def initialize(self, read: Callable[[bytes, str], Any]) -> None:
        self._read = read

    async def post(self) -> None:
        name = self.get_query_argument('name', '')
        try:
            with suppress(asyncio.CancelledError):  # the panel is closing
                read = await asyncio.to_thread(self._read, self.request.body, name)
                self.write({'read': read})
        except StickSlipError as error:
            self.write({'refused': str(error)})


class Hub:
    """Sends sheet, state and pictures of a source to all its pages."""

    def __init__(self, source: Source, sheet: Mapping[str, Any]) -> None:
        self.source = source
        self.pages: set[_Socket] = set()
        self._sheet = json.dumps({'sheet': sheet})
        self._state_sent = ''

    def join(self, page: _Socket) -> None:
        """Send the sheet to a new page; pictures follow with the next tick."""
        page.send(self._sheet)
        self._state_sent = ''
        self.source.do({'do': 'view'})
        self.pages.add(page)

    def tick(self) -> None:
        """Send changed state and pictures."""
        if not self.pages:
            return
        frame = twin_frame = None
        try:
            state = json.dumps({'state': self.source.state()}, allow_nan=False)
            frame, twin_frame = self.source.frame(), self.source.twin_frame()
        except Exception as error:  # noqa: BLE001 - STOP must work after any error
            state = json.dumps({'failed': f'{type(error).__name__}: {error}'})
        is_new, self._state_sent = state != self._state_sent, state
        for page in tuple(self.pages):
            for kind, news in zip(FRAME_KINDS, (state * is_new, twin_frame, frame), strict=True):
                if news:
                    page.show(kind, news)


def serve(
    source: Source, sheet: Mapping[str, Any], port: int, on_start: Callable[[str], None]
) -> None:
    """
    Serve the page of a source until the end, then close the source.

    Port 0 takes a free port; ``on_start`` receives the address.

    """
    try:
        asyncio.run(_serve(Hub(source, sheet), port, on_start))
    finally:
        source.close()


def next_due_s(due_s: float, begun_s: float, now_s: float) -> float:
    """Return when the next picture is due; pictures take at most half of the time."""
    return max(due_s + PERIOD_S, now_s + (now_s - begun_s))


async def _serve(hub: Hub, port: int, on_start: Callable[[str], None]) -> None:
    source = hub.source
    parts: list[Any] = [
        ('/socket', _Socket, {'hub': hub}),
        ('/waveform', _Upload, {'read': read_waveform}),
        ('/number', _Upload, {'read': read_number}),
        ('/parameters', _Upload, {'read': read_parameter_file}),
        ('/stand.svg', _Text, {'make': source.drawing, 'kind': 'image/svg+xml'}),
        ('/parameters.yaml', _Text, {'make': source.settings, 'kind': 'text/yaml'}),
        (r'/(oscilloscope|history|twin)\.csv', _Table, {'source': source}),
        ('/(.*)', _File, {'path': str(PAGE), 'default_filename': 'index.html'}),
    ]
    application = Application(
        parts,
        websocket_max_message_size=MESSAGE_MAX_BYTES,
        websocket_ping_interval=PING_S,
        log_function=lambda _: None,
    )
    try:
        listener = socket.create_server((ADDRESS, port))
    except (OSError, OverflowError):
        limit = f'taken, or not allowed, on {ADDRESS}'
        raise OutOfRange('port', port, '', limit, 'choose another, or 0 for a free one') from None
    server = HTTPServer(application, max_body_size=MESSAGE_MAX_BYTES)
    listener.setblocking(False)
    server.add_socket(listener)
    on_start(f'http://{ADDRESS}:{listener.getsockname()[1]}/')
    loop = asyncio.get_running_loop()
    due_s = loop.time()
    try:
        while True:
            stop_if_asked()
            begun_s = loop.time()
            hub.tick()
            due_s = next_due_s(due_s, begun_s, loop.time())
            await asyncio.sleep(due_s - loop.time())
    finally:
        server.stop()
        await server.close_all_connections()
