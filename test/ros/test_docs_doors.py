# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The doors of docs/examples are opened by clients that others wrote, and stand what they get."""

import json
import re
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from processes import start_process
from pymeasure.instruments.attocube import ANC300Controller
from waiting import GIVE_UP_S

pytestmark = pytest.mark.slow

EXAMPLES = Path(__file__).parents[2] / 'docs' / 'examples'
FREE = {'load_cell.contact': 'absent', 'runner.damping': 5.0}
STEPS = 50
LEAST_STEP_M, STROKE_M = 80e-9, 160e-9
"""Way of a free runner in a step of 300 V, at least and at most."""
QUERIES = 20_000
TOLERANCE_UM = 3e-3
"""closed_loop.tolerance, and the noise of a single reading."""


@pytest.fixture
def stand(start_drive: Callable[..., Any]) -> Any:
    """Give a drive whose runner is free."""
    return start_drive(FREE)


@pytest.fixture
def door(stand: Any, start: Callable[..., Any]) -> Callable[..., Any]:
    """Give a function that starts an example beside the drive and waits for a line of its log."""

    def open_door(name: str, until: str, **parameters: Any) -> Any:
        words = [w for k, v in parameters.items() for w in ('-p', f'{k}:={v}')]
        process = start(sys.executable, str(EXAMPLES / name), '--ros-args', *words)
        for line in process.stderr:
            found = re.search(until, line)
            if found:
                return found
        raise AssertionError(f'{name} has ended with {process.wait()}')

    return open_door


class Console:
    """A client of the console that says and hears lines."""

    def __init__(self, port: int) -> None:
        self.socket = socket.create_connection(('127.0.0.1', port), GIVE_UP_S)
        self.lines = self.socket.makefile('r', newline='\r\n')
        self.say('123456')
        assert self.hear(2) == ['******', 'Authorization success']

    def say(self, line: str) -> None:
        self.socket.sendall(f'{line}\r\n'.encode())

    def hear(self, count: int) -> list[str]:
        return [self.lines.readline().rstrip('\r\n') for _ in range(count)]

    def ask(self, line: str) -> list[str]:
        """Return what is answered without an echo, up to OK or ERROR."""
        self.say(line)
        said = self.hear(1)
        while said[-1] not in ('OK', 'ERROR', ''):
            said += self.hear(1)
        return said

    def close(self) -> None:
        self.lines.close()
        self.socket.close()


@pytest.fixture
def port(door: Callable[..., Any]) -> int:
    """Give the port of a console that knows its drive."""
    number = int(door('anc300.py', r"listens on \('127\.0\.0\.1', (\d+)\)", port=0)[1])
    console = Console(number)
    console.ask('echo off')
    while console.ask('getm 1')[-1] == 'ERROR':
        pass
    console.close()
    return number


@pytest.fixture
def console(port: int) -> Iterator[Callable[[], Console]]:
    """Give a function that connects a client without echo."""
    with ExitStack() as stack:

        def connect() -> Console:
            made = Console(port)
            stack.callback(made.close)
            assert made.ask('echo off')[-1] == 'OK'
            return made

        yield connect


def test_pymeasure_steps_the_drive_through_the_console_of_an_anc300(stand: Any, port: int):
    anc300 = ANC300Controller(
        f'TCPIP::127.0.0.1::{port}::SOCKET',
        axisnames=['x'],
        passwd='123456',
        query_delay=0.0,
        visa_library='@py',
        timeout=1e3 * GIVE_UP_S,
    )
    axis = anc300.x
    assert anc300.version.startswith('attocube ANC300')
    axis.mode = 'stp'
    axis.voltage, axis.frequency = 150.0, 1000.0
    assert (axis.mode, axis.voltage, axis.frequency) == ('stp', 150.0, 1000)
    axis.move(STEPS)
    up = stand.operator.wait_for_event('sawtooth', 0)
    assert (up['result'], up['steps'], axis.mode) == ('DONE', STEPS, 'gnd')
    assert LEAST_STEP_M < up['step_m'] < STROKE_M
    axis.move(-STEPS, gnd=False)
    down = stand.operator.wait_for_event('sawtooth', len(stand.operator.events) - 1)
    assert (down['steps'], axis.output_voltage) == (STEPS, 0.0)
    axis.move_raw(float('inf'))
    assert axis.output_voltage == 150.0
    axis.stop()
    assert axis.output_voltage == 0.0
    axis.pattern_up = [min(2 * i, 255) for i in range(256)]
    axis.move(3, gnd=False)
    assert stand.operator.wait_for_event('waveform', 0)['steps'] == 3
    axis.mode = 'stp+'
    axis.offset_voltage = 20.0
    with pytest.raises(ValueError, match=r"340 V is above the amplifier's 300 V"):
        axis.move_raw(1)
    with pytest.raises(ValueError, match='Unsupported mode'):
        axis.mode = 'inp'
    anc300.ground_all()
    assert axis.mode == 'gnd'
    anc300.adapter.close()


def test_an_axis_waits_for_its_own_steps_alone(stand: Any, console: Callable[[], Console]):
    ours, operator = console(), stand.operator
    assert ours.ask('setm 1 stp') == ['OK']
    assert ours.ask('setv 1 150') == ['OK']
    assert ours.ask('stepu 1 c') == ['OK']
    operator.command('sawtooth', (300.0, 1000.0, 0.0), tag='somebody')
    assert ours.ask('stepw 1') == ['OK']
    assert operator.wait_for_event('sawtooth', 0)['result'] == 'ABORTED'
    assert ours.ask('geto 1') == ['voltage = 0.000000 V', 'OK']
    operator.switch('enable_amplifier', False)
    while ours.ask('getm 1')[0] != 'mode = gnd':
        pass
    assert ours.ask('stepu 1 1') == ['Axis in wrong mode', 'ERROR']


def test_what_makes_no_sense_is_an_error(console: Callable[[], Console]):
    ours = console()
    for line, why in (
        ('getv 2', 'Wrong axis type'),
        ('getv x', 'Wrong axis type'),
        ('jump 1', 'Unknown command, or wrong number of parameters'),
        ('setv 1', 'Unknown command, or wrong number of parameters'),
        ('setv 1 151', '151 is not a number from 0 to 150'),
        ('setv 1 nan', 'nan is not a number from 0 to 150'),
        ('setpu 1 5 5', '256 values needed'),
        ('stepu 1 10', 'Axis in wrong mode'),
        ('settu 1 3', 'Unknown command, or wrong number of parameters'),
    ):
        assert ours.ask(line) == [why, 'ERROR']
    assert ours.ask('settu 1 off') == ['OK']


def say_on(console: Console) -> None:
    """Send a line without an end."""
    while True:
        console.socket.sendall(b'x' * 1_000_000)


def test_the_console_stands_long_lines_and_heaps_of_queries(console: Callable[[], Console]):
    first, second = console(), console()
    queries = b'getf 1\r\n' * QUERIES
    sending = threading.Thread(target=first.socket.sendall, args=(queries,), daemon=True)
    sending.start()
    assert second.ask('getv 1') == ['voltage = 30.000000 V', 'OK']
    assert set(first.hear(2 * QUERIES)) == {'frequency = 1000 Hz', 'OK'}
    sending.join(GIVE_UP_S)
    with pytest.raises(ConnectionError):
        say_on(console())
    assert second.ask('getv 1') == ['voltage = 30.000000 V', 'OK']


def free_port() -> int:
    """Return a port that no one has, for TCP and UDP."""
    with socket.socket() as one, socket.socket(type=socket.SOCK_DGRAM) as two:
        one.bind(('127.0.0.1', 0))
        two.bind(one.getsockname())
        return int(one.getsockname()[1])


class Motor:
    """A process with ophyd's EpicsMotor ``m``, which tells what expressions come to."""

    def __init__(self, process: Any) -> None:
        self.process = process

    def tell(self, line: str) -> Any:
        """Run a line; return what it printed as JSON."""
        self.process.stdin.write(f'{line}\n')
        self.process.stdin.flush()
        answer = self.process.stdout.readline()
        assert answer, self.process.stderr.read()
        return json.loads(answer)

    def move(self, target_um: float) -> list[Any]:
        """Move; return success, position and alarm severity at the end."""
        return list(self.tell(f'move({target_um})'))


@pytest.fixture
def motor(door: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> Iterator[Motor]:
    """Give the motor of a record that hears its drive."""
    here = {'EPICS_CA_ADDR_LIST': '127.0.0.1', 'EPICS_CA_AUTO_ADDR_LIST': 'NO'}
    for name, port in zip(('SERVER', 'REPEATER'), (free_port(), free_port()), strict=True):
        here[f'EPICS_CA_{name}_PORT'] = str(port)
    for name, value in here.items():
        monkeypatch.setenv(name, value)
    door('epics_motor.py', 'serves stand:x')
    with start_process(
        [sys.executable, '-c', OPHYD],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        yield Motor(process)
        process.kill()


OPHYD = """\
import json, sys, time
import caproto.sync.client
import ophyd

ophyd.set_cl('caproto')
m = ophyd.EpicsMotor('stand:x', name='m')
m.wait_for_connection(timeout=60)

def wait(condition):
    end_s = time.monotonic() + 60
    while not condition() and time.monotonic() < end_s:
        time.sleep(0.01)
    return bool(condition())

def move(target, act=lambda: None):
    try:
        status = m.move(target, wait=False, timeout=60)
    except ophyd.utils.LimitError as error:
        return str(error)
    act()
    status_done = wait(lambda: status.done)
    return status_done and status.success, m.position, int(m.user_readback.alarm_severity)

def put_nan(field):
    try:
        caproto.sync.client.write(f'stand:x.{field}', float('nan'), notify=True)
    except caproto.CaprotoError:
        return None
    return 'taken'

wait(lambda: m.user_readback.alarm_severity == 0)
setpoints = []
m.user_setpoint.subscribe(lambda value, **_: setpoints.append(value))
for line in sys.stdin:
    print(json.dumps(eval(line)), flush=True)
"""


def test_ophyd_moves_the_drive_as_a_motor_record_of_epics(stand: Any, motor: Motor):
    operator = stand.operator
    assert motor.tell('m.egu') == 'um'
    for target_um in (2.0, -1.5, -1.5):  # the last is there already
        success, position_um, severity = motor.move(target_um)
        assert (success, severity) == (True, 0)
        assert position_um == pytest.approx(target_um, abs=TOLERANCE_UM)
    operator.spin_until(lambda: len(operator.events) == 3, 'three events')
    assert {(e['command'], e['result']) for e in operator.events} == {('position', 'DONE')}
    motor.tell('m.high_limit_travel.put(3.0, wait=True)')
    assert motor.tell('wait(lambda: m.limits == (0.0, 3.0))')
    heard = motor.tell('len(setpoints)')
    motor.tell('m.low_limit_travel.put(-3.0, wait=True)')
    assert motor.tell('wait(lambda: m.limits == (-3.0, 3.0))')
    assert motor.tell('len(setpoints)') == heard  # or its old limits came with it, at times last
    assert stand.drive.get_parameter('limits.soft_min').value == pytest.approx(-3e-6)
    assert stand.drive.get_parameter('limits.soft_max').value == pytest.approx(3e-6)
    assert 'outside of range' in motor.tell('move(5.0)')
    motor.tell('m.velocity.put(0.5, wait=True)')
    assert stand.drive.get_parameter('closed_loop.velocity').value == pytest.approx(5e-7)
    under_way = 'wait(lambda: m.position > -1.4)'
    _, position_um, severity = motor.tell(f'move(2.5, lambda: ({under_way}, m.stop()))')
    assert -1.5 < position_um < 2.4
    assert severity == 0
    assert motor.tell('wait(lambda: not m.moving and m.user_setpoint.get() < 2.4)')
    assert motor.tell('put_nan("OFF"), put_nan("TWV"), m.user_offset.get()') == [None, None, 0.0]
    motor.tell('m.set_current_position(0.0)')
    assert motor.tell('wait(lambda: abs(m.position) < 0.1)')
    assert motor.tell('m.user_offset.get()') == pytest.approx(-position_um, abs=0.1)


def test_what_a_drive_cannot_do_fails_the_move_of_ophyd(stand: Any, motor: Motor):
    operator = stand.operator
    assert operator.set_parameter('fault.runner_stuck', True).successful
    assert motor.move(5.0)[0] is False
    assert motor.tell('wait(lambda: m.user_readback.alarm_severity > 0)')
    assert operator.wait_for_event('position', 0)['result'] == 'END_STOP_REACHED'
    assert motor.tell('m.high_limit_switch.get()') == 1
    assert operator.trigger('clear_faults').success
    assert motor.move(1.0)[0]
    assert motor.tell('m.high_limit_switch.get()') == 0
    operator.change_state('deactivate')
    assert motor.tell('wait(lambda: m.user_readback.alarm_severity == 3)')
    assert motor.move(2.0)[0] is False
    operator.change_state('activate')
    assert motor.tell('wait(lambda: m.user_readback.alarm_severity == 0)')
    assert motor.move(2.0)[0]


@pytest.mark.parametrize('name', ['anc300.py', 'epics_motor.py'])
def test_a_door_is_short_and_needs_nothing_of_this_package(name: str):
    text = (EXAMPLES / name).read_text(encoding='utf-8')
    assert len(text.splitlines()) <= 300
    assert 'import stickslip_ros' not in text
    assert 'from stickslip_ros' not in text
