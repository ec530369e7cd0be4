"""The file itself: an MCAP container as ROS 2 tools expect it, open for writing."""

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from mcap.exceptions import McapError

from stickslip_ros.errors import RecordingError, UnknownName
from stickslip_ros.recording.channels import Channel
from stickslip_ros.recording.chunk_indexes import ChunkIndexes, spill_indexes
from stickslip_ros.recording.chunks import (
    COMPRESSIONS,
    Stored,
    make_writer,
    provisional_chunk,
    register_channels,
)
from stickslip_ros.recording.file_form import FileForm

_RECORD_BYTES = 9 + 22
"""What a message takes beside its data."""


class Container:
    """
    An MCAP file that is being written by one caller at a time.

    Where a chunk ends is decided by the sizes and the simulated times of its messages alone. The
    first chunk ends with the first time, so that the channels are soon on the disk.

    Parameters
    ----------
    path : Path
        The file, which must not exist; missing folders are made.
    channels : sequence of Channel
        Every topic that it will hold.
    form : FileForm
        Gives compression and chunks.

    Raises
    ------
    RecordingError
        If the file exists or cannot be made.
    UnknownName
        If the compression is not one of the three.

    """

    def __init__(self, path: Path, channels: Sequence[Channel], form: FileForm) -> None:
        if form.compression not in COMPRESSIONS:
            known = ', '.join(COMPRESSIONS)
            raise UnknownName('compression', form.compression, f'take one of {known}')
        self.path = path
        self.chunks = 0
        self.size_bytes = 0
        self._channels = channels
        self._form = form
        self._pending: list[Stored] = []
        self._pending_bytes = 0
        self._secured = 0
        self._chunk_end_ns = 0
        self._stream = _create(path)
        self._identity = _identity(os.fstat(self._stream.fileno()))
        self._indexes: ChunkIndexes | None = None
        with self._discarding():
            self._writer = make_writer(self._stream, form.compression)
            self._indexes = spill_indexes(self._writer)

    def start(
        self,
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
            _sync_folder(self.path.parent)
            return register_channels(self._writer, self._channels)

    @property
    def pending(self) -> int:
        """Messages of the chunk in progress."""
        return len(self._pending)

    def write(self, message: Stored) -> None:
        """Add a message; its time must not be earlier than the last one's."""
        if self._pending and message.time_ns >= self._chunk_end_ns:
            self.end_chunk()
        if not self._pending:
            period_ns = self._form.chunk_period_ns if self.chunks else 1
            self._chunk_end_ns = message.time_ns + period_ns
        channel_id, time_ns, data, sequence = message
        self._writer.add_message(channel_id, time_ns, data, time_ns, sequence)
        self._pending.append(message)
        self._pending_bytes += _RECORD_BYTES + len(data)
        if self._pending_bytes > self._form.chunk_size_bytes:
            self.end_chunk()

    def end_chunk(self) -> None:
        """Write the chunk in progress and hand it to the operating system."""
        self._writer.flush()  # type: ignore[no-untyped-call]
        self._pending.clear()
        self._pending_bytes = self._secured = 0
        self.chunks += 1
        self.size_bytes = self._stream.tell()

    def secure(self) -> None:
        """
        Bring all that was written to the disk, without ending the chunk.

        The chunk in progress is written behind the end of the file, where the real one will be
        written over it: what the finished file says does not depend on when this is called.

        """
        self._stream.flush()
        if len(self._pending) > self._secured:
            chunk = provisional_chunk(self._channels, self._form.compression, self._pending)
            _write_at(self._stream.fileno(), chunk, self._stream.tell())
            self._secured = len(self._pending)
        self.sync()

    def sync(self) -> None:
        """
        Have the operating system bring to the disk what it was handed.

        Raises
        ------
        RecordingError
            If the file is no longer where it was made: what it holds will be gone when it ends.

        """
        os.fsync(self._stream.fileno())
        try:
            is_there = _identity(self.path.lstat()) == self._identity
        except OSError:
            is_there = False
        if not is_there:
            problem = 'it was deleted, moved or replaced while it was written'
            raise RecordingError(
                self.path, problem, 'record anew, and leave the file in its place'
            )

    def finish(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        """Write closing metadata, the last chunk, the summary and the end; close the file."""
        self._add_metadata(metadata)
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._stream.truncate()
        self.sync()
        self._close()

    def abandon(self) -> None:
        """Close the file as it is, with what fits on the disk."""
        with suppress(OSError):
            self._close()

    def _close(self) -> None:
        if self._indexes is not None:
            self._indexes.close()
        self._stream.close()

    def _add_metadata(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        for name, entries in metadata.items():
            self._writer.add_metadata(name, dict(entries))

    @contextmanager
    def _discarding(self) -> Iterator[None]:
        """Take the file away again when it cannot even be begun."""
        try:
            yield
        except BaseException as error:
            self.abandon()
            self.path.unlink()
            if isinstance(error, (OSError, McapError)):
                raise RecordingError(
                    self.path, f'it cannot be begun ({error})', 'choose another place'
                ) from error
            raise


def _create(path: Path) -> BinaryIO:
    """Open a file that must not exist yet."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return path.open('xb')
    except OSError as error:
        if os.path.lexists(path):
            problem, mend = 'it exists and is not overwritten', 'choose another name'
        else:
            problem, mend = f'it cannot be made ({error.strerror})', 'choose another folder'
        raise RecordingError(path, problem, mend) from error


def _identity(status: os.stat_result) -> tuple[int, int]:
    """Return what makes a file the same one, whatever its name."""
    return status.st_dev, status.st_ino


def _write_at(handle: int, data: bytes, offset: int) -> None:
    """Write at a place of a file, and leave the place where its stream goes on alone."""
    view = memoryview(data)
    while view:
        written = os.pwrite(handle, view, offset)
        view, offset = view[written:], offset + written


def _sync_folder(folder: Path) -> None:
    """Bring the name of a new file to the disk, where the file system knows how."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
