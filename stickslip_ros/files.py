# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Check input and output files before the work begins."""

import contextlib
import os
import secrets
from collections.abc import Iterator
from pathlib import Path

from stickslip_ros.budget import TABLE_BYTES, YAML_CHARACTERS, Limit
from stickslip_ros.errors import RecordingError


def readable(path: Path) -> Path:
    """Return a path; refuse a device, a pipe or a socket, which may never end."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise RecordingError(path, 'is a device or a pipe, not a file', 'copy it to a file first')
    return path


def read_bytes(path: Path, hint: str, length: int = -1, limit: Limit = TABLE_BYTES) -> bytes:
    """Return a file's content, or its first ``length`` bytes; RecordingError gives the hint."""
    try:
        with readable(path).open('rb') as file:
            if length < 0:
                limit.check(os.fstat(file.fileno()).st_size, path)
            return file.read(length)
    except OSError as error:
        raise RecordingError(path, f'cannot be read ({error.strerror})', hint) from None


def read_text(path: Path, hint: str, form: str) -> str:
    """Return the text of a file; if it is not UTF-8, RecordingError tells the expected form."""
    try:
        return read_bytes(path, hint, limit=YAML_CHARACTERS).decode()
    except UnicodeDecodeError:
        raise RecordingError(path, 'is not text in UTF-8', form) from None


def check_folder(folder: Path) -> None:
    """Refuse a missing folder, and name the folder to make."""
    if missing := [each for each in (folder, *folder.parents) if not each.exists()]:
        hint = f'make {folder}, or choose another'
        raise RecordingError(missing[-1], 'is a folder that does not exist', hint)


def make_folder(folder: Path) -> None:
    """Create a folder if needed, and check that files can be written to it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        problem = f'cannot be made ({error.strerror})'
        raise RecordingError(folder, problem, 'choose another folder') from None
    if not os.access(folder, os.W_OK | os.X_OK):
        raise RecordingError(folder, 'cannot be written', 'choose another folder')


SWEEP_PARTS = 'part-*-of-*.parquet'  # files of a sweep in a folder
RUN_ENDINGS, PAGE_ENDINGS = ('.mcap', ''), ('.html', '.htm')


def prepare_output(path: Path, *, is_new: bool = False, endings: tuple[str, ...] = ()) -> None:
    """Check name and folder of a file to be written; ``is_new``: it must not exist."""
    if endings and path.suffix.lower() not in endings:
        problem = f'is not a name that ends with {endings[0]}'
        more = '; stickslip export makes tables' * (endings == RUN_ENDINGS)
        raise RecordingError(path, problem, f'end its name so{more}')
    if path.is_dir():
        raise RecordingError(path, 'is a folder', 'choose another name')
    if is_new and path.exists():
        raise RecordingError(path, 'it exists and is not overwritten', 'choose another name')
    if path.exists() and not path.is_file():
        raise RecordingError(path, 'is a device or a pipe, not a file', 'choose another name')
    check_folder(path.parent)
    make_folder(path.parent)


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """
    Yield a temporary file to write to; when complete, it replaces the file at the path.

    Its name is hidden, so that no reader takes it for a part of a folder of tables, and is its
    own, as two workers of a cluster may write the same table.

    """
    part = path.with_name(f'.{path.name}.{secrets.token_hex(4)}.part')
    try:
        check_folder(path.parent)
        yield part
        _keep_on_disk(part)
        part.replace(path)
    except OSError as error:
        problem = f'cannot be written ({error.strerror or error})'
        raise RecordingError(path, problem, 'choose another place') from None
    finally:
        with contextlib.suppress(OSError):
            part.unlink()


def _keep_on_disk(path: Path) -> None:
    """Put a file onto the disk, so that a crash of the machine leaves it whole or absent."""
    with path.open('rb') as file:
        os.fsync(file.fileno())
