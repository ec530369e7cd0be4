# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A session answers every order, whatever happens to it."""

import time
from array import array
from collections.abc import Iterator

import pytest
from waiting import GIVE_UP_S

from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.instrument.commands import WAVEFORM_ROWS_MAX, Request
from stickslip_ros.interface.feed import Packed
from stickslip_ros.parameters import Parameters
from stickslip_ros.runtime.orders import Grant
from stickslip_ros.runtime.session import Session, require

FAR_NS = 10**15
MS = 1_000_000
RUN_NS = 60 * MS


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


def bytes_of(changes: dict[str, object]) -> tuple[bytes, float]:
    """Return what a drive publishes in the time of RUN_NS, and its blocks per wake-up."""
    published: list[bytes] = []

    def publish(packed: Packed) -> None:
        if packed.time_ns <= RUN_NS:
            published.append(packed.key.encode() + packed.data)

    session = Session(Parameters().updated({'sim.time_origin': 'zero', **changes}), publish)
    session.submit(Request('sawtooth', (100.0, 1000.0, 20.0)), due_ns=7_000_000)
    end = session.submit(Request('stop'), due_ns=RUN_NS)
    session.start()
    session.extend_grant(Grant(2 * RUN_NS, 0))
    end.result(GIVE_UP_S)
    session.stop()
    blocks = session.bench.time_ns / MS
    return b''.join(published), blocks / session.pacer.report().ticks


@pytest.mark.parametrize('lockstep', [False, True])
def test_several_blocks_a_wake_up_give_the_same_bytes(lockstep: bool):
    each, one = bytes_of({'sim.lockstep': lockstep})
    at_once, ten = bytes_of({'sim.lockstep': lockstep, 'sim.wake': 0.01})
    assert at_once == each
    assert len(each) > RUN_NS // MS
    assert one < 1.1
    assert ten > 8.0


def test_stamps_of_a_wake_up_do_not_lie_in_the_future():
    parameters = Parameters().updated({'sim.wake': 0.05})
    ahead_ns: list[int] = []

    def publish(packed: Packed) -> None:
        stamp_ns = drive.worker.time_origin_ns + packed.time_ns
        ahead_ns.append(stamp_ns - time.time_ns())

    drive = Session(parameters, publish)
    drive.fix_time_origin(follows_clock=False)
    drive.start()
    drive.submit(Request('stop'), due_ns=100 * MS).result(GIVE_UP_S)
    drive.stop()
    assert max(ahead_ns) < 0


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
