"""Where a run goes: the names of its files, and the names that a user may give."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from stickslip_ros.errors import OutOfRange, RecordingError

SUFFIX: Final = '.mcap'
NAME_MAX_BYTES: Final = 200
"""Leaves room for the number of a part, ``.recovered`` and the suffix within the usual 255."""

_DEVICES: Final = {'con', 'prn', 'aux', 'nul'} | {
    f'{port}{n}' for port in ('com', 'lpt') for n in range(10)
}


@dataclass(frozen=True)
class Layout:
    """
    The files of one run.

    Parameters
    ----------
    path : Path
        What the user is told: a file, the directory of a bag, or the name that parts share.
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
        numbers = sorted(map(_number, self._candidates()))
        return [self.part(number) for number in numbers]

    def refuse_existing(self) -> None:
        """
        Make sure that nothing is there yet.

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

    def _candidates(self) -> list[Path]:
        if not self.folder.is_dir():
            return []
        start = f'{self.stem}_'
        return [
            path
            for path in self.folder.iterdir()
            if path.name.startswith(start) and path.suffix == SUFFIX and _is_number(path, start)
        ]


def check_name(name: str) -> None:
    """
    Make sure that a name stays in its folder and is safe on every file system.

    Raises
    ------
    OutOfRange
        If it has a separator, begins or ends oddly, is reserved or too long.

    """
    problems = {
        'it contains a separator of folders': '/' in name or '\\' in name,
        'it contains a character that cannot be printed': not name.isprintable(),
        'it begins with a dot, a dash or a space': name[:1] in '.- ',
        'it ends with a dot or a space': name[-1:] in '. ',
        'it is the name of a device on some systems': name.split('.', maxsplit=1)[0].lower()
        in _DEVICES,
        f'it is longer than {NAME_MAX_BYTES} bytes': _size_bytes(name) > NAME_MAX_BYTES,
    }
    for problem, applies in problems.items():
        if applies:
            limit = f'not a plain file name: {problem}'
            raise OutOfRange('record.name', name, '', limit, 'give a name such as run_7')


def _size_bytes(name: str) -> int:
    return len(name.encode(errors='surrogatepass'))


def _is_number(path: Path, start: str) -> bool:
    """Tell whether a file is ``stem_12.mcap``, and not ``stem_012.mcap`` or another run's."""
    digits = path.stem.removeprefix(start)
    return digits.isascii() and digits.isdecimal() and str(int(digits)) == digits


def _number(path: Path) -> int:
    return int(path.stem.rpartition('_')[2])
