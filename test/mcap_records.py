# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""MCAP files in tests: what stands in one in order, and files as other programs write them."""

import struct
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Message
from mcap.writer import IndexType, Writer

from stickslip_ros.interface.cdr import pack_float64
from stickslip_ros.message_types import FLOAT64

MAGIC_BYTES = 8
WITHOUT_INDEX: dict[str, Any] = {
    'index_types': IndexType.NONE,
    'repeat_channels': False,
    'repeat_schemas': False,
    'use_statistics': False,
    'use_summary_offsets': False,
}
Row = tuple[str, int, int, bytes]


def records_of(content: bytes) -> Iterator[tuple[int, int, Opcode]]:
    """Give where each record of a finished file begins and ends, and of what kind it is."""
    start = MAGIC_BYTES
    while start < len(content) - MAGIC_BYTES:
        opcode, length = struct.unpack_from('<BQ', content, start)
        end = start + 9 + length
        yield start, end, Opcode(opcode)
        start = end


def rows_of(path: Path) -> list[Row]:
    """Give topic, time, sequence number and bytes of each message of a finished file."""
    with path.open('rb') as stream:
        messages = make_reader(stream, validate_crcs=True).iter_messages(log_time_order=False)
        return [
            (channel.topic, each.log_time, each.sequence, each.data)
            for _, channel, each in messages
        ]


def foreign(path: Path, profile: str = 'ros2', **options: Any) -> Writer:
    """Begin a file as other programs write it; whoever calls finishes it."""
    writer = Writer(str(path), **options)
    writer.start(profile)
    return writer


def foreign_numbers(path: Path, rows: Iterable[tuple[int, int, float]], **options: Any) -> Path:
    """Write time, sequence number and value of each message of the topic ``/u``."""
    writer = foreign(path, **options)
    schema = writer.register_schema(FLOAT64, 'ros2msg', b'float64 data')
    number = writer.register_channel('/u', 'cdr', schema)
    for time_ns, sequence, value in rows:
        writer.add_message(number, time_ns, pack_float64(value), time_ns, sequence)
    writer.finish()
    return path


def foreign_notes(path: Path, profile: str = 'ros2', **options: Any) -> Path:
    """Write ten messages that are no messages of ROS."""
    writer = foreign(path, profile, **options)
    note = writer.register_channel('/note', 'json', 0)
    for number in range(10):
        writer.add_message(note, number, b'{"n": %d}' % number, number)
    writer.finish()
    return path


def rewritten(
    source: Path,
    target: Path,
    change: Callable[[list[tuple[str, Message]]], Iterable[tuple[str, Message]]] = list,
    **options: Any,
) -> Path:
    """Write a finished file anew: with other chunks, other messages."""
    with source.open('rb') as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert summary is not None
        writer = foreign(target, **options)
        schemas = {
            key: writer.register_schema(each.name, each.encoding, each.data)
            for key, each in summary.schemas.items()
        }
        channels = {
            each.topic: writer.register_channel(
                each.topic, each.message_encoding, schemas[each.schema_id], each.metadata
            )
            for each in summary.channels.values()
        }
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, dict(record.metadata))
        for file in reader.iter_attachments():
            writer.add_attachment(0, 0, file.name, file.media_type, file.data)
        rows = [(channel.topic, each) for _, channel, each in reader.iter_messages()]
    for topic, each in change(rows):
        writer.add_message(
            channels[topic], each.log_time, each.data, each.publish_time, each.sequence
        )
    writer.finish()
    return target
