"""Experiment files: CSV with units in the header, refused by line, column and value."""

import csv
import difflib
import io
import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.files import read_bytes
from stickslip_ros.parameters import Spec, spec_of
from stickslip_ros.study.sweep import AMPLITUDE, FREQUENCY

BY_AMPLITUDE, OVER_TIME = 'experiment by amplitude', 'experiment over time'
COMMENT, SIGMA = '#', '_sigma_'


def _measured(unit: str, text: str, largest: float) -> Spec:
    return Spec(float, 0.0, unit, 'measured', text, -largest, largest)


def _sigma(unit: str, text: str) -> Spec:
    return Spec(float, 0.0, unit, 'measured', f'standard deviation of {text}', 0.0)


POINT_COLUMNS: Mapping[str, Spec] = {
    'preload_n': spec_of('stand.preload'),
    'amplitude_m': AMPLITUDE,
    'frequency_hz': FREQUENCY,
    'force_n': _measured('N', 'generated force, mean over a cycle', 1e3),
    'step_length_m': _measured('m', 'net motion per cycle of a free runner', 1.0),
    'amplitude_sigma_m': _sigma('m', 'the amplitude'),
    'force_sigma_n': _sigma('N', 'the force'),
    'step_length_sigma_m': _sigma('m', 'the step length'),
}
TIME_COLUMNS: Mapping[str, Spec] = {
    'time_s': _measured('s', 'time of the sample; each after the one before', 1e12),
    'position_m': _measured('m', 'position of the runner', 1.0),
    'force_n': _measured('N', 'force on the load cell', 1e3),
    'voltage_v': _measured('V', 'voltage at the piezo', 1e5),
    'foot_m': _measured('m', 'displacement of the feet', 1.0),
    'position_sigma_m': _sigma('m', 'the position'),
    'force_sigma_n': _sigma('N', 'the force'),
    'voltage_sigma_v': _sigma('V', 'the voltage'),
    'foot_sigma_m': _sigma('m', 'the displacement'),
}
COLUMNS = {BY_AMPLITUDE: POINT_COLUMNS, OVER_TIME: TIME_COLUMNS}
NEEDED = {BY_AMPLITUDE: ('preload_n', 'amplitude_m'), OVER_TIME: ('time_s',)}
MEASURED = {
    BY_AMPLITUDE: ('force_n', 'step_length_m'),
    OVER_TIME: ('position_m', 'force_n', 'voltage_v', 'foot_m'),
}
"""Columns of which at least one must be there."""


@dataclass(frozen=True, eq=False)
class Experiment:
    """
    A measured table.

    Attributes
    ----------
    origin : str
        File that it came from.
    kind : str
        BY_AMPLITUDE or OVER_TIME.
    columns : dict of str to array, shape (rows,)
        Finite numbers in SI units, by column.
    notes : tuple of str
        Lines that began with ``#``, in front of the header.

    """

    origin: str
    kind: str
    columns: dict[str, Array]
    notes: tuple[str, ...] = ()


def sigma_name(name: str) -> str:
    """Return the column with the uncertainty of another one, ``force_sigma_n`` of ``force_n``."""
    stem, _, unit = name.rpartition('_')
    return f'{stem}{SIGMA}{unit}'


def read_experiment(path: Path) -> Experiment:
    """
    Read an experiment file.

    Raises
    ------
    StickSlipError
        If it cannot be read or is not as docs/compare.md says; names line, column and value.

    """
    return parse_experiment(read_bytes(path, 'check the path'), str(path))


def parse_experiment(content: bytes, origin: str) -> Experiment:
    """Do what ``read_experiment`` does, with the content of a file."""
    try:
        text = content.decode('utf-8-sig')
    except UnicodeDecodeError as error:
        problem = f'byte {error.start} is not UTF-8'
        raise RecordingError(origin, problem, 'save it as CSV in UTF-8') from None
    lines = text.splitlines()
    notes = list(itertools.takewhile(lambda line: line.startswith(COMMENT), lines))
    rows = _rows(text, len(notes), origin)
    number, header = next(rows, (1, []))
    names = [name.strip() for name in header]
    kind = OVER_TIME if 'time_s' in names else BY_AMPLITUDE
    _check_header(names, kind, f'{origin}: line {number}')
    numbered = list(rows)
    if not numbered:
        raise RecordingError(origin, 'has no values below its header', 'give at least one row')
    columns = {}
    for index, name in enumerate(names):
        spec = COLUMNS[kind][name]
        values = [
            _number(cells[index], spec, f'{origin}: line {line}, column {name}:')
            for line, cells in numbered
        ]
        columns[name] = np.array(values, dtype=np.float64)
    if kind == OVER_TIME:
        _check_rising(columns['time_s'], [line for line, _ in numbered], origin)
    return Experiment(origin, kind, columns, tuple(note.lstrip('# ').rstrip() for note in notes))


def _rows(text: str, skipped: int, origin: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the number and the values of each line that is not empty, header first."""
    lines = io.StringIO(''.join(text.splitlines(keepends=True)[skipped:]), newline='')
    reader = csv.reader(lines, strict=True)
    width = 0
    try:
        for row in reader:
            if not any(cell.strip() for cell in row):
                continue
            number = skipped + reader.line_num
            width = width or len(row)
            if len(row) != width:
                problem = f'line {number} has {len(row)} values, the header {width} columns'
                raise RecordingError(origin, problem, 'give one value per column')
            yield number, row
    except csv.Error as error:
        problem = f'line {skipped + reader.line_num} is not CSV ({error})'
        raise RecordingError(origin, problem, 'separate plain numbers with commas') from None


def _check_header(names: Sequence[str], kind: str, where: str) -> None:
    specs = COLUMNS[kind]
    for index, name in enumerate(names):
        if name not in specs:
            raise RecordingError(where, f'column {name!r} is not known', _hint(name, specs))
        if name in names[:index]:
            raise RecordingError(where, f'column {name!r} comes twice', 'take one of them away')
    for name in NEEDED[kind]:
        if name not in names:
            unit = specs[name].unit
            raise RecordingError(where, f'column {name!r} is missing', f'add it, in {unit}')
    if not set(MEASURED[kind]) & set(names):
        choices = ', '.join(MEASURED[kind])
        raise RecordingError(where, 'nothing was measured', f'add at least one of {choices}')
    for name in names:
        if SIGMA in name and name.replace(SIGMA, '_') not in names:
            of_what = name.replace(SIGMA, '_')
            raise RecordingError(where, f'{name!r} is there without {of_what!r}', 'add that one')


def _hint(name: str, specs: Mapping[str, Spec]) -> str:
    """Say how a column may have been meant: most often in another unit."""
    if ';' in name or '\t' in name:
        return 'separate columns with commas, and write decimals with a point'
    stem = re.split(r'[^a-z]', name.lower())[0]
    close = difflib.get_close_matches(name, specs, 1)
    for known in [each for each in specs if stem and each.startswith(stem)] or close:
        return f'give it in {specs[known].unit} under the name {known!r}'
    return f'take it away; known are {", ".join(specs)}'


def _number(text: str, spec: Spec, where: str) -> float:
    value = float(spec.check(where, text.strip()))
    if spec.minimum == 0.0 and spec.maximum is None and value == 0.0:
        hint = 'give the standard deviation, or take the column away'
        raise OutOfRange(where, value, spec.unit, 'not above 0', hint)
    return value


def _check_rising(time_s: Array, lines: Sequence[int], origin: str) -> None:
    wrong = np.flatnonzero(np.diff(time_s) <= 0.0)
    if len(wrong):
        index = int(wrong[0]) + 1
        where = f'{origin}: line {lines[index]}, column time_s:'
        limit = f'not after the {time_s[index - 1]:.9g} s of the row before'
        hint = 'sort the rows, and keep one per time'
        raise OutOfRange(where, float(time_s[index]), 's', limit, hint)
