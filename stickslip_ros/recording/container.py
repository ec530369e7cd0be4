"""The file itself: an MCAP container as ROS 2 tools expect it, open for writing."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, Final

from mcap.exceptions import McapError
from mcap.writer import CompressionType, Writer

from stickslip_ros.errors import RecordingError, UnknownName
from stickslip_ros.recording.channels import Channel
from stickslip_ros.recording.schemas import SCHEMAS, TYPE_HASHES

COMPRESSIONS: Final = {
    'zstd': CompressionType.ZSTD,
    'lz4': CompressionType.LZ4,
    'none': CompressionType.NONE,
}


class Container:
    """
    An MCAP file that is being written by one caller at a time.

    Parameters
    ----------
    path : Path
        The file, which must not exist; missing folders are made.
    compression : str
        Of the chunks: ``zstd``, ``lz4`` or ``none``.
    chunk_size_bytes : int
        Size, before compression, at which a chunk is closed.

    Raises
    ------
    RecordingError
        If the file exists or cannot be made.
    UnknownName
        If the compression is not one of the three.

    """

    def __init__(self, path: Path, compression: str, chunk_size_bytes: int) -> None:
        kind = COMPRESSIONS.get(compression)
        if kind is None:
            raise UnknownName('compression', compression, f'take one of {", ".join(COMPRESSIONS)}')
        self._path = path
        self._stream = _create(path)
        with self._discarding():
            self._writer = Writer(self._stream, chunk_size_bytes, kind)

    def start(
        self,
        channels: Sequence[Channel],
        metadata: Mapping[str, Mapping[str, str]],
        attachments: Mapping[str, tuple[str, bytes]],
    ) -> list[int]:
        """Write all that precedes the messages; give the identifier of each channel."""
        with self._discarding():
            self._writer.start(profile='ros2')
            for name, (media_type, data) in attachments.items():
                self._writer.add_attachment(0, 0, name, media_type, data)
            self._add_metadata(metadata)
            self._stream.flush()
            return self._register(channels)

    def write(self, channel_id: int, time_ns: int, data: bytes, sequence: int) -> None:
        """Add a message; its time must not be earlier than the last one's."""
        self._writer.add_message(channel_id, time_ns, data, time_ns, sequence)

    def finish(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        """Write closing metadata, the last chunk, the summary and the end; close the file."""
        self._add_metadata(metadata)
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._stream.close()

    def abandon(self) -> None:
        """Close the file as it is, with what fits on the disk."""
        with suppress(OSError):
            self._stream.close()

    def _add_metadata(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        for name, entries in metadata.items():
            self._writer.add_metadata(name, dict(entries))

    def _register(self, channels: Sequence[Channel]) -> list[int]:
        """Announce channels and, once each, their schemas."""
        names = dict.fromkeys(channel.type_name for channel in channels)
        schema_ids = {name: self._register_schema(name) for name in names}
        return [self._register_channel(each, schema_ids[each.type_name]) for each in channels]

    def _register_schema(self, type_name: str) -> int:
        definition = SCHEMAS[type_name].encode()
        return int(self._writer.register_schema(type_name, 'ros2msg', definition))

    def _register_channel(self, channel: Channel, schema_id: int) -> int:
        metadata = {
            'offered_qos_profiles': channel.qos.to_yaml(),
            'topic_type_hash': TYPE_HASHES[channel.type_name],
        }
        return self._writer.register_channel(channel.topic, 'cdr', schema_id, metadata)

    @contextmanager
    def _discarding(self) -> Iterator[None]:
        """Take the file away again when it cannot even be begun."""
        try:
            yield
        except BaseException as error:
            self.abandon()
            self._path.unlink()
            if isinstance(error, (OSError, McapError)):
                raise RecordingError(
                    self._path, f'it cannot be begun ({error})', 'choose another place'
                ) from error
            raise


def _create(path: Path) -> BinaryIO:
    """Open a file that must not exist yet."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return path.open('xb')
    except OSError as error:
        if path.exists():
            problem, mend = 'it exists and is not overwritten', 'choose another name'
        else:
            problem, mend = f'it cannot be made ({error.strerror})', 'choose another folder'
        raise RecordingError(path, problem, mend) from error
