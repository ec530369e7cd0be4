# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The MCAP files of a run, part after part, in the form of ROS 2 tools."""

import os
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final, NamedTuple

from stickslip_ros.errors import RecordingError, UnknownName
from stickslip_ros.interface.channels import Channel
from stickslip_ros.recording.bag import file_metadata, write_metadata
from stickslip_ros.recording.layout import FileForm, Layout
from stickslip_ros.recording.writer import COMPRESSIONS, Attachments, McapWriter, Metadata, Stored

CLOSING_RECORD: Final = 'stickslip_recorder'
"""Metadata record of a finished file: its content and its losses."""
PART_RECORD: Final = 'stickslip_part'  # metadata record with the number of a part
FIRST_PART: Final = 'first'
"""Entry of the part record: number of the oldest part that is kept."""
FOLLOWED_BY: Final = 'followed_by'
"""Entry of a part's closing record: name of the next file, or nothing."""
SECURE_AFTER: Final = 1 / 2
"""Share of the flush period (wall-clock) after which a chunk is written to the disk."""

_BUFFER_BYTES: Final = 1 << 12
"""Buffer of a file. A full disk loses it; the default of Python 3.14 is 128 kiB."""


class PartMark(NamedTuple):
    """Start of a part: its attachments, and the messages repeated from earlier parts."""

    attachments: Attachments
    repeated: Sequence[Stored]


class McapFile(McapWriter):
    """A new MCAP file; makes its folder if it is missing."""

    def __init__(
        self,
        path: Path,
        channels: Sequence[Channel],
        form: FileForm,
        metadata: Metadata,
        attachments: Attachments,
    ) -> None:
        self.path = path
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._stream = path.open('xb', _BUFFER_BYTES)
        except OSError as error:
            problem, hint = f'it cannot be made ({error.strerror})', 'choose another folder'
            if os.path.lexists(path):
                problem, hint = 'it exists and is not overwritten', 'choose another name'
            raise RecordingError(path, problem, hint) from error
        try:
            self._made, self._is_synced = os.fstat(self._stream.fileno()), form.synced
            super().__init__(self._stream, channels, form)
            self.attach(attachments)
            self.describe(metadata)
            self._stream.flush()
        except BaseException as error:
            self.abandon()
            path.unlink()
            if isinstance(error, OSError):
                problem = f'it cannot be begun ({error})'
                raise RecordingError(path, problem, 'choose another place') from error
            raise
        # Unless its folder is synced, a synced file may lose its name in a power failure.
        with suppress(OSError):  # some file systems cannot sync a folder
            folder = os.open(path.parent, os.O_RDONLY)
            try:
                self._sync_disk(folder)
            finally:
                os.close(folder)

    def secure(self) -> None:
        """End the present chunk, and sync the file to the disk."""
        self.end_chunk()
        self._sync()

    def finish(self, metadata: Metadata) -> None:
        """Write closing metadata, the last chunk, the summary and the end; close the file."""
        self.describe(metadata)
        self.end()
        self._sync()
        self._stream.close()

    def abandon(self) -> None:
        """Close the file unfinished, with all data that fits on the disk."""
        with suppress(OSError):
            self._stream.close()

    def _sync_disk(self, handle: int) -> None:
        if self._is_synced:
            os.fsync(handle)

    def _sync(self) -> None:
        self._stream.flush()
        self._sync_disk(self._stream.fileno())
        try:
            is_there = os.path.samestat(self.path.lstat(), self._made)
        except OSError:
            is_there = False
        if not is_there:
            problem = 'it was deleted, moved or replaced while it was written'
            hint = 'record anew, and leave the file in its place'
            raise RecordingError(self.path, problem, hint)


class RunFiles:
    """
    The files of one run; not thread-safe.

    Every file begins with the metadata and the attachments; `losses` returns the counts of lost
    messages for the closing record. Raises RecordingError if the run exists or cannot be begun,
    UnknownName if the compression is unknown.

    """

    def __init__(
        self,
        layout: Layout,
        channels: Sequence[Channel],
        form: FileForm,
        metadata: Metadata,
        attachments: Attachments,
        losses: Callable[[], dict[str, str]],
    ) -> None:
        if form.compression not in COMPRESSIONS:
            known = ', '.join(COMPRESSIONS)
            raise UnknownName('compression', form.compression, f'take one of {known}')
        layout.refuse_existing()
        self.parts = 0  # files begun
        self.written = self.secured = 0  # messages given to the file; messages on the disk
        self.stored = 0  # messages in all files, repeated messages included
        self._layout, self._channels, self._form = layout, channels, form
        self._metadata, self._attachments, self._losses = metadata, attachments, losses
        self._due_s = 0.0
        try:
            self._file = self._begin(attachments)
        except BaseException:
            if layout.bag:
                with suppress(OSError):
                    layout.folder.rmdir()
            raise

    def _begin(self, attachments: Attachments) -> McapFile:
        metadata = {**self._metadata, **file_metadata()}
        if self._layout.numbered:
            keep = self._form.keep_parts or self.parts + 1
            metadata[PART_RECORD] = {
                'run': self._layout.stem,
                'part': str(self.parts),
                FIRST_PART: str(max(0, self.parts + 1 - keep)),
            }
        path = self._layout.part(self.parts)
        file = McapFile(path, self._channels, self._form, metadata, attachments)
        self.parts += 1
        return file

    def write(self, message: Stored) -> None:
        """Add a message; times must not fall."""
        self._file.write(message)
        self.stored += 1
        self.written += 1

    def begin_part(self, mark: PartMark) -> None:
        """Begin the next file; before the first message, set the mark of the first file."""
        if not self.written:
            self._file.attach(mark.attachments)
        else:
            # Begin before the last file ends: its named successor then exists.
            try:
                following = self._begin({**self._attachments, **mark.attachments})
            except BaseException:
                self._end_file('')
                raise
            try:
                self._end_file(following.path.name)
            except BaseException:
                following.abandon()
                raise
            self._file = following
            if 0 < self._form.keep_parts < self.parts:
                self._layout.part(self.parts - self._form.keep_parts - 1).unlink(missing_ok=True)
        for message in mark.repeated:
            self._file.write(message)
            self.stored += 1

    def keep(self) -> None:
        """Sync new messages to the disk if the last sync is old (wall-clock)."""
        if self.secured < self.written and time.monotonic() >= self._due_s:
            self._file.secure()
            self.secured = self.written
            self._due_s = time.monotonic() + SECURE_AFTER * self._form.flush_period_s

    def finish(self) -> None:
        """End the last file, and describe the bag."""
        self._end_file('')
        if self._layout.bag:
            write_metadata(self._layout.folder, self._layout.parts())

    def abandon(self) -> None:
        """Close the open file, unfinished."""
        self._file.abandon()

    def _end_file(self, next_name: str) -> None:
        own = {FOLLOWED_BY: next_name} if self._layout.numbered else {}
        record = {'written': str(self.written), **self._losses(), **own}
        self._file.finish({CLOSING_RECORD: record})
        self.secured = self.written
