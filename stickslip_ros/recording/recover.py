# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Copy the whole records of an unfinished or damaged recording to a new, finished file."""

import json
import os
import shutil
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from io import BytesIO
from itertools import chain
from pathlib import Path
from typing import Any, BinaryIO, Final

import numpy as np
from mcap import records as r
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.stream_reader import StreamReader
from mcap.summary import Summary
from mcap.writer import Writer

from stickslip_ros.budget import LOSSES, NAMES_MOST
from stickslip_ros.errors import RecordingError
from stickslip_ros.files import check_folder, make_folder, prepare_output, readable, replacing
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.recording.bag import bag_parts, files_of_a_bag, write_metadata
from stickslip_ros.recording.chunks import (
    CHUNK_MAX_BYTES,
    MAGIC,
    RECORD_HEAD,
    find_messages,
    unpack_chunk,
)
from stickslip_ros.recording.integrity import (
    DAMAGE,
    PROFILE,
    is_database,
    open_whole,
    refuse_foreign,
)
from stickslip_ros.recording.layout import SUFFIX, Layout

RECOVERY_RECORD: Final = 'stickslip_recovery'
"""Metadata record of a recovered file: its source and its losses."""
MARK: Final = '.recovered'  # added to the name of a recovered file or directory
_KINDS: Final = {int(each): each.name.lower().replace('_', ' ') for each in Opcode}


@dataclass(frozen=True)
class Loss:
    """Bytes that cannot be read, and the reason."""

    offset: int
    size_bytes: int
    problem: str


@dataclass
class Recovery:
    """Report on the recovery of a file."""

    source: str
    size_bytes: int
    is_whole: bool = False  # nothing to recover: all fields below but `messages` are empty
    output: str = ''  # the readable copy
    messages: int = 0  # messages read
    counted: int | None = None  # messages by the file's statistics; None without statistics
    losses: list[Loss] = field(default_factory=list)

    @property
    def lost_bytes(self) -> int:
        return sum(each.size_bytes for each in self.losses)


def recover(path: Path, output: Path | None = None) -> tuple[list[Recovery], Path | None]:
    """Copy the whole records of a recording; return a report for each file, and the path."""
    is_bag = path.is_dir()
    path = path if path.name else path.resolve()
    parts = _parts_of(path)
    name = f'{path.name}{MARK}' if is_bag else f'{path.name.removesuffix(SUFFIX)}{MARK}{SUFFIX}'
    copy = Layout.plan(output or path.with_name(name), bag=is_bag, split=bool(parts))
    copy.refuse_existing()
    check_folder(copy.path.parent)
    try:
        recoveries = [
            recover_file(each, copy.part(number), is_part=bool(parts))
            for number, each in enumerate(parts or [path])
        ]
        if all(each.is_whole for each in recoveries):
            return recoveries, _describe_bag(path, parts)
        for number, each in enumerate(recoveries):
            if each.is_whole:
                with replacing(copy.part(number)) as new:
                    shutil.copyfile(each.source, new)
        if is_bag:
            write_metadata(copy.folder, copy.parts())
    except BaseException:  # leave no partial copy
        for part in copy.parts() if copy.numbered else []:
            part.unlink()
        if copy.bag:
            shutil.rmtree(copy.folder, ignore_errors=True)
        raise
    return recoveries, copy.path


def _parts_of(path: Path) -> list[Path]:
    """Return the parts of a run or bag, [] for a single file; refuse other directories."""
    if path.is_dir():
        return files_of_a_bag(path) or bag_parts(path)  # raises with the reason if there are none
    return [] if path.is_file() else Layout.plan(path, split=True).parts()


def _describe_bag(path: Path, parts: list[Path]) -> Path | None:
    """Write the missing description of a whole bag; return its path."""
    try:
        if path.is_dir():
            bag_parts(path)
    except RecordingError:
        return write_metadata(path, parts)
    return None


def recover_file(source: Path, output: Path, *, is_part: bool = False) -> Recovery:
    """Copy the readable records of a damaged file to a new file, finished and indexed."""
    try:
        with readable(source).open('rb') as stream:
            result = Recovery(str(source), stream.seek(0, os.SEEK_END))
            summary = _check(source, result)
            if result.is_whole:
                return result
            result.output = str(output)
            make_folder(output.parent)
            prepare_output(output, is_new=True)
            with replacing(output) as part, part.open('wb') as target:
                if not _copy(stream, target, result, summary) and not is_part:
                    refuse_foreign(source)
                    problem = 'it ends before its first record'
                    raise RecordingError(source, problem, 'it holds nothing to recover')
                target.flush()
                os.fsync(target.fileno())
            return result
    except OSError as error:
        problem = f'it cannot be read ({error.strerror})'
        raise RecordingError(source, problem, 'name an MCAP file or a bag directory') from error


def _check(path: Path, result: Recovery) -> Summary:
    """Count the messages of a whole file; return its summary, empty if missing."""
    summary = Summary()
    try:
        with open_whole(path) as reader:
            summary = reader.get_summary()
            reader.check()
            for _ in chain[Any](reader.iter_metadata(), reader.iter_attachments()):
                pass
            result.messages = sum(len(piece.starts) for piece in reader.pieces())
            result.is_whole = True
    except RecordingError:
        if is_database(path):  # its refusal says how to recover it
            raise
    return summary


def _copy(stream: BinaryIO, target: BinaryIO, result: Recovery, summary: Summary) -> bool:
    """Copy records until bytes are no record; return whether there was a record."""
    header, at, size = None, len(MAGIC), result.size_bytes
    with suppress(*DAMAGE):
        header = _parse(_content(stream, at, size))
    writer = Writer(target, enable_data_crcs=True)
    writer.start(header.profile if isinstance(header, r.Header) else PROFILE)
    copy = _Copy(writer, result.source)
    for each in (*summary.schemas.values(), *summary.channels.values()):
        copy.add(each)
    while at < size:
        stop_if_asked()
        content = b''
        try:
            content = _content(stream, at, size)
            record = _parse(content)
            if isinstance(record, r.DataEnd):
                break
            copy.add(record)
        except DAMAGE as error:
            why = f'{_KINDS[content[0]]} damaged ({error})' if content else str(error)
            result.losses.append(Loss(at, len(content) or size - at, why))
            LOSSES.check(len(result.losses), result.source)
        at += len(content) or size
    if not result.losses:
        why = (
            'its end is missing' if at >= size else 'its index or metadata are damaged or missing'
        )
        result.losses.append(Loss(min(at, size), max(size - at, 0), why))
    result.messages = copy.messages
    if statistics := summary.statistics:
        result.counted = statistics.message_count
    account = {**asdict(result), 'source': Path(result.source).name, 'output': ''}
    writer.add_metadata(RECOVERY_RECORD, {key: json.dumps(each) for key, each in account.items()})
    writer.finish()  # type: ignore[no-untyped-call]
    return header is not None or result.messages > 0


def _content(stream: BinaryIO, at: int, size: int) -> bytes:
    """Return the record at an offset; ValueError if there is none or its end is missing."""
    stream.seek(at)
    head = stream.read(RECORD_HEAD.size)
    opcode, length = RECORD_HEAD.unpack(head.ljust(RECORD_HEAD.size, b'\xff'))
    kind = _KINDS.get(opcode, 'bytes')
    if opcode not in _KINDS or length > min(CHUNK_MAX_BYTES, size - stream.tell()):
        raise ValueError(f'{kind} cut off, or a length in it is wrong')
    content, next_byte = head + stream.read(length), stream.read(1)
    if opcode == Opcode.MESSAGE and next_byte and next_byte[0] not in _KINDS:  # it has no checksum
        raise ValueError('a message with a wrong length')
    return content


def _parse(content: bytes) -> r.McapRecord:
    """
    Parse a record; ValueError if it is not whole.

    A record is whole if writing it gives the same bytes: all lengths agree, and the checksum of
    an attachment too. A checksum of 0 means none.

    """
    record = next(StreamReader(BytesIO(content), skip_magic=True, emit_chunks=True).records)
    builder = RecordBuilder()
    record.write(builder)
    written = bytes(builder.end())  # type: ignore[no-untyped-call]
    if isinstance(record, r.Attachment) and not any(content[-4:]):
        content, written = content[:-4], written[:-4]
    if written != content:
        raise ValueError('a length, a checksum or the kind of record is wrong')
    return record


class _Copy:
    """Adds records to a new file, and renumbers their schemas and channels."""

    def __init__(self, writer: Writer, path: str) -> None:
        self._writer, self._path = writer, path
        # Numbers in the copy by those in the file:
        self._schemas: dict[int, int] = {0: 0}
        self._channels: dict[int, int] = {}
        self.messages = 0

    def add(self, record: r.McapRecord) -> None:
        """Write a record; the first of two descriptions with one number counts."""
        match record:
            case r.Chunk():
                packed = self._path, len(record.data)
                piece = find_messages(unpack_chunk(record), None, packed)
                for each in piece.descriptions():
                    self.add(_parse(each))
                if unknown := {*map(int, np.unique(piece.channels))} - self._channels.keys():
                    raise ValueError(f'channel {min(unknown)} is not described')
                for place in range(len(piece.starts)):
                    self.add(piece.message(place))
            case r.Message():
                number = self._channels[record.channel_id]
                self._writer.add_message(
                    number, record.log_time, record.data, record.publish_time, record.sequence
                )
                self.messages += 1
            case r.Schema() if record.id not in self._schemas:
                number = self._writer.register_schema(record.name, record.encoding, record.data)
                self._schemas[record.id] = number
            case r.Channel() if record.id not in self._channels:
                NAMES_MOST.check(len(self._channels) + 1, self._path)
                schema = self._schemas.get(record.schema_id, 0)
                fields = record.topic, record.message_encoding, schema, record.metadata
                self._channels[record.id] = self._writer.register_channel(*fields)
            case r.Metadata():
                self._writer.add_metadata(record.name, record.metadata)
            case r.Attachment():
                times_ns, named = (record.create_time, record.log_time), record.media_type
                self._writer.add_attachment(*times_ns, record.name, named, record.data)
