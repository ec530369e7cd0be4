"""Where a run goes and in what form: the names of its files, chunks, parts, bag."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.units import NS_PER_S

SUFFIX: Final = '.mcap'
NAME_MAX_BYTES: Final = 200
"""Leaves room for the number of a part, ``.recovered`` and the suffix within the usual 255."""
CHUNKS_PER_PERIOD: Final = 3
"""Chunks that end in one flush period: the last one is then on the disk before it is over."""

_DEVICES: Final = {'con', 'prn', 'aux', 'nul'} | {
    f'{port}{n}' for port in ('com', 'lpt') for n in range(10)
}


@dataclass(frozen=True)
class FileForm:
    """
    In what form a run is written.

    Parameters
    ----------
    compression : str
        Of the chunks: ``zstd``, ``lz4`` or ``none``.
    chunk_size_bytes : int
        Size, before compression, at which a chunk is written.
    flush_period_s : float
        What is older than this, in wall-clock time, is on the disk.
    in_parts : bool
        Whether a run can have several files.
    bag : bool
        Whether to make a directory with ``metadata.yaml``, as rosbag2 does.

    """

    compression: str = 'zstd'
    chunk_size_bytes: int = 512 * 1024
    flush_period_s: float = 1.0
    in_parts: bool = False
    bag: bool = False

    @property
    def chunk_period_ns(self) -> int:
        """Simulated time after which a chunk ends."""
        return max(1, round(self.flush_period_s * NS_PER_S / CHUNKS_PER_PERIOD))


@dataclass(frozen=True)
class Layout:
    """
    The files of one run.

    Parameters
    ----------
    path : Path
        What the user is shown: a file, the directory of a bag, or the name that parts share.
    folder : Path
        Where the files stand.
    stem : str
        What the names of the files begin with.
    numbered : bool
        Whether the files are parts: ``stem_0.mcap``, ``stem_1.mcap`` …
    bag : bool
        Whether the folder is a bag with a ``metadata.yaml``.

    """

    path: Path
    folder: Path
    stem: str
    numbered: bool
    bag: bool

    @classmethod
    def plan(cls, path: Path, *, bag: bool = False, split: bool = False) -> 'Layout':
        """Lay out a run that is to be kept under a path, with or without ``.mcap`` behind it."""
        stem = path.name.removesuffix(SUFFIX)
        if bag:
            folder = path.with_name(stem)
            return cls(folder, folder, stem, numbered=True, bag=True)
        return cls(path, path.parent, stem, numbered=split, bag=False)

    def part(self, number: int) -> Path:
        """Return the path of a file, counted from 0."""
        if not self.numbered:
            return self.path
        return self.folder / f'{self.stem}_{number}{SUFFIX}'

    def parts(self) -> list[Path]:
        """List the numbered files that are there, in the order of their numbers."""
        if not self.folder.is_dir():
            return []
        ends = [path.stem.removeprefix(f'{self.stem}_') for path in self.folder.iterdir()]
        numbers = {int(end) for end in ends if end.isascii() and end.isdecimal()}
        return [self.part(number) for number in sorted(numbers) if self.part(number).exists()]

    def refuse_existing(self) -> None:
        """
        Make sure that nothing is there yet; one file by itself is refused when it is made.

        Raises
        ------
        RecordingError
            If a run of that name exists, in one file or in parts.

        """
        found = [path for path in (self.path, *self.parts()) if path.exists()]
        if found and self.numbered:
            raise RecordingError(
                found[0], 'it exists and is not overwritten', 'choose another name'
            )


def check_name(name: str) -> None:
    """
    Make sure that a name stays in its folder and is safe on every file system.

    Raises
    ------
    OutOfRange
        If it has a separator, begins or ends oddly, is reserved or too long.

    """
    size_bytes = len(name.encode(errors='surrogatepass'))
    problems = {
        'it contains a separator of folders': '/' in name or '\\' in name,
        'it contains a character that cannot be printed': not name.isprintable(),
        'it begins with a dot, a dash or a space': name[:1] in '.- ',
        'it ends with a dot or a space': name[-1:] in '. ',
        'it is the name of a device on some systems': name.split('.', maxsplit=1)[0].lower()
        in _DEVICES,
        f'it is longer than {NAME_MAX_BYTES} bytes': size_bytes > NAME_MAX_BYTES,
    }
    for problem, applies in problems.items():
        if applies:
            limit = f'not a plain file name: {problem}'
            raise OutOfRange('record.name', name, '', limit, 'give a name such as run_7')
