# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Read numbers of recognised columns in SI units, from text in chunks of rows."""

import io
import re
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.arrays import Array
from stickslip_ros.budget import CELLS_MOST
from stickslip_ros.errors import OutOfRange, RecordingError, WrongKind, quoted
from stickslip_ros.lab.readers.columns import ROW, Column, Found, nanoseconds, resolve_columns
from stickslip_ros.lab.readers.layout import (
    EMPTY,
    OVER_RANGE,
    OVER_RANGE_NUMBER,
    Header,
    TextLayout,
    TextTable,
    to_number,
)
from stickslip_ros.lab.readers.refusal import option_for, unit_to_fill
from stickslip_ros.lab.readers.units import in_si
from stickslip_ros.lab.readers.vocabulary import CLOCK_QUANTITY, Vocabulary
from stickslip_ros.process.stopping import stop_if_asked

Lines = NDArray[np.intp]  # line numbers of rows, from 1
CHUNK_CELLS = 1_000_000  # cells read at once, to limit memory
TIME_DECIMALS = 15  # of computed times, s
_NUMBER = 'a finite number'
_TOO_MANY = 'give one value per column; with decimal commas separate columns by semicolons'


class Rows(NamedTuple):
    """Rows of a table."""

    columns: Sequence[Column]
    numbers: list[Array]  # of each column, SI; NaN for empty cells
    lines: Lines


def read_columns(table: TextTable, found: Found, vocabulary: Vocabulary) -> tuple[Rows, list[str]]:
    """Return complete rows of the columns, and notes; refuse the first wrong cell."""
    columns = resolve_columns(found, table, vocabulary)
    rows, notes = whole_rows(read_rows(table, columns, vocabulary), vocabulary)
    check_values(rows, vocabulary, table)
    return rows, notes


def read_rows(table: TextTable, columns: Sequence[Column], vocabulary: Vocabulary) -> Rows:
    """Read the rows with a number; refuse the first wrong cell or row."""
    parts: list[list[Array]] = [[] for _ in columns]
    lines, empty = list[Lines](), list[Lines]()
    named = 1 + max(each.at for each in table.layout.columns if each.text)
    places = [each.index for each in columns if each.index != ROW.at]
    texts = [each.index for each in columns if each.begin or each.name in vocabulary.words]
    for first, chunk in _chunks(table, texts):
        stop_if_asked()
        is_there = chunk.notna().to_numpy()
        for row in np.flatnonzero(is_there[:, named:].any(axis=1)):
            problem = f'has more values than the {named} columns with names'
            raise RecordingError(f'{table.origin}: line {first + row}', problem, _TOO_MANY)
        kept = is_there[:, places].any(axis=1)
        lines.append(first + np.flatnonzero(kept))
        empty.append(first + np.flatnonzero(~is_there.any(axis=1)))
        for number, column in enumerate(columns):
            parts[number].append(_numbers(chunk[kept], lines[-1], table, column, vocabulary))
    found = Rows(columns, [np.concatenate(each) for each in parts], np.concatenate(lines))
    blank = np.concatenate(empty)
    is_counted = any(each.index == ROW.at for each in columns) and len(found.lines)
    if is_counted and (blank < found.lines[-1]).any():
        problem = 'is empty, so the times of the rows below are unknown'
        raise RecordingError(f'{table.origin}: line {blank[0]}', problem, 'remove the line')
    return found


def _numbers(
    cells: Any, lines: Lines, table: TextTable, column: Column, vocabulary: Vocabulary
) -> Array:
    """Return the numbers of a column, SI; refuse a wrong cell."""
    layout, at = table.layout, column.index
    if at == ROW.at:
        values = np.asarray(lines - layout.first, np.float64)
    else:
        values, wrong = _floats(cells[at], layout, column, vocabulary)
        for row in wrong:
            is_word = column.name in vocabulary.words
            wanted = vocabulary.quantities[column.name].text if is_word else _NUMBER
            hint = 'correct the row, or leave the cell empty'
            where = _place(table, lines[row], column)
            raise WrongKind(where, str(cells[at].iloc[row]), wanted, hint)
    values = in_si(values, column.factor)
    if column.name == CLOCK_QUANTITY and layout.start_s:
        values = np.round(layout.start_s + values, TIME_DECIMALS)
    return values


def _chunks(table: TextTable, texts: Sequence[int]) -> Iterator[tuple[int, Any]]:
    """Yield first line and cells (DataFrame) of chunks of rows; some columns as text."""
    import pandas as pd  # noqa: PLC0415 - slow import

    source, layout, origin = table
    line = layout.first
    if isinstance(source, pd.DataFrame):
        yield line, source
        return
    size_bytes = len(source) if isinstance(source, bytes) else source.stat().st_size
    try:
        stream = io.BytesIO(source) if isinstance(source, bytes) else source.open('rb')
        with io.TextIOWrapper(stream, layout.encoding) as text:
            for _ in range(layout.first - 1):  # a quotation may begin above the first row
                text.readline()
            for chunk in pd.read_csv(
                text,
                sep=layout.delimiter,
                decimal=layout.decimal,
                header=None,
                names=range(len(layout.columns)),
                skip_blank_lines=False,
                skipinitialspace=True,
                keep_default_na=False,
                na_values=[form for each in EMPTY for form in (each, each.upper())],
                float_precision='round_trip',
                chunksize=max(1, CHUNK_CELLS // len(layout.columns)),
                dtype=dict.fromkeys(texts, str),
            ):
                CELLS_MOST.check((line + len(chunk)) * chunk.shape[1], origin, size_bytes)
                yield line, chunk
                line += len(chunk)
    except pd.errors.ParserError as error:
        where, problem = f'{origin}: below line {layout.first}', f'is no table ({error})'
        hint = 'save it again as CSV, with closed quotations'
        if found := re.search(r'Expected (\d+) fields in line (\d+), saw (\d+)', str(error)):
            where, hint = f'{origin}: line {layout.first - 1 + int(found[2])}', _TOO_MANY
            problem = f'has {found[3]} values, the lines above {found[1]}'
        raise RecordingError(where, problem, hint) from None
    except UnicodeDecodeError as error:
        problem = f'is not {layout.encoding} throughout (byte {error.object[error.start]:#x})'
        raise RecordingError(f'{origin}: after line {line}', problem, 'save it in UTF-8') from None


def _floats(
    cells: Any, layout: TextLayout, column: Column, vocabulary: Vocabulary
) -> tuple[Array, NDArray[np.intp]]:
    """Return numbers minus `begin`, NaN if empty or over range, and the rows of wrong cells."""
    if cells.dtype.kind in 'iuf':
        values = cells.to_numpy(dtype=np.float64)
        is_over = np.abs(values) >= OVER_RANGE_NUMBER
        return np.where(is_over, np.nan, values), np.flatnonzero(np.isinf(values))
    texts = [str(cell).strip().lower() for cell in cells.fillna('')]
    if column.unit == '%':
        texts = [text.removesuffix('%').rstrip() for text in texts]
    is_gap = np.array([text in EMPTY or bool(OVER_RANGE.fullmatch(text)) for text in texts], bool)
    texts = list(map(vocabulary.words.get(column.name, str), texts))
    values = np.array([to_number(text, layout.decimal) for text in texts])
    is_gap |= np.abs(values) >= OVER_RANGE_NUMBER
    if column.begin:  # subtract as integers, before the conversion to floats
        whole = [int(text) if text.isdecimal() else nanoseconds(text.upper()) for text in texts]
        pairs = zip(whole, values - column.begin, strict=True)
        values = np.array([each - column.begin if each else value for each, value in pairs])
    return np.where(is_gap, np.nan, values), np.flatnonzero(~np.isfinite(values) & ~is_gap)


def whole_rows(rows: Rows, vocabulary: Vocabulary) -> tuple[Rows, list[str]]:
    """
    Return complete rows, and notes on omitted rows and on times.

    A row needs a time; in a table without times, a number and its settings.

    """
    pairs = [*zip(rows.columns, rows.numbers, strict=True)]
    known = {each.name: ~np.isnan(numbers) for each, numbers in pairs}
    clocks = [numbers for each, numbers in pairs if each.name == CLOCK_QUANTITY]
    found, is_kept = rows.numbers, ~np.all(np.isnan(clocks), axis=0)
    is_lost = np.ones(len(rows.lines), dtype=bool)
    if not clocks:
        whole = {
            name: np.all([known[each] for each in needed if each in known], axis=0)
            for name, needed in vocabulary.needed.items()
            if name in known
        }
        found = [np.where(whole.get(each.name, True), numbers, np.nan) for each, numbers in pairs]
        is_kept = np.any([*whole.values()], axis=0)
        is_lost = ~is_kept | np.any([known[name] & ~whole[name] for name in whole], axis=0)
    begun = [each for each, _ in pairs if each.begin_s]
    notes = [f'{quoted(each.header)} counts from {each.begin_s:.9f} s' for each in begun]
    for each, numbers in pairs:
        is_missing = np.isnan(numbers) & is_lost
        if clocks[1:]:  # columns with several clocks may end early
            is_missing &= np.logical_or.accumulate(~np.isnan(numbers)[::-1])[::-1]
        if len(without := rows.lines[is_missing]):
            count, which = f'{len(without)} of {len(rows.lines)}', quoted(each.header)
            text = f'{count} rows without {which} were left out, the first is line {without[0]}'
            notes.append(text)
    kept = [numbers[is_kept] for numbers in found]
    return rows._replace(numbers=kept, lines=rows.lines[is_kept]), notes


def _place(table: TextTable, line: int, column: Column) -> str:
    return f'{table.origin}: line {line}, column {column.header or column.name}:'


def check_values(rows: Rows, vocabulary: Vocabulary, table: TextTable) -> None:
    """Refuse the first value out of range; if it is large, suggest another unit."""
    for column, numbers in zip(rows.columns, rows.numbers, strict=True):
        values = numbers + column.begin_s
        spec, is_sigma = vocabulary.quantities[column.name], column.name in vocabulary.sigmas
        below = values < (-np.inf if spec.minimum is None else spec.minimum)
        above = values > (np.inf if spec.maximum is None else spec.maximum)
        for row in np.flatnonzero(below | above | (is_sigma & (values == 0.0))):
            limit, hint = f'below the minimum {spec.minimum:g} {spec.unit}', 'correct the row'
            if above[row]:
                limit = f'above the largest {column.name}, {spec.maximum:g} {spec.unit}'
                if column.index != ROW.at:
                    header, unit = table.layout.columns[column.index], unit_to_fill(spec.unit)
                    hint += f', or fill in {option_for(column.name, table.layout, header, unit)}'
            elif is_sigma:
                limit, hint = 'not above 0', 'give the standard deviation, or remove the column'
            where = _place(table, rows.lines[row], column)
            raise OutOfRange(where, float(values[row]), spec.unit, limit, hint)


def varying(table: TextTable, headers: Sequence[Header]) -> list[Header]:
    """Return the columns whose cells vary."""
    cells: dict[int, set[str]] = {each.at: set() for each in headers}
    for _, chunk in _chunks(table, [*cells]):
        for at, found in cells.items():
            found.update(str(cell).strip() for cell in chunk[at].dropna())
    return [each for each in headers if len(cells[each.at]) > 1]
