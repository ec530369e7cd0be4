"""Recovers whatever a path names: a file, the parts of a run, a bag directory."""

import shutil
from pathlib import Path

from stickslip_ros.errors import RecordingError
from stickslip_ros.recording.bag_metadata import write_metadata
from stickslip_ros.recording.layout import SUFFIX, Layout
from stickslip_ros.recording.recover import Recovery, recover_file
from stickslip_ros.recording.run_parts import is_finished_bag, refuse_sqlite

MARK = '.recovered'
"""What is added to the name of a recovered file or directory."""


def recover(path: Path, output: Path | None = None) -> tuple[list[Recovery], Path | None]:
    """
    Make a recording readable, and leave the original as it is.

    Parameters
    ----------
    path : Path
        An MCAP file, a bag directory, or the name that numbered parts share.
    output : Path, optional
        Where the readable copy goes; by default beside the original, ``run.recovered.mcap`` or
        the directory ``run.recovered``.

    Returns
    -------
    list of Recovery
        What became of each file.
    Path or None
        What was written: a file, a directory, the ``metadata.yaml`` that was missing in a bag of
        whole files, or nothing for a recording that is whole.

    Raises
    ------
    RecordingError
        If there is nothing to recover, or the copy exists or cannot be written.

    """
    if path.is_dir():
        return _recover_bag(path, output)
    layout = Layout.plan(path, split=True)
    parts = [] if path.exists() else layout.parts()
    if not parts:
        target = output or path.with_name(f'{layout.stem}{MARK}{SUFFIX}')
        recovery = recover_file(path, target)
        return [recovery], None if recovery.is_whole else target
    copy = Layout.plan(output or path.with_name(f'{layout.stem}{MARK}{SUFFIX}'), split=True)
    return _recover_parts(parts, copy)


def _recover_bag(path: Path, output: Path | None) -> tuple[list[Recovery], Path | None]:
    parts = _files(path)
    copy = Layout.plan(output or path.with_name(f'{path.name}{MARK}'), bag=True)
    recoveries, written = _recover_parts(parts, copy)
    if written is not None:
        write_metadata(copy.folder, copy.parts())
        return recoveries, written
    if is_finished_bag(path):
        return recoveries, None
    return recoveries, write_metadata(path, parts)


def _files(path: Path) -> list[Path]:
    """List the files of a bag that may not say so itself."""
    refuse_sqlite(path)
    parts = sorted(path.glob(f'*{SUFFIX}'), key=_by_number)
    if not parts:
        raise RecordingError(path, 'there is no MCAP file in it', 'name the directory of a bag')
    return parts


def _by_number(path: Path) -> tuple[str, int, str]:
    stem, _, number = path.stem.rpartition('_')
    is_number = number.isascii() and number.isdecimal()
    return (stem, int(number), path.name) if is_number else (path.stem, -1, path.name)


def _recover_parts(parts: list[Path], copy: Layout) -> tuple[list[Recovery], Path | None]:
    """Recover what is damaged; if anything is, copy what is whole beside it."""
    copy.refuse_existing()
    recoveries = [recover_file(part, copy.part(n), is_part=True) for n, part in enumerate(parts)]
    if all(recovery.is_whole for recovery in recoveries):
        return recoveries, None
    for number, recovery in enumerate(recoveries):
        if recovery.is_whole:
            _copy(Path(recovery.source), copy.part(number))
    return recoveries, copy.path


def _copy(source: Path, target: Path) -> None:
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, target)
    except OSError as error:
        raise RecordingError(
            target, f'it cannot be written ({error.strerror})', 'choose another place with -o'
        ) from error
