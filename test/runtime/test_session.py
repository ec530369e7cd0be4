# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A session answers every order, whatever happens to it."""

from array import array
from collections.abc import Iterator

import pytest
from waiting import GIVE_UP_S

from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.instrument.commands import WAVEFORM_ROWS_MAX, Request
from stickslip_ros.interface.feed import Packed
from stickslip_ros.parameters import Parameters
from stickslip_ros.runtime.session import Session, require

FAR_NS = 10**15


@pytest.fixture
def session() -> Iterator[Session]:
    running = Session(Parameters(), lambda packed: None)
    running.start()
    yield running
    running.stop()


def test_an_order_is_carried_out_at_the_first_tick_from_its_time_on(session: Session):
    session.submit(Request('voltage', (30.0,)), due_ns=5_000_000).result(GIVE_UP_S)
    assert session.bench.time_ns >= 6_000_000
    assert session.failure is None


def test_a_withdrawn_order_is_never_carried_out_and_does_no_harm():
    session = Session(Parameters(), lambda packed: None)
    withdrawn = session.submit(Request('voltage', (30.0,)), due_ns=10_000_000)
    later = session.submit(Request('stop'), due_ns=20_000_000)
    assert withdrawn.cancel()
    session.start()
    later.result(GIVE_UP_S)
    assert session.failure is None
    assert session.bench.state.voltage_v == 0.0
    session.stop()


@pytest.mark.filterwarnings('ignore::pytest.PytestUnhandledThreadExceptionWarning')
def test_when_the_drive_fails_every_waiting_order_is_refused_with_the_reason():
    def publish(packed: Packed) -> None:
        if packed.time_ns >= 3_000_000:
            raise OSError('the network is gone')

    session = Session(Parameters(), publish)
    waiting = session.submit(Request('stop'), due_ns=FAR_NS)
    session.start()
    with pytest.raises(StickSlipError, match='the drive has stopped: the network is gone'):
        waiting.result(GIVE_UP_S)
    with pytest.raises(StickSlipError, match='configure the node anew'):
        require(session, 'active')
    session.stop()


def test_stopping_does_not_wait_for_a_slow_pace():
    session = Session(Parameters().updated({'sim.real_time_factor': 1e-6}), lambda packed: None)
    first_tick = session.submit(Request('stop'))
    session.start()
    first_tick.result(GIVE_UP_S)
    thread = session._thread
    session.stop()
    assert thread is not None
    assert not thread.is_alive()


def test_commands_that_wait_while_time_is_held_take_bounded_memory(session: Session):
    longest = Request('waveform', array('d', bytes(8 * 2 * WAVEFORM_ROWS_MAX)))
    session.set_paused(wanted=True)

    def fill() -> None:
        for _ in range(10):
            session.receive(longest)
        with pytest.raises(OutOfRange, match='waiting for the next block; advance simulated time'):
            session.receive(longest)

    fill()
    session.step().result(GIVE_UP_S)
    fill()
    session.receive(None)  # what made no sense takes no memory
