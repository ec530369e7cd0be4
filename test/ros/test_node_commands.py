# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Every command topic is obeyed, and refused with an event."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import pytest
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray, MultiArrayDimension

from stickslip_ros.instrument.reports import Status, read_event
from stickslip_ros.interface.topics import COMMAND_TOPICS
from stickslip_ros.ros.client import DriveClient, Handshake

COMMANDS: Mapping[str, tuple[Any, Any]] = {
    'voltage': (301.0, 100.0),
    'sawtooth': ((300.0, 0.0, 5.0), (300.0, 1000.0, 5.0)),
    'steps': (-(2**31), -5),
    'jog': (math.nan, 0.0),
    'waveform': (((0.0, 0.0), (0.0, 100.0)), ((0.0, 0.0), (0.005, 100.0))),
    'position': (math.inf, 10e-9),
    'joint': (math.inf, 10e-9),
    'load': (11.0, -0.1),
    'preload': (0.0, 0.502),
}
"""A bad and a good value of each command."""


def test_a_bad_command_is_refused_and_the_next_good_one_is_carried_out(start_drive: Callable):
    names = {topic.request for topic in COMMAND_TOPICS if topic.request != 'grant'}
    assert COMMANDS.keys() == names
    operator = start_drive({'load_cell.contact': 'absent', 'runner.damping': 5.0}).operator
    for number, (name, (bad, good)) in enumerate(COMMANDS.items()):
        operator.command(name, bad)
        refused = operator.wait_for_event(name, 2 * number)
        assert (refused['number'], refused['result']) == (2 * number + 1, 'INVALID_PARAMETER')
        assert '; ' in refused['message']  # what is wrong; the hint
        operator.spin_until(lambda: bool(operator.status & Status.REFUSED), 'the refusal')
        operator.command(name, good)
        done = operator.wait_for_event(name, 2 * number + 1)
        assert (done['number'], done['result']) == (2 * number + 2, 'DONE')
        operator.spin_until(lambda: not operator.status & Status.REFUSED, 'the good command')


def test_a_waveform_repeats_over_topics_until_the_next_at_the_end_of_a_cycle(stand: Any):
    operator, bench = stand.operator, stand.drive.session.bench
    hill = ((0.0, 0.0), (0.01, 100.0), (0.0137, 0.0))
    operator.command('waveform', hill, cycles=0)
    operator.spin_until(lambda: operator.status & Status.STREAMING, 'the waveform')
    later_ns = bench.time_ns + 100_000_000
    operator.spin_until(lambda: bench.time_ns > later_ns, 'seven cycles')
    operator.command('waveform', ((0.0, 0.0), (0.003, 40.0)))
    first, last = (operator.wait_for_event('waveform', n) for n in range(2))
    assert (first['result'], last['result']) == ('ABORTED', 'DONE')
    assert first['steps'] >= 7
    assert bench.state.voltage_v == pytest.approx(40.0)


def test_a_waveform_with_a_layout_of_other_columns_is_refused_and_counted(stand: Any):
    operator = stand.operator
    message = Float64MultiArray(data=[0.0] * 6)
    message.layout.dim = [MultiArrayDimension(size=2), MultiArrayDimension(size=3)]
    operator.send('waveform', message)
    operator.spin_until(lambda: stand.drive.guard.count == 1, 'the refusal')
    assert operator.events == []
    operator.command('voltage', 10.0)
    assert operator.wait_for_event('voltage', 0)['number'] == 1


def test_each_of_two_senders_finds_its_own_event_by_its_tag(stand: Any):
    operator, heard = stand.operator, list[Any]()
    other = DriveClient(Node('other', context=stand.context), commands=('sawtooth',))
    other.subscribe('event', lambda message: heard.append(read_event(message.data)))
    operator.add_node(other.node)
    handshake = Handshake(other.node, other.drive)
    operator.spin_until(lambda: other.is_connected() and handshake.is_done(), 'the other sender')
    operator.command('sawtooth', (300.0, 1000.0, 0.0), tag='left')
    operator.spin_until(lambda: bool(operator.status & Status.MOVING), 'the first saw-tooth')
    other.command('sawtooth', (300.0, -1000.0, 7.0), tag='right')
    operator.spin_until(lambda: len(heard) == 2, 'both events')
    told = [(each['tag'], each['result'], each['number']) for each in heard]
    assert told == [('left', 'ABORTED', 1), ('right', 'DONE', 2)]
    assert heard[1]['steps'] == 7
