# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The server answers pages of its own and nobody else, and a slow page delays nobody."""

import asyncio
import graphlib
import http.client
import json
import re
import socket
from collections.abc import Iterator, Mapping
from typing import Any

import pytest
from serving import served
from tornado.httpclient import HTTPRequest
from tornado.websocket import websocket_connect
from waiting import GIVE_UP_S

from stickslip_ros.errors import OutOfRange
from stickslip_ros.lab.panel import server
from stickslip_ros.lab.panel.server import PERIOD_S, Hub, _Socket, next_due_s, serve

READY = json.dumps({'do': server.DEALT_WITH})


class Told:
    """A source that says the same for ever, and keeps what is wished."""

    def __init__(self) -> None:
        self.wishes: list[Mapping[str, Any]] = []
        self.is_closed, self.drawn = False, ''

    def state(self) -> dict[str, Any]:
        return {'wishes': len(self.wishes)}

    def frame(self) -> bytes:
        return b'frame'

    def twin_frame(self) -> bytes | None:
        return None

    def drawing(self) -> str:
        return self.drawn

    def settings(self) -> str:
        return ''

    def table(self, plot: str, origin_s: float, start_s: float, end_s: float) -> str:
        return f'{plot}\n'

    def do(self, wish: Mapping[str, Any]) -> None:
        self.wishes.append(wish)

    def close(self) -> None:
        self.is_closed = True


@pytest.fixture
def source() -> Told:
    return Told()


@pytest.fixture
def port(source: Told) -> Iterator[int]:
    """Give the port of a server, which ends with the test."""
    with served(source, {'kind': 'drive'}) as address:
        yield int(address.rstrip('/').rpartition(':')[2])
    assert source.is_closed


def status_of(port: int, path: str = '/', **headers: str) -> tuple[int, http.client.HTTPResponse]:
    """Ask for a page with some headers; give status and answer."""
    connection = http.client.HTTPConnection('127.0.0.1', port, timeout=GIVE_UP_S)
    connection.putrequest('GET', path, skip_host=True)
    for name, value in {'Host': f'127.0.0.1:{port}', **headers}.items():
        connection.putheader(name, value)
    connection.endheaders()
    answer = connection.getresponse()
    answer.read()
    connection.close()
    return answer.status, answer


def test_the_page_and_its_files_are_served_and_nothing_beside(port: int):
    files = [path.name for path in server.PAGE.iterdir()]
    assert 'panel.js' in files
    for name in ('', *files):
        assert status_of(port, f'/{name}')[0] == 200
    for path in ('/server.py', '/../server.py', '/%2e%2e/server.py', '/page/'):
        assert status_of(port, path)[0] in {403, 404}


def test_the_drawing_of_the_stand_is_served_as_soon_as_there_is_one(source: Told, port: int):
    assert status_of(port, '/stand.svg')[0] == 404
    source.drawn = '<svg/>'
    status, answer = status_of(port, '/stand.svg?1')
    assert (status, answer.getheader('Content-Type')) == (200, 'image/svg+xml')
    assert answer.getheader('Cache-Control') == 'no-store'
    assert status_of(port, '/stand.svg', Origin='http://evil.example')[0] == 403


def posted(port: int, content: bytes, **headers: str) -> tuple[int, dict[str, Any]]:
    """Hand a file over as a page does; give status and answer."""
    connection = http.client.HTTPConnection('127.0.0.1', port, timeout=GIVE_UP_S)
    connection.request('POST', '/waveform?name=wave.csv', content, headers)
    answer = connection.getresponse()
    text = answer.read()
    connection.close()
    return answer.status, json.loads(text) if answer.status == 200 else {}


def test_a_file_of_the_page_comes_back_as_rows_or_with_a_reason(port: int):
    own = {'Origin': f'http://127.0.0.1:{port}'}
    table = b'time (ms),voltage (V)\n0,0\n10,100\n'
    assert posted(port, table, **own) == (200, {'read': [[0.0, 0.0], [0.01, 100.0]]})
    assert 'has no unit for' in posted(port, b'time,voltage\n0,0\n10,1\n', **own)[1]['refused']
    assert posted(port, table, Origin='http://evil.example')[0] == 403
    assert posted(port, table)[0] == 403


def test_the_scripts_of_the_page_import_each_other_in_one_direction():
    imports = {
        path.name: re.findall(r'from \"\./([\w.]+)\"', path.read_text(encoding='utf-8'))
        for path in server.PAGE.glob('*.js')
    }
    assert sorted(imports['waveform.js']) == ['fields.js', 'plot.js', 'socket.js']
    order = list(graphlib.TopologicalSorter(imports).static_order())  # CycleError of a circle
    assert order[-1] == 'panel.js'


def test_the_page_may_load_from_here_only_and_stand_in_no_frame(port: int):
    _, answer = status_of(port)
    policy = answer.headers['Content-Security-Policy']
    assert "default-src 'none'" in policy
    assert "frame-ancestors 'none'" in policy
    assert 'unsafe' not in policy
    assert answer.headers['Cross-Origin-Resource-Policy'] == 'same-origin'


@pytest.mark.parametrize('host', ['evil.example', 'localhost.evil.example', '127.0.0.1.nip.io'])
def test_a_foreign_host_is_refused(port: int, host: str):
    assert status_of(port, Host=f'{host}:{port}')[0] == 403
    assert status_of(port, Host=host)[0] == 403


@pytest.mark.parametrize(
    'origin',
    ['http://evil.example', 'https://127.0.0.1:{port}', 'http://localhost:{port}', 'null'],
)
def test_a_foreign_origin_is_refused(port: int, origin: str):
    assert status_of(port, '/panel.js', Origin=origin.format(port=port))[0] == 403
    through_a_tunnel = {'Host': 'localhost:9999', 'Origin': 'http://localhost:9999'}
    assert status_of(port, **through_a_tunnel)[0] == 200


async def connect(port: int, **headers: str) -> Any:
    request = HTTPRequest(f'ws://127.0.0.1:{port}/socket', headers=headers)
    return await asyncio.wait_for(websocket_connect(request), GIVE_UP_S)


async def dealt_with(page: Any) -> Any:
    """Return the next message, and say that the page is ready for another."""
    message = await asyncio.wait_for(page.read_message(), GIVE_UP_S)
    await page.write_message(READY)
    return message


@pytest.mark.parametrize('headers', [{}, {'Origin': 'http://evil.example'}, {'Origin': 'null'}])
def test_a_socket_without_an_origin_or_with_a_foreign_one_is_refused(port, source, headers):
    upgrade = {
        'Upgrade': 'websocket',
        'Connection': 'Upgrade',
        'Sec-WebSocket-Key': 'AAAAAAAAAAAAAAAAAAAAAA==',
        'Sec-WebSocket-Version': '13',
    }
    assert status_of(port, '/socket', **upgrade, **headers)[0] == 403
    assert source.wishes == []
    own = {'Origin': f'http://127.0.0.1:{port}'}
    assert status_of(port, '/socket', **upgrade, **own)[0] == 101


ODD: tuple[str | bytes, ...] = ('{', '[]', '7', '[' * 100_000, b'\xff\xfe\x00', '\0')


def test_a_page_is_told_and_its_wishes_are_done(port: int, source: Told):
    async def talk() -> None:
        page = await connect(port, Origin=f'http://127.0.0.1:{port}')
        heard = [await dealt_with(page) for _ in range(3)]
        assert json.loads(heard[0]) == {'sheet': {'kind': 'drive'}}
        assert 'state' in json.loads(heard[1])
        assert heard[2] == b'frame'
        for message in (*ODD, '{"do": "service", "name": "stop"}'):
            await page.write_message(message, binary=isinstance(message, bytes))
        while await dealt_with(page) and len(source.wishes) < 2:
            pass
        page.close()
        while await page.read_message() is not None:
            pass

    asyncio.run(asyncio.wait_for(talk(), GIVE_UP_S))
    assert source.wishes == [{'do': 'view'}, {'do': 'service', 'name': 'stop'}]


@pytest.mark.parametrize('broken', ['state', 'frame'])
def test_a_picture_that_cannot_be_made_is_said_and_wishes_are_done(port, source, broken):
    setattr(source, broken, lambda: 1 / 0)

    async def talk() -> None:
        page = await connect(port, Origin=f'http://127.0.0.1:{port}')
        heard = [json.loads(await dealt_with(page)) for _ in range(2)]
        assert heard[1] == {'failed': 'ZeroDivisionError: division by zero'}
        await page.write_message('{"do": "service", "name": "stop"}')
        delattr(source, broken)
        while await dealt_with(page) != b'frame':
            pass
        page.close()
        while await page.read_message() is not None:
            pass

    asyncio.run(asyncio.wait_for(talk(), GIVE_UP_S))
    assert source.wishes == [{'do': 'view'}, {'do': 'service', 'name': 'stop'}]


def test_only_this_host_is_listened_on(port: int):
    with socket.create_connection(('127.0.0.1', port), GIVE_UP_S):
        pass
    with pytest.raises(OSError, match='refused'):
        socket.create_connection(('127.0.0.2', port), GIVE_UP_S)


def test_a_port_that_is_taken_is_refused(port: int):
    with pytest.raises(OutOfRange, match=f'port {port} is taken'):
        serve(Told(), {}, port, lambda _: None)


class Page:
    """A page that keeps what it is told and shown."""

    def __init__(self) -> None:
        self.told: list[str] = []
        self.shown: list[bytes] = []
        self.send = self.told.append

    def show(self, _: str, news: Any) -> None:
        (self.told if isinstance(news, str) else self.shown).append(news)


class Slow(_Socket):
    """A page that is busy with what it was sent until it is let go on."""

    def __init__(self) -> None:
        self.initialize(Hub(Told(), {}))
        self.sent: list[Any] = []

    def write_message(self, message: Any, binary: bool = False) -> asyncio.Future:
        self.sent.append(message)
        done = asyncio.get_running_loop().create_future()
        done.set_result(None)  # the system has taken it
        return done

    def go_on(self) -> list[Any]:
        """Deal with all that is sent, and return it."""
        for _ in self.sent:  # grows on the way
            self.on_message(READY)
        return self.sent


def test_a_busy_page_gets_the_newest_state_and_picture_when_it_has_dealt_with_what_it_got():
    async def send() -> list[Any]:
        page = Slow()
        page.send('sheet')
        for picture in (b'1', b'2', b'3'):
            page.show('picture', picture)
            page.show('state', f'state {picture.decode()}')
        page.send('more')
        await asyncio.sleep(0)
        assert page.sent == ['sheet', 'more']
        return page.go_on()

    assert asyncio.run(send()) == ['sheet', 'more', 'state 3', b'3']


def test_a_busy_page_gets_the_newest_picture_of_a_twin_and_no_queue_of_them(source: Told):
    pictures, twins = iter([b'1', b'2', b'3', b'4']), iter([None, b'0.30', b'0.24', None])
    source.frame = lambda: next(pictures)  # type: ignore[method-assign]
    source.twin_frame = lambda: next(twins)  # type: ignore[method-assign]

    async def send() -> list[Any]:
        hub, page = Hub(source, {}), Slow()
        hub.join(page)
        for _ in range(4):
            hub.tick()
        assert len(page.sent) == 1  # the sheet
        return [each for each in page.go_on() if isinstance(each, bytes)]

    assert asyncio.run(send()) == [b'0.24', b'4']


def test_pictures_leave_as_much_time_as_they_take():
    due_s, short_s, long_s = 7.0, 0.25 * PERIOD_S, 3.0 * PERIOD_S
    assert next_due_s(due_s, due_s, due_s + short_s) == due_s + PERIOD_S
    assert next_due_s(due_s, due_s, due_s + long_s) == pytest.approx(due_s + 2.0 * long_s)


def test_a_picture_is_made_once_for_all_pages_and_never_without_one(source: Told):
    hub, pages = Hub(source, {}), [Page(), Page()]
    hub.source.frame = lambda: pytest.fail('nobody looks')  # type: ignore[method-assign]
    hub.tick()
    made = iter([b'picture', b'next'])
    hub.source.frame = lambda: next(made)  # type: ignore[method-assign]
    for page in pages:
        hub.join(page)  # type: ignore[arg-type]
    hub.tick()
    for page in pages:
        assert page.shown == [b'picture']
    hub.tick()
    assert pages[0].shown == [b'picture', b'next']
    assert len(pages[0].told) == 2
