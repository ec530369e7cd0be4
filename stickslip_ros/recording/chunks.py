"""Chunks: what compresses them, what they announce, and one that is only for now."""

from collections.abc import Iterable, Sequence
from io import BytesIO
from typing import IO, Final, NamedTuple

from mcap.writer import CompressionType, Writer

from stickslip_ros.recording.channels import Channel
from stickslip_ros.recording.schemas import SCHEMAS, TYPE_HASHES

COMPRESSIONS: Final = {
    'zstd': CompressionType.ZSTD,
    'lz4': CompressionType.LZ4,
    'none': CompressionType.NONE,
}
ENDED_BY_CALLER_BYTES: Final = 1 << 62
"""Size of a chunk that no writer ends by itself."""


class Stored(NamedTuple):
    """A message as it stands in a file."""

    channel_id: int
    time_ns: int
    data: bytes
    sequence: int


def make_writer(stream: IO[bytes], compression: str) -> Writer:
    """Return a writer whose chunks end when its caller says so."""
    return Writer(stream, ENDED_BY_CALLER_BYTES, COMPRESSIONS[compression], enable_data_crcs=True)


def register_channels(writer: Writer, channels: Sequence[Channel]) -> list[int]:
    """Announce channels and, once each, their schemas; give the identifier of each channel."""
    names = dict.fromkeys(channel.type_name for channel in channels)
    schema_ids = {
        name: writer.register_schema(name, 'ros2msg', SCHEMAS[name].encode()) for name in names
    }
    return [_register(writer, each, schema_ids[each.type_name]) for each in channels]


def _register(writer: Writer, channel: Channel, schema_id: int) -> int:
    metadata = {
        'offered_qos_profiles': channel.qos.to_yaml(),
        'topic_type_hash': TYPE_HASHES[channel.type_name],
    }
    return int(writer.register_channel(channel.topic, 'cdr', schema_id, metadata))


def provisional_chunk(
    channels: Sequence[Channel], compression: str, messages: Iterable[Stored]
) -> bytes:
    """
    Return messages as a chunk that can stand at the end of a file until the real one is there.

    It announces every channel again: the file may hold no other chunk.

    """
    stream = BytesIO()
    writer = make_writer(stream, compression)
    writer.start(profile='ros2')
    start = stream.tell()
    register_channels(writer, channels)
    for channel_id, time_ns, data, sequence in messages:
        writer.add_message(channel_id, time_ns, data, time_ns, sequence)
    writer.flush()  # type: ignore[no-untyped-call]
    return stream.getvalue()[start:]
