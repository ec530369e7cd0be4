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


def test_in_lockstep_even_the_first_block_needs_a_grant():
    control = TimeControl(BLOCK_NS, lockstep=True)
    assert not control.allows(0)
    control.extend(Grant(BLOCK_NS - 1, 0))
    assert not control.allows(0)
    control.extend(Grant(BLOCK_NS, 0))
    assert control.allows(0)
    assert not control.allows(BLOCK_NS)
    control.extend(Grant(3 * BLOCK_NS, 0))
    assert [control.allows(n * BLOCK_NS) for n in range(4)] == [True, True, True, False]


def test_a_grant_waits_for_its_commands():
    control = TimeControl(BLOCK_NS, lockstep=True)
    control.extend(Grant(BLOCK_NS, 2))
    control.received += 1
    assert not control.allows(0)
    control.received += 1
    assert control.allows(0)
    control.received += 1
    assert control.allows(0)


def test_a_grant_may_come_twice_and_an_older_one_late():
    control = TimeControl(BLOCK_NS, lockstep=True)
    for grant in (Grant(2 * BLOCK_NS, 0), Grant(2 * BLOCK_NS, 0), Grant(BLOCK_NS, 7)):
        control.extend(grant)
        assert control.allows(BLOCK_NS)
        assert not control.allows(2 * BLOCK_NS)


def test_the_newest_grant_of_the_same_time_counts():
    control = TimeControl(BLOCK_NS, lockstep=True)
    control.extend(Grant(BLOCK_NS, 1))
    control.extend(Grant(BLOCK_NS, 0))
    assert control.allows(0)


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
