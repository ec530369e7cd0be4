"""Whether a block may begin depends on pause, grants and commands, and on nothing else."""

import math

import pytest
from rclpy.serialization import serialize_message
from std_msgs.msg import Float64MultiArray

from stickslip_ros.errors import OutOfRange, StickSlipError, WrongKind
from stickslip_ros.instrument.commands import Request
from stickslip_ros.recording.requests import pack_command
from stickslip_ros.recording.topics import COMMANDS
from stickslip_ros.ros.orders import AT_ONCE, NEXT_BLOCK, Order, Orders
from stickslip_ros.ros.permit import Grant, Permit, read_grant

BLOCK_NS = 1_000_000
[GRANT] = [topic for topic in COMMANDS if topic.request == 'grant']


def test_without_lockstep_only_a_pause_holds_the_drive():
    permit = Permit(BLOCK_NS, lockstep=False)
    assert permit.allows(0)
    permit.is_paused = True
    assert not permit.allows(0)
    assert permit.is_granted(0)


def test_in_lockstep_even_the_first_block_needs_a_grant():
    permit = Permit(BLOCK_NS, lockstep=True)
    assert not permit.allows(0)
    permit.extend(Grant(BLOCK_NS - 1, 0))
    assert not permit.allows(0)
    permit.extend(Grant(BLOCK_NS, 0))
    assert permit.allows(0)
    assert not permit.allows(BLOCK_NS)
    permit.extend(Grant(3 * BLOCK_NS, 0))
    assert [permit.allows(n * BLOCK_NS) for n in range(4)] == [True, True, True, False]


def test_a_grant_waits_for_its_commands():
    permit = Permit(BLOCK_NS, lockstep=True)
    permit.extend(Grant(BLOCK_NS, 2))
    permit.count_command()
    assert not permit.allows(0)
    permit.count_command()
    assert permit.allows(0)
    permit.count_command()
    assert permit.allows(0)


def test_a_grant_may_come_twice_and_an_older_one_late():
    permit = Permit(BLOCK_NS, lockstep=True)
    for grant in (Grant(2 * BLOCK_NS, 0), Grant(2 * BLOCK_NS, 0), Grant(BLOCK_NS, 7)):
        permit.extend(grant)
        assert permit.allows(BLOCK_NS)
        assert not permit.allows(2 * BLOCK_NS)


def test_the_newest_grant_of_the_same_time_counts():
    permit = Permit(BLOCK_NS, lockstep=True)
    permit.extend(Grant(BLOCK_NS, 1))
    permit.extend(Grant(BLOCK_NS, 0))
    assert permit.allows(0)


def test_a_pause_holds_a_granted_block():
    permit = Permit(BLOCK_NS, lockstep=True)
    permit.extend(Grant(BLOCK_NS, 0))
    permit.is_paused = True
    assert permit.is_granted(0)
    assert not permit.allows(0)


def test_an_activation_begins_with_nothing_granted_received_or_paused():
    permit = Permit(BLOCK_NS, lockstep=True)
    permit.extend(Grant(BLOCK_NS, 1))
    permit.count_command()
    permit.is_paused = True
    permit.restart()
    assert not permit.is_paused
    assert not permit.is_granted(0)
    permit.extend(Grant(BLOCK_NS, 1))
    assert not permit.is_granted(0)


def test_in_lockstep_the_orders_of_a_block_are_sorted_by_topic_and_stay_in_order_within():
    orders = Orders(by_topic=True)
    came = [
        Request('preload', (1.0,)),
        Request('voltage', (1.0,)),
        Request('stop'),
        Request('position', (1.0, 0.0, 0.0)),
        Request('voltage', (2.0,)),
        Request('steps', (1.0,)),
    ]
    for request in came:
        orders.put(Order(NEXT_BLOCK, request=request))
    taken = [order.request for order in orders.take(0)]
    assert taken == [came[2], came[1], came[4], came[5], came[3], came[0]]


def test_what_is_urgent_is_taken_alone_and_the_rest_keeps_its_order():
    orders = Orders(by_topic=False)
    first = orders.put(Order(NEXT_BLOCK, request=Request('voltage', (1.0,))))
    urgent = orders.put(Order(AT_ONCE, request=Request('stop')))
    later = orders.put(Order(BLOCK_NS, request=Request('voltage', (2.0,))))
    assert orders.take(AT_ONCE) == [urgent]
    assert orders.take(AT_ONCE) == []
    assert orders.take(0) == [first]
    assert orders.take(BLOCK_NS) == [later]


def test_a_withdrawn_order_is_not_taken():
    orders = Orders(by_topic=False)
    assert orders.put(Order(NEXT_BLOCK, request=Request('stop'))).reply.cancel()
    assert orders.take(0) == []


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
