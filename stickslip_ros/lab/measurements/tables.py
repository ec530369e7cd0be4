# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Read measured tables of laboratories into columns in SI units."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import RecordingError, StickSlipError, quoted
from stickslip_ros.files import replacing
from stickslip_ros.lab.measurements.numbers import NUMBERS, SHEET_SHARE, sigma_name
from stickslip_ros.lab.measurements.sheets import columns_of_sheet, completed
from stickslip_ros.lab.measurements.table_options import TABLE_DEFAULTS, TableOptions
from stickslip_ros.lab.measurements.vocabulary import (
    BY_AMPLITUDE,
    MEASURED,
    OVER_TIME,
    VOCABULARIES,
    MeasuredTable,
)
from stickslip_ros.lab.readers.cells import read_columns, varying
from stickslip_ros.lab.readers.clocks import joined_clocks, over_all_times
from stickslip_ros.lab.readers.columns import Found, columns_named, find_columns
from stickslip_ros.lab.readers.formats import tables_in
from stickslip_ros.lab.readers.layout import Header, TextLayout, TextTable, layout_of
from stickslip_ros.lab.readers.refusal import RATE, to_fill, unclear
from stickslip_ros.lab.readers.units import is_unit_of
from stickslip_ros.recording.integrity import is_recording, refuse_foreign

if TYPE_CHECKING:
    from pandas import DataFrame

_ONSET = 'zero_amplitude_m'  # needs no amplitude
_TRAVEL = {'travel_m', 'steps'}  # together they give a step length
_LOOP = 'tangential_n'  # marks a friction loop of one sphere: displacement and normal force
_LISTED = 6  # most missing quantities listed in a refusal
_SPREAD_SIGMAS = 5.0
"""Largest difference of readings at one setting, in standard errors."""


def listed_sources(given: Any) -> list[Any]:
    """Return one or several sources as a list; strings become paths."""
    is_one = isinstance(given, str | Mapping) or hasattr(given, 'to_csv')
    sources = given if isinstance(given, Iterable) and not is_one else [given]
    return [Path(each) if isinstance(each, str) else each for each in sources]


def read_experiment(
    path: 'Path | DataFrame',
    options: TableOptions = TABLE_DEFAULTS,
    *,
    number: int = 0,
    kind: str | None = None,
    measured: Sequence[str] = (),
) -> MeasuredTable:
    """Read a measured table (of a workbook the first suitable sheet); refuse by file and line."""
    if isinstance(path, Path):
        by_file = _by_file([path], options)
        if len(by_file) > 1:
            return _joined_by_time(by_file, options, measured)
        options = dataclasses.replace(options, headers=by_file[path])
    tables, refusals = list[TextTable](), list[StickSlipError]()
    if isinstance(path, Path) and is_recording(path):
        if path.is_file():
            refuse_foreign(path)
        problem = 'cannot be read as a table: it is a recording or a folder'
        hint = 'use compare, fit, plot or replay, or make a table with stickslip export'
        raise RecordingError(path, problem, hint)
    for origin, source in tables_in(path, is_named=bool(options.headers)):
        try:
            tables.append(TextTable(source, layout_of(source, origin), origin))
        except RecordingError as error:  # noqa: PERF203
            refusals.append(error)
    refusals = [] if tables else refusals
    for table in tables:
        try:
            return _read(table, options, number, kind, measured)
        except StickSlipError as error:  # noqa: PERF203
            refusals.append(error)
    raise next(iter(refusals), RecordingError(path, 'holds no table', 'save it as CSV'))


def parse_experiment(
    content: bytes, origin: str, options: TableOptions = TABLE_DEFAULTS
) -> MeasuredTable:
    """Read a measured table from the content of a file."""
    return _read(TextTable(content, layout_of(content, origin), origin), options)


def read_joined(
    paths: 'Sequence[Path | DataFrame]',
    options: TableOptions = TABLE_DEFAULTS,
    measured: Sequence[str] = (),
) -> MeasuredTable:
    """Join the rows of tables by amplitude with the same columns, or tables over time by time."""
    try:
        parts = [
            read_experiment(path, options, number=at, kind=BY_AMPLITUDE, measured=measured)
            for at, path in enumerate(paths)
        ]
    except StickSlipError:
        files = [path for path in paths if isinstance(path, Path)]
        if len(files) < max(len(paths), 2) or not all(map(_is_over_time, files)):
            raise
        return _joined_by_time(_by_file(files, options), options, measured)
    return _joined(parts, ', '.join(part.origin for part in parts))


def _by_file(files: Sequence[Path], options: TableOptions) -> dict[Path, dict[str, str]]:
    """Return the named columns by file: the file of ``CH2.CSV:Ampl (V)``, else files with it."""
    found: dict[Path, dict[str, str]] = {each: {} for each in files}
    for name, text in options.headers.items():
        before, _, column = text.partition(':')
        places = [files[0].parent / before, Path(before)] if column else []
        file = next((each for each in places if each.is_file()), None)
        if file is not None:
            same = (each for each in found if each.is_file() and each.samefile(file))
            found.setdefault(next(same, file), {})[name] = column
            continue
        holders = [
            each
            for each in files
            if len(files) > 1 and any(columns_named(layout, text) for layout in _layouts(each))
        ]
        for each in holders or files[:1]:
            found[each][name] = text
    return found


def _layouts(path: Path) -> list[TextLayout]:
    return [layout_of(source, origin) for origin, source in tables_in(path, is_named=True)]


def _is_over_time(path: Path) -> bool:
    """Return whether a table has neither preload nor amplitude."""
    recognise = VOCABULARIES[BY_AMPLITUDE].recognise
    columns = [each for layout in _layouts(path) for each in layout.columns]
    return not {recognise(e.name, e.unit) for e in columns} & {'preload_n', 'amplitude_m'}


def _joined_by_time(
    by_file: Mapping[Path, Mapping[str, str]], options: TableOptions, measured: Sequence[str]
) -> MeasuredTable:
    """Read the named columns of each file over time; a quantity keeps the times of its file."""
    first, *others = parts = [
        read_experiment(path, dataclasses.replace(options, headers=headers), kind=OVER_TIME)
        for path, headers in by_file.items()
    ]
    for part in others:
        both = [each.columns['time_s'] for each in (first, part)]
        if max(each[0] for each in both) > min(each[-1] for each in both):
            ranges = ' and '.join(f'{each[0]:g} to {each[-1]:g} s' for each in both)
            problem = f'has no time in common with {part.origin}: {ranges}'
            hint = f'join files of one clock; {RATE}, which counts the times of each from 0'
            raise RecordingError(first.origin, problem, hint)
    found = dict[str, tuple[Array, Array]]()
    for part in parts:
        if twice := found.keys() & part.columns.keys():
            problem, hint = f'has {min(twice)}, as another file has', to_fill(min(twice), 'FILE')
            raise RecordingError(part.origin, problem, f'name one: {hint}')
        time_s = part.columns['time_s']
        found |= {name: (time_s, e) for name, e in part.columns.items() if name != 'time_s'}
    if measured and not {*measured} & found.keys():
        problem = f'there is no {" or ".join(measured)}'
        raise RecordingError(first.origin, problem, 'name it with --map')
    return MeasuredTable(
        origin=', '.join(part.origin for part in parts),
        kind=OVER_TIME,
        columns=over_all_times(found),
        notes=tuple(dict.fromkeys(note for part in parts for note in part.notes)),
        recognised=tuple(each for part in parts for each in part.recognised),
    )


def _joined(parts: Sequence[MeasuredTable], origin: str) -> MeasuredTable:
    names = list(dict.fromkeys(name for part in parts for name in part.columns))
    blanks = dict[str, float]()  # for columns missing in one part, if another is a data sheet
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
    """Write CSV with our column names, in SI units with 15 digits: 0.000817 for 0.817 mN."""
    import pandas as pd  # noqa: PLC0415 - slow import

    frame = pd.DataFrame(experiment.columns)
    if experiment.kind == OVER_TIME:  # seconds since 1970 need more digits
        frame['time_s'] = [*map(repr, frame.time_s.tolist())]
    with replacing(path) as part, part.open('w', encoding='utf-8', newline='') as file:
        file.writelines(f'# {note}\n' for note in experiment.notes)
        frame.to_csv(file, index=False, lineterminator='\n', float_format='%.15g')


def _read(
    table: TextTable,
    options: TableOptions,
    number: int = 0,
    kind: str | None = None,
    measured: Sequence[str] = (),
) -> MeasuredTable:
    table, options = _instructed(table, options)
    kind, found, unread = _kind(table, options, kind)
    options.check_use(kind, table.where)
    preload_n = _preload_n(found, options, number, table.where) if kind == BY_AMPLITUDE else None
    preload_n = 0.0 if _LOOP in found else preload_n
    given = [*found] if preload_n is None else ['preload_n', *found]
    _check_present(given, kind, measured or MEASURED[kind], table, unread)
    rows, gaps = read_columns(table, found, VOCABULARIES[kind])
    pairs = zip(rows.columns, rows.numbers, strict=True)
    values, notes = {each.name: numbers for each, numbers in pairs}, list[str]()
    if kind == OVER_TIME:
        values, notes = joined_clocks(rows, table.origin, f'sort the rows by time, or {RATE}')
        if measured:  # keep rows with the requested quantities
            known = ~np.isnan(next(values[name] for name in measured if name in values))
            values = {name: numbers[known] for name, numbers in values.items()}
    elif len(rows.lines):
        own = dict[str, Array]()
        if preload_n is not None:
            own['preload_n'] = np.full(len(rows.lines), preload_n)
        if _LOOP in values:
            own['preload_n'][:] = np.max(values['normal_n'])
            own['row'] = np.arange(1.0, 1.0 + len(rows.lines), dtype=np.float64)
        values, notes = completed(own | values, table.where)
        _check_conditions(values, table, unread)
    if not len(next(iter(values.values()))):
        raise RecordingError(table.where, 'has no values below its header', 'give at least a row')
    firsts = [
        dataclasses.replace(each, first=float(numbers[np.argmax(~np.isnan(numbers))]))
        for each, numbers in zip(rows.columns, rows.numbers, strict=True)
    ]
    left_out, gaps = [each.shown for each in unread], gaps + notes
    texts = (*table.layout.notes, *(f'column {quoted(e)} was not read' for e in left_out), *gaps)
    experiment = MeasuredTable(
        table.origin, kind, values, texts, tuple(firsts), tuple(left_out), tuple(gaps)
    )
    if options.report is not None:
        options.report(experiment)
    return experiment


def _instructed(table: TextTable, options: TableOptions) -> tuple[TextTable, TableOptions]:
    """Return the table with the user's rate, and the options without topics."""
    table = columns_of_sheet(table) or table
    layout = table.layout
    headers = {
        name: text
        for name, text in options.headers.items()
        if options.only_tables or not text.startswith('/') or columns_named(layout, text)
    }
    if options.rate_hz is not None:
        layout = dataclasses.replace(layout, step_s=1.0 / options.rate_hz, start_s=0.0)
    return table._replace(layout=layout), dataclasses.replace(options, headers=headers)


def _preload_n(found: Found, options: TableOptions, number: int, where: str) -> float | None:
    """Return the preload, N, for a table by amplitude without a preload column."""
    preload_n = options.preload_n(number)
    if preload_n is not None and 'preload_n' in found:
        hint = 'leave out --preload, or give a preload for each file'
        raise RecordingError(where, f'has a preload column and --preload {preload_n:g}', hint)
    return options.stand_n if preload_n is None and 'preload_n' not in found else preload_n


def _kind(
    table: TextTable, options: TableOptions, kind: str | None
) -> tuple[str, Found, list[Header]]:
    """Return kind of a table (over time or by amplitude), its columns, and unread columns."""
    needed = {'preload_n', 'amplitude_m', *MEASURED[BY_AMPLITUDE]} - {'force_n'}  # or over time
    kinds = [(OVER_TIME, {'time_s'}), (BY_AMPLITUDE, needed | _TRAVEL)]
    if options.rate_hz is not None:  # then each table has a time
        kinds.insert(0, (BY_AMPLITUDE, {'preload_n', *_TRAVEL}))
    kinds.insert(0, (BY_AMPLITUDE, {_LOOP}))
    for each, signs in kinds:
        if kind in {None, each}:
            found, unread = find_columns(table, VOCABULARIES[each], options.headers)
            found = _of_points(found, unread) if each == BY_AMPLITUDE else found
            if kind or signs & found.keys():
                return each, found, unread
    over_time, by_amplitude = [to_fill('time_s', 's')], [to_fill('amplitude_m', 'm')]
    if not {*MEASURED[OVER_TIME]} & options.headers.keys():
        over_time.append(to_fill('position_m', 'm'))
        by_amplitude.append(to_fill('force_n', 'N'))
    if 'preload_n' not in options.headers and options.preload_n(0) is None:
        by_amplitude.append(to_fill('preload_n', 'N'))
    otherwise = f'by amplitude {" ".join(by_amplitude)}, or {RATE}'
    raise unclear(table, 'has neither a time nor an amplitude', over_time, otherwise)


def _of_points(found: Found, unread: list[Header]) -> Found:
    """Resolve columns by amplitude: in a table of steps, a load acts on the runner."""
    if _LOOP in found:
        if 'preload_n' in found:
            found.setdefault('normal_n', found.pop('preload_n'))
        return found
    if 'steps' in found and 'displacement_m' in found:
        found.setdefault('travel_m', found.pop('displacement_m'))
    for name in found.keys() & {'displacement_m', 'normal_n', 'rig_n_per_m'}:
        unread += [place.header for place in found.pop(name)]
    is_by_way = any(name in found for name in ('step_length_m', 'step_back_m', 'travel_m'))
    is_by_way |= any(name in found for name in ('speed_m_per_s', 'speed_back_m_per_s'))
    forces = [header.name.lower() for header, _ in found.get('force_n', [])]
    if is_by_way and forces == ['load']:
        found['load_n'] = found.pop('force_n')
    if len(_TRAVEL & found.keys()) == 1:
        [name] = _TRAVEL & found.keys()
        unread += [place.header for place in found.pop(name)]
    return found


def _check_present(
    names: Sequence[str],
    kind: str,
    measured: Sequence[str],
    table: TextTable,
    unread: Sequence[Header],
) -> None:
    """Refuse contradictory and missing columns."""
    there = {*measured} & {*names, *(['step_length_m'] if {*names} >= _TRAVEL else [])}
    needed = [['time_s']]
    if kind == BY_AMPLITUDE:
        if _ONSET in there and {'force_n', 'step_length_m'} & there:
            hint = 'give it in a separate table, a row for each preload'
            raise RecordingError(table.where, f'has both {_ONSET} and numbers by amplitude', hint)
        if {'amplitude_m', 'voltage_v'} <= {*names}:
            hint = 'remove one; a stroke is the gain times the voltage'
            raise RecordingError(table.where, 'has both amplitude_m and voltage_v', hint)
        of = [NUMBERS[each].settings for each in there & {*NUMBERS}]
        is_stroke = not there or any('amplitude_m' in each for each in of)
        needed = [['preload_n'], *[['amplitude_m', 'voltage_v']] * is_stroke]
    needed += [['displacement_m'], ['normal_n']] * (_LOOP in there)
    for name in names:
        if (whose := VOCABULARIES[kind].of(name)) not in names:
            problem = f'has {name!r} without {whose!r}'
            raise RecordingError(table.where, problem, f'add a column {whose!r}')
    missing = [each for each in needed if not {*each} & {*names}]
    missing += [] if there else [[*measured]]
    if missing:
        raise _missing(missing, kind, table, unread)


def _missing(
    missing: Sequence[Sequence[str]], kind: str, table: TextTable, unread: Sequence[Header]
) -> RecordingError:
    """Return the refusal of missing columns, each a choice of names; show the columns there."""
    specs = VOCABULARIES[kind].quantities
    for each in unread:
        name = VOCABULARIES[kind].recognise(each.name, each.unit)
        if each.kind == 'text' and any(name in names for names in missing):
            problem = f'column {quoted(each.text)} has text, {quoted(each.cell)}'
            return unclear(table, problem, (), 'write numbers alone, and the unit in the header')
    units = [each.unit for each in unread if each.kind in {'number', 'date'}]
    listed = [
        ' or '.join(each[:_LISTED]) + ' or another number' * (len(each) > _LISTED)
        for each in missing
    ]
    others = {'preload_n': 'fill in the preload of the file, --preload ...N', 'time_s': RATE}
    otherwise = [others[each[0]] for each in missing if each[0] in others]
    likely = [
        next((e for e in each if any(is_unit_of(unit, specs[e].unit) for unit in units)), each[0])
        for each in missing
    ]
    options = [to_fill(name, specs[name].unit) for name in likely]
    if not units:
        options, named = [], ', '.join(f'{name} ({specs[name].unit})' for name in likely)
        otherwise.insert(0, f'add a column {named}')
    problem = f'there is no {", and no ".join(listed)}'
    return unclear(table, problem, options, ', or '.join(otherwise))


def _check_conditions(
    values: Mapping[str, Array], table: TextTable, unread: Sequence[Header]
) -> None:
    """Refuse different readings at one setting if an unread column varies."""
    recognise = VOCABULARIES[BY_AMPLITUDE].recognise
    free = [e for e in unread if e.kind != 'empty' and not recognise(e.name, e.unit)]
    sigmas = {sigma_name(name) for name in NUMBERS}
    settings = [values[name] for name in values if name not in {*NUMBERS, *sigmas}]
    groups = np.unique(np.nan_to_num(settings), axis=1, return_inverse=True)[1].reshape(-1)
    for name in [each for each in values if each in NUMBERS and free]:
        errors = values.get(sigma_name(name), np.zeros(len(groups)))
        for group in np.unique(groups):
            of = (groups == group) & ~np.isnan(values[name])
            numbers = values[name][of]
            least = _SPREAD_SIGMAS * np.max(errors[of], initial=0.0)
            least = max(least, SHEET_SHARE * np.max(np.abs(numbers), initial=0.0))
            if len(numbers) < 2 or np.ptp(numbers) <= least:
                continue
            if names := varying(table, free):
                listed = ', '.join(quoted(each.shown) for each in names)
                problem = f'{name} differs, {np.min(numbers):.4g} and {np.max(numbers):.4g}, in '
                problem += f'rows that differ only in columns that are not read: {listed}'
                hint = 'save the rows of each condition in a separate file'
                raise RecordingError(table.where, problem, hint)
