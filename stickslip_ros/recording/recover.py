"""Makes the rest of an unfinished, cut or damaged recording readable: a new file beside it."""

import mmap
import os
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final

from mcap.records import Message
from mcap.writer import Writer

from stickslip_ros.errors import RecordingError
from stickslip_ros.files import readable
from stickslip_ros.recording.chunks import COMPRESSIONS
from stickslip_ros.recording.integrity import (
    MAGIC,
    SQLITE_MAGIC,
    check_data,
    convert_mend,
    open_whole,
)
from stickslip_ros.recording.records import Bytes
from stickslip_ros.recording.salvage import Loss, Salvage
from stickslip_ros.recording.tally import ChannelSummary

RECOVERY_RECORD: Final = 'stickslip_recovery'
"""Metadata record in which a recovered file says what it was made of and what is lost."""
_CHUNK_BYTES: Final = 1 << 20


@dataclass(frozen=True)
class Recovery:
    """
    What became of one file.

    Parameters
    ----------
    source : str
        The file.
    output : str
        The readable copy; empty for a file that is whole.
    size_bytes, lost_bytes : int
        Of the file, and how many of them cannot be read.
    chunks, messages : int
        What was read.
    unchecked : int
        Messages that no checksum covers, such as those of a chunk that was cut off.
    strangers : int
        Messages that are lost because nothing says what they are.
    topics : list of ChannelSummary
        What there is of each topic.
    losses : list of Loss
        Every stretch that cannot be read.
    notes : list of str
        What else is to be known.

    """

    source: str
    output: str
    size_bytes: int
    lost_bytes: int
    chunks: int
    messages: int
    unchecked: int
    strangers: int
    topics: list[ChannelSummary]
    losses: list[Loss]
    notes: list[str]

    @property
    def is_whole(self) -> bool:
        """Whether there was nothing to recover."""
        return not self.output

    @property
    def last_ns(self) -> int | None:
        """Time of the last message that was read."""
        return max(
            (each.last_ns for each in self.topics if each.last_ns is not None), default=None
        )


def is_whole(path: Path) -> bool:
    """Tell whether every byte of a file is as its checksums say, and all of it is indexed."""
    try:
        check_data(path)
        with open_whole(path) as reader:
            messages = sum(1 for _ in reader.iter_messages(log_time_order=False))
            summary = reader.get_summary()
            list(reader.iter_metadata())
            list(reader.iter_attachments())
    except RecordingError:
        return False
    statistics = summary.statistics if summary else None
    return statistics is None or bool(statistics.message_count == messages)


def recover_file(source: Path, output: Path, *, is_part: bool = False) -> Recovery:
    """
    Write what can be read of a file to a new one, finished and indexed.

    Parameters
    ----------
    source : Path
        An MCAP file in any state, of any program; it is only read.
    output : Path
        The new file; it must not exist.
    is_part : bool
        Whether it belongs to a run of several: it is then replaced even if nothing can be read.

    Returns
    -------
    Recovery
        What was found; nothing is written if the source is whole.

    Raises
    ------
    RecordingError
        If the source holds nothing that can be read, or the output cannot be written.

    """
    whole = is_whole(source)
    with _mapped(source) as data:
        found = Salvage(data).scan()
        if not is_part:
            _refuse_nothing(source, found, data)
        topics, strangers = found.topics(), found.strangers()
        recovery = Recovery(
            source=str(source),
            output='' if whole else str(output),
            size_bytes=len(data),
            lost_bytes=0 if whole else sum(loss.size_bytes for loss in found.losses),
            chunks=found.chunks,
            messages=sum(topic.messages for topic in topics),
            unchecked=found.unchecked,
            strangers=strangers,
            topics=topics,
            losses=[] if whole else found.losses,
            notes=[] if whole else _notes(found, strangers),
        )
        if not whole:
            _write(found, recovery, output)
    return recovery


@contextmanager
def _mapped(path: Path) -> Iterator[Bytes]:
    """Give the bytes of a file without reading them all at once."""
    try:
        with readable(path).open('rb') as stream, _map(stream) as data:
            yield data
    except OSError as error:
        raise RecordingError(
            path, f'it cannot be read ({error.strerror})', 'name an MCAP file or a bag directory'
        ) from error


def _map(stream: BinaryIO) -> AbstractContextManager[Bytes]:
    """Map a file; one without bytes cannot be."""
    if stream.seek(0, os.SEEK_END) == 0:
        return nullcontext(b'')
    return mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)


def _refuse_nothing(path: Path, found: Salvage, data: Bytes) -> None:
    """Refuse a file in which there is no record at all."""
    if data[: len(SQLITE_MAGIC)] == SQLITE_MAGIC:
        raise RecordingError(path, 'it is a bag of storage sqlite3', convert_mend(path))
    if found.header or found.channels or found.metadata or found.attachments:
        return
    begins = data[: len(MAGIC)] == MAGIC
    problem = 'it ends before its first record' if begins else 'it is not an MCAP file'
    problem = problem if data else 'it is empty'
    raise RecordingError(path, problem, 'there is nothing in it to recover')


def _notes(found: Salvage, strangers: int) -> list[str]:
    """Say what the list of losses does not."""
    remarks = {
        'it was not finished: what came after its last chunk was never written': (
            not found.is_finished
        ),
        f'{strangers} messages are lost: what they are is not described any more': strangers > 0,
        'it has no index': found.is_finished and not found.has_index,
        'every chunk is whole, but a byte outside of them is wrong: look at metadata and names': (
            found.is_finished and found.has_index and not found.losses
        ),
        'its header is lost: ROS 2 is assumed': found.header is None,
    }
    return [remark for remark, applies in remarks.items() if applies]


def _write(found: Salvage, recovery: Recovery, output: Path) -> None:
    """Write a new file, or none: one that cannot be completed is taken away again."""
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        stream = output.open('xb')
    except OSError as error:
        raise _refused(output, error) from error
    try:
        with stream:
            _rewrite(found, recovery, stream)
            stream.flush()
            os.fsync(stream.fileno())
    except BaseException as error:
        output.unlink()
        if isinstance(error, OSError):
            raise _refused(output, error) from error
        raise


def _refused(output: Path, error: OSError) -> RecordingError:
    if isinstance(error, FileExistsError):
        return RecordingError(
            output, 'it exists and is not overwritten', 'choose another name with -o'
        )
    return RecordingError(
        output, f'it cannot be written ({error.strerror})', 'choose another place with -o'
    )


def _rewrite(found: Salvage, recovery: Recovery, stream: BinaryIO) -> None:
    compression = COMPRESSIONS.get(found.compression, COMPRESSIONS['zstd'])
    writer = Writer(stream, _CHUNK_BYTES, compression, enable_data_crcs=True)
    writer.start(found.header.profile if found.header else 'ros2')
    for attachment in found.attachments:
        writer.add_attachment(
            attachment.create_time,
            attachment.log_time,
            attachment.name,
            attachment.media_type,
            attachment.data,
        )
    for metadata in found.metadata:
        writer.add_metadata(metadata.name, metadata.metadata)
    writer.add_metadata(RECOVERY_RECORD, _record(recovery))
    _copy_messages(found, writer)
    writer.finish()  # type: ignore[no-untyped-call]


def _copy_messages(found: Salvage, writer: Writer) -> None:
    """Copy descriptions and messages; identifiers are given anew."""
    schemas = {
        key: writer.register_schema(each.name, each.encoding, each.data)
        for key, each in sorted(found.schemas.items())
    }
    channels = {
        key: writer.register_channel(
            each.topic, each.message_encoding, schemas.get(each.schema_id, 0), each.metadata
        )
        for key, each in sorted(found.channels.items())
    }
    for messages in found.groups():
        for message in messages:
            if message.channel_id in channels:
                _copy(message, channels[message.channel_id], writer)


def _copy(message: Message, channel_id: int, writer: Writer) -> None:
    writer.add_message(
        channel_id, message.log_time, message.data, message.publish_time, message.sequence
    )


def _record(recovery: Recovery) -> dict[str, str]:
    """Return what the new file says of the old one."""
    lost = {
        f'loss at byte {loss.offset}': f'{loss.size_bytes} bytes: {loss.problem}'
        for loss in recovery.losses
    }
    missing = {f'missing {each.topic}': str(each.gaps) for each in recovery.topics if each.gaps}
    return {
        'source': Path(recovery.source).name,
        'source_bytes': str(recovery.size_bytes),
        'lost_bytes': str(recovery.lost_bytes),
        'messages': str(recovery.messages),
        'messages_without_checksum': str(recovery.unchecked),
        'last_time_ns': str(recovery.last_ns),
        'notes': '; '.join(recovery.notes),
        **lost,
        **missing,
    }
