"""Diagnostics say whether the drive keeps up, what it refused, and whether the disk keeps up."""

from collections.abc import Callable
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticStatus

TIME_KEYS = {
    'real_time_factor',
    'lateness_mean_us',
    'lateness_p99_us',
    'lateness_max_us',
    'ticks',
    'overruns',
    'overruns_total',
    'behind_s',
}
RECORDER_KEYS = {'file', 'written', 'queued', 'queue_peak', 'dropped'}
ROUNDING = 1e-4
"""The factor is printed with four digits behind the point."""


def next_parts(stand: Any, heard: list[Any]) -> dict[str, Any]:
    """Wait for diagnostics from now on; give the parts by the last word of their names."""
    seen = len(heard)
    stand.operator.spin_until(lambda: len(heard) > seen, 'diagnostics')
    return {part.name.rpartition(': ')[2]: part for part in heard[-1].status}


def values_of(part: Any) -> dict[str, str]:
    return {pair.key: pair.value for pair in part.values}


def test_diagnostics_carry_time_drive_and_recorder(stand: Any):
    parts = next_parts(stand, stand.listen('diagnostics'))
    assert parts.keys() == {'time', 'drive', 'recorder'}
    assert values_of(parts['time']).keys() == TIME_KEYS
    drive = values_of(parts['drive'])
    assert drive.keys() == {'simulated_s', 'status', 'commands_refused'}
    assert (drive['status'], drive['commands_refused']) == ('0x00000000', '0')
    assert (parts['drive'].level, parts['drive'].message) == (DiagnosticStatus.OK, 'running')
    recorder = parts['recorder']
    assert (recorder.level, recorder.message) == (DiagnosticStatus.OK, 'not recording')
    assert {part.hardware_id for part in parts.values()} == {'virtual'}


def test_the_values_of_time_agree_with_each_other(stand: Any):
    part = next_parts(stand, stand.listen('diagnostics'))['time']
    values = {key: float(value) for key, value in values_of(part).items()}
    assert 0.0 < values['real_time_factor'] < 1.5
    assert 0.0 <= values['lateness_mean_us'] <= values['lateness_max_us']
    assert values['lateness_p99_us'] <= values['lateness_max_us']
    assert values['overruns'] <= values['ticks']
    assert values['overruns'] <= values['overruns_total']
    is_late = values['overruns'] > 0
    assert part.level == (DiagnosticStatus.WARN if is_late else DiagnosticStatus.OK)
    assert (part.message == 'in time') != is_late


def test_as_fast_as_possible_is_never_late_and_faster_than_real_time(launch: Callable[..., Any]):
    stand = launch({'sim.real_time_factor': 0.0})
    values = values_of(next_parts(stand, stand.listen('diagnostics'))['time'])
    assert float(values['real_time_factor']) > 1.0
    assert (values['overruns'], values['lateness_max_us']) == ('0', '0.0')


def test_a_pace_that_cannot_be_kept_is_a_warning_with_the_time_lost(launch: Callable[..., Any]):
    stand = launch({'sim.real_time_factor': 1000.0})  # a tick of 1 ms each microsecond
    heard = stand.listen('diagnostics')
    next_parts(stand, heard)
    part = next_parts(stand, heard)['time']
    values = values_of(part)
    assert part.level == DiagnosticStatus.WARN
    assert part.message == f'{values["overruns"]} of {values["ticks"]} ticks late'
    assert float(values['real_time_factor']) < 1000.0
    assert float(values['behind_s']) > 0.0


def test_the_recorder_is_accounted_for_while_it_records(stand: Any, tmp_path: Any):
    heard = stand.listen('diagnostics')
    path = stand.operator.set_recording(wanted=True).message
    part = next_parts(stand, heard)['recorder']
    assert (part.level, part.message) == (DiagnosticStatus.OK, 'recording')
    values = values_of(part)
    assert values.keys() == RECORDER_KEYS
    assert values['file'] == path
    assert values['dropped'] == '0'
    assert int(values['queue_peak']) >= int(values['queued']) >= 0


def test_a_drive_that_has_failed_is_an_error_with_its_reason(stand: Any, recwarn: Any):
    heard = stand.listen('diagnostics')
    stand.drive.session.failure = RuntimeError('broken on purpose')
    part = next_parts(stand, heard)['drive']
    assert part.level == DiagnosticStatus.ERROR
    assert part.message == 'stopped: broken on purpose'
    answer = stand.operator.trigger('stop')
    assert not answer.success
    assert answer.message == (
        'stop refused: the drive has stopped: broken on purpose; restart the node'
    )


@pytest.mark.parametrize('queue', [10])
def test_messages_that_the_recorder_lost_are_a_warning(launch: Callable[..., Any], queue: int):
    stand = launch({'record.queue_length': queue, 'sim.real_time_factor': 1000.0})
    heard = stand.listen('diagnostics')
    assert stand.operator.set_recording(wanted=True).success
    part = next_parts(stand, heard)['recorder']
    stand.operator.spin_until(
        lambda: stand.drive.session.writer.recorder.dropped > 0, 'a lost message'
    )
    part = next_parts(stand, heard)['recorder']
    assert part.level == DiagnosticStatus.WARN
    assert part.message == f'{values_of(part)["dropped"]} dropped'
