# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Whether a block may begin depends on pause, grants and commands, and on nothing else."""

import math

import pytest
from rclpy.serialization import serialize_message
from std_msgs.msg import Float64MultiArray

from stickslip_ros.errors import OutOfRange, StickSlipError, WrongKind
from stickslip_ros.interface.requests import pack_command
from stickslip_ros.interface.topics import COMMAND_TOPICS
from stickslip_ros.runtime.orders import Grant, TimeControl, read_grant

BLOCK_NS = 1_000_000
[GRANT] = [topic for topic in COMMAND_TOPICS if topic.request == 'grant']


def test_without_lockstep_only_a_pause_holds_the_drive():
    control = TimeControl(BLOCK_NS, lockstep=False)
    assert control.allows(0)
    control.is_paused = True
    assert not control.allows(0)
    assert control.is_granted(0)


@pytest.mark.parametrize(
    ('grants', 'received', 'blocks'),
    [
        ([], 0, 0),
        ([(BLOCK_NS - 1, 0)], 0, 0),
        ([(BLOCK_NS, 0)], 0, 1),
        ([(BLOCK_NS - 1, 0), (BLOCK_NS, 0), (3 * BLOCK_NS, 0)], 0, 3),
        ([(BLOCK_NS, 2)], 1, 0),
        ([(BLOCK_NS, 2)], 2, 1),
        ([(BLOCK_NS, 2)], 3, 1),
        ([(2 * BLOCK_NS, 0), (2 * BLOCK_NS, 0), (BLOCK_NS, 7)], 0, 2),
        ([(BLOCK_NS, 1), (BLOCK_NS, 0)], 0, 1),
    ],
    ids=[
        'none', 'short of a block', 'one', 'longer ones', 'a command is missing', 'all came',
        'more came', 'twice, and an older one late', 'the newest of the same time',
    ],
)  # fmt: skip
def test_in_lockstep_a_block_needs_a_grant_and_its_commands(grants, received, blocks):
    control = TimeControl(BLOCK_NS, lockstep=True)
    for grant in grants:
        control.extend(Grant(*grant))
    control.received = received
    assert [control.allows(n * BLOCK_NS) for n in range(4)] == [n < blocks for n in range(4)]


def test_a_pause_holds_a_granted_block():
    control = TimeControl(BLOCK_NS, lockstep=True)
    control.extend(Grant(BLOCK_NS, 0))
    control.is_paused = True
    assert control.is_granted(0)
    assert not control.allows(0)


def test_an_activation_begins_with_nothing_granted_received_or_paused():
    control = TimeControl(BLOCK_NS, lockstep=True)
    control.extend(Grant(BLOCK_NS, 1))
    control.received += 1
    control.is_paused = True
    control.restart()
    assert not control.is_paused
    assert not control.is_granted(0)
    control.extend(Grant(BLOCK_NS, 1))
    assert not control.is_granted(0)


def test_a_grant_is_rounded_to_nanoseconds():
    assert read_grant(GRANT, pack_command(GRANT, (0.1 + 0.2, 3))) == Grant(300_000_000, 3)


@pytest.mark.parametrize(
    ('values', 'refusal', 'message'),
    [
        ([], WrongKind, 'grant [] is not a list of 2 finite numbers; send [until s, commands]'),
        ([1.0], WrongKind, 'is not a list of 2'),
        ([1.0, 2.0, 3.0, 4.0], WrongKind, 'is not a list of 2'),
        ([math.nan, 0.0], WrongKind, 'is not a list of 2 finite'),
        ([math.inf, 0.0], WrongKind, 'is not a list of 2 finite'),
        ([1.0, math.nan], WrongKind, 'is not a list of 2 finite'),
        ([-1e-9, 0.0], OutOfRange, 'grant until -1e-09 s is below 0 s; give a simulated time'),
        ([1.0, -1.0], OutOfRange, 'grant commands -1 is not a count; give the number'),
        ([1.0, 0.5], OutOfRange, 'grant commands 0.5 is not a count'),
    ],
)
def test_a_bad_grant_is_refused(values: list[float], refusal: type[StickSlipError], message: str):
    with pytest.raises(refusal) as caught:
        read_grant(GRANT, bytes(serialize_message(Float64MultiArray(data=values))))
    assert message in str(caught.value)
