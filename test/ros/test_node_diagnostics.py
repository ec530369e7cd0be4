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
from geometry_msgs.msg import WrenchStamped
from rclpy.event_handler import QoSSubscriptionEventType
from rclpy.time import Time
from reports import ERROR, OK, WARN, Reports, values_of

from stickslip_ros.instrument.reports import Status
from stickslip_ros.kernels import cache as kernel_cache
from stickslip_ros.kernels.cache import Folders
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.run import RunWriter
from stickslip_ros.ros.diagnostics import Doubling, lag_to_log_s, pace_status, recorder_status
from stickslip_ros.runtime.pacing import PaceReport
from stickslip_ros.runtime.session import Session

pytestmark = pytest.mark.usefixtures('frequent_diagnostics')

TIME_KEYS = {
    'real_time_factor', 'real_time_factor_wanted', 'lateness_mean_us', 'lateness_p99_us',
    'lateness_max_us', 'ticks', 'overruns', 'overruns_total', 'lag_s', 'behind_s',
    'stamps_behind_s', 'paused',
}  # fmt: skip
RECORDER_KEYS = {
    'file', 'written', 'queued', 'queue_peak', 'queue_length', 'dropped', 'length_s', 'size_bytes',
}  # fmt: skip


def test_a_running_drive_accounts_for_time_commands_and_its_recorder(stand: Any):
    reports = Reports(stand)
    reports.next('time')
    parts = {part.name.rpartition(': ')[2]: part for part in reports.heard[-1].status}
    assert parts.keys() == {'time', 'drive', 'faults', 'recorder', 'connections'}
    assert {part.hardware_id for part in parts.values()} == {'virtual /stickslip_drive'}
    assert values_of(parts['time']).keys() == TIME_KEYS
    drive = values_of(parts['drive'])
    assert int(drive.pop('status'), 16) == Status.SENSOR_PRESENT | Status.AMPLIFIER_ENABLED
    assert float(drive.pop('simulated_s')) > 0.0
    counts = ('commands_refused', 'messages_refused', 'messages_lost', 'setpoints_replaced')
    assert drive == {**dict.fromkeys(counts, '0'), 'last_refused': ''}
    assert (parts['drive'].level, parts['drive'].message) == (OK, 'running')
    assert (parts['recorder'].level, parts['recorder'].message) == (OK, 'not recording')
    path = stand.operator.set_recording(wanted=True).message
    part = reports.next('recorder')
    assert (part.level, part.message) == (OK, 'recording')
    values = values_of(part)
    assert values.keys() == RECORDER_KEYS
    assert (values['file'], values['dropped']) == (path, '0')
    assert 0.0 < float(values['length_s']) <= stand.drive.session.bench.time_ns * 1e-9
    assert 0 < int(values['size_bytes']) <= stand.drive.session.worker.writer.recorder.size_bytes
    assert int(values['queue_peak']) >= int(values['queued']) >= 0


def test_a_refusal_is_a_warning_once(stand: Any):
    reports = Reports(stand)
    stand.operator.command('voltage', 1e6)

    def told() -> list[Any]:
        parts = reports.parts('drive')
        return [part for part in parts if values_of(part)['commands_refused'] == '1']

    stand.operator.spin_until(lambda: len(told()) >= 3, 'three reports of it')
    first, *later = told()
    assert (first.level, first.message) == (WARN, '1 refused since the last report')
    assert {(each.level, each.message) for each in later} == {(OK, 'running')}


NONE: dict[str, Any] = dict.fromkeys(PaceReport.__annotations__, 0)
PACE = PaceReport(**{**NONE, 'real_time_factor': 1.0, 'ticks': 1000})
SLOW = {'real_time_factor': 0.89, 'missing_s': 0.11}
LATE = {'overruns': 9}
MEND = (
    "s %s the system's time, more than 0.5 s; deactivate and activate the node; if this host "
    'stays too busy, set sim.real_time_factor to 0.0 (as fast as it goes) in between'
)
GIVEN_UP = '70.0 s of simulated time given up: the lag was above sim.lag_max, 60 s; '


@pytest.mark.parametrize(
    ('changes', 'stamps_behind_s', 'level', 'message'),
    [
        ({}, 0.0, OK, 'in time'),
        ({'real_time_factor': 0.91, 'missing_s': 0.09}, 0.0, OK, 'in time'),
        ({'real_time_factor': 0.0, 'missing_s': 0.002}, 0.0, OK, 'in time'),  # a block on its way
        ({'lag_s': 0.49}, 0.0, OK, 'in time'),
        (LATE, 0.0, WARN, '9 of 1000 ticks late'),
        (SLOW, 0.0, ERROR, 'real-time factor 0.8900 instead of 1'),
        (SLOW | {'overruns': 9}, 0.0, ERROR, 'real-time factor 0.8900 instead of 1'),
        ({'lag_s': 0.51}, 0.0, WARN, '0.5 s late, made up at 1 times real time; stamps'),
        ({'lateness_max_s': 0.51}, 0.0, WARN, '0.5 s late, made up at 1 times'),  # it is over
        ({'lag_s': 5.0}, 5.0, WARN, '5.0 s late, made up at 1 times real time'),
        ({}, 0.49, OK, 'in time'),
        ({}, 113.0, WARN, f'stamps are 113.0 {MEND % "behind"}'),
        ({}, -2.0, WARN, f'stamps are 2.0 {MEND % "ahead of"}'),
        (LATE, 113.0, WARN, '9 of 1000 ticks late; stamps are '),
        ({'given_up_s': 70.0, 'behind_s': 70.0}, 70.0, WARN, f'{GIVEN_UP}stamps are 70.0 '),
    ],
)
def test_the_status_of_a_pace(monkeypatch, changes, stamps_behind_s, level, message):
    session, now_ns = Session(Parameters(), lambda _: None), time.time_ns()
    monkeypatch.setattr(time, 'time_ns', lambda: now_ns)
    session.worker.time_origin_ns = now_ns - round(stamps_behind_s * 1e9)
    status = pace_status('x', replace(PACE, **changes), session)
    assert (status.level, status.message[: len(message)]) == (level, message)


def test_a_lag_is_news_when_it_begins_and_when_all_lags_together_have_doubled():
    lags: list[dict[str, Any]] = [{'lag_s': 0.4}, {'lag_s': 0.6}, {'lateness_max_s': 0.8}, {}]
    lags += [{'lag_s': 0.7}, {'given_up_s': 60.0, 'lateness_max_s': 60.0}]
    late_s = [lag_to_log_s(replace(PACE, **each)) for each in lags]
    assert late_s == [0.0, 0.6, 0.8, 0.0, 0.7, 60.0]
    log = Doubling()
    assert [log.is_news(sum(late_s[:count])) for count in range(1, 7)] == [
        False, True, True, False, False, True,
    ]  # fmt: skip
    assert not log.is_news(0.0)  # another recording
    assert log.is_news(0.1)


def test_a_queue_more_than_half_full_is_a_warning_unless_the_recorder_may_wait(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    parameters = Parameters().updated({'record.queue_length': 10})
    session = Session(parameters, lambda _: None)
    for name, wait, full in (('run', False, WARN), ('waits', True, OK)):
        with RunWriter(tmp_path / f'{name}.mcap', parameters, wait=wait) as writer:
            session.worker.writer = writer
            levels = []
            with monkeypatch.context() as patch:
                for queued in range(1, 11):
                    patch.setattr(Recorder, 'queued', queued)
                    levels.append(recorder_status('x', session).level)
            assert levels == [OK] * 5 + [full] * 5


@pytest.mark.parametrize(
    ('free_bytes', 'keep_parts', 'told'),
    [
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
        monkeypatch.setattr(shutil, 'disk_usage', lambda _: SimpleNamespace(free=free_bytes))
        status = recorder_status('x', session)
    assert (status.level, status.message) == (OK if told == 'recording' else WARN, told)


def test_a_node_without_a_drive_that_runs_says_its_state_and_what_was_refused(manual: Any):
    operator, reports = manual.operator, Reports(manual)
    for state in ('unconfigured', 'inactive'):
        reports.await_part('drive', lambda part: (part.level, part.message) == (OK, state))  # noqa: B023
        operator.change_state('configure')
    operator.set_parameter('record.on_start', value=True)
    operator.set_parameter('record.name', '../run')
    assert not operator.change_state('activate')
    why = "inactive; not activated: record.name '../run' is not"
    reports.await_part('drive', lambda part: part.level == ERROR and part.message.startswith(why))
    operator.set_parameter('record.on_start', value=False)
    assert operator.change_state('activate')
    assert (reports.next('drive').level, reports.next('drive').message) == (OK, 'running')


def test_a_node_says_how_far_the_compilation_of_its_kernels_is(manual, monkeypatch):
    monkeypatch.setattr(kernel_cache, 'cache_folders', lambda: Folders((), None))
    monkeypatch.setattr(
        'stickslip_ros.runtime.remaining.compile_for',
        lambda _: entry_point(lambda value: 2.0 * value)(1.5),
    )
    reports = Reports(manual)
    reports.await_part('drive')  # it is heard
    manual.operator.change_state('configure')
    part = reports.await_part('drive', lambda part: part.level == WARN)
    assert part.message.startswith('compiling kernels, once: 0 of ')


def test_each_subscription_counts_what_dds_reports_as_lost(start_drive: Callable):
    stand = start_drive({'sim.publish_clock': True})
    reports = Reports(stand)
    taken = {each.topic_name: each for each in stand.drive.subscriptions}
    assert {'/command/load', '/command/steps'} <= taken.keys()
    for name, subscription in taken.items():
        [loses] = [
            handler.callback
            for handler in subscription.event_handlers
            if handler.event_type == QoSSubscriptionEventType.RCL_SUBSCRIPTION_MESSAGE_LOST
        ]
        for count in (2, 3) if name == '/command/load' else ():
            loses(SimpleNamespace(total_count_change=count))
    assert values_of(reports.next('drive'))['messages_lost'] == '5'
    told = reports.next('connections')
    assert values_of(told) == {'command/load lost': '5'}
    lost = '5 messages lost on their way since the configuration'
    assert (told.level, told.message) == (WARN, lost)
    for transition in ('deactivate', 'cleanup', 'configure', 'activate'):
        assert stand.operator.change_state(transition)
    assert reports.next('connections').level == OK


def test_the_age_of_commands_is_that_of_their_stamps(stand: Any):
    reports = Reports(stand)
    stand.operator.command('load', 0.0)  # has no stamp
    assert values_of(reports.next('connections')) == {}
    now_ns, load = time.time_ns(), WrenchStamped()
    for age_s in (1, 2, 9):
        load.header.stamp = Time(nanoseconds=now_ns - age_s * 10**9).to_msg()
        stand.operator.send('load', load)

    def largest_s(part: Any) -> float:
        return float(values_of(part).get('command_age_max_s', 0.0))

    told_s = largest_s(reports.await_part('connections', lambda part: largest_s(part) >= 9.0))
    assert 9.0 <= told_s <= 9.0 + 1e-9 * (time.time_ns() - now_ns)
    assert values_of(reports.next('connections')) == {}
