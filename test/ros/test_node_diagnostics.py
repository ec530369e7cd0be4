# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Diagnostics say whether the drive keeps up, what it refused, and whether the disk keeps up."""

import shutil
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import WrenchStamped
from rclpy.event_handler import QoSSubscriptionEventType
from rclpy.time import Time

from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.reports import Status
from stickslip_ros.interface.cdr import pack_float64
from stickslip_ros.interface.feed import Packed
from stickslip_ros.kernels import cache as kernel_cache
from stickslip_ros.kernels.cache import Folders
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.run import RunWriter
from stickslip_ros.ros.diagnostics import LagLog, pace_status, recorder_status
from stickslip_ros.runtime.orders import NEXT_BLOCK, Order
from stickslip_ros.runtime.pacing import PaceReport
from stickslip_ros.runtime.session import Session
from stickslip_ros.testing import stamp_ns

pytestmark = pytest.mark.usefixtures('frequent_diagnostics')

TIME_KEYS = {
    'real_time_factor', 'real_time_factor_wanted', 'lateness_mean_us', 'lateness_p99_us',
    'lateness_max_us', 'ticks', 'overruns', 'overruns_total', 'lag_s', 'behind_s',
    'stamps_behind_s', 'paused',
}  # fmt: skip
RECORDER_KEYS = {
    'file', 'written', 'queued', 'queue_peak', 'queue_length', 'dropped', 'length_s', 'size_bytes',
}  # fmt: skip


def next_parts(stand: Any, heard: list[Any], *, ticked: bool = False) -> dict[str, Any]:
    """
    Wait for diagnostics that are made from now on; give the parts by the last word of their names.

    If ``ticked``, of a time in which there was a tick: on a busy machine not each report has one.

    """
    now_ns = stand.drive.get_clock().now().nanoseconds
    parts: dict[str, Any] = {}

    def look() -> bool:
        for each in (each for each in heard if stamp_ns(each) >= now_ns):
            parts.update({part.name.rpartition(': ')[2]: part for part in each.status})
        whole = parts.keys() > {'faults'}  # they come alone too
        return whole and not (ticked and values_of(parts['time'])['ticks'] == '0')

    stand.operator.spin_until(look, 'diagnostics')
    return parts


def values_of(part: Any) -> dict[str, str]:
    return {pair.key: pair.value for pair in part.values}


def test_diagnostics_carry_time_drive_and_recorder(stand: Any):
    parts = next_parts(stand, stand.operator.listen('diagnostics'))
    assert parts.keys() == {'time', 'drive', 'faults', 'recorder', 'connections'}
    assert values_of(parts['time']).keys() == TIME_KEYS
    drive = values_of(parts['drive'])
    counts = ('commands_refused', 'messages_refused', 'messages_lost', 'setpoints_replaced')
    assert drive.keys() == {'simulated_s', 'status', 'last_refused', *counts}
    assert drive['last_refused'] == ''
    assert {drive[count] for count in counts} == {'0'}
    assert int(drive['status'], 16) == Status.SENSOR_PRESENT | Status.AMPLIFIER_ENABLED
    assert (parts['drive'].level, parts['drive'].message) == (DiagnosticStatus.OK, 'running')
    recorder = parts['recorder']
    assert (recorder.level, recorder.message) == (DiagnosticStatus.OK, 'not recording')
    assert {part.hardware_id for part in parts.values()} == {'virtual /stickslip_drive'}


def test_the_recorder_is_accounted_for_while_it_records(stand: Any, tmp_path: Any):
    heard = stand.operator.listen('diagnostics')
    path = stand.operator.set_recording(wanted=True).message
    part = next_parts(stand, heard)['recorder']
    assert (part.level, part.message) == (DiagnosticStatus.OK, 'recording')
    values = values_of(part)
    assert values.keys() == RECORDER_KEYS
    assert values['file'] == path
    assert values['dropped'] == '0'
    assert 0.0 < float(values['length_s']) <= stand.drive.session.bench.time_ns * 1e-9
    assert 0 < int(values['size_bytes']) <= stand.drive.session.worker.writer.recorder.size_bytes
    assert int(values['queue_peak']) >= int(values['queued']) >= 0


@pytest.mark.parametrize('queue', [10])
def test_messages_that_the_recorder_lost_are_an_error(start_drive: Callable, queue: int):
    stand = start_drive({'record.queue_length': queue, 'sim.real_time_factor': 1000.0})
    heard = stand.operator.listen('diagnostics')
    assert stand.operator.set_recording(wanted=True).success
    part = next_parts(stand, heard)['recorder']
    stand.operator.spin_until(
        lambda: stand.drive.session.worker.writer.recorder.dropped > 0, 'a lost message'
    )
    part = next_parts(stand, heard)['recorder']
    assert part.level == DiagnosticStatus.ERROR
    values = values_of(part)
    assert part.message == f'{values["dropped"]} dropped'
    assert ' of /position' in values['losses']


def test_a_refusal_is_a_warning_once(stand: Any):
    heard = stand.operator.listen('diagnostics')
    stand.operator.command('voltage', 1e6)
    stand.operator.wait_for_event('voltage', 0)

    def told() -> list[Any]:
        parts = [part for each in heard for part in each.status if part.name.endswith(': drive')]
        return [part for part in parts if values_of(part)['commands_refused'] == '1']

    stand.operator.spin_until(lambda: len(told()) >= 3, 'three reports of it')
    first, *later = told()
    assert first.level == DiagnosticStatus.WARN
    assert first.message == '1 refused since the last report'
    assert {(each.level, each.message) for each in later} == {(DiagnosticStatus.OK, 'running')}


PACE = PaceReport(
    real_time_factor=1.0,
    lateness_mean_s=0.0,
    lateness_p99_s=0.0,
    lateness_max_s=0.0,
    overruns=0,
    ticks=1000,
    overruns_total=0,
    lag_s=0.0,
    given_up_s=0.0,
    behind_s=0.0,
    missing_s=0.0,
)


@pytest.mark.parametrize(
    ('changes', 'level'),
    [
        ({}, DiagnosticStatus.OK),
        ({'overruns': 1}, DiagnosticStatus.WARN),
        ({'real_time_factor': 0.91, 'missing_s': 0.09}, DiagnosticStatus.OK),
        ({'real_time_factor': 0.89, 'missing_s': 0.11}, DiagnosticStatus.ERROR),
        ({'real_time_factor': 0.89, 'missing_s': 0.11, 'overruns': 9}, DiagnosticStatus.ERROR),
        ({'real_time_factor': 0.0, 'missing_s': 0.002}, DiagnosticStatus.OK),  # a block on its way
        ({'lag_s': 0.49}, DiagnosticStatus.OK),
        ({'lag_s': 0.51}, DiagnosticStatus.WARN),
        ({'lateness_max_s': 0.51}, DiagnosticStatus.WARN),  # a lag that is over
        ({'given_up_s': 70.0}, DiagnosticStatus.WARN),
    ],
    ids=str,
)
def test_the_level_of_a_pace(changes: dict[str, Any], level: bytes):
    session = Session(Parameters(), lambda _: None)
    status = pace_status('x', replace(PACE, **changes), session)
    assert status.level == level


def test_stamps_that_are_far_from_the_time_of_the_system_are_a_warning(monkeypatch):
    session, now_ns = Session(Parameters(), lambda _: None), time.time_ns()
    monkeypatch.setattr(time, 'time_ns', lambda: now_ns)
    said = []
    late: dict[str, Any] = {'overruns': 9}
    for behind_s, changes in ((0.49, {}), (113.0, {}), (-2.0, {}), (113.0, late)):
        session.worker.time_origin_ns = now_ns - round(behind_s * 1e9)
        status = pace_status('x', replace(PACE, **changes), session)
        said.append((status.level, status.message))
    ok, warn = DiagnosticStatus.OK, DiagnosticStatus.WARN
    hint = 'more than 0.5 s; deactivate and activate the node'
    behind = f"stamps are 113.0 s behind the system's time, {hint}"
    assert said == [
        (ok, 'in time'),
        (warn, behind),
        (warn, f"stamps are 2.0 s ahead of the system's time, {hint}"),
        (warn, f'9 of 1000 ticks late; {behind}'),
    ]


def test_a_lag_that_is_made_up_needs_no_remedy_and_one_that_is_given_up_says_its_limit(
    monkeypatch: pytest.MonkeyPatch,
):
    session, now_ns = Session(Parameters(), lambda _: None), time.time_ns()
    monkeypatch.setattr(time, 'time_ns', lambda: now_ns)
    session.worker.time_origin_ns = now_ns - 5 * 10**9
    lag = pace_status('x', replace(PACE, lag_s=5.0), session)
    assert lag.message == '5.0 s late, made up at 1 times real time'
    session.worker.time_origin_ns = now_ns - 70 * 10**9
    lost = pace_status('x', replace(PACE, given_up_s=70.0, behind_s=70.0), session)
    assert lost.message == (
        '70.0 s of simulated time given up: the lag was above sim.lag_max, 60 s; '
        "stamps are 70.0 s behind the system's time, more than 0.5 s; "
        'deactivate and activate the node'
    )


def test_a_lag_is_logged_when_it_begins_doubles_is_made_up_faster_and_is_made_up():
    log = LagLog()

    def news(lag_s: float, pace: float = 0.95, **more: Any) -> tuple[bool, str]:
        return log.news(replace(PACE, lag_s=lag_s, real_time_factor=pace, **more), 1.0)

    silent, warning = (False, ''), (True, '')
    assert [news(each) for each in (0.4, 0.6, 1.0, 1.3, 2.5)] == [
        silent,
        warning,
        silent,
        warning,
        silent,
    ]
    assert [news(lag_s, 2.5) for lag_s in (1.8, 0.7, 0.3)] == [warning, silent, silent]
    assert news(0.0, 1.4) == (False, 'a lag of 2.5 s is made up, at up to 2.5 times real time')
    assert news(0.0) == silent
    # A lag between two reports, and one that is given up:
    over = True, 'a lag of 0.8 s is made up, at up to 1.2 times real time'
    assert news(0.0, 1.2, lateness_max_s=0.8) == over
    assert [news(0.0, lateness_max_s=70.0, given_up_s=70.0), news(0.0)] == [warning, silent]


def told_by(log: LagLog, seconds: int, *reports: dict[str, Any]) -> list[int]:
    """Give the seconds at which a log has a line, of reports that repeat."""
    said = (log.news(replace(PACE, **reports[s % len(reports)]), 1.0) for s in range(seconds))
    return [second for second, (warns, made_up) in enumerate(said) if warns or made_up]


def test_on_a_host_that_stays_too_slow_the_log_says_so_once_and_at_each_doubling():
    growing = [{'lag_s': 0.8 * s, 'real_time_factor': 0.2} for s in range(75)]
    lost = {'lateness_max_s': 60.0, 'given_up_s': 60.0, 'real_time_factor': 0.2}
    told = told_by(LagLog(), 10_000, *growing, lost)
    assert told == [1, 3, 7, 15, 31, 63, *(76 * 2**n - 1 for n in range(8))]
    made_up = [{'lag_s': 0.7, 'real_time_factor': 0.5}, {'real_time_factor': 1.4}, {}]
    told = told_by(LagLog(), 3000, *made_up)
    assert told == [3 * (2**n - 1) + after for n in range(10) for after in (0, 1)]


def test_a_host_that_stays_too_busy_is_told_a_pace_at_which_nothing_is_late(monkeypatch):
    session, now_ns = Session(Parameters(), lambda _: None), time.time_ns()
    monkeypatch.setattr(time, 'time_ns', lambda: now_ns)
    session.worker.time_origin_ns = now_ns - 421 * 10**9
    slow = replace(PACE, real_time_factor=0.17, missing_s=0.83, given_up_s=60.0)
    assert pace_status('x', slow, session).message.endswith(
        "stamps are 421.0 s behind the system's time, more than 0.5 s; this host is too busy: "
        'deactivate the node, set sim.real_time_factor to 0.0 (as fast as it goes), activate it'
    )
    session = Session(Parameters().updated({'sim.real_time_factor': 0.0}), lambda _: None)
    session.fix_time_origin(follows_clock=False)
    slow = replace(slow, missing_s=0.0, given_up_s=0.0)
    assert pace_status('x', slow, session).message == 'in time'


def test_what_is_behind_because_of_a_preload_on_its_way_says_so_once():
    session = Session(Parameters(), lambda _: None)
    late = replace(PACE, real_time_factor=0.5, missing_s=0.5)
    session.worker.advance([Order(NEXT_BLOCK, Request('preload', (0.6,)))])
    messages = [pace_status('x', late, session).message for _ in range(2)]
    slow = 'real-time factor 0.5000 instead of 1'
    assert messages == [f'{slow}; a preload on its way steps every spring', slow]


def test_a_queue_more_than_half_full_is_a_warning(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    parameters = Parameters().updated(
        {'record.queue_length': 10, 'record.directory': str(tmp_path)}
    )
    session = Session(parameters, lambda _: None)
    with RunWriter(tmp_path / 'run.mcap', parameters) as writer:
        session.worker.writer = writer
        levels = []
        for queued in range(1, 11):
            monkeypatch.setattr(Recorder, 'queued', queued)
            levels.append(recorder_status('x', session).level)
        ok, warn = DiagnosticStatus.OK, DiagnosticStatus.WARN
        assert levels == [ok] * 5 + [warn] * 5


@pytest.mark.parametrize(
    ('free_bytes', 'keep_parts', 'told'),
    [
        (10**13, 0, 'recording'),
        (7_190_000_000, 0, 'recording; at 2 MB/s the disk is full in 60 min'),
        (7_210_000_000, 0, 'recording'),
        (10**8, 3, 'recording'),
    ],
)
def test_a_disk_that_will_be_full_within_an_hour_is_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, free_bytes: int, keep_parts: int, told: str
):
    values = {'record.keep_parts': keep_parts, 'record.split_duration': 60.0}
    parameters = Parameters().updated(values)
    session = Session(parameters, lambda _: None)
    with RunWriter(tmp_path / 'run.mcap', parameters) as writer:
        session.worker.writer = writer
        writer.begun_ns = session.bench.time_ns - 10 * 10**9
        monkeypatch.setattr(Recorder, 'size_bytes', 20_000_000)
        usage = SimpleNamespace(free=free_bytes)
        monkeypatch.setattr(shutil, 'disk_usage', lambda _: usage)
        status = recorder_status('x', session)
    assert status.message == told
    assert status.level == (DiagnosticStatus.OK if told == 'recording' else DiagnosticStatus.WARN)


def test_a_recorder_that_may_wait_for_the_disk_is_not_warned_about(tmp_path: Path, unshared: None):
    parameters = Parameters().updated({'record.queue_length': 10})
    session = Session(parameters, lambda _: None)
    with RunWriter(tmp_path / 'run.mcap', parameters, wait=True) as writer:
        session.worker.writer = writer
        for _ in range(10):
            writer.write(Packed('voltage', 0, pack_float64(0.0)))
        assert writer.recorder.queued == 10
        assert recorder_status('x', session).level == DiagnosticStatus.OK


def last_of_the_drive(stand: Any, heard: list[Any], level: bytes, start: str) -> Any:
    """Wait until the drive is reported at a level with a message that starts so."""

    def found() -> list[Any]:
        parts = [part for each in heard for part in each.status if part.name.endswith(': drive')]
        return [each for each in parts if each.level == level and each.message.startswith(start)]

    stand.operator.spin_until(lambda: bool(found()), f'the drive at {level!r}, {start}')
    return found()[-1]


def test_a_node_without_a_drive_that_runs_says_its_state_and_what_was_refused(manual: Any):
    heard = manual.operator.listen('diagnostics')
    ok, error = DiagnosticStatus.OK, DiagnosticStatus.ERROR
    assert last_of_the_drive(manual, heard, ok, 'unconfigured').message == 'unconfigured'
    manual.operator.change_state('configure')
    assert last_of_the_drive(manual, heard, ok, 'inactive').message == 'inactive'
    manual.operator.set_parameter('record.on_start', value=True)
    manual.operator.set_parameter('record.name', '../run')
    assert not manual.operator.change_state('activate')
    last_of_the_drive(manual, heard, error, "inactive; not activated: record.name '../run' is not")
    manual.operator.set_parameter('record.on_start', value=False)
    heard.clear()
    assert manual.operator.change_state('activate')
    last_of_the_drive(manual, heard, ok, 'running')


def test_a_node_says_how_far_the_compilation_of_its_kernels_is(manual, monkeypatch):
    monkeypatch.setattr(kernel_cache, 'cache_folders', lambda: Folders((), None))
    monkeypatch.setattr(
        'stickslip_ros.runtime.remaining.compile_for',
        lambda _: entry_point(lambda value: 2.0 * value)(1.5),
    )
    heard = manual.operator.listen('diagnostics')
    last_of_the_drive(manual, heard, DiagnosticStatus.OK, 'unconfigured')  # it is heard
    manual.operator.change_state('configure')
    last_of_the_drive(manual, heard, DiagnosticStatus.WARN, 'compiling kernels, once: 0 of ')


def test_each_subscription_counts_what_dds_reports_as_lost(start_drive: Callable):
    stand = start_drive({'sim.publish_clock': True})
    heard = stand.operator.listen('diagnostics')
    taken = {each.topic_name: each for each in stand.drive.subscriptions}
    assert {'/command/load', '/command/steps'} <= taken.keys()
    for subscription in taken.values():
        [loses] = [
            handler.callback
            for handler in subscription.event_handlers
            if handler.event_type == QoSSubscriptionEventType.RCL_SUBSCRIPTION_MESSAGE_LOST
        ]
        if subscription.topic_name == '/command/load':
            loses(SimpleNamespace(total_count_change=2))
            loses(SimpleNamespace(total_count_change=3))
    parts = next_parts(stand, heard)
    assert values_of(parts['drive'])['messages_lost'] == '5'
    told = parts['connections']
    assert values_of(told) == {'command/load lost': '5'}
    lost = '5 messages lost on their way since the configuration'
    assert (told.level, told.message) == (DiagnosticStatus.WARN, lost)
    for transition in ('deactivate', 'cleanup', 'configure', 'activate'):
        assert stand.operator.change_state(transition)
    assert next_parts(stand, heard)['connections'].level == DiagnosticStatus.OK


def test_the_age_of_commands_is_that_of_their_stamps(stand: Any):
    heard = stand.operator.listen('diagnostics')
    stand.operator.command('load', 0.0)  # has no stamp
    assert values_of(next_parts(stand, heard)['connections']) == {}
    now_ns, load = time.time_ns(), WrenchStamped()
    for age_s in (1, 2, 9):
        load.header.stamp = Time(nanoseconds=now_ns - age_s * 10**9).to_msg()
        stand.operator.send('load', load)
    told: dict[str, str] = {}

    def look() -> bool:
        for part in (part for each in heard for part in each.status):
            if part.name.endswith(': connections'):
                told.update(values_of(part))
        return float(told.get('command_age_max_s', 0.0)) >= 9.0

    stand.operator.spin_until(look, 'ages')
    since_s = 1e-9 * (time.time_ns() - now_ns)
    assert 9.0 <= float(told['command_age_max_s']) <= 9.0 + since_s
    assert values_of(next_parts(stand, heard)['connections']) == {}
