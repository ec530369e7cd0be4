# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Files of a run: names, chunks, parts, bag."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from stickslip_ros.errors import RecordingError

SUFFIX: Final = '.mcap'
STORAGES: Final = {SUFFIX: 'mcap', '.db3': 'sqlite3'}
"""Suffix and storage name of the files of rosbag2."""
TIME_MAX_NS: Final = (1 << 63) - 1


@dataclass(frozen=True)
class FileForm:
    """Form in which a run is written."""

    compression: str = 'zstd'  # of chunks: zstd, lz4 or none
    chunk_size_bytes: int = 512 * 1024  # before compression; the flush period may end it sooner
    flush_period_s: float = 1.0  # older messages are on the disk; wall-clock time
    in_parts: bool = False  # whether a run can have several files
    keep_parts: int = 0  # number of parts kept; 0 keeps all
    bag: bool = False  # whether to make a directory with metadata.yaml, as rosbag2 does
    synced: bool = True  # whether it survives a power failure; a temporary file need not


@dataclass(frozen=True)
class Layout:
    """The files of one run."""

    path: Path  # shown to the user: a file, a bag's directory, or the common name of parts
    folder: Path  # where the files stand
    stem: str  # common start of the files' names
    numbered: bool  # whether they are parts: stem_0.mcap, stem_1.mcap ...
    bag: bool  # whether the folder is a bag with a metadata.yaml

    @classmethod
    def plan(cls, path: Path, *, bag: bool = False, split: bool = False) -> 'Layout':
        """Lay out a run under a path, with or without ``.mcap`` at its end."""
        stem = path.name.removesuffix(SUFFIX)
        if bag:
            folder = path.with_name(stem)
            return cls(folder, folder, stem, numbered=True, bag=True)
        return cls(path, path.parent, stem, numbered=split, bag=False)

    def part(self, number: int | str) -> Path:
        """Return the path of a part, counted from 0."""
        if not self.numbered:
            return self.path
        return self.folder / f'{self.stem}_{number}{SUFFIX}'

    def parts(self) -> list[Path]:
        if not self.folder.is_dir():
            return []
        ends = [path.stem.removeprefix(f'{self.stem}_') for path in self.folder.iterdir()]
        numbers = {int(end) for end in ends if end.isascii() and end.isdecimal()}
        return [self.part(number) for number in sorted(numbers) if self.part(number).exists()]

    def refuse_existing(self) -> None:
        """Refuse an existing run in parts; single files are checked when they are opened."""
        taken = (self.path, *self.parts()) if self.numbered else ()
        if found := [path for path in taken if path.exists()]:
            raise RecordingError(
                found[0], 'it exists and is not overwritten', 'choose another name'
            )
