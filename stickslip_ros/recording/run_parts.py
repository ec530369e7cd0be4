"""Which files make up a recording: one file, numbered parts, or what a bag directory lists."""

from pathlib import Path, PurePath
from typing import Any, Final

import yaml

from stickslip_ros.errors import RecordingError
from stickslip_ros.recording.bag_metadata import METADATA_FILE, ROOT
from stickslip_ros.recording.integrity import convert_mend, recover_mend
from stickslip_ros.recording.layout import SUFFIX, Layout

_STORAGE: Final = 'mcap'


def find_parts(path: Path) -> list[Path]:
    """
    Return the files of a recording, in the order of time.

    Parameters
    ----------
    path : Path
        A file, a bag directory, or the name that numbered parts share: ``run.mcap`` for
        ``run_0.mcap``, ``run_1.mcap`` …

    Raises
    ------
    RecordingError
        If a bag is not finished, or not one that opens here, or a part is missing.

    """
    if path.is_dir():
        return _bag_parts(path)
    if path.exists():
        return [path]
    layout = Layout.plan(path, split=True)
    parts = layout.parts()
    _refuse_gaps(layout, parts)
    return parts or [path]


def is_finished_bag(path: Path) -> bool:
    """Tell whether a directory has a readable description whose files are all there."""
    try:
        return bool(_listed_parts(path))
    except RecordingError:
        return False


def _bag_parts(path: Path) -> list[Path]:
    if (path / METADATA_FILE).is_file():
        return _listed_parts(path)
    refuse_sqlite(path)
    if not list(path.glob(f'*{SUFFIX}')):
        raise RecordingError(
            path, 'it is a directory without a recording', 'name a file or a bag directory'
        )
    raise RecordingError(
        path, f'it has no {METADATA_FILE}: the recording was cut off', recover_mend(path)
    )


def refuse_sqlite(path: Path) -> None:
    """
    Make sure that a directory is not a bag of rosbag2's other storage.

    Raises
    ------
    RecordingError
        If it is one.

    """
    if list(path.glob('*.db3*')):
        raise RecordingError(path, 'it is a bag of storage sqlite3', convert_mend(path))


def _listed_parts(path: Path) -> list[Path]:
    """Return the files that a description lists; they stand beside it, whatever it says."""
    description = _read(path)
    try:
        storage = description['storage_identifier']
        names = [PurePath(name).name for name in description['relative_file_paths']]
        mode = description.get('compression_mode') or ''
    except (KeyError, TypeError) as error:
        raise _unreadable(path, f'{error} is missing or wrong') from error
    if storage != _STORAGE:
        raise RecordingError(path, f'it is a bag of storage {storage}', convert_mend(path))
    if str(mode).lower() not in ('', 'none'):
        raise RecordingError(
            path, f'rosbag2 has compressed each {str(mode).lower()} of it', convert_mend(path)
        )
    missing = [name for name in names if not (path / name).is_file()]
    if missing or not names:
        raise RecordingError(
            path, f'{missing[0] if missing else "its list of files"} is missing', 'put it back'
        )
    return [path / name for name in names]


def _read(path: Path) -> dict[str, Any]:
    """Return what stands in the description of a bag."""
    try:
        text = (path / METADATA_FILE).read_text(encoding='utf-8')
        description = yaml.safe_load(text)[ROOT]
    except (OSError, ValueError, KeyError, TypeError, yaml.YAMLError) as error:
        raise _unreadable(path, type(error).__name__) from error
    if not isinstance(description, dict):
        raise _unreadable(path, 'it is no table')
    return description


def _unreadable(path: Path, problem: str) -> RecordingError:
    return RecordingError(
        path, f'its {METADATA_FILE} cannot be read ({problem})', recover_mend(path)
    )


def _refuse_gaps(layout: Layout, parts: list[Path]) -> None:
    for number, part in enumerate(parts):
        if part != layout.part(number):
            raise missing_part(layout.part(number))


def missing_part(path: Path) -> RecordingError:
    """Return the refusal of a run that has lost one of its files."""
    return RecordingError(
        path, 'this part of the run is missing', 'put it back, or open parts one by one'
    )
