# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The node says what it is and does, who is in its way, and what it refuses; each line once."""

import re
from collections.abc import Callable
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PointStamped
from rclpy.lifecycle import LifecyclePublisher
from std_msgs.msg import Float64

import stickslip_ros
from stickslip_ros.interface.topics import COMMAND
from stickslip_ros.testing import stamp_ns

pytestmark = pytest.mark.usefixtures('frequent_diagnostics')

REFUSED_V = 1e6
FLOOD = 300


class Log:
    """What stands on stderr, collected while a test looks."""

    def __init__(self, capfd: pytest.CaptureFixture[str]) -> None:
        self._capfd = capfd
        self._text = ''

    def lines(self, *words: str) -> list[str]:
        """Give the lines so far with all of these words."""
        self._text += self._capfd.readouterr().err
        return [each for each in self._text.splitlines() if all(word in each for word in words)]


@pytest.fixture
def log(capfd: pytest.CaptureFixture[str]) -> Log:
    return Log(capfd)


def connections(stand: Any) -> Callable[..., DiagnosticStatus]:
    """
    Listen to diagnostics; give a function that gives the newest part on connections.

    With a time, by the clock of the drive, it is one that was made later, or an empty one.

    """
    heard = stand.operator.listen('diagnostics')
    empty = DiagnosticStatus()

    def newest(since_ns: int = 0) -> DiagnosticStatus:
        late = (each for each in reversed(heard) if stamp_ns(each) >= since_ns)
        parts = (part for array in late for part in array.status)
        return next((part for part in parts if part.name.endswith(': connections')), empty)

    return newest


def now_ns(stand: Any) -> int:
    """Give the time by the clock of the drive."""
    return int(stand.drive.get_clock().now().nanoseconds)


@pytest.mark.usefixtures('default_blocks')
def test_it_says_who_it_is_and_a_command_that_is_true(start_drive: Callable, log: Log):
    stand = start_drive(namespace='/left', remaps=('command/voltage:=volts',), wait=False)
    [start] = log.lines(f'stickslip_ros {stickslip_ros.__version__}, ROS 2 ')
    assert f': /left/stickslip_drive, domain {stand.domain}, discovery LOCALHOST' in start
    [active] = log.lines('active: 1 kHz blocks, in real time, preload 0.5 N; try: ')
    command = r'ros2 topic pub --once (\S+) std_msgs/msg/Float64 "\{data: (\S+)\}"'
    topic, voltage_v = re.search(command, active).groups()
    node = stand.operator.node
    publisher = node.create_publisher(Float64, topic, COMMAND.depth)
    stand.operator.spin_until(lambda: publisher.get_subscription_count() == 1, topic)
    stand.operator.shake_hands()
    publisher.publish(Float64(data=float(voltage_v)))
    assert stand.operator.wait_for_event('voltage', 0)['result'] == 'DONE'


def test_in_lockstep_it_says_what_it_waits_for(start_drive: Callable, log: Log):
    start_drive({'sim.lockstep': True}, namespace='/left', wait=False)
    assert log.lines(
        'active: 1 kHz blocks, in lockstep,', 'waits for grants on /left/command/grant'
    )


def test_a_fault_of_the_program_in_a_transition_is_told(start_drive, log, monkeypatch):
    def fail(*_: Any) -> None:
        raise RuntimeError('a fault of the program')

    monkeypatch.setattr('stickslip_ros.ros.node.read_parameters', fail)
    start_drive(wait=False)
    assert log.lines('configure has failed')
    assert log.lines('RuntimeError: a fault of the program')


@pytest.mark.parametrize(('failures', 'unsent'), [(1, 0), (2, 1)])
def test_a_message_that_the_network_does_not_take_is_counted_and_ends_nothing(
    start_drive: Callable, monkeypatch: pytest.MonkeyPatch, failures: int, unsent: int
):
    stand = start_drive()
    newest = connections(stand)
    stand.operator.spin_until(lambda: bool(newest().name), 'diagnostics')
    left = [failures]
    publish = LifecyclePublisher.publish

    def fail(publisher: Any, message: Any) -> None:
        if left[0] and publisher.topic_name == '/force':
            left[0] -= 1
            raise RuntimeError('cannot publish data')
        publish(publisher, message)

    monkeypatch.setattr(LifecyclePublisher, 'publish', fail)
    stand.operator.spin_until(lambda: not left[0], 'the failures')
    failed_ns = now_ns(stand)
    stand.operator.spin_until(lambda: bool(newest(failed_ns).name), 'the next diagnostics')
    told = {each.key: each.value for each in newest().values}
    assert told.get('force not sent', '0') == str(unsent)
    assert newest().message == (
        f'{unsent} messages not sent since the configuration' if unsent else 'compatible'
    )
    stand.operator.command('steps', 1)
    assert stand.operator.wait_for_event('steps', 0)['result'] == 'DONE'


def test_a_second_drive_of_the_same_name_is_told(start_drive: Callable, log: Log):
    stand = start_drive()
    newest = connections(stand)
    start_drive(wait=False)
    named = 'another node is called /stickslip_drive too'
    published = '/stickslip_drive publishes on /position too'
    stand.operator.spin_until(
        lambda: named in newest().message and published in newest().message, 'the warning'
    )
    assert newest().level == DiagnosticStatus.WARN
    assert log.lines('WARN', named)


def test_another_publisher_of_a_reading_is_told_once_and_while_it_is_there(stand: Any, log: Log):
    newest = connections(stand)
    node = stand.operator.node
    publisher = node.create_publisher(PointStamped, 'position', 1)
    words = '/operator publishes on /position too'
    stand.operator.spin_until(lambda: words in newest().message, 'the warning')
    before = newest()
    stand.operator.spin_until(lambda: newest() is not before, 'the next diagnostics')
    assert len(log.lines('WARN', words)) == 1
    node.destroy_publisher(publisher)
    stand.operator.spin_until(lambda: newest().message == 'compatible', 'the end of the warning')


def test_refusals_are_told_and_those_that_are_held_back_are_counted(stand: Any, log: Log):
    operator = stand.operator
    for number in range(1, FLOOD + 1):
        operator.command('voltage', REFUSED_V)
        if number % (COMMAND.depth // 2) == 0:
            operator.spin_until(lambda: len(operator.events) == number, 'events')  # noqa: B023

    def told() -> int:
        first = log.lines('WARN', 'voltage (command', "above the amplifier's 300 V")
        more = [re.search(r'voltage: (\d+) more refused', each) for each in log.lines('more')]
        return len(first) + sum(int(each[1]) for each in more if each)

    operator.spin_until(lambda: told() >= FLOOD, 'the last line')
    assert told() == FLOOD
    assert len(log.lines('WARN', 'voltage')) < FLOOD / 3
