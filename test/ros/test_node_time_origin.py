# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Stamps, the clock and recordings begin at the time origin; whatever else has a time does not."""

import itertools
import statistics
import time
from collections.abc import Callable, Mapping
from typing import Any

import pytest

from stickslip_ros.interface.feed import Packed
from stickslip_ros.parameters import Parameters, Scalar
from stickslip_ros.recording.run_file import TIME_ORIGIN
from stickslip_ros.ros.connections import Connections
from stickslip_ros.runtime.pacing import Pacer
from stickslip_ros.runtime.session import has_system_time
from stickslip_ros.testing import LockstepClient, deep_queues, stamp_ns

pytestmark = pytest.mark.usefixtures('default_blocks')

BLOCK_NS = Parameters().block_ns
SYSTEM = {'sim.time_origin': 'system'}
DUE_S = 1e-3
"""Below the time of an activation; two clocks of a host are read within a microsecond."""
HOUR_NS = 3600 * 10**9
"""Far above what any drive of a test simulates, far below the time of day."""


def told_origin_ns(stand: Any) -> int:
    return int(stand.operator.info[TIME_ORIGIN])


def restarted(stand: Any, *transitions: str, **changes: Scalar) -> int:
    """Lead the drive through transitions, change parameters before the last; give its origin."""
    operator = stand.operator
    *before, last = transitions
    assert all(operator.change_state(each) for each in before)
    for name, value in changes.items():
        assert operator.set_parameter(name.replace('__', '.'), value).successful
    operator.info = {}
    assert operator.change_state(last)
    operator.spin_until(lambda: bool(operator.info), 'info')
    return told_origin_ns(stand)


@pytest.mark.parametrize(
    ('values', 'follows_clock', 'is_system'),
    [
        ({}, False, True),
        ({}, True, False),
        ({'sim.publish_clock': True}, False, False),
        ({'sim.lockstep': True}, False, False),
        ({'sim.real_time_factor': 0.0}, False, False),
        ({'sim.real_time_factor': 2.0}, False, False),
        ({'sim.time_origin': 'zero'}, False, False),
        ({**SYSTEM, 'sim.publish_clock': True}, False, True),
        ({**SYSTEM, 'sim.lockstep': True}, True, True),
    ],
)
def test_stamps_are_of_the_system_in_real_time_without_a_clock_or_where_asked_for(
    values: Mapping[str, Scalar], follows_clock: bool, is_system: bool
):
    parameters = Parameters().updated(values)
    assert has_system_time(parameters, follows_clock=follows_clock) is is_system


def test_stamps_begin_with_the_activation_and_never_lie_in_the_future(start_drive: Callable):
    before_ns = time.time_ns()
    stand = start_drive(deep_queues('position', 'force'))
    position, force = stand.operator.listen('position'), stand.operator.listen('force')
    for heard in (position, force):
        stand.operator.spin_until(lambda each=heard: len(each) >= 20, 'readings')
    origin_ns = told_origin_ns(stand)
    assert before_ns <= origin_ns + BLOCK_NS <= time.time_ns()
    for heard in (position, force):
        stamps = [stamp_ns(each) for each in heard]
        assert stamps[-1] <= time.time_ns()
        assert (stamps[0] - origin_ns) % BLOCK_NS == 0
        assert {b - a for a, b in itertools.pairwise(stamps)} == {BLOCK_NS}


@pytest.mark.parametrize('records', [False, True])
def test_a_reading_is_due_at_its_stamp_however_long_the_activation_takes(
    start_drive: Callable, monkeypatch: pytest.MonkeyPatch, records: bool
):
    """Judged by the deadline of its wake-up, so that a busy host is not late."""
    pacers: list[Pacer] = []
    due: list[tuple[int, float]] = []
    start, publish = Pacer.start, Connections.publish

    def note_pacer(pacer: Pacer, *moment: Any) -> None:
        pacers.append(pacer)
        start(pacer, *moment)

    def note_deadline(connections: Connections, packed: Packed) -> None:
        if packed.key == 'position':
            lead_s = max(time.time() - time.monotonic() for _ in range(5))
            due.append((packed.time_ns, pacers[-1]._deadline_s + lead_s))
        publish(connections, packed)

    monkeypatch.setattr(Pacer, 'start', note_pacer)
    monkeypatch.setattr(Connections, 'publish', note_deadline)
    stand = start_drive({'record.on_start': records})
    for _ in range(2):
        due.clear()
        stand.operator.spin_until(lambda: len(due) >= 100, 'readings')
        origin_ns = stand.drive.session.worker.time_origin_ns
        late_s = [at_s - (origin_ns + time_ns) * 1e-9 for time_ns, at_s in due[1:]]
        assert abs(statistics.median(late_s)) < DUE_S
        assert stand.drive.session.pacer.report().behind_s == 0.0
        restarted(stand, 'deactivate', 'activate', record__on_start=False)


def test_the_clock_carries_the_origin_too(start_drive: Callable):
    queues = deep_queues('clock', 'position')
    stand = start_drive({**SYSTEM, **queues, 'sim.publish_clock': True})
    clock, position = stand.operator.listen('clock'), stand.operator.listen('position')
    stand.operator.spin_until(lambda: len(clock) >= 20, 'the clock')
    times = [each.clock.sec * 10**9 + each.clock.nanosec for each in clock]
    stand.operator.spin_until(
        lambda: bool(position) and stamp_ns(position[-1]) >= times[-1], 'a position'
    )
    stamps = {stamp_ns(each) for each in position}
    assert {each for each in times if each >= min(stamps)} <= stamps
    assert times[0] - told_origin_ns(stand) < HOUR_NS


def test_each_activation_begins_with_stamps_of_now(start_drive: Callable):
    stand = start_drive()
    operator, bench = stand.operator, stand.drive.session.bench
    assert operator.change_state('deactivate')
    stopped_ns, between_ns = bench.time_ns, time.time_ns()
    again_ns = restarted(stand, 'activate')
    assert stand.drive.session.bench is bench  # the same drive goes on
    assert again_ns + stopped_ns + BLOCK_NS >= between_ns
    between_ns = time.time_ns()
    rebuilt_ns = restarted(stand, 'deactivate', 'activate', runner__damping=5.0)
    assert rebuilt_ns + BLOCK_NS >= between_ns  # another drive: its time begins anew
    for transition in ('deactivate', 'cleanup', 'configure'):
        assert operator.change_state(transition)
    waited_ns = time.time_ns()
    assert restarted(stand, 'activate') + BLOCK_NS >= waited_ns
    assert restarted(stand, 'deactivate', 'activate', sim__time_origin='zero') == 0


def test_a_position_from_before_the_activation_that_comes_late_keeps_its_time(start_drive):
    stand = start_drive()
    operator = stand.operator
    heard = operator.listen('position')
    operator.spin_until(lambda: len(heard) > 1, 'positions')
    late, late_ns = heard[-1], operator.simulated_ns(heard[-1])
    assert operator.change_state('deactivate')
    between_ns = time.time_ns()
    assert operator.change_state('activate')
    operator.spin_until(lambda: bool(operator.info), 'info')
    assert operator.simulated_ns(late) == late_ns
    operator.spin_until(lambda: stamp_ns(heard[-1]) > between_ns, 'a position')
    newest = heard[-1]
    assert operator.simulated_ns(newest) == stamp_ns(newest) - told_origin_ns(stand)


@pytest.mark.usefixtures('frequent_diagnostics')
def test_stamps_that_do_not_follow_the_system_lag_nothing(start_drive: Callable):
    operator = start_drive({'sim.time_origin': 'zero'}).operator
    title = 'stickslip_drive: time'
    operator.spin_until(lambda: any(title in each for each in operator.diagnostics), 'a report')
    [part, *_] = [each[title] for each in operator.diagnostics if title in each]
    assert 'behind_s' in part
    assert 'stamps_behind_s' not in part


def test_a_restored_drive_goes_on_in_simulated_time_from_now(start_drive: Callable):
    saved = start_drive()
    answer = saved.operator.trigger('save_checkpoint')
    saved_ns = saved.drive.session.bench.time_ns
    saved.close()
    before_ns = time.time_ns()
    stand = start_drive({'sim.checkpoint': answer.message})
    operator = stand.operator
    assert min(operator.positions) > 0
    start_ns = min(operator.positions) - BLOCK_NS
    assert start_ns <= saved_ns + (time.time_ns() - before_ns)
    assert before_ns <= told_origin_ns(stand) + start_ns + BLOCK_NS <= time.time_ns()


def test_a_controller_in_lockstep_sees_simulated_time_whatever_the_origin(start_drive: Callable):
    stand = start_drive({**SYSTEM, 'sim.lockstep': True}, wait=False)
    seen_s: list[float] = []

    def answer(time_s: float, _: float) -> list[tuple[str, float]]:
        seen_s.append(time_s)
        return [('voltage', 10.0)]

    client = LockstepClient(stand.operator.node, 1e-3, answer)
    stand.operator.spin_until(lambda: len(seen_s) >= 5, 'five blocks')
    stand.operator.spin_until(lambda: bool(stand.operator.info), 'the info of the operator')
    client.close()
    assert seen_s[:5] == pytest.approx([1e-3, 2e-3, 3e-3, 4e-3, 5e-3], rel=1e-12)
    assert told_origin_ns(stand) > HOUR_NS
