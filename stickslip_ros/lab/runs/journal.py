# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The journal of a study: results are appended as they arrive, so an interrupted study continues.

One JSON object per line; the first line identifies the study. Floats survive to the bit. A torn
last line is dropped; a line interrupted by Ctrl-C may appear twice.

"""

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import stickslip_ros
from stickslip_ros.budget import load_json
from stickslip_ros.errors import RecordingError
from stickslip_ros.lab.measurements.sweep_table import Row
from stickslip_ros.parameters import Parameters

try:
    import fcntl
except ImportError:  # of Windows, where a journal has no lock
    fcntl = None  # type: ignore[assignment]


_HINT = 'start again with --fresh, or choose another output'


@dataclass(frozen=True)
class JournalIdentity:
    """The identity of a study; the digest includes all parameters."""

    study: str
    version: str
    cases: int
    digest: str


def identify(
    study: str, parameters: Parameters, cases: int, settings: Mapping[str, object]
) -> JournalIdentity:
    """Return the identity of a study with these settings (JSON values)."""
    version = stickslip_ros.__version__
    content = [study, version, cases, parameters.flat(), dict(settings)]
    text = json.dumps(content, sort_keys=True)
    return JournalIdentity(study, version, cases, hashlib.sha256(text.encode()).hexdigest())


class Journal:
    """The file of finished cases, a context; refuses a file in use or of another study."""

    def __init__(self, path: Path, identity: JournalIdentity, *, fresh: bool = False) -> None:
        self.path = path
        self.rows: dict[int, Row] = {}
        self._identity = identity
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
        header = {'journal': stickslip_ros.__name__, **asdict(self._identity)}
        whole, newline, _ = content.rpartition(b'\n')
        if not newline and _line(header).startswith(content):
            self._file.truncate(0)
            self._write(header)
            return
        first, *lines = whole.split(b'\n')
        if first + b'\n' != _line(header):
            raise RecordingError(self.path, _difference(first, header), _HINT)
        for number, line in enumerate(lines, start=2):
            try:
                entry = load_json(line)
                case, row = int(entry['case']), dict(entry['row'])
            except (ValueError, KeyError, TypeError):
                case, row = -1, {}
            if not 0 <= case < self._identity.cases:
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


def _difference(first: bytes, header: Mapping[str, object]) -> str:
    """Return how the first line of a file differs from the expected header."""
    try:
        theirs = load_json(first)
    except ValueError:
        theirs = None
    if not isinstance(theirs, dict) or theirs.get('journal') != header['journal']:
        return 'is not a journal of a study'
    for name in ('study', 'version', 'cases'):
        if theirs.get(name) != header[name]:
            return f'is of another study: {name} {theirs.get(name)!r}, not {header[name]!r}'
    return 'is of another study: its parameters or the values of its cases are different'
