# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Measured tables of laboratories, read into columns in SI units."""

import dataclasses
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import RecordingError, StickSlipError, quoted
from stickslip_ros.files import read_bytes, replacing
from stickslip_ros.lab.readers.cells import check_values, read_rows, whole_rows
from stickslip_ros.lab.readers.clocks import joined_clocks
from stickslip_ros.lab.readers.columns import Found, columns_named, find_columns, resolve_columns
from stickslip_ros.lab.readers.formats import tables_in
from stickslip_ros.lab.readers.instructions import AS_IT_IS, Reading
from stickslip_ros.lab.readers.layout import HEAD_BYTES, Header, TextForm, layout_of
from stickslip_ros.lab.readers.measured import (
    BY_AMPLITUDE,
    EXPERIMENT_COLUMNS,
    MEASURED,
    OVER_TIME,
    POINT_COLUMNS,
    TIME_COLUMNS,
    MeasuredTable,
    recognised,
)
from stickslip_ros.lab.readers.numbers import (
    NUMBERS,
    SIGMA,
    columns_of_sheet,
    completed,
    sigma_name,
)
from stickslip_ros.lab.readers.remedies import RATE, epoch_of, listed, suggestion
from stickslip_ros.lab.readers.units import factor_of, split_unit
from stickslip_ros.units import parse_quantity

if TYPE_CHECKING:
    from pandas import DataFrame

_PRELOAD = re.compile(r'(?<![^\W_])(?<![.,-])\d+(?:[.,]\d+)?\s*[kmuµμnp]?N\b')
_WITHIN = re.compile(r'[\[(]([^\[\]()\d]+)[\])]')  # a unit
_ONSET = 'zero_amplitude_m'  # without an amplitude


def listed_sources(given: Any) -> list[Any]:
    """Return one source of data, or several, as a list; texts become paths."""
    is_one = isinstance(given, str | Mapping) or hasattr(given, 'to_csv')
    sources = given if isinstance(given, Iterable) and not is_one else [given]
    return [Path(each) if isinstance(each, str) else each for each in sources]


def read_experiment(
    path: 'Path | DataFrame',
    reading: Reading = AS_IT_IS,
    *,
    number: int = 0,
    kind: str | None = None,
    measured: Sequence[str] = (),
) -> MeasuredTable:
    """Read a measured table, of a workbook the first suitable sheet; refuse with file and line."""
    laid_out: list[tuple[Path | bytes, TextForm, str]] = []
    refusals: list[StickSlipError] = []
    for origin, source in tables_in(path, is_named=bool(reading.headers)):
        head = source
        if isinstance(head, Path):
            head = read_bytes(head, 'check the path', HEAD_BYTES + 1)
        try:
            laid_out.append((source, layout_of(head[: HEAD_BYTES + 1], origin), origin))
        except RecordingError as error:
            refusals.append(error)
    if laid_out:
        refusals.clear()
    for table in laid_out:
        try:
            return _read(*table, reading, number, kind, measured)
        except StickSlipError as error:  # noqa: PERF203
            refusals.append(error)
    raise next(iter(refusals), RecordingError(path, 'holds no table', 'save it as CSV'))


def parse_experiment(content: bytes, origin: str, reading: Reading = AS_IT_IS) -> MeasuredTable:
    """Read a measured table from the content of a file."""
    return _read(content, layout_of(content[: HEAD_BYTES + 1], origin), origin, reading)


def read_joined(
    paths: 'Sequence[Path | DataFrame]', reading: Reading = AS_IT_IS, measured: Sequence[str] = ()
) -> MeasuredTable:
    """Read tables by amplitude with the same columns, and join their rows."""
    parts = [
        read_experiment(path, reading, number=at, kind=BY_AMPLITUDE, measured=measured)
        for at, path in enumerate(paths)
    ]
    return _joined(parts, ', '.join(part.origin for part in parts))


def _joined(parts: Sequence[MeasuredTable], origin: str) -> MeasuredTable:
    names = list(dict.fromkeys(name for part in parts for name in part.columns))
    blanks = dict[str, float]()  # beside a data sheet
    if any(NUMBERS[name].is_of_sheet for name in names if name in NUMBERS):
        blanks = dict.fromkeys((*NUMBERS, *map(sigma_name, NUMBERS)), np.nan)
        blanks |= {'voltage_v': 0.0, 'load_n': 0.0}

    def column(part: MeasuredTable, name: str) -> Array:
        if name in part.columns:
            return part.columns[name]
        if name in blanks:
            return np.full(len(part.columns['preload_n']), blanks[name])
        hint = 'give files with the same columns'
        raise RecordingError(part.origin, f'has no {name}, as another file has', hint)

    return MeasuredTable(
        origin=origin,
        kind=BY_AMPLITUDE,
        columns={name: np.concatenate([column(part, name) for part in parts]) for name in names},
        notes=tuple(dict.fromkeys(note for part in parts for note in part.notes)),
    )


def write_experiment(experiment: MeasuredTable, path: Path) -> None:
    """Write CSV with our columns in SI units, floats to the bit."""
    import pandas as pd  # noqa: PLC0415 - slow import

    with replacing(path) as part, part.open('w', encoding='utf-8', newline='') as file:
        file.writelines(f'# {note}\n' for note in experiment.notes)
        pd.DataFrame(experiment.columns).to_csv(file, index=False, lineterminator='\n')


def _read(
    source: 'Path | bytes | DataFrame',
    layout: TextForm,
    origin: str,
    reading: Reading,
    number: int = 0,
    kind: str | None = None,
    measured: Sequence[str] = (),
) -> MeasuredTable:
    where = f'{origin}: line {layout.header or layout.first}'
    if isinstance(source, Path | bytes) and (sheet := columns_of_sheet(source, layout, origin)):
        source, layout = sheet
    headers = {
        name: text
        for name, text in reading.headers.items()
        if reading.only_tables or not text.startswith('/') or columns_named(layout, text)
    }
    reading = dataclasses.replace(reading, headers=headers)
    if reading.rate_hz is not None:
        layout = dataclasses.replace(layout, step_s=1.0 / reading.rate_hz, start_s=0.0)
    if of_preloads := _of_preloads(layout, reading, kind, where):
        parts = (_read(source, e, origin, of, 0, BY_AMPLITUDE, measured) for e, of in of_preloads)
        return _joined([*parts], origin)
    kind, found, unread = _kind(layout, reading, kind, where)
    reading.check_use(kind, layout, where)
    if reading.start_s is not None:
        layout = dataclasses.replace(layout, start_s=reading.start_s)
    preload_n = reading.preload_n(number) if kind == BY_AMPLITUDE else None
    if preload_n is not None and 'preload_n' in found:
        hint = 'leave --preload away, or give as many as there are files'
        raise RecordingError(where, f'names a preload, and --preload {preload_n:g} too', hint)
    if 'preload_n' not in found and preload_n is None and kind == BY_AMPLITUDE:
        preload_n = reading.stand_n
    given = [*found] if preload_n is None else ['preload_n', *found]
    _check_present(given, kind, measured or MEASURED[kind], layout, unread, where)
    specs = EXPERIMENT_COLUMNS[kind]
    rows = read_rows(source, layout, resolve_columns(found, layout, specs, where), origin)
    rows, gaps = whole_rows(rows)
    check_values(rows, specs, layout, origin)
    values = {each.name: numbers for each, numbers in zip(rows.columns, rows.numbers, strict=True)}
    if kind == OVER_TIME:
        hint = ', or '.join(filter(None, (epoch_of(layout), RATE)))
        values, notes = joined_clocks(rows, origin, hint)
        if measured:  # all rows have what was asked for
            known = ~np.isnan(next(values[name] for name in measured if name in values))
            values = {name: numbers[known] for name, numbers in values.items()}
    if not len(next(iter(values.values()))):
        raise RecordingError(where, 'has no values below its header', 'give at least one row')
    if kind == BY_AMPLITUDE:
        if preload_n is not None:
            values = {'preload_n': np.full(len(rows.lines), preload_n), **values}
        values, notes = completed(values, where)
    firsts = [
        dataclasses.replace(each, first=float(numbers[np.argmax(~np.isnan(numbers))]))
        for each, numbers in zip(rows.columns, rows.numbers, strict=True)
    ]
    aside, gaps = [each.shown for each in unread], gaps + notes
    said = (*layout.notes, *(f'column {quoted(each)} was not read' for each in aside), *gaps)
    experiment = MeasuredTable(
        origin, kind, values, said, tuple(firsts), tuple(aside), tuple(gaps)
    )
    if reading.report is not None:
        reading.report(experiment)
    return experiment


def _of_preloads(
    layout: TextForm, reading: Reading, kind: str | None, where: str
) -> list[tuple[TextForm, Reading]]:
    """Return how to read each column of a table with a column for each preload."""
    specs = {'time_s': TIME_COLUMNS['time_s'], **POINT_COLUMNS}
    names = {*reading.headers, *(recognised(e.name, e.unit, specs) for e in layout.columns)}
    is_given = reading.preloads_n or {'time_s', 'preload_n'} & names
    shared = [e for e in reading.headers.items() if e[1].startswith('*') and e[0] in specs]
    is_by_amplitude = kind == BY_AMPLITUDE or (not kind and (shared or 'amplitude_m' in names))
    amounts = {
        each: [parse_quantity(e.replace(',', '.'), 'N') for e in _PRELOAD.findall(each.text)]
        for each in layout.columns
    }
    preloads = {each: e[0] for each, e in amounts.items() if len(e) == 1 and e[0]}
    if is_given or layout.step_s or not is_by_amplitude or len(preloads) < 2:
        return []
    if len({*preloads.values()}) < len(preloads):
        problem = f'columns {listed(preloads)} name a preload twice'
        raise RecordingError(where, problem, 'keep one column of each, or a row for each point')
    others = dict(e for e in reading.headers.items() if e not in shared)
    parts = []
    for header, preload_n in preloads.items():
        aside = preloads.keys() - {header}  # a blank is not reported as unread
        columns = tuple(e._replace(text=' ', name='') if e in aside else e for e in layout.columns)
        for name, text in shared[:1] or (('force_n', ''), ('step_length_m', '')):
            units = split_unit(text)[1], header.below, *_WITHIN.findall(header.text)
            if factor_of(unit := next(filter(None, units), ''), specs[name].unit):
                headers = {**others, name: f'#{header.at + 1} ({unit})'}
                own = dataclasses.replace(reading, headers=headers, preloads_n=(preload_n,))
                parts.append((dataclasses.replace(layout, columns=columns), own))
    if len(parts) < len(preloads):
        problem = f'columns {listed(preloads)} are of one preload each'
        raise RecordingError(where, problem, 'say what they hold: --map force_n="* (mN)"')
    return parts


def _kind(
    layout: TextForm, reading: Reading, kind: str | None, where: str
) -> tuple[str, Found, list[Header]]:
    """Return whether a table is over time or by amplitude, its columns, and those unread."""
    needed = {'preload_n', 'amplitude_m', *MEASURED[BY_AMPLITUDE]} - {'force_n'}  # in time too
    kinds = [(OVER_TIME, {'time_s'}), (BY_AMPLITUDE, needed)]
    if reading.rate_hz is not None:  # which gives each table a time
        kinds.insert(0, (BY_AMPLITUDE, {'preload_n'}))
    for each, told_by in kinds:
        if kind in {None, each}:
            found, unread = find_columns(layout, EXPERIMENT_COLUMNS[each], reading.headers, where)
            if kind or told_by & found.keys():
                return each, found, unread
    there = [each for each in layout.columns if each.text]
    problem = f'columns {listed(there)} tell neither a time nor an amplitude'
    named = [e for text in reading.headers.values() for e, _ in columns_named(layout, text)]
    free = [each for each in there if each not in named]
    specs = EXPERIMENT_COLUMNS[OVER_TIME]
    option = epoch_of(layout) or suggestion(['time_s'], layout, free, specs)[1]
    raise RecordingError(
        where, problem, f'which holds the time? {option}; {RATE}' if option else RATE
    )


def _check_present(
    names: Sequence[str],
    kind: str,
    measured: Sequence[str],
    layout: TextForm,
    unread: Sequence[Header],
    where: str,
) -> None:
    """Refuse a missing column, and suggest a candidate."""
    there, specs = {*measured} & {*names}, EXPERIMENT_COLUMNS[kind]
    needed, wrong = ['time_s'], list[tuple[bool, str, str]]()
    if kind == BY_AMPLITUDE:
        is_stroke = not there or any('amplitude_m' in NUMBERS[each].settings for each in there)
        needed = ['preload_n', *['amplitude_m'] * (is_stroke and 'voltage_v' not in names)]
        wrong = [
            (
                _ONSET in there and bool({'force_n', 'step_length_m'} & there),
                f'has both {_ONSET} and numbers by amplitude',
                'give it in a table of its own, a row for each preload',
            ),
            (
                {'amplitude_m', 'voltage_v'} <= {*names},
                'has both amplitude_m and voltage_v',
                'take one away; a stroke is the gain times the voltage',
            ),
        ]
    for is_wrong, problem, hint in wrong:
        if is_wrong:
            raise RecordingError(where, problem, hint)
    missing = [[name] for name in needed if name not in names] + ([] if there else [[*measured]])
    for each in missing:
        problem = f'there is no {" or ".join(each)}'
        name, option = suggestion(each, layout, unread, specs)
        hint = 'add one' if each[1:] else f'add it, in {specs[name].unit}'
        if unread:
            problem += f'; not understood: {", ".join(quoted(e.shown) for e in unread)}'
        if option:
            hint = f'say which column it is, as {option}'
        if each[0] == 'preload_n':
            hint += ', or give the preload of the file in N, as --preload 0.5'
        elif name == 'amplitude_m' and not unread:
            hint += ', or voltage_v, in V'
        if each[0] == 'time_s':
            hint += f'; {RATE}'
        raise RecordingError(where, problem, hint)
    for name in names:
        if (of_what := name.replace(SIGMA, '_')) not in names:
            raise RecordingError(where, f'{name!r} is there without {of_what!r}', 'add that one')
