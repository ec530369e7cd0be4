"""Recordings that a node starts and ends."""

from collections.abc import Mapping
from concurrent.futures import Future
from concurrent.futures import TimeoutError as NoReply
from typing import Any, TypeVar

from stickslip_ros.errors import StickSlipError
from stickslip_ros.interface.channels import Channel
from stickslip_ros.recording.run import RunWriter
from stickslip_ros.recording.run_file import run_path
from stickslip_ros.runtime.session import Session

REPLY_TIMEOUT_S = 10.0

T = TypeVar('T')


def open_recording(session: Session, channels: Mapping[str, Channel]) -> RunWriter:
    """
    Start the file of a recording; one whose drive need not keep a pace loses nothing.

    Its path is absolute: whoever asks for a recording may be in another folder.

    """
    parameters = session.parameters
    waits = session.pacer.real_time_factor == 0.0
    return RunWriter(
        run_path(parameters).absolute(),
        parameters,
        wait=waits,
        channels=channels,
        time_origin_ns=session.worker.time_origin_ns,
    )


def close_recording(writer: RunWriter, session: Session, logger: Any) -> str:
    """
    Finish a file; the drive does not wait for the disk, the caller does. Return its path.

    Raises
    ------
    StickSlipError
        If it has failed, which the drive then says too.

    """
    writer.close()
    recorder = writer.recorder
    if recorder.error is not None:
        session.worker.lose_recording(writer)
        raise StickSlipError(_why_not_recording(session))
    logger.info(
        f'recorded {recorder.place}: {recorder.stored} messages, {recorder.dropped} dropped'
    )
    return recorder.place


def start_recording(session: Session, channels: Mapping[str, Channel]) -> str:
    """
    Record from now on; return the path.

    Raises
    ------
    StickSlipError
        If the drive records already, or the file cannot be written.

    """
    if session.worker.writer is not None:
        raise StickSlipError('already recording')
    writer = open_recording(session, channels)
    try:
        await_reply(session.exchange_recording(writer))
    except StickSlipError:
        writer.close()
        raise
    return writer.recorder.place


def end_recording(session: Session, logger: Any) -> str:
    """
    End the recording; return its path.

    Raises
    ------
    StickSlipError
        If the drive does not record, or the recording has failed.

    """
    if session.worker.writer is None:
        raise StickSlipError(_why_not_recording(session))
    ended = await_reply(session.exchange_recording(None))
    return '' if ended is None else close_recording(ended, session, logger)


def _why_not_recording(session: Session) -> str:
    failed = session.worker.failed_writer
    if failed is None:
        return 'not recording'
    return f'{failed.recorder.path} has stopped: {failed.recorder.error}'


def await_reply(reply: 'Future[T]') -> T:
    """Wait for a tick to carry out an order; one that does not come is withdrawn and refused."""
    try:
        return reply.result(REPLY_TIMEOUT_S)
    except NoReply:
        reply.cancel()
        raise StickSlipError(
            f'the drive made no tick in {REPLY_TIMEOUT_S:g} s; look at /diagnostics'
        ) from None
