"""The files of a run, one after the other: when each ends, and when they are safe on the disk."""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Final, NamedTuple

from stickslip_ros.recording.bag import write_metadata
from stickslip_ros.recording.channels import Channel
from stickslip_ros.recording.layout import FileForm, Layout
from stickslip_ros.recording.mcap_writer import McapWriter, Stored

CLOSING_RECORD: Final = 'stickslip_recorder'
"""Metadata record with which a finished file says what it holds and what was lost."""
PART_RECORD: Final = 'stickslip_part'
"""Metadata record in which a part says which one it is."""
FOLLOWED_BY: Final = 'followed_by'
"""Entry of a part's closing record: the file in which the run goes on, or nothing."""

SECURE_AFTER: Final = 1 / 2
"""Share of the flush period after which a chunk in progress is brought to the disk."""
SECURE_CHUNK_AFTER: Final = 1 / 4
"""Share of it after which one that has ended is: it costs less, but not nothing."""


class PartMark(NamedTuple):
    """Where a file begins: what it alone has attached, and the messages that it repeats."""

    attachments: Mapping[str, tuple[str, bytes]]
    repeated: Sequence[Stored]


class RunStorage:
    """
    The files of one run; one caller at a time.

    Parameters
    ----------
    metadata, attachments : mapping
        What every file begins with.
    losses : callable
        Gives what the closing record says of messages that never came here.

    Raises
    ------
    RecordingError
        If the run exists or cannot be begun.
    UnknownName
        If the compression is not known.

    """

    def __init__(
        self,
        layout: Layout,
        channels: Sequence[Channel],
        form: FileForm,
        metadata: Mapping[str, Mapping[str, str]],
        attachments: Mapping[str, tuple[str, bytes]],
        losses: Callable[[], dict[str, str]],
    ) -> None:
        layout.refuse_existing()
        self.parts = 0
        self.written = self.secured = self.stored = 0
        self._layout = layout
        self._channels = channels
        self._form = form
        self._metadata = metadata
        self._attachments = attachments
        self._losses = losses
        try:
            self._file = self._begin(attachments)
        except BaseException:
            if layout.bag:
                with suppress(OSError):
                    layout.folder.rmdir()
            raise
        self._secured_s = time.monotonic()
        self._chunks_secured = 0

    def _begin(self, attachments: Mapping[str, tuple[str, bytes]]) -> McapWriter:
        """Make the next file."""
        metadata = dict(self._metadata)
        if self._layout.numbered:
            metadata[PART_RECORD] = {'run': self._layout.stem, 'part': str(self.parts)}
        path = self._layout.part(self.parts)
        file = McapWriter(path, self._channels, self._form, metadata, attachments)
        self.parts += 1
        return file

    def write(self, message: Stored) -> None:
        """Add a message; its time must not be earlier than the last one's."""
        self._file.write(message)
        self.stored += 1
        self.written += 1

    def begin_part(self, mark: PartMark) -> None:
        """Begin the next file; as long as there is no message, the first is that."""
        if self.written:
            self._go_on_in_next({**self._attachments, **mark.attachments})
        else:
            for name, attached in mark.attachments.items():
                self._file.attach(name, *attached)
        for message in mark.repeated:
            self._file.write(message)
            self.stored += 1

    def keep(self) -> None:
        """Bring to the disk what came since, if the last time is long ago by the clock."""
        if self.secured == self.written:
            return
        period_s = self._form.flush_period_s
        waited_s = time.monotonic() - self._secured_s
        has_new_chunk = self._file.chunks != self._chunks_secured
        if waited_s >= SECURE_AFTER * period_s:
            self._file.secure()
            self.secured = self.written
        elif has_new_chunk and waited_s >= SECURE_CHUNK_AFTER * period_s:
            self._file.sync()
            self.secured = self.written - self._file.pending
        else:
            return
        self._secured_s = time.monotonic()
        self._chunks_secured = self._file.chunks

    def finish(self) -> None:
        """End the last file, and describe the bag."""
        self._end_file('')
        if self._layout.bag:
            write_metadata(self._layout.folder, self._layout.parts())

    def abandon(self) -> None:
        """Close what is open as it is."""
        self._file.abandon()

    def _go_on_in_next(self, attachments: Mapping[str, tuple[str, bytes]]) -> None:
        """Begin a file before the last one ends: one that says that it goes on does go on."""
        try:
            following = self._begin(attachments)
        except BaseException:
            self._end_file('')
            raise
        try:
            self._end_file(following.path.name)
        except BaseException:
            following.abandon()
            raise
        self._file = following

    def _end_file(self, next_name: str) -> None:
        own = {FOLLOWED_BY: next_name} if self._layout.numbered else {}
        said = {'written': str(self.written), **self._losses(), **own}
        self._file.finish({CLOSING_RECORD: said})
        self.secured = self.written
