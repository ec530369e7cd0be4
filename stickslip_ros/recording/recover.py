"""Makes the rest of an unfinished, cut or damaged recording readable: a new file beside it."""

import dataclasses
import mmap
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, Final, NamedTuple

from mcap import records
from mcap.writer import CompressionType, Writer

from stickslip_ros.errors import RecordingError
from stickslip_ros.files import readable
from stickslip_ros.recording.bag import bag_parts, refuse_sqlite, write_metadata
from stickslip_ros.recording.integrity import (
    MAGIC,
    PROFILE,
    SQLITE_MAGIC,
    open_whole,
    sqlite_refusal,
)
from stickslip_ros.recording.layout import SUFFIX, Layout
from stickslip_ros.recording.reader import ChannelSummary
from stickslip_ros.recording.run_file import RUN_RECORD, TIME_ORIGIN
from stickslip_ros.recording.salvage import Bytes, Scan, Stretch, read_messages, times_ns

RECOVERY_RECORD: Final = 'stickslip_recovery'
"""Metadata record in which a recovered file says what it was made of and what is lost."""
MARK: Final = '.recovered'
"""What is added to the name of a recovered file or directory."""
_CHUNK_BYTES: Final = 1 << 20
_NUMBERS: Final = ('size_bytes', 'lost_bytes', 'chunks', 'messages', 'unchecked', 'strangers')


class Loss(NamedTuple):
    """Bytes that cannot be read, what is wrong with them, and the times that they still tell."""

    offset: int
    size_bytes: int
    problem: str
    first_ns: int | None
    last_ns: int | None


class Recovery:
    """
    What can be read of a file, and what became of it; times are simulated time.

    Parameters
    ----------
    source : Path
        The file.
    data : bytes or mmap
        Its content.

    Attributes
    ----------
    output : str
        The readable copy; empty for a file that is whole.
    chunks : int
        Chunks that are whole.
    unchecked : int
        Messages that no checksum covers, such as those of a chunk that was cut off.
    losses : list of Loss
        Every stretch that cannot be read.
    places : list of (int, int)
        Where messages begin that count, and how many of them are left out as repeated.

    """

    def __init__(self, source: Path, data: Bytes) -> None:
        self.source, self.output = str(source), ''
        self.size_bytes = len(data)
        self.chunks = self.unchecked = 0
        self.losses: list[Loss] = []
        self.header: records.Header | None = None
        self.schemas: dict[int, records.Schema] = {}
        self.channels: dict[int, records.Channel] = {}
        self.metadata: list[records.Metadata] = []
        self.attachments: list[records.Attachment] = []
        self.compression = ''
        self.is_finished = self.has_index = False
        self.places: list[tuple[int, int]] = []
        self._last: list[records.Message] = []
        self._counts: dict[int, ChannelSummary] = {}
        for stretch in Scan(data):
            if stretch.problem:
                size_bytes = stretch.end - stretch.start
                times = times_ns(data, stretch.start)
                self.losses.append(Loss(stretch.start, size_bytes, stretch.problem, *times))
            self._take(stretch)
        self._time_origin_ns = self._told_origin_ns()
        self.losses = [
            loss._replace(
                first_ns=self._simulated_ns(loss.first_ns),
                last_ns=self._simulated_ns(loss.last_ns),
            )
            for loss in self.losses
        ]

    @property
    def is_whole(self) -> bool:
        """Whether there was nothing to recover."""
        return not self.output

    @property
    def lost_bytes(self) -> int:
        """Bytes that cannot be read."""
        return sum(loss.size_bytes for loss in self.losses)

    @property
    def messages(self) -> int:
        """Messages that were read."""
        return sum(topic.messages for topic in self.topics)

    @property
    def strangers(self) -> int:
        """Messages that are lost because nothing says what they are."""
        counts = self._counts.items()
        return sum(each.messages for key, each in counts if key not in self.channels)

    @property
    def topics(self) -> list[ChannelSummary]:
        """What there is of each topic."""
        counts = {key: self._counts.get(key, ChannelSummary()) for key in sorted(self.channels)}
        return [
            dataclasses.replace(
                count,
                topic=self.channels[key].topic,
                type_name=getattr(self.schemas.get(self.channels[key].schema_id), 'name', ''),
                first_ns=self._simulated_ns(count.first_ns),
                last_ns=self._simulated_ns(count.last_ns),
            )
            for key, count in counts.items()
        ]

    @property
    def last_ns(self) -> int | None:
        """Time of the last message that was read."""
        return max(
            (each.last_ns for each in self.topics if each.last_ns is not None), default=None
        )

    @property
    def notes(self) -> list[str]:
        """What the list of losses does not say."""
        strangers = self.strangers
        remarks = {
            'it was not finished: what came after its last chunk was never written': (
                not self.is_finished
            ),
            f'{strangers} messages are lost: what they are is not described any more': (
                strangers > 0
            ),
            'it has no index': self.is_finished and not self.has_index,
            'every chunk is whole, but a byte outside of them is wrong: look at metadata and '
            'names': self.is_finished and self.has_index and not self.losses,
            'its header is lost: ROS 2 is assumed': self.header is None,
        }
        return [remark for remark, applies in remarks.items() if applies and not self.is_whole]

    def to_json(self) -> dict[str, Any]:
        """Return all of it, as ``stickslip recover --json`` prints it."""
        return {
            'source': self.source,
            'output': self.output,
            **{name: getattr(self, name) for name in _NUMBERS},
            'topics': [dataclasses.asdict(topic) for topic in self.topics],
            'losses': [loss._asdict() for loss in self.losses],
            'notes': self.notes,
            'is_whole': self.is_whole,
            'last_ns': self.last_ns,
        }

    def _told_origin_ns(self) -> int:
        """Return the time origin that the metadata tell; 0 where they are lost."""
        runs = [each.metadata for each in self.metadata if each.name == RUN_RECORD]
        told = runs[0].get(TIME_ORIGIN, '') if runs else ''
        return int(told) if told.isdecimal() else 0

    def _simulated_ns(self, time_ns: int | None) -> int | None:
        return None if time_ns is None else time_ns - self._time_origin_ns

    def _take(self, stretch: Stretch) -> None:
        for record in stretch.records:
            self._take_record(record)
        messages = [record for record in stretch.records if isinstance(record, records.Message)]
        repeated = self._repeated(messages, stretch)
        for message in messages[repeated:]:
            count = self._counts.setdefault(message.channel_id, ChannelSummary())
            count.add(message.log_time, message.sequence)
        if messages[repeated:]:
            self.places.append((stretch.start, repeated))
            self._last = messages
        self.unchecked += 0 if stretch.is_checked else len(messages) - repeated
        self.chunks += bool(stretch.compression)
        self.compression = self.compression or stretch.compression

    def _repeated(self, messages: list[records.Message], stretch: Stretch) -> int:
        """
        Count the messages of a chunk that the last one held: what replaces it may stand behind it.

        One that is cut off is known by its first message: further ones may be wrong.

        """
        both = min(len(messages), len(self._last)) if stretch.is_chunk else 0
        compared = min(both, 1) if stretch.problem else both
        return both if messages[:compared] == self._last[:compared] else 0

    def _take_record(self, record: records.McapRecord) -> None:
        """Keep what is no message; of two descriptions the first one counts."""
        match record:
            case records.Header():
                self.header = self.header or record
            case records.Schema():
                self.schemas.setdefault(record.id, record)
            case records.Channel():
                self.channels.setdefault(record.id, record)
            case records.Metadata() if record not in self.metadata:
                self.metadata.append(record)
            case records.Attachment():
                self.attachments.append(record)
            case records.Statistics() | records.ChunkIndex():
                self.has_index = True
            case records.Footer():
                self.is_finished = True


def recover(path: Path, output: Path | None = None) -> tuple[list[Recovery], Path | None]:
    """
    Make a recording readable, and leave the original as it is.

    Parameters
    ----------
    path : Path
        An MCAP file, a bag directory, or the name that numbered parts share.
    output : Path, optional
        Where the readable copy goes; by default beside the original, ``run.recovered.mcap`` or
        the directory ``run.recovered``.

    Returns
    -------
    list of Recovery
        What became of each file.
    Path or None
        What was written: a file, a directory, the ``metadata.yaml`` that was missing in a bag of
        whole files, or nothing for a recording that is whole.

    Raises
    ------
    RecordingError
        If there is nothing to recover, or the copy exists or cannot be written.

    """
    if path.is_dir():
        return _recover_bag(path, output)
    layout = Layout.plan(path, split=True)
    target = output or path.with_name(f'{layout.stem}{MARK}{SUFFIX}')
    parts = [] if path.exists() else layout.parts()
    if parts:
        return _recover_parts(parts, Layout.plan(target, split=True))
    recovery = recover_file(path, target)
    return [recovery], None if recovery.is_whole else target


def recover_file(source: Path, output: Path, *, is_part: bool = False) -> Recovery:
    """
    Write what can be read of a file to a new one, finished and indexed.

    Parameters
    ----------
    source : Path
        An MCAP file in any state, of any program; it is only read.
    output : Path
        The new file, which must not exist; nothing is written if the source is whole.
    is_part : bool
        Whether it belongs to a run of several: it is then replaced even if nothing can be read.

    Raises
    ------
    RecordingError
        If the source holds nothing that can be read, or the output cannot be written.

    """
    whole = is_whole(source)
    with _mapped(source) as data:
        recovery = Recovery(source, data)
        if whole:
            recovery.losses.clear()
            return recovery
        if not is_part:
            _refuse_nothing(source, recovery, data)
        recovery.output = str(output)
        _write(recovery, data, output)
    return recovery


def is_whole(path: Path) -> bool:
    """Return whether every byte of a file is as its checksums say, and all of it is indexed."""
    try:
        with open_whole(path, checks_data=True) as reader:
            messages = sum(1 for _ in reader.iter_messages(log_time_order=False))
            summary = reader.get_summary()
            list(reader.iter_metadata())
            list(reader.iter_attachments())
    except RecordingError:
        return False
    statistics = summary.statistics if summary else None
    return statistics is None or bool(statistics.message_count == messages)


def _recover_bag(path: Path, output: Path | None) -> tuple[list[Recovery], Path | None]:
    refuse_sqlite(path)
    parts = sorted(path.glob(f'*{SUFFIX}'), key=_by_number)
    if not parts:
        raise RecordingError(path, 'there is no MCAP file in it', 'name the directory of a bag')
    copy = Layout.plan(output or path.with_name(f'{path.name}{MARK}'), bag=True)
    recoveries, written = _recover_parts(parts, copy)
    if written is not None:
        write_metadata(copy.folder, copy.parts())
    elif not _is_described(path):
        written = write_metadata(path, parts)
    return recoveries, written


def _by_number(path: Path) -> tuple[str, int, str]:
    stem, _, number = path.stem.rpartition('_')
    is_number = number.isascii() and number.isdecimal()
    return (stem, int(number), path.name) if is_number else (path.stem, -1, path.name)


def _is_described(bag: Path) -> bool:
    """Return whether a directory has a readable description whose files are all there."""
    try:
        return bool(bag_parts(bag))
    except RecordingError:
        return False


def _recover_parts(parts: list[Path], copy: Layout) -> tuple[list[Recovery], Path | None]:
    """Recover what is damaged; if anything is, copy what is whole beside it."""
    copy.refuse_existing()
    recoveries = [recover_file(part, copy.part(n), is_part=True) for n, part in enumerate(parts)]
    if all(recovery.is_whole for recovery in recoveries):
        return recoveries, None
    for number, recovery in enumerate(recoveries):
        if recovery.is_whole:
            target = copy.part(number)
            try:
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(recovery.source, target)
            except OSError as error:
                raise _refused(target, error) from error
    return recoveries, copy.path


@contextmanager
def _mapped(path: Path) -> Iterator[Bytes]:
    """Give the bytes of a file without reading them all at once."""
    try:
        with readable(path).open('rb') as stream:
            if stream.seek(0, os.SEEK_END) == 0:  # what has no bytes cannot be mapped
                yield b''
                return
            with mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
                yield data
    except OSError as error:
        raise RecordingError(
            path, f'it cannot be read ({error.strerror})', 'name an MCAP file or a bag directory'
        ) from error


def _refuse_nothing(path: Path, found: Recovery, data: Bytes) -> None:
    """Refuse a file in which there is no record at all."""
    if data[: len(SQLITE_MAGIC)] == SQLITE_MAGIC:
        raise sqlite_refusal(path)
    if found.header or found.channels or found.metadata or found.attachments:
        return
    begins = data[: len(MAGIC)] == MAGIC
    problem = 'it ends before its first record' if begins else 'it is not an MCAP file'
    problem = problem if data else 'it is empty'
    raise RecordingError(path, problem, 'there is nothing in it to recover')


def _write(recovery: Recovery, data: Bytes, output: Path) -> None:
    """Write a new file, or none: one that cannot be completed is taken away again."""
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        stream = output.open('xb')
    except OSError as error:
        raise _refused(output, error) from error
    try:
        with stream:
            _rewrite(recovery, data, stream)
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


def _rewrite(recovery: Recovery, data: Bytes, stream: BinaryIO) -> None:
    """Write all that was read; identifiers are given anew."""
    compression = CompressionType[(recovery.compression or 'zstd').upper()]
    writer = Writer(stream, _CHUNK_BYTES, compression, enable_data_crcs=True)
    writer.start(recovery.header.profile if recovery.header else PROFILE)
    for attachment in recovery.attachments:
        writer.add_attachment(
            attachment.create_time,
            attachment.log_time,
            attachment.name,
            attachment.media_type,
            attachment.data,
        )
    for metadata in recovery.metadata:
        writer.add_metadata(metadata.name, metadata.metadata)
    writer.add_metadata(RECOVERY_RECORD, _record(recovery))
    schemas = {
        key: writer.register_schema(each.name, each.encoding, each.data)
        for key, each in sorted(recovery.schemas.items())
    }
    channels = {
        key: writer.register_channel(
            each.topic, each.message_encoding, schemas.get(each.schema_id, 0), each.metadata
        )
        for key, each in sorted(recovery.channels.items())
    }
    for offset, repeated in recovery.places:
        for each in read_messages(data, offset)[repeated:]:
            if (channel := channels.get(each.channel_id)) is not None:
                writer.add_message(
                    channel, each.log_time, each.data, each.publish_time, each.sequence
                )
    writer.finish()  # type: ignore[no-untyped-call]


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
