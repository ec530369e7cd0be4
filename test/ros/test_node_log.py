# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The node says what it is and does, who is in its way, and what it refuses; each line once."""

import re
from collections.abc import Callable
from typing import Any

import pytest
from geometry_msgs.msg import PointStamped
from rclpy.lifecycle import LifecyclePublisher
from reports import WARN, Reports, values_of
from std_msgs.msg import Float64

import stickslip_ros
from stickslip_ros.interface.topics import COMMAND

pytestmark = pytest.mark.usefixtures('frequent_diagnostics')

REFUSED_V = 1e6
FLOOD = 100


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
    reports, left = Reports(stand), [failures]
    reports.await_part('connections')
    publish = LifecyclePublisher.publish

    def fail(publisher: Any, message: Any) -> None:
        if left[0] and publisher.topic_name == '/force':
            left[0] -= 1
            raise RuntimeError('cannot publish data')
        publish(publisher, message)

    monkeypatch.setattr(LifecyclePublisher, 'publish', fail)
    stand.operator.spin_until(lambda: not left[0], 'the failures')
    part = reports.next('connections')
    assert values_of(part).get('force not sent', '0') == str(unsent)
    why = f'{unsent} messages not sent since the configuration' if unsent else 'compatible'
    assert part.message == why
    stand.operator.command('steps', 1)
    assert stand.operator.wait_for_event('steps', 0)['result'] == 'DONE'


def test_a_second_drive_of_the_same_name_is_told(start_drive: Callable, log: Log):
    stand = start_drive()
    reports = Reports(stand)
    start_drive(wait=False)
    named = 'another node is called /stickslip_drive too'
    published = '/stickslip_drive publishes on /position too'
    part = reports.await_part('connections', lambda part: published in part.message)
    assert (part.level, named in part.message) == (WARN, True)
    assert log.lines('WARN', named)


def test_another_publisher_of_a_reading_is_told_once_and_while_it_is_there(stand: Any, log: Log):
    reports, node = Reports(stand), stand.operator.node
    publisher = node.create_publisher(PointStamped, 'position', 1)
    words = '/operator publishes on /position too'
    reports.await_part('connections', lambda part: words in part.message)
    assert words in reports.next('connections').message
    assert len(log.lines('WARN', words)) == 1
    node.destroy_publisher(publisher)
    reports.heard.clear()
    reports.await_part('connections', lambda part: part.message == 'compatible')


def test_refusals_are_told_once_a_report_and_name(stand: Any, log: Log):
    operator, reports = stand.operator, Reports(stand)
    for number in range(1, FLOOD + 1):
        operator.command('voltage', REFUSED_V)
        operator.spin_until(lambda: len(operator.events) == number, 'events')  # noqa: B023
    reports.await_part('drive', lambda part: values_of(part)['commands_refused'] == str(FLOOD))
    told = log.lines('WARN', 'voltage (command', "above the amplifier's 300 V")
    assert 1 <= len(told) <= 1 + len(reports.parts('drive'))
    assert len(told) < FLOOD / 3
