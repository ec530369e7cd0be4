# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The server of the page: on this host only, for pages of its own only.

A page of another site can send requests to this host too, and ask for a WebSocket. It cannot
choose the headers Host and Origin, so every request is judged by them.

"""

import asyncio
import json
import socket
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPServerRequest
from tornado.web import Application, HTTPError, RequestHandler, StaticFileHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.lab.panel.controls import read_waveform
from stickslip_ros.lab.panel.model import Source
from stickslip_ros.process.stopping import stop_if_asked

ADDRESS = '127.0.0.1'
HOSTS = ('127.0.0.1', 'localhost')
PERIOD_S = 0.04
"""Time between two pictures, s."""
MESSAGE_MAX_BYTES = 8 << 20
"""Longest message and file of a page: a waveform of 100,000 rows."""
PING_S = 10.0
"""Time between two pings; a page that does not answer one is let go, s."""
PAGE = Path(__file__).parent / 'page'
BESIDE = """\
<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>stickslip panels</title>
<link rel="icon" href="0/icon.svg">
<link rel="stylesheet" href="0/beside.css">
</head>
<body>
{frames}
</body>
</html>
"""
DEALT_WITH = 'dealt with'
"""What a page wishes after each message: it is ready for the next."""
HEADERS = {
    'Content-Security-Policy': "default-src 'none'; script-src 'self'; style-src 'self'; "
    "connect-src 'self'; img-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-src 'self'; frame-ancestors 'self'",
    'Cache-Control': 'no-store',
    'Cross-Origin-Resource-Policy': 'same-origin',
    'Referrer-Policy': 'no-referrer',
    'X-Content-Type-Options': 'nosniff',
}


def is_own(request: HTTPServerRequest, *, needs_origin: bool) -> bool:
    """
    Return whether a request comes from a page of this server, or from no page.

    With ``needs_origin`` one without an origin is refused: browsers name it with every WebSocket.

    """
    hosts, origins = (request.headers.get_list(name) for name in ('Host', 'Origin'))
    if len(hosts) != 1 or hosts[0].rpartition(':')[0] not in HOSTS:
        return False
    return origins == [f'http://{hosts[0]}'] or not (origins or needs_origin)


def _number(digits: str) -> float:
    """Return a whole number, as a float if it is longer than one: others cannot become floats."""
    return int(digits) if len(digits) <= sys.float_info.max_10_exp else float(digits)


class _Part(RequestHandler):
    """A part of the page; what comes from elsewhere is refused before anything else."""

    def prepare(self) -> None:
        if not is_own(self.request, needs_origin=False):
            raise HTTPError(403)
        if '\0' in ''.join(self.path_args):  # which no file has in its name
            raise HTTPError(400)

    def set_default_headers(self) -> None:
        for name, value in HEADERS.items():
            self.set_header(name, value)


class _File(_Part, StaticFileHandler):
    """A file of the page."""


class _Beside(_Part):
    """The pages of several sources, each in a frame."""

    def initialize(self, count: int) -> None:
        self._count = count

    def get(self) -> None:
        frames = [
            f'<iframe src="{each}/" title="panel {each + 1}"></iframe>'
            for each in range(self._count)
        ]
        self.write(BESIDE.format(frames='\n'.join(frames)))


class _Stand(_Part):
    """The drawing of the stand as it is now."""

    def initialize(self, source: Source) -> None:
        self._source = source

    def get(self) -> None:
        drawing = self._source.drawing()
        if not drawing:
            raise HTTPError(404)
        self.set_header('Content-Type', 'image/svg+xml')
        self.write(drawing)


class _Socket(WebSocketHandler):
    """The connection to one page."""

    def initialize(self, hub: 'Hub') -> None:
        self._hub = hub
        self._busy = 0  # messages that the page has not dealt with
        self._next: dict[type, str | bytes] = {}  # the newest state and picture that wait

    def prepare(self) -> None:
        if not is_own(self.request, needs_origin=True):
            raise HTTPError(403)

    def check_origin(self, origin: str) -> bool:  # noqa: ARG002 - judged already, with the host
        return True

    def open(self, *_: str, **__: str) -> None:
        self.set_nodelay(True)
        self._hub.join(self)

    def on_message(self, message: str | bytes) -> None:
        with suppress(ValueError, RecursionError):
            wish = json.loads(message, parse_int=_number)
            if isinstance(wish, dict) and wish.get('do') == DEALT_WITH:
                self._busy = max(0, self._busy - 1)
                self._go_on()
            elif isinstance(wish, dict):
                self._hub.source.do(wish)

    def on_close(self) -> None:
        self._hub.pages.discard(self)

    def show(self, news: str | bytes) -> None:
        """
        Send a state or a picture; a page that is busy gets the newest of each when it is not.

        The page says when. What has only been sent may wait in the browser and in the system for
        a minute, with all that comes after it.

        """
        self._next[type(news)] = news
        self._go_on()

    def send(self, message: str | bytes) -> None:
        """Send what no page may miss; all of it is sent in its order."""
        with suppress(WebSocketClosedError):
            sent = self.write_message(message, binary=isinstance(message, bytes))
            self._busy += 1
            # Raised by a page that has gone; on_close comes too.
            asyncio.ensure_future(sent).add_done_callback(lambda sent: sent.exception())

    def _go_on(self) -> None:
        if not self._busy:
            news, self._next = self._next, {}
            for kind in (str, bytes):
                if kind in news:
                    self.send(news[kind])


class _Waveform(RequestHandler):
    """What a file of somebody at the page says, as rows that can be sent to a drive."""

    def prepare(self) -> None:
        if not is_own(self.request, needs_origin=True):
            raise HTTPError(403)

    async def post(self) -> None:
        name = self.get_query_argument('name', '')
        try:
            with suppress(asyncio.CancelledError):  # the panel ends meanwhile
                rows = await asyncio.to_thread(read_waveform, self.request.body, name)
                self.write({'rows': rows})
        except StickSlipError as error:
            self.write({'refused': str(error)})


class Hub:
    """Sends what a source says to all pages, once made for all of them; the sheet comes first."""

    def __init__(self, source: Source, sheet: Mapping[str, Any]) -> None:
        self.source = source
        self.pages: set[_Socket] = set()
        self._sheet = json.dumps({'sheet': sheet})
        self._state_sent = ''

    def join(self, page: _Socket) -> None:
        """Tell a new page what there is; the picture comes by itself."""
        page.send(self._sheet)
        self._state_sent = ''
        self.source.do({'do': 'view'})
        self.pages.add(page)

    def tick(self) -> None:
        """Send what is new."""
        if not self.pages:
            return
        frame = of_twin = None
        try:
            state = json.dumps({'state': self.source.state()}, allow_nan=False)
            frame, of_twin = self.source.frame(), self.source.twin_frame()
        except Exception as error:  # noqa: BLE001 - whatever it is, STOP must be heard
            state = json.dumps({'failed': f'{type(error).__name__}: {error}'})
        if state != self._state_sent:
            self._state_sent = state
            for page in tuple(self.pages):
                page.show(state)
        if of_twin is not None:  # at most each window, so not replaced by a newer one
            for page in tuple(self.pages):
                page.send(of_twin)
        if frame is not None:
            for page in tuple(self.pages):
                page.show(frame)


def serve(
    source: Source,
    sheet: Mapping[str, Any],
    port: int,
    on_start: Callable[[str], None],
    beside: Sequence[tuple[Source, Mapping[str, Any]]] = (),
) -> None:
    """
    Serve the page of a source until the end is asked for (see `stopping`), and close the source.

    A page is told the sheet first. Port 0 takes a free one, a taken one is refused; ``on_start``
    receives the address. With further sources and their sheets, the page shows those of all.

    """
    hubs = [Hub(source, sheet), *(Hub(*each) for each in beside)]
    try:
        asyncio.run(_serve(hubs, port, on_start))
    finally:
        for hub in hubs:
            hub.source.close()


def next_due_s(due_s: float, begun_s: float, now_s: float) -> float:
    """
    Return when the next picture is due, of one that was due, begun and is done at these times.

    Pictures leave as much time as they take: on a busy machine they would take all that the panel
    gets, and files, tables and wishes of pages would wait.

    """
    return max(due_s + PERIOD_S, now_s + (now_s - begun_s))


def _parts(place: str, hub: Hub) -> list[Any]:
    """Return what the page of a source consists of, in its place."""
    return [
        (f'{place}socket', _Socket, {'hub': hub}),
        (f'{place}waveform', _Waveform),
        (f'{place}stand.svg', _Stand, {'source': hub.source}),
        (f'{place}(.*)', _File, {'path': str(PAGE), 'default_filename': 'index.html'}),
    ]


async def _serve(hubs: Sequence[Hub], port: int, on_start: Callable[[str], None]) -> None:
    parts = _parts('/', hubs[0])
    if len(hubs) > 1:
        parts = [(r'/', _Beside, {'count': len(hubs)})]
        for number, hub in enumerate(hubs):
            parts += _parts(f'/{number}/', hub)
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
            for hub in hubs:
                hub.tick()
            due_s = next_due_s(due_s, begun_s, loop.time())
            await asyncio.sleep(due_s - loop.time())
    finally:
        server.stop()
        await server.close_all_connections()
