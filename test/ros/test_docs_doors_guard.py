# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The doors of docs/examples hear who has the password, and outlive messages of no drive."""

import asyncio
import importlib.util
import json
import math
from collections.abc import Awaitable, Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from sensor_msgs.msg import JointState
from std_msgs.msg import String

EXAMPLES = Path(__file__).parents[2] / 'docs' / 'examples'
PASSWORD = '123456'
ODD = (
    '', 'no JSON', '[' * 100_000, '3', 'null', '[]', '{}', '{"tag": []}', '{"tag": {}}', '"tag"',
    '{"parameters": 5}', '{"parameters": {"amplifier.voltage_min": "low"}}',
    '{"tag": "ours"}', '{"tag": "ours", "result": []}', '{"result": "DONE", "message": 5}',
)  # fmt: skip
"""Texts that somebody may publish where a drive publishes JSON."""


def example(name: str) -> ModuleType:
    """Load an example."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f'{name}.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def anc300(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Give the console, which makes nobody wait after a wrong password."""
    module = example('anc300')
    monkeypatch.setattr(module, 'TRY_S', 0.0)
    return module


Connect = Callable[[], Awaitable[tuple[asyncio.StreamReader, asyncio.StreamWriter]]]


def talk(anc300: ModuleType, act: Callable[[Connect], Awaitable[None]]) -> None:
    """Act as clients of a console without axes."""

    async def run() -> None:
        clients: set[Any] = set()
        strangers: dict[Any, Any] = {}
        opened: list[asyncio.StreamWriter] = []
        serving: list[Any] = []

        async def serve(*streams: Any) -> None:
            serving.append(asyncio.current_task())
            await anc300.serve([], PASSWORD, clients, strangers, *streams)

        async def connect() -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
            reader, writer = await asyncio.open_connection(*server.sockets[0].getsockname())
            opened.append(writer)
            return reader, writer

        server = await asyncio.start_server(serve, '127.0.0.1', 0)
        await act(connect)
        for writer in opened:
            writer.close()
            await writer.wait_closed()
        await asyncio.gather(*serving)
        server.close()
        assert (clients, strangers) == (set(), {})

    asyncio.run(run())


async def log_in(connect: Connect) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """Connect with the password."""
    reader, writer = await connect()
    writer.write(f'{PASSWORD}\r\nver\r\n'.encode())
    assert await reader.readline() == b'******\r\n'
    assert await reader.readline() == b'Authorization success\r\n'
    return reader, writer


def test_clients_without_a_password_lock_nobody_out(anc300: ModuleType):
    async def act(connect: Connect) -> None:
        silent = [await connect() for _ in range(2 * anc300.STRANGERS)]
        known = [await log_in(connect) for _ in range(anc300.CLIENTS)]
        for reader, _ in known:
            assert await reader.readline() == b'> ver\r\n'
        assert await silent[0][0].read() == b''  # the oldest had to go
        known.append(await log_in(connect))
        assert await known[-1][0].read() == b'8 clients are here, which is the limit\r\nERROR\r\n'

    talk(anc300, act)


def test_after_three_wrong_passwords_or_a_silence_the_console_closes(anc300, monkeypatch):
    async def act(connect: Connect) -> None:
        reader, writer = await connect()
        writer.write(b'wrong\r\n' * 200 + f'{PASSWORD}\r\n'.encode())
        assert await reader.read() == b'*****\r\nAuthorization failed\r\n' * 3
        reader, writer = await connect()
        writer.write(f'open\r\n{PASSWORD}\r\ngetcser\r\n'.encode())
        said = [(await reader.readline()).decode().strip() for _ in range(7)]
        assert said[1::2] == [
            'Authorization failed',
            'Authorization success',
            'ANC300B-C-0000-0000001',
        ]
        monkeypatch.setattr(anc300, 'LOGIN_S', 0.0)
        reader, _ = await connect()
        assert await reader.read() == b''

    talk(anc300, act)


class Log:
    """A logger that keeps what it is told."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def warning(self, line: str, **_: Any) -> None:
        self.lines.append(line)


def test_the_console_outlives_what_is_no_message_of_a_drive(anc300: ModuleType):
    axis, log = anc300.Axis.__new__(anc300.Axis), Log()
    axis.log, axis.under_way, axis.failure, axis.given = log, {'ours'}, '', {}
    for text in ODD:
        axis._take_event(String(data=text))
        axis._take_info(String(data=text))
    assert (axis.under_way, axis.given) == ({'ours'}, {})
    assert len(log.lines) >= len(ODD)
    given = dict.fromkeys(anc300.NEEDED, 1.0)
    axis._take_info(String(data=json.dumps({'parameters': given | {'more': 'text'}})))
    assert axis.given == given
    event = {'tag': 'ours', 'result': 'MOVEMENT_FAILED', 'message': ''}
    axis._take_event(String(data=json.dumps(event)))
    assert (axis.under_way, axis.failure) == (set(), 'MOVEMENT_FAILED')


@pytest.fixture
def record() -> Any:
    """Give the motor record without a loop."""
    log = Log()
    node = SimpleNamespace(
        get_parameter=lambda _: SimpleNamespace(value=1e6),
        create_publisher=lambda *_: None,
        get_logger=lambda: log,
    )
    made = example('epics_motor').MotorRecord(node, prefix='stand:x')
    made.tag, made.f, made.log = 'ours', made.motor.field_inst, log
    return made


def test_the_record_outlives_what_is_no_message_of_a_drive(record: Any):
    for text in ODD:
        record.guard(record._take_event, String(data=text))
        record.guard(record._take_info, String(data=text))
    for position in ([], [math.nan], [math.inf]):
        record.guard(record._take_position, JointState(position=position))
    assert (record.given, record.dial_m, record.step_m) == ({}, 0.0, None)
    assert len(record.log.lines) >= len(ODD)
    record.guard(record._take_position, JointState(position=[2e-6]))
    assert record.dial_m == 2e-6


@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf])
def test_the_record_refuses_a_number_that_is_not_finite(record: Any, value: float):
    for act in (
        lambda: record.take(record.f.user_offset, value),
        lambda: record.put(value),
        lambda: record.set('limits.soft_min', value),
    ):
        with pytest.raises(ValueError, match=f'{value} is not finite; write a number'):
            asyncio.run(act())
    assert asyncio.run(record.take(record.f.user_offset, 2.0)) == 2.0
