"""Diagnostics: lateness, refusals, faults, connections, state of the recording."""

import threading
from collections import deque
from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from stickslip_ros.instrument.reports import Event
from stickslip_ros.ros.connections import Connections
from stickslip_ros.runtime.pacing import PaceReport
from stickslip_ros.runtime.session import Session
from stickslip_ros.runtime.worker import Faults
from stickslip_ros.units import MICRO, MILLI, NANO

FACTOR_SHARE = 0.9
"""Share of the wanted real-time factor below which a report is an error."""
MISSING_BLOCKS = 2.0
"""Blocks that must be missing as well: a slow pace has few in a report."""
BLOCK_MAX_S = 1.0
"""Wall-clock time above which a block of the drive is an error, while it lasts."""
STAMPS_OFF_MAX_S = 0.5
"""Distance of stamps from the system's time above which a report is a warning."""
QUEUE_SHARE = 0.5
"""Share of the recorder's queue above which a report is a warning."""

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


class Refusals:
    """
    What was refused: counted, and logged once per name and report.

    ``on_line`` is called, in any thread, when there are lines for the log.

    """

    def __init__(self, on_line: Callable[[], object]) -> None:
        self.messages = 0  # and calls that the node refused before they reached the drive
        self.lines: deque[str] = deque()
        self._on_line = on_line
        self._reported = 0
        self._held_back: dict[str, int] = {}
        self._lock = threading.Lock()

    def refuse(self, name: str, line: str) -> None:
        """Note that the node has refused a message or a call of this name."""
        self.messages += 1
        self._log(name, line)

    def note(self, event: Event) -> None:
        """Note the end of a command that the drive has refused, or that has failed."""
        start = f'{event.command} (command {event.number})'
        self._log(event.command, f'{start} {event.result.name}: {event.message}')

    def _log(self, name: str, line: str) -> None:
        with self._lock:
            is_first = name not in self._held_back
            self._held_back[name] = 0 if is_first else self._held_back[name] + 1
        if is_first:
            self.lines.append(line)
            self._on_line()

    def begin_report(self) -> None:
        """Log how many were held back since the last call; the next of each name is logged."""
        with self._lock:
            held_back, self._held_back = self._held_back, {}
        self.lines.extend(
            f'{name}: {count} more refused or failed, counted in /diagnostics'
            for name, count in held_back.items()
            if count
        )
        if self.lines:
            self._on_line()

    def news(self, commands: int) -> int:
        """Return how many refusals were not reported before, with those of the drive itself."""
        total = self.messages + commands
        news, self._reported = max(0, total - self._reported), total
        return news


def pace_status(name: str, report: PaceReport, session: Session) -> DiagnosticStatus:
    """Return how well real time was kept since the last report."""
    wanted = session.pacer.real_time_factor
    kept = f'{report.real_time_factor:.4f}'
    values = {
        'real_time_factor': kept,
        'real_time_factor_wanted': f'{wanted:g}',
        'lateness_mean_us': f'{report.lateness_mean_s / MICRO:.1f}',
        'lateness_p99_us': f'{report.lateness_p99_s / MICRO:.1f}',
        'lateness_max_us': f'{report.lateness_max_s / MICRO:.1f}',
        'ticks': str(report.ticks),
        'overruns': str(report.overruns),
        'overruns_total': str(report.overruns_total),
        'overruns_work_ms': f'{report.stalls.work_s / MILLI:.3f}',
        'overruns_processor_ms': f'{report.stalls.processor_s / MILLI:.3f}',
        'overruns_rest_ms': f'{report.stalls.rest_s / MILLI:.3f}',
        'behind_s': f'{report.behind_s:.6f}',
        'paused': str(session.is_paused).lower(),
    }
    level, message = OK, 'paused' if session.is_paused else 'in time'
    missing_blocks = report.missing_s / session.parameters.sim.block
    if report.real_time_factor < FACTOR_SHARE * wanted and missing_blocks > MISSING_BLOCKS:
        level, message = ERROR, f'real-time factor {kept} instead of {wanted:g}'
    elif report.overruns:
        level = WARN
        message = f'{report.overruns} of {report.ticks} ticks late{report.stalls.most}'
    # Set back here: what the report says is whether a preload was on its way since the last one.
    ramped, session.worker.preload_ramped = session.worker.preload_ramped, False
    if ramped and level != OK:
        message += '; a preload on its way steps every spring'
    if (behind_s := session.stamps_behind_s) is not None:
        values['stamps_behind_s'] = f'{behind_s:.6f}'
        if abs(behind_s) > STAMPS_OFF_MAX_S and not session.is_paused:
            where = 'behind' if behind_s > 0.0 else 'ahead of'
            off = f"stamps are {abs(behind_s):.1f} s {where} the system's time"
            remedy = 'deactivate, clean up, configure and activate the node'
            off += f', more than {STAMPS_OFF_MAX_S:g} s; {remedy}'
            level, message = max(level, WARN), off if level == OK else f'{message}; {off}'
    return _status(f'{name}: time', level, message, values)


def drive_status(name: str, session: Session, refusals: Refusals) -> DiagnosticStatus:
    """Return the state of the drive and what was refused."""
    news = refusals.news(session.bench.refused)
    values = {
        'simulated_s': f'{session.bench.time_ns * NANO:.3f}',
        'status': f'0x{int(session.worker.status):08x}',
        'commands_refused': str(session.bench.refused),
        'messages_refused': str(refusals.messages),
        'setpoints_replaced': str(session.bench.replaced),
    }
    title = f'{name}: drive'
    if session.failure is not None:
        return _status(title, ERROR, f'stopped: {session.failure}', values)
    if late := long_block(session):
        return _status(title, ERROR, late, values)
    if held := session.held:
        why = f'{held} commands wait for kernels, which are being compiled'
        return _status(title, WARN, why, values)
    if news:
        return _status(title, WARN, f'{news} refused since the last report', values)
    return _status(title, OK, 'running', values)


def long_block(session: Session) -> str:
    """Say how long the present block of a drive has lasted, if that is too long."""
    at_s, busy_s = session.bench.time_ns * NANO, session.busy_s
    if busy_s <= BLOCK_MAX_S:
        return ''
    return f'the block at {at_s:.9g} s has not ended in {busy_s:.1f} s'


def fault_status(name: str, faults: Faults) -> DiagnosticStatus:
    """Return what is broken."""
    values = {fault: str(value) for fault, value in faults.items()}
    message = ', '.join(faults) or 'none'
    return _status(f'{name}: faults', WARN if faults else OK, message, values)


def connection_status(name: str, connections: Connections) -> DiagnosticStatus:
    """Return what is wrong with the endpoints of others, and what the network did not take."""
    incompatible, unsent = connections.incompatible, connections.unsent
    values = {topic: str(count) for topic, count in incompatible.items()}
    values.update({f'{topic} not sent': str(count) for topic, count in unsent.items()})
    problems = [*connections.conflicts]
    if incompatible:
        count = sum(incompatible.values())
        problems.append(f'{count} of incompatible quality of service since the configuration')
    if unsent:
        problems.append(f'{sum(unsent.values())} messages not sent since the configuration')
    message = '; '.join(problems) or 'compatible'
    return _status(f'{name}: connections', WARN if problems else OK, message, values)


def recorder_status(name: str, session: Session) -> DiagnosticStatus:
    """Return the state of the recording."""
    title = f'{name}: recorder'
    writer = session.worker.writer or session.worker.failed_writer
    if writer is None:
        return _status(title, OK, 'not recording', {})
    recorder, length = writer.recorder, session.parameters.record.queue_length
    queued, dropped = recorder.queued, recorder.dropped
    values = {
        'file': str(recorder.path),
        'size_bytes': str(recorder.size_bytes),
        'written': str(recorder.written),
        'queued': str(queued),
        'queue_peak': str(recorder.queue_peak),
        'queue_length': str(length),
        'dropped': str(dropped),
    }
    if recorder.error is not None:
        return _status(title, ERROR, f'stopped: {recorder.error}', values)
    values['length_s'] = f'{(session.bench.time_ns - writer.begun_ns) * NANO:.3f}'
    if dropped:
        return _status(title, ERROR, f'{dropped} dropped', values)
    if queued > QUEUE_SHARE * length and not writer.waits:
        return _status(title, WARN, f'queue {queued} of {length}', values)
    return _status(title, OK, 'recording', values)


def _status(name: str, level: bytes, message: str, values: dict[str, str]) -> DiagnosticStatus:
    pairs = [KeyValue(key=key, value=value) for key, value in values.items()]
    return DiagnosticStatus(
        level=level, name=name, message=message, hardware_id='virtual', values=pairs
    )
