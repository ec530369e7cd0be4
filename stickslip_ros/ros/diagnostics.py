# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Diagnostics: lateness, refusals, faults, connections, state of the recording."""

import math
import shutil
import statistics
from collections.abc import Mapping
from contextlib import suppress

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from stickslip_ros.ros.connections import Connections
from stickslip_ros.ros.guard import Guard
from stickslip_ros.runtime.pacing import PaceReport
from stickslip_ros.runtime.session import Session
from stickslip_ros.runtime.worker import Faults
from stickslip_ros.units import MICRO, NANO

FACTOR_SHARE = 0.9
"""Share of the wanted real-time factor below which a report is an error."""
MISSING_BLOCKS = 2.0
"""Smallest number of missing blocks for an error: a slow pace has few blocks in a report."""
BLOCK_MAX_S = 1.0
"""Wall-clock time of a block above which it is an error, while it lasts."""
STAMPS_OFF_MAX_S = 0.5
"""Difference of stamps and system time above which a report is a warning."""
FULL_SOON_S, RATE_OVER_S = 3600.0, 10.0
"""Time until the disk is full, below which a report is a warning; and the shortest time over which
the rate is averaged, since a file begins with its parameters."""
QUEUE_SHARE = 0.5
"""Share of the recorder's queue above which a report is a warning."""

_OK, _WARN, _ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


def pace_status(name: str, report: PaceReport, session: Session) -> DiagnosticStatus:
    """Return the status of the pace since the last report."""
    values = {
        'real_time_factor': f'{report.real_time_factor:.4f}',
        'real_time_factor_wanted': f'{session.pacer.real_time_factor:g}',
        'lateness_mean_us': f'{report.lateness_mean_s / MICRO:.1f}',
        'lateness_p99_us': f'{report.lateness_p99_s / MICRO:.1f}',
        'lateness_max_us': f'{report.lateness_max_s / MICRO:.1f}',
        'ticks': str(report.ticks),
        'overruns': str(report.overruns),
        'overruns_total': str(report.overruns_total),
        'lag_s': f'{report.lag_s:.6f}',
        'behind_s': f'{report.behind_s:.6f}',
        'paused': str(session.is_paused).lower(),
    }
    level, message = _lateness(report, session)
    problems = []
    if report.given_up_s:
        lag_max_s = session.parameters.sim.lag_max
        lost = f'{report.given_up_s:.1f} s of simulated time given up'
        problems.append(f'{lost}: the lag was above sim.lag_max, {lag_max_s:g} s')
    if (behind_s := session.stamps_behind_s) is not None:
        values['stamps_behind_s'] = f'{behind_s:.6f}'
        off_s = behind_s - report.lag_s
        if abs(off_s) > STAMPS_OFF_MAX_S and not session.is_paused:
            where = 'behind' if off_s > 0.0 else 'ahead of'
            off = f"stamps are {abs(off_s):.1f} s {where} the system's time, more than"
            mend = 'deactivate and activate the node; if this host stays too busy, set'
            mend += ' sim.real_time_factor to 0.0 (as fast as it goes) in between'
            problems.append(f'{off} {STAMPS_OFF_MAX_S:g} s; {mend}')
    if problems:
        before = [] if level == _OK else [message]
        level, message = max(level, _WARN), '; '.join([*before, *problems])
    return _status(name, 'time', level, message, values)


def _lateness(report: PaceReport, session: Session) -> tuple[bytes, str]:
    """Return how late a drive is, as a level with its message."""
    wanted, late_s = session.pacer.real_time_factor, _lag_s(report)
    missing_blocks = report.missing_s / session.parameters.sim.block
    if report.real_time_factor < FACTOR_SHARE * wanted and missing_blocks > MISSING_BLOCKS:
        message = f'real-time factor {report.real_time_factor:.4f} instead of {wanted:g}'
        return _ERROR, message + f'; {late_s:.1f} s late' * (late_s > STAMPS_OFF_MAX_S)
    if late_s > STAMPS_OFF_MAX_S:
        pace = f'{report.real_time_factor:.2g} times real time'
        return _WARN, f'{late_s:.1f} s late, made up at {pace}'
    if report.overruns:
        return _WARN, f'{report.overruns} of {report.ticks} ticks late'
    return _OK, 'paused' if session.is_paused else 'in time'


class Doubling:
    """What is news once, and again whenever it has doubled; less than before begins anew."""

    def __init__(self) -> None:
        self._told = 0.0

    def is_news(self, amount: float) -> bool:
        """Return whether to tell the amount; it is told then."""
        is_new = amount > 0.0 and not self._told <= amount < 2.0 * self._told
        if is_new or not amount:
            self._told = amount
        return is_new


def lag_to_log_s(report: PaceReport) -> float:
    """Return the lag since the last report, given up or not, s; 0 if it is short."""
    late_s = report.given_up_s or _lag_s(report)
    return late_s if late_s > STAMPS_OFF_MAX_S else 0.0


def _lag_s(report: PaceReport) -> float:
    """Return the lag, s, or if it is short the longest since the last report; 0: given up."""
    is_over = report.lag_s <= STAMPS_OFF_MAX_S < report.lateness_max_s
    return 0.0 if report.given_up_s else report.lateness_max_s if is_over else report.lag_s


def drive_status(name: str, session: Session, guard: Guard) -> DiagnosticStatus:
    """Return the status of the drive, with its refusals."""
    news = guard.news(session.bench.refused)
    values = {
        'simulated_s': f'{session.bench.time_ns * NANO:.3f}',
        'status': f'0x{int(session.worker.status):08x}',
        'commands_refused': str(session.bench.refused),
        **guard.values(),
        'setpoints_replaced': str(session.bench.replaced),
    }
    if session.failure is not None:
        return _status(name, 'drive', _ERROR, f'stopped: {session.failure}', values)
    if late := long_block(session):
        return _status(name, 'drive', _ERROR, late, values)
    return verdict(name, 'drive', news, 'running', values)


def long_block(session: Session) -> str:
    """Return a warning if the present block of a drive lasts too long; else nothing."""
    at_s, busy_s = session.bench.time_ns * NANO, session.busy_s
    if busy_s <= BLOCK_MAX_S:
        return ''
    return f'the block at {at_s:.9g} s has not ended in {busy_s:.1f} s'


def fault_status(name: str, faults: Faults) -> DiagnosticStatus:
    """Return the present faults as a status."""
    values = {fault: str(value) for fault, value in faults.items()}
    return verdict(name, 'faults', ', '.join(faults), 'none', values)


def connection_status(name: str, connections: Connections, guard: Guard) -> DiagnosticStatus:
    """
    Return the status of connections: foreign endpoints, messages that were not sent or got lost.

    The ages of commands begin anew.

    """
    incompatible, unsent, lost = connections.incompatible, connections.unsent, guard.lost
    values = {topic: str(count) for topic, count in incompatible.items()}
    values.update({f'{topic} not sent': str(count) for topic, count in unsent.items()})
    values.update({f'{topic} lost': str(count) for topic, count in lost.items()})
    ages_s, connections.command_ages_s = connections.command_ages_s, []
    if ages_s:
        values['command_age_median_s'] = f'{statistics.median(ages_s):.6f}'
        values['command_age_max_s'] = f'{max(ages_s):.6f}'
    problems = [*connections.conflicts]
    if incompatible:
        count = sum(incompatible.values())
        problems.append(f'{count} of incompatible quality of service since the configuration')
    if unsent:
        problems.append(f'{sum(unsent.values())} messages not sent since the configuration')
    if lost:
        problems.append(f'{lost.total()} messages lost on their way since the configuration')
    return verdict(name, 'connections', '; '.join(problems), 'compatible', values)


def recorder_status(name: str, session: Session) -> DiagnosticStatus:
    """Return the status of the recording."""
    writer = session.worker.writer or session.worker.failed_writer
    if writer is None:
        return _status(name, 'recorder', _OK, 'not recording', {})
    recorder, length = writer.recorder, session.parameters.record.queue_length
    queued, dropped, size_bytes = recorder.queued, recorder.dropped, recorder.size_bytes
    values = {
        'file': str(recorder.path),
        'size_bytes': str(size_bytes),
        'written': str(recorder.written),
        'queued': str(queued),
        'queue_peak': str(recorder.queue_peak),
        'queue_length': str(length),
        'dropped': str(dropped),
    }
    if recorder.error is not None:
        return _status(name, 'recorder', _ERROR, f'stopped: {recorder.error}', values)
    length_s = (session.bench.time_ns - writer.begun_ns) * NANO
    values['length_s'] = f'{length_s:.3f}'
    if dropped:
        values['losses'] = recorder.losses
        return _status(name, 'recorder', _ERROR, f'{dropped} dropped', values)
    if queued > QUEUE_SHARE * length and not writer.waits:
        return _status(name, 'recorder', _WARN, f'queue {queued} of {length}', values)
    free_bytes = math.inf
    with suppress(OSError):
        free_bytes = shutil.disk_usage(recorder.path.parent).free
    rate = size_bytes / max(length_s, RATE_OVER_S)  # in bytes per second
    if free_bytes < FULL_SOON_S * rate and not session.parameters.record.keep_parts:
        left_min = free_bytes / rate / 60.0
        why = f'recording; at {MICRO * rate:.2g} MB/s the disk is full in {left_min:.0f} min'
        return _status(name, 'recorder', _WARN, why, values)
    return _status(name, 'recorder', _OK, 'recording', values)


def idle_status(name: str, state: str, trouble: str, guard: Guard) -> DiagnosticStatus:
    """Return the status of a node without a running drive, with the cause if there is one."""
    level, message = (_ERROR, f'{state}; {trouble}') if trouble else (_OK, state)
    return _status(name, 'drive', level, message, guard.values())


def compiling_status(name: str, line: str) -> DiagnosticStatus:
    """Return the progress of the kernels' compilation."""
    return _status(name, 'drive', _WARN, line, {})


def verdict(
    name: str, part: str, bad: str, good: str, values: Mapping[str, object]
) -> DiagnosticStatus:
    """Return the status of a part of a node: a warning of what is bad, or else what is good."""
    return _status(name, part, _WARN if bad else _OK, bad or good, values)


def _status(
    name: str, part: str, level: bytes, message: str, values: Mapping[str, object]
) -> DiagnosticStatus:
    """Return the status of a part of a drive, by the full name of its node."""
    pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
    return DiagnosticStatus(
        level=level,
        name=f'{name.lstrip("/")}: {part}',
        message=message,
        hardware_id=f'virtual {name}',
        values=pairs,
    )
