# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Convert tables of spreadsheets and measuring programs to CSV text."""

import csv
import gzip
import io
import logging
import math
import struct
import warnings
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip_ros.budget import NAMES_MOST, NUMBERS_MOST, TABLE_BYTES, TAGS
from stickslip_ros.errors import RecordingError, StickSlipError, WrongKind
from stickslip_ros.extras import load_extra
from stickslip_ros.files import read_bytes, readable

if TYPE_CHECKING:
    from pandas import DataFrame

    Table = str | Path | DataFrame | Mapping[str, Sequence[float]]

# ruff: noqa: PLC0415 - slow imports

DATA_FRAME = 'DataFrame'  # name of a table without a file
Columns = Iterable[tuple[str, str, Any]]  # name, unit and numbers of each column
Sources = Iterator[tuple[str, Path | bytes]]  # origin; text or path
BLOCK_BYTES = 1 << 20
_EPOCH = np.datetime64(0, 's')
EMPTY_ROW = 48  # cells that an empty row counts as; a sheet has at most a million rows
EXCEL_ERRORS = frozenset(('#NULL!', '#DIV/0!', '#VALUE!', '#REF!', '#NAME?', '#NUM!', '#N/A'))
MATLAB_HDF5, MATLAB_HEAD_BYTES, MATLAB_ORDERS = b'MATLAB 7.3', 128, {b'IM': '<', b'MI': '>'}
MATLAB_MATRIX, MATLAB_PACKED, MATLAB_STRUCT, MATLAB_NUMBERS = 14, 15, 2, range(6, 16)
"""Types of elements, and classes of a struct and of numeric matrices."""
MATLAB_TYPES = {1: 'i1', 2: 'u1', 3: 'i2', 4: 'u2', 5: 'i4', 6: 'u4', 7: 'f4', 9: 'f8'}
MATLAB_TYPES |= {12: 'i8', 13: 'u8'}  # stored types, and their names in numpy
INCREMENTS = {'wf_increment': 'wf_start_offset', 'tinterval': 'tstart', 'xinc': 'xorg'}
INCREMENTS |= {'dt_s': 't0_s'}
"""Names of numbers with the time step, s, and the first time, s, of vectors; lower case."""
Timed = Iterable[tuple[str, str, Any, tuple[float, float] | None]]
"""Name, unit, numbers, start and increment (if known) of each column."""


def tables_in(path: 'Path | DataFrame', *, is_named: bool = False) -> Sources:
    """
    Yield origin and CSV text of each table, or the path of a text file; one table per sheet.

    If the user names columns, the vectors of each length are a table. Raises RecordingError for
    unreadable or too large files, and for vectors of several lengths without a named column.

    """
    if not isinstance(path, Path):
        yield getattr(path, 'attrs', {}).get('source', DATA_FRAME), _csv(path)
        return
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        yield str(path), path
        return
    try:
        if suffix == '.gz':
            with gzip.open(readable(path)) as packed:
                content = packed.read(TABLE_BYTES.most + 1)
            TABLE_BYTES.check(len(content), path)
            yield str(path), content
            return
        if suffix == '.xlsx':
            yield from read_sheets(readable(path))
            return
        tables = READERS[suffix](readable(path))
    except StickSlipError:
        raise
    except Exception as error:  # noqa: BLE001 - six libraries have many exceptions
        problem = f'cannot be read as {suffix} ({" ".join(str(error).split())[:200]})'
        raise RecordingError(path, problem, 'check the file, or save it as CSV') from None
    if len(tables) > 1 and not is_named:
        lengths = '; '.join(f'{", ".join(map(str, each))} of {len(each)}' for each in tables)
        hint = 'name vectors of one length: --map time_s="NAME (s)" --map voltage_v="NAME (V)"'
        raise RecordingError(path, f'has vectors of several lengths: {lengths}', hint)
    for each in tables:
        part = f', vectors of {len(each)}' if len(tables) > 1 else ''
        yield f'{path}{part}', _csv(each)


def _csv(given: 'DataFrame') -> bytes:
    """Return a frame or columns as CSV text; a named index becomes a column."""
    from pandas import DataFrame

    try:
        frame = DataFrame(given)
    except (TypeError, ValueError):
        hint = "give a path, a Run, a DataFrame or columns as {'time_s': [0, 1]}"
        raise WrongKind('data', given, 'a table with columns of one length', hint) from None
    if frame.index.name is None and frame.index.dtype.kind in 'mM':
        frame = frame.rename_axis('time')
    frame = frame if frame.index.name is None else frame.reset_index()
    for name in frame.select_dtypes('timedelta'):
        seconds = frame[name].dt.total_seconds()
        frame = frame.assign(**{str(name): seconds}).rename(columns={name: f'{name} (s)'})
    is_named = frame.columns.inferred_type != 'integer'  # pandas 3 has text of type str
    if not (is_named or isinstance(given, DataFrame)):
        hint = "write {'time_s': rows[:, 0], 'position_m': rows[:, 1]}"
        raise WrongKind('data', given, 'a table whose columns have names', hint)
    content: str = frame.to_csv(index=False, header=is_named)
    return content.encode(errors='replace')


def read_sheets(path: Path) -> Sources:
    """Yield the cells of each sheet as CSV."""
    openpyxl = load_extra(f'a table {path.suffix}', 'openpyxl')
    warnings.filterwarnings('ignore', module='openpyxl')
    tags, size_bytes, stored_bytes = 0, 0, path.stat().st_size
    with zipfile.ZipFile(path) as archive:
        NAMES_MOST.check(len(archive.infolist()), path)
        for part in archive.infolist():
            with archive.open(part) as stream:
                end = b''
                while block := stream.read(BLOCK_BYTES):
                    tags, size_bytes = tags + block.count(b'<'), size_bytes + len(block)
                    TABLE_BYTES.check(size_bytes, path)
                    TAGS.check(tags, path, stored_bytes)
                    end = (end[-8:] + block).replace(b'\0', b'')  # may be UTF-16
                    if b'<!DOCTYPE' in end:  # entities can expand to any length
                        raise ValueError(f'{part.filename} has a DOCTYPE, unlike any workbook')
    with closing(openpyxl.load_workbook(path, read_only=True, data_only=True)) as book:
        cells = size_bytes = 0
        for sheet in book.worksheets:
            text = io.StringIO()
            writer = csv.writer(text, lineterminator='\n')
            sheet.reset_dimensions()  # some programs write wrong dimensions
            for row in sheet.iter_rows(values_only=True):
                cells += len(row) or EMPTY_ROW
                NUMBERS_MOST.check(cells, path, stored_bytes)
                size_bytes += sum(len(each) for each in row if isinstance(each, str))
                TABLE_BYTES.check(size_bytes, path)  # many cells may share a text
                writer.writerow(None if each in EXCEL_ERRORS else each for each in row)
            origin = f'{path}, sheet {sheet.title}' if len(book.worksheets) > 1 else str(path)
            yield origin, text.getvalue().encode()


def check_parquet(path: Path) -> Any:
    """Return the metadata of a Parquet file; refuse it above the size limits."""
    parquet = load_extra(f'a table {path.suffix}', 'pyarrow.parquet')
    metadata = parquet.read_metadata(path)
    NAMES_MOST.check(metadata.num_columns, path)
    groups = [metadata.row_group(at) for at in range(metadata.num_row_groups)]
    columns = [each.column(at) for each in groups for at in range(each.num_columns)]
    NUMBERS_MOST.check(sum(each.num_values for each in columns), path, path.stat().st_size)
    TABLE_BYTES.check(sum(each.total_byte_size for each in groups), path)
    return metadata


def read_parquet(path: Path) -> 'list[DataFrame]':
    """Return a table after checking its size."""
    metadata = check_parquet(path)
    import pandas as pd

    schema = (metadata.schema.column(at) for at in range(metadata.num_columns))
    flat = [each for each in schema if each.path == each.name]  # no nested columns
    return [pd.read_parquet(path, columns=[e.name for e in flat if 'BYTE' not in e.physical_type])]


def read_hdf5(path: Path) -> 'list[DataFrame]':
    """
    Return datasets, with units from attributes such as ``units`` or ``Unit``.

    If groups share a dataset's name, names are paths, and the times of a group come first.

    """
    h5py = load_extra(f'a table {path.suffix}', 'h5py')
    found: list[Any] = []

    def take(name: str, each: Any) -> None:
        if isinstance(each, h5py.Dataset) and each.dtype.kind in 'fiu' and _is_vector(each.shape):
            if each.external or each.is_virtual:
                raise ValueError(f'{name} stands in another file; copy it into this one')
            found.append(each)
            NAMES_MOST.check(len(found), path)

    def unit_of(each: Any) -> str:
        units = (each.attrs[key] for key in each.attrs if key.lower() in {'unit', 'units'})
        unit = next(units, '')
        text = unit.decode(errors='replace') if isinstance(unit, bytes) else str(unit)
        return text.encode(errors='replace').decode()

    with h5py.File(path) as file:
        file.visititems(take)
        numbers = sum(max(each.size, math.prod(each.chunks or ())) for each in found)
        NUMBERS_MOST.check(numbers, path, path.stat().st_size)
        names = [each.name.rpartition('/')[2] for each in found]
        if len({*names}) < len(names):
            found.sort(key=lambda each: (each.name.rpartition('/')[0], unit_of(each) != 's'))
            names = [each.name.removeprefix('/') for each in found]
        clocks = [_clock_of({**each.parent.attrs, **each.attrs}) for each in found]
        columns = [(n, unit_of(e), e[()]) for n, e in zip(names, found, strict=True)]
    is_timed = [unit == 's' for _, unit, _ in columns]
    if not any(is_timed) and any(clocks):
        return _timed(path, ((*e, clock) for e, clock in zip(columns, clocks, strict=True)))
    return _joined(path, columns, has_clocks=sum(is_timed) > 1 and is_timed[0])


def read_numpy(path: Path) -> 'list[DataFrame]':
    """Return the vectors of a numpy archive, or of an array with fields or columns."""
    stored_bytes = path.stat().st_size
    if path.suffix.lower() == '.npy':
        NUMBERS_MOST.check(stored_bytes // 8, path)
        columns = enumerate(np.atleast_2d(np.load(path, allow_pickle=False).T), 1)
        return _joined(path, _vectors((f'column {number}', each) for number, each in columns))
    with zipfile.ZipFile(path) as archive:
        NAMES_MOST.check(len(archive.infolist()), path)
        unpacked_bytes = sum(each.file_size for each in archive.infolist())
        TABLE_BYTES.check(unpacked_bytes, path)
        NUMBERS_MOST.check(unpacked_bytes // 8, path, stored_bytes)
    with np.load(path, allow_pickle=False) as found:
        return _counted(path, _vectors((name, found[name]) for name in found.files))


def _vectors(arrays: Iterable[tuple[str, Any]]) -> Columns:
    """Return the numbers of named arrays and of their fields, as columns without a unit."""
    found = list[tuple[str, str, Any]]()
    for name, array in arrays:
        parts = [(field, array[field]) for field in array.dtype.names or ()] or [(name, array)]
        found += [(part, '', each) for part, each in parts if each.dtype.kind in 'fiu']
    return found


def read_matlab(path: Path) -> 'list[DataFrame]':
    """Return vectors of version 5; files from version 7.3 on are HDF5."""
    with path.open('rb') as file:
        head = file.read(MATLAB_HEAD_BYTES)
    if head.startswith(MATLAB_HDF5):
        return read_hdf5(path)
    if head[-2:] not in MATLAB_ORDERS:
        raise ValueError('it is no file of version 5 or later; save it with -v7')
    content = read_bytes(path, 'check the path')[MATLAB_HEAD_BYTES:]
    return _counted(path, _matlab_vectors(path, content, MATLAB_ORDERS[head[-2:]]))


def _matlab_vectors(path: Path, content: bytes, order: str) -> Columns:
    """Yield real vectors of version 5; not by scipy, which crashes on damaged files."""
    room = TABLE_BYTES.most
    for count, (kind, data) in enumerate(_elements(content, order)):
        NAMES_MOST.check(count, path)
        if kind == MATLAB_PACKED:
            unpacked = zlib.decompressobj().decompress(data, room + 1)
            room -= len(unpacked)
            TABLE_BYTES.check(TABLE_BYTES.most - room, path)
            NUMBERS_MOST.check((TABLE_BYTES.most - room) // 8, path, len(content))
            kind, data = next(_elements(unpacked, order))  # noqa: PLW2901
        if kind != MATLAB_MATRIX:
            continue
        yield from _matlab_matrix(data, order)


def _matlab_matrix(data: bytes, order: str, field: str = '') -> Columns:
    """Yield a vector or number, or the fields of a struct."""
    (_, flags), (_, sizes), (_, name), *parts = _elements(data, order)
    shape = np.frombuffer(sizes, f'{order}i4').tolist()
    [described, *_] = np.frombuffer(flags, f'{order}u4').tolist()
    if described & 0xFF == MATLAB_STRUCT and not field and math.prod(shape) == 1:
        (_, size), (_, names), *values = parts
        [length] = np.frombuffer(size, f'{order}i4').tolist()
        fields = [names[at : at + length] for at in range(0, len(names), max(length, 1))]
        for each, (_, value) in zip(fields, values, strict=True):
            yield from _matlab_matrix(value, order, each.rstrip(b'\0').decode(errors='replace'))
    elif described & 0xFF in MATLAB_NUMBERS and len(parts) == 1 and max(shape) == math.prod(shape):
        [(stored, numbers)] = parts
        vector = np.frombuffer(numbers, order + MATLAB_TYPES[stored])
        if len(vector) != math.prod(shape):
            raise ValueError(f'{len(vector)} of {math.prod(shape)} numbers are there')
        native = vector.astype(vector.dtype.newbyteorder('='))
        yield field or bytes(name).decode(errors='replace'), '', native


def _elements(content: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Yield type and content of successive elements; small content lies in the header."""
    at = 0
    while at < len(content):
        kind, size_bytes = struct.unpack_from(f'{order}II', content, at)
        small_bytes, begin = kind >> 16, at + 8
        if small_bytes:
            kind, size_bytes, begin = kind & 0xFFFF, small_bytes, at + 4
        yield kind, content[begin : begin + size_bytes]
        end = at + 8 if small_bytes else begin + size_bytes
        at = end if kind == MATLAB_PACKED else end + -end % 8


def read_tdms(path: Path) -> 'list[DataFrame]':
    """Return the channels, each after its times, from increment, offset and start."""
    nptdms = load_extra(f'a table {path.suffix}', 'nptdms')
    nptdms.log.log_manager.set_level(logging.CRITICAL)  # it logs many lines on damage
    with nptdms.TdmsFile.open(path) as tdms:
        if tdms.file_status.incomplete_final_segment:
            raise ValueError('it was cut off')
        channels = [each for group in tdms.groups() for each in group.channels() if len(each)]
        NUMBERS_MOST.check(2 * sum(map(len, channels)), path, path.stat().st_size)
        known = [
            e.properties['wf_start_time'] for e in channels if 'wf_start_time' in e.properties
        ]
        first = min(known, default=_EPOCH)
        columns = []
        for each in channels:
            told, clock = each.properties, _clock_of(each.properties)
            if clock:
                late_s = float((told.get('wf_start_time', first) - first) / np.timedelta64(1, 's'))
                clock = late_s + clock[0], clock[1]
            columns.append((each.name, told.get('unit_string', ''), each[:], clock))
    return _timed(path, columns)


def _clock_of(values: Mapping[str, Any]) -> tuple[float, float] | None:
    """Return start and increment, s, from values with names in INCREMENTS, or None."""
    lower = {name.lower(): np.ravel(value) for name, value in values.items()}
    known = {n: float(e[0]) for n, e in lower.items() if e.size == 1 and e.dtype.kind in 'fiu'}
    for step, start in INCREMENTS.items():
        if known.get(step, 0.0) > 0.0:
            return known.get(start, 0.0), known[step]
    return None


def _counted(path: Path, columns: Columns) -> 'list[DataFrame]':
    """Join vectors, with times if a number in the file is their increment."""
    listed = list(columns)
    clock = _clock_of({name: numbers for name, _, numbers in listed})
    vectors = [each for each in listed if np.size(each[2]) > 1]
    if clock and not any('time' in name.lower() for name, *_ in vectors):
        return _timed(path, ((*each, clock) for each in vectors))
    return _joined(path, listed)


def _timed(path: Path, columns: Timed) -> 'list[DataFrame]':
    """Join columns, each after the times of its clock."""
    found, last = list[tuple[str, str, Any]](), None
    for *column, clock in columns:
        if clock and (*clock, len(column[2])) != last:
            last = *clock, len(column[2])
            found.append(('time', 's', clock[0] + clock[1] * np.arange(len(column[2]))))
        found.append(tuple(column))
    return _joined(path, found, has_clocks=last is not None)


def _is_vector(shape: Sequence[int]) -> bool:
    return 1 < math.prod(shape) == max(shape)


def _joined(path: Path, columns: Columns, *, has_clocks: bool = False) -> 'list[DataFrame]':
    """
    Join the vectors of each length to a table; refuse two vectors with one name.

    With clocks (columns of times before their values) all vectors are one table; shorter columns
    end with empty cells.

    """
    import pandas as pd

    names, by_length = list[str](), dict[int, list[Any]]()
    for name, unit, values in columns:
        if _is_vector(np.shape(values)):
            flat, header = np.ravel(values), f'{name} ({unit})' if unit else name
            # pandas 3 refuses names that are no UTF-8.
            header = header.encode(errors='backslashreplace').decode()
            if header in names and not (has_clocks and unit == 's'):
                raise ValueError(f'it has two vectors {header}; rename one')
            names.append(header)
            of_length = by_length.setdefault(0 if has_clocks else len(flat), [])
            of_length.append(pd.Series(flat, name=header))
    NAMES_MOST.check(len(names), path)
    NUMBERS_MOST.check(sum(len(e) * max(map(len, e)) for e in by_length.values()), path)
    if not by_length:
        raise ValueError('it has no vector of numbers')
    return [pd.concat(each, axis=1) for each in by_length.values()]


READERS: dict[str, Callable[[Path], 'list[DataFrame]']] = {
    '.parquet': read_parquet,
    '.h5': read_hdf5,
    '.hdf5': read_hdf5,
    '.mat': read_matlab,
    '.npz': read_numpy,
    '.npy': read_numpy,
    '.tdms': read_tdms,
}
"""Readers by suffix, next to workbooks."""
SUFFIXES = {'.xlsx', '.gz', *READERS}
