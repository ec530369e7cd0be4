# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Data sheets with a number in each row; computed columns of tables by amplitude."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.files import read_bytes
from stickslip_ros.lab.measurements.numbers import BACK, NUMBERS, SHEET_SHARE, sigma_name
from stickslip_ros.lab.readers.layout import BLANKS, HEAD_BYTES, TextTable, header_of, to_number
from stickslip_ros.units import unit_of

_SETTINGS = ('amplitude_m', 'amplitude_sigma_m', 'voltage_v', 'frequency_hz', 'load_n')
_NAME = {'quantity', 'parameter', 'property', 'specification', 'größe'}
_VALUE = {'value', 'typical', 'typ', 'typ.', 'nominal', 'wert'}
_UNIT = {'unit', 'units', 'einheit'}
_LOWEST, _HIGHEST = {'min', 'min.', 'minimum'}, {'max', 'max.', 'maximum'}
"""Headers of a sheet with a number in each row."""
_TOLERANCE = 'tolerance (%)'
_LIMIT_SIGMAS = 2.0
"""Distance of limits from the typical value in standard errors: nearly all devices keep them."""


def columns_of_sheet(table: TextTable) -> TextTable | None:
    """Turn a sheet with a number in each row into a table with columns; None if it is none."""
    source, layout, origin = table
    texts = [each.text for each in layout.columns]
    named, value, unit, lowest, highest = (
        next((text for text in texts if text.lower() in known), '')
        for known in (_NAME, _VALUE, _UNIT, _LOWEST, _HIGHEST)
    )
    is_sheet = named and (value or (lowest and highest)) and layout.delimiter != BLANKS
    if not (is_sheet and isinstance(source, Path | bytes)):
        return None
    lines, rows, notes = _content(source, origin).decode(layout.encoding).splitlines(), [], []
    below = lines[layout.header :]
    reader = csv.reader(below, delimiter=layout.delimiter, skipinitialspace=True)
    for line, cells in enumerate(reader, layout.header + 1):
        row = dict(zip(texts, cells + [''] * len(texts), strict=False))
        if len(cells) > len(texts):
            problem = f'has {len(cells)} values, the header {len(texts)} names'
            hint = 'with decimal commas separate columns by semicolons'
            raise RecordingError(f'{origin}: line {line}', problem, hint)
        header = f'{row.pop(named)} ({row.pop(unit).strip()})' if unit else row.pop(named)
        number, limits = row.pop(value, ''), [row.pop(lowest, ''), row.pop(highest, '')]
        if any(limits):
            number, tolerance, what = _from_limits(number, limits, layout.decimal)
            row |= {_TOLERANCE: row.get(_TOLERANCE) or tolerance}
            notes.append(f'{header}: {what}')
        rows.append({header: number, **row} if any(cells) else {})
    import pandas as pd  # noqa: PLC0415 - slow import

    frame = pd.DataFrame(rows).drop(columns='', errors='ignore')
    columns = tuple(header_of(at, str(text)) for at, text in enumerate(frame))
    notes = [*layout.notes, *notes]
    form = replace(layout, columns=columns, first=layout.header + 1, notes=tuple(notes))
    return TextTable(frame.set_axis(range(len(columns)), axis=1), form, origin)


def _content(source: Path | bytes, origin: str) -> bytes:
    content = source if isinstance(source, bytes) else read_bytes(source, '', HEAD_BYTES + 1)
    if len(content) > HEAD_BYTES:
        problem = f'is a sheet with a number in each row, longer than {HEAD_BYTES} bytes'
        raise RecordingError(origin, problem, 'leave out rows, or give each quantity a column')
    return content


def _from_limits(typical: str, limits: Sequence[str], decimal: str) -> tuple[str, str, str]:
    """Return the typical value or the middle of the limits, its standard error in %, a note."""
    note = f'its limits are {_LIMIT_SIGMAS:g} standard errors from it'
    numbers = np.array([to_number(each, decimal) for each in limits])
    value = to_number(typical, decimal) if typical.strip() else float(np.mean(numbers))
    if not value or not np.isfinite(value):
        return typical, '', note if typical else 'it has only one limit, and is not read'
    share = float(np.nanmean(np.abs(numbers - value))) / abs(value) / _LIMIT_SIGMAS
    error = f'{100.0 * share:.6g}' if share else ''
    return f'{value!r}'.replace('.', decimal), error.replace('.', decimal), note


def completed(given: Mapping[str, Array], origin: str) -> tuple[dict[str, Array], list[str]]:
    """
    Add columns for directions and standard errors; return all columns, and notes.

    Empty cells of settings become 0: only numbers without a drive may have them.

    """
    columns, notes, assumed = dict(given), list[str](), list[str]()
    if 'travel_m' in columns:
        steps = np.abs(columns.pop('steps'))
        if np.any(steps == 0.0):
            hint = 'leave the row out, or give its number of steps'
            raise OutOfRange(f'{origin}: steps', 0.0, '', 'no number to divide by', hint)
        columns['step_length_m'] = columns.pop('travel_m') / steps
        notes.append('step_length_m is the displacement divided by the number of steps')
    notes += _directed(columns, origin)
    columns |= {name: np.nan_to_num(columns[name]) for name in _SETTINGS if name in columns}
    numbers = [name for name in NUMBERS if name in columns and sigma_name(name) not in columns]
    stated = columns.pop('tolerance', np.full(len(columns['preload_n']), np.nan))
    is_sheet = np.any(stated > 0.0) or any(NUMBERS[name].is_of_sheet for name in numbers)
    for name in numbers:
        value = columns[name]
        if not is_sheet and (len(value) > 1 or name not in {*BACK, *BACK.values()}):
            continue
        if np.any(value == 0.0):
            hint = f'add a column {sigma_name(name)}, or leave the cell empty'
            raise OutOfRange(f'{origin}: {name}', 0.0, unit_of(name), 'without a tolerance', hint)
        columns[sigma_name(name)] = np.where(stated > 0.0, 0.01 * stated, SHEET_SHARE) * abs(value)
        if np.any(np.isfinite(value) & ~(stated > 0.0)):
            assumed.append(name)
    if assumed:
        text = (
            f'no tolerance is given for {", ".join(assumed)}: {100.0 * SHEET_SHARE:g} % is taken'
        )
        notes.append(f'{text}; state others in a column tolerance (%)')
    return columns, notes


def _directed(columns: dict[str, Array], origin: str) -> list[str]:
    """Split columns by direction; motions backwards become positive. Return notes."""
    way, hertz = columns.pop('direction', None), columns.get('frequency_hz', np.ones(1))
    both = {name: back for name, back in BACK.items() if name in columns}
    if way is not None:
        if not both or {*both.values()} & columns.keys() or np.any(hertz < 0.0):
            problem = 'has a direction, but no step or speed, or two columns with a direction'
            raise RecordingError(origin, problem, 'state the direction of steps or speeds once')
        both |= {sigma_name(name): sigma_name(back) for name, back in both.items()}
        for each in both.keys() & columns.keys():
            columns[both[each]] = np.where(way < 0.0, columns[each], np.nan)
            columns[each] = np.where(way > 0.0, columns[each], np.nan)
    notes = []
    for each in {*BACK.values()} & columns.keys():
        if np.nanmax(columns[each], initial=-np.inf) < 0.0:
            columns[each] = -columns[each]
            notes.append(f'{each} is below 0 in each row: its size is taken')
    for each in both.keys() & columns.keys():
        is_size = (hertz < 0.0) & (columns[each] > 0.0) & (columns.get('load_n', 0.0) == 0.0)
        if np.any(is_size):
            columns[each] = np.where(is_size, -columns[each], columns[each])
            notes.append(f'{each} above 0 at a frequency below 0 is taken as backwards')
    return notes
