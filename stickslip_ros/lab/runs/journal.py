# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The journal of a study: results are appended as they arrive, so an interrupted study continues.

One JSON object per line; the first line has the study and the number of its cases. Floats survive
to the bit. A torn last line is dropped; a line interrupted by Ctrl-C may appear twice.

"""

import json
import os
from collections.abc import Mapping
from pathlib import Path

import stickslip_ros
from stickslip_ros.budget import load_json
from stickslip_ros.errors import RecordingError
from stickslip_ros.lab.measurements.sweep_table import Row

try:
    import fcntl
except ImportError:  # of Windows, where a journal has no lock
    fcntl = None  # type: ignore[assignment]


_HINT = 'start again with --fresh, or choose another output'


class Journal:
    """The file of finished cases, a context; refuses a file in use or of another study."""

    def __init__(self, path: Path, study: str, cases: int, *, fresh: bool = False) -> None:
        self.path = path
        self.rows: dict[int, Row] = {}
        self._header = {'journal': stickslip_ros.__name__, 'study': study, 'cases': cases}
        self._cases = cases
        try:
            # Unbuffered: the kernel has each line at once.
            self._file = path.open('ab+', buffering=0)
        except OSError as error:
            problem = f'cannot be written ({error.strerror})'
            raise RecordingError(path, problem, 'choose another folder') from None
        try:
            try:  # the lock ends with the process
                if fcntl is not None:
                    fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                hint = 'wait for it, or choose another output'
                raise RecordingError(path, 'is in use by another run', hint) from None
            if fresh:
                self._file.truncate(0)
            self._take_up()
        except BaseException:
            self._file.close()
            raise

    def __enter__(self) -> 'Journal':
        return self

    def __exit__(self, *_: object) -> None:
        """Close the file; remove it if it is empty."""
        self._file.close()
        if not self.rows:
            self.remove()

    def append(self, case: int, row: Row) -> None:
        """Add a finished case; RecordingError if the disk is full."""
        self._write({'case': case, 'row': row})
        self.rows[case] = row

    def remove(self) -> None:
        """Close and remove the file of a complete study."""
        self._file.close()
        self.path.unlink(missing_ok=True)

    def _take_up(self) -> None:
        """Read finished cases, drop a torn end, or start a new journal."""
        self._file.seek(0)
        content = self._file.readall()
        whole, newline, _ = content.rpartition(b'\n')
        if not newline and _line(self._header).startswith(content):
            self._file.truncate(0)
            self._write(self._header)
            return
        first, *lines = whole.split(b'\n')
        if first + b'\n' != _line(self._header):
            problem = 'is no journal, or one of another version, or of other parameters or values'
            raise RecordingError(self.path, problem, _HINT)
        for number, line in enumerate(lines, start=2):
            try:
                entry = load_json(line)
                case, row = int(entry['case']), dict(entry['row'])
            except (ValueError, KeyError, TypeError):
                case, row = -1, {}
            if not 0 <= case < self._cases:
                raise RecordingError(self.path, f'line {number} is damaged', _HINT)
            self.rows[case] = row
        self._file.truncate(len(whole) + 1)

    def _write(self, content: Mapping[str, object]) -> None:
        line = _line(content)
        try:
            written = os.write(self._file.fileno(), line)
        except OSError as error:
            problem = f'cannot be written ({error.strerror})'
            raise RecordingError(self.path, problem, 'make room; what is done is kept') from None
        if written != len(line):
            raise RecordingError(self.path, 'the disk is full', 'make room; what is done is kept')


def _line(content: Mapping[str, object]) -> bytes:
    return json.dumps(content).encode() + b'\n'
