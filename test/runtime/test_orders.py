# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Orders are taken when they are due, in the order in which they came, or that of their topics."""

from stickslip_ros.instrument.commands import Request
from stickslip_ros.runtime.orders import AT_ONCE, NEXT_BLOCK, Order, Orders

BLOCK_NS = 1_000_000


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


def test_orders_of_one_tick_are_carried_out_in_the_order_in_which_they_came():
    orders = Orders(by_topic=False)
    requests = [Request('voltage', (float(n),)) for n in range(20)]
    for number, request in enumerate(requests):
        orders.put(Order((number % 2) * 5 * BLOCK_NS, request=request))
    taken = [order.request for due_ns in (0, 5 * BLOCK_NS) for order in orders.take(due_ns)]
    assert taken == requests[::2] + requests[1::2]


def test_without_all_kernels_preload_friction_and_faults_wait_and_nothing_else_does():
    kernels: list[str] = []
    orders = Orders(by_topic=False, has_kernels=lambda: bool(kernels))
    fault, friction = (('fault.dead_foot', 1),), (('contact.friction', 0.2),)
    held = [
        orders.put(Order(AT_ONCE, request=Request('fault', settings=fault))),
        orders.put(Order(AT_ONCE, request=Request('parameters', settings=friction))),
        orders.put(Order(NEXT_BLOCK, request=Request('preload', (0.4,)))),
    ]
    mass = Request('parameters', settings=(('runner.mass', 0.012),))
    free = [
        orders.put(Order(NEXT_BLOCK, request=each)) for each in (Request('voltage', (1.0,)), mass)
    ]
    assert orders.wait_for_kernels
    assert orders.take(0) == free
    assert orders.take(0) == []
    kernels.append('all')
    assert not orders.wait_for_kernels
    assert orders.take(0) == held
