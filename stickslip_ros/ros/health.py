"""Diagnostics: does the drive keep up, is it refused, does the disk keep up."""

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from stickslip_ros.ros.pacing import PaceReport
from stickslip_ros.ros.session import Session

MICRO = 1e6


def pace_status(name: str, report: PaceReport) -> DiagnosticStatus:
    """Return how well real time was kept since the last report."""
    late = report.overruns > 0
    values = {
        'real_time_factor': f'{report.real_time_factor:.4f}',
        'lateness_mean_us': f'{report.lateness_mean_s * MICRO:.1f}',
        'lateness_p99_us': f'{report.lateness_p99_s * MICRO:.1f}',
        'lateness_max_us': f'{report.lateness_max_s * MICRO:.1f}',
        'ticks': str(report.ticks),
        'overruns': str(report.overruns),
        'overruns_total': str(report.overruns_total),
        'behind_s': f'{report.behind_s:.6f}',
    }
    message = f'{report.overruns} of {report.ticks} ticks late' if late else 'in time'
    level = DiagnosticStatus.WARN if late else DiagnosticStatus.OK
    return _status(f'{name}: time', level, message, values)


def drive_status(name: str, session: Session) -> DiagnosticStatus:
    """Return the state of the drive and what it refused."""
    values = {
        'simulated_s': f'{session.bench.time_ns * 1e-9:.3f}',
        'status': f'0x{int(session.status):08x}',
        'commands_refused': str(session.bench.refused),
    }
    if session.failure is not None:
        return _status(
            f'{name}: drive', DiagnosticStatus.ERROR, f'stopped: {session.failure}', values
        )
    return _status(f'{name}: drive', DiagnosticStatus.OK, 'running', values)


def recorder_status(name: str, session: Session) -> DiagnosticStatus:
    """Return the state of the recording."""
    writer = session.writer
    if writer is None:
        return _status(f'{name}: recorder', DiagnosticStatus.OK, 'not recording', {})
    recorder = writer.recorder
    values = {
        'file': str(recorder.path),
        'written': str(recorder.written),
        'queued': str(recorder.queued),
        'queue_peak': str(recorder.queue_peak),
        'dropped': str(recorder.dropped),
    }
    title = f'{name}: recorder'
    if recorder.error is not None:
        return _status(title, DiagnosticStatus.ERROR, f'stopped: {recorder.error}', values)
    if recorder.dropped:
        return _status(title, DiagnosticStatus.WARN, f'{recorder.dropped} dropped', values)
    return _status(title, DiagnosticStatus.OK, 'recording', values)


def _status(name: str, level: bytes, message: str, values: dict[str, str]) -> DiagnosticStatus:
    pairs = [KeyValue(key=key, value=value) for key, value in values.items()]
    return DiagnosticStatus(
        level=level, name=name, message=message, hardware_id='virtual', values=pairs
    )
