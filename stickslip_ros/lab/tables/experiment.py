# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Measured tables of laboratories, read into columns in SI units."""

import dataclasses
import io
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.arrays import Array
from stickslip_ros.errors import (
    OutOfRange,
    RecordingError,
    StickSlipError,
    UnknownName,
    WrongKind,
    quoted,
)
from stickslip_ros.files import read_bytes, replacing
from stickslip_ros.lab.tables.columns import (
    ROW,
    Column,
    epoch_of,
    find_columns,
    likely_unit,
    listed,
    map_hint,
    places_of,
    resolve_columns,
    shown_column,
    suggestion,
)
from stickslip_ros.lab.tables.formats import tables_in
from stickslip_ros.lab.tables.layout import (
    BEYOND,
    EMPTY,
    HEAD_BYTES,
    OVER_RANGE,
    TextForm,
    layout_of,
    to_number,
)
from stickslip_ros.lab.tables.numbers import (
    BACK,
    DIRECTIONS,
    NUMBERS,
    SHEET_SHARE,
    SIGMA,
    columns_of_sheet,
    completed,
    sigma_name,
)
from stickslip_ros.lab.tables.times import TIME_DECIMALS, joined_clocks
from stickslip_ros.lab.tables.units import factor_of, in_si, split_unit
from stickslip_ros.parameters import AMPLITUDE_SPEC, FREQUENCY_SPEC, SENSORS, Spec, spec_of
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.recording.integrity import is_recording
from stickslip_ros.units import quantity, unit_of

if TYPE_CHECKING:
    from pandas import DataFrame

Lines = NDArray[np.intp]  # line numbers of rows, from 1
BY_AMPLITUDE, OVER_TIME = 'experiment by amplitude', 'experiment over time'
RATE = 'if the rows are evenly spaced in time, give their rate, as --rate 10kHz'
CHUNK_ROWS = 100_000  # rows read at once, to limit memory
ALL_COLUMNS = '*'  # all columns of a table with one per preload
AMOUNT = re.compile(r'(?<![^\W_])(?<![.,-])(\d+(?:[.,]\d+)?)\s*([kmuµμnp]?N)\b')
UNIT_WITHIN = re.compile(r'[\[(]([^\[\]()\d]+)[\])]')
ONE_PER_COLUMN = 'give one value per column; with decimal commas separate columns by semicolons'
LARGEST_AMPLITUDE_M = 1e-3
"""Ten times the stroke of a usual piezo stack; above, the unit was wrong."""


def _measured(unit: str, text: str, largest: float) -> Spec:
    return Spec(float, 0.0, unit, 'measured', text, -largest, largest)


def _sigma(unit: str, text: str) -> Spec:
    return Spec(float, 0.0, unit, 'measured', f'standard deviation of {text}', 0.0)


def _number(name: str) -> Spec:
    spec = _measured(unit_of(name), name, _LARGEST.get(unit_of(name), 1e12))
    return dataclasses.replace(spec, minimum=0.0) if NUMBERS[name].is_of_sheet else spec


_NUMBERS = [name for name, each in NUMBERS.items() if each.words]
_LARGEST = {'N': 1e3, 'm': 1.0, 'm/s': 10.0, 'Hz': 1e6, 's': 10.0, 'V': 1e5, 'kg': 10.0, 'F': 1e-3}
POINT_COLUMNS: Mapping[str, Spec] = {
    'preload_n': spec_of('stand.preload'),
    'amplitude_m': dataclasses.replace(AMPLITUDE_SPEC, maximum=LARGEST_AMPLITUDE_M),
    'frequency_hz': FREQUENCY_SPEC,
    'voltage_v': Spec(float, 0.0, 'V', 'measured', 'saw-tooth, peak to peak', 0.0, 1e5),
    'load_n': _measured('N', 'constant force on the runner along +x', 1e3),
    'direction': _measured('', 'up or down', 1.0),
    'tolerance': Spec(float, 100.0 * SHEET_SHARE, '%', 'measured', 'standard error', 1e-3, 1e3),
    **{name: _number(name) for name in _NUMBERS},
    'amplitude_sigma_m': _sigma('m', 'the amplitude'),
    **{sigma_name(name): _sigma(unit_of(name), name) for name in _NUMBERS},
}
TIME_COLUMNS: Mapping[str, Spec] = {
    'time_s': _measured('s', 'time of the sample; each after the one before', 1e12),
    **{each.quantity: _measured(each.unit, each.label, each.largest) for each in SENSORS},
    'voltage_v': _measured('V', 'voltage at the piezo', 1e5),
    'foot_m': _measured('m', 'displacement of the feet', 1.0),
    **{sigma_name(each.quantity): _sigma(each.unit, f'the {each.words}') for each in SENSORS},
    'voltage_sigma_v': _sigma('V', 'the voltage'),
    'foot_sigma_m': _sigma('m', 'the displacement'),
}
_RATE = Spec(float, 0.0, 'Hz', 'measured', 'rows per second', 1e-6, 1e12)
_START = TIME_COLUMNS['time_s']
EXPERIMENT_COLUMNS = {BY_AMPLITUDE: POINT_COLUMNS, OVER_TIME: TIME_COLUMNS}
_NEEDED = {BY_AMPLITUDE: ('preload_n', 'amplitude_m'), OVER_TIME: ('time_s',)}
PRELOAD_QUANTITY = 'zero_amplitude_m'  # without an amplitude
_PER_PRELOAD = ('force_n', 'step_length_m')  # may have a column per preload
MEASURED = {
    BY_AMPLITUDE: tuple(_NUMBERS),
    OVER_TIME: (*(each.quantity for each in SENSORS), 'voltage_v', 'foot_m'),
}
"""Columns of which at least one is needed."""


@dataclass(frozen=True, eq=False)
class MeasuredTable:
    """A measured table."""

    origin: str  # file
    kind: str  # BY_AMPLITUDE or OVER_TIME
    columns: dict[str, Array]  # SI, shape (rows,); over time, NaN for an empty cell
    notes: tuple[str, ...] = ()  # comment lines above the header
    recognised: tuple[Column, ...] = ()  # recognised columns
    unread: tuple[str, ...] = ()  # headers of columns that were not read
    gaps: tuple[str, ...] = ()  # omitted rows with empty cells


@dataclass(frozen=True)
class Reading:
    """Information about tables from the user."""

    # headers by quantity, {'force_n': 'Force (mN)'}, whose unit overrides that of the file; for
    # recordings of other programs topic and field
    headers: Mapping[str, str] = field(default_factory=dict)
    preloads_n: Sequence[float] = ()  # of tables without such a column: one each, or one for all
    report: Callable[[MeasuredTable], None] | None = None  # called with each table
    is_run: bool = False  # tables over time are simulated, so that preloads_n apply
    stand_n: float | None = None  # preload of tables by amplitude without one; None: refused
    rate_hz: float | None = None  # of rows; times are counted, columns of times are not read
    start_s: float | None = None  # time of the first row
    only_tables: bool = True  # no recording is among the sources, so that no header is a topic

    def __post_init__(self) -> None:
        """Check column names, preloads, rate and start."""
        for name in self.headers:
            if name not in {**POINT_COLUMNS, **TIME_COLUMNS}:
                points, times = ', '.join(POINT_COLUMNS), ', '.join(TIME_COLUMNS)
                hint = f'known are, by amplitude {points}; over time {times}'
                raise UnknownName('column of --map', name, hint)
        for preload_n in self.preloads_n:
            POINT_COLUMNS['preload_n'].check('--preload', preload_n)
        if self.rate_hz is not None:
            _RATE.check('--rate', self.rate_hz)
        if self.start_s is not None:
            _START.check('--start', self.start_s)

    @property
    def topics(self) -> dict[str, str]:
        """Entries that recordings take: topic and field, ``/rig/cell.wrench.force.x (mN)``."""
        return {name: text for name, text in self.headers.items() if text.startswith('/')}

    def for_sources(self, listed: Sequence[Any]) -> 'Reading':
        """Return how to read these sources; refuse more preloads than sources."""
        if len(self.preloads_n) > len(listed):
            limit = f'above the number of tables, {len(listed)}'
            hint = 'give one of all, or one of each'
            raise OutOfRange('number of preloads', len(self.preloads_n), '', limit, hint)
        is_table = [
            hasattr(each, 'to_csv') or (isinstance(each, Path) and not is_recording(each))
            for each in listed
        ]
        if self.rate_hz is not None and not any(is_table):
            hint = 'leave it away: a recording has times'
            raise OutOfRange('--rate', self.rate_hz, 'Hz', 'without effect on recordings', hint)
        return dataclasses.replace(self, only_tables=all(is_table))

    def preload_n(self, number: int) -> float | None:
        """Return the preload given for a table, counted from 0."""
        given = self.preloads_n
        if len(given) == 1:
            return given[0]
        return given[number] if number < len(given) else None


AS_IT_IS = Reading()


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
            layout = layout_of(head[: HEAD_BYTES + 1], origin)
            if columns := columns_of_sheet(head, layout):
                laid_out.append((columns, layout_of(columns, origin), origin))
            else:
                laid_out.append((source, layout, origin))
        except RecordingError as error:
            refusals.append(error)
    if laid_out:
        refusals.clear()
    for table in laid_out:
        try:
            return _read(*table, reading, number, kind, measured)
        except StickSlipError as error:  # noqa: PERF203
            refusals.append(error)
    raise refusals[0]


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
    return _concatenated(parts, ', '.join(part.origin for part in parts))


def _concatenated(parts: Sequence[MeasuredTable], origin: str) -> MeasuredTable:
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
    source: Path | bytes,
    layout: TextForm,
    origin: str,
    reading: Reading,
    number: int = 0,
    kind: str | None = None,
    measured: Sequence[str] = (),
) -> MeasuredTable:
    where = f'{origin}: line {layout.header or layout.first}'
    headers = {
        name: text
        for name, text in reading.headers.items()
        if reading.only_tables or not text.startswith('/') or places_of(layout, text)
    }
    reading = dataclasses.replace(reading, headers=headers)
    if reading.rate_hz is not None:
        layout = dataclasses.replace(layout, step_s=1.0 / reading.rate_hz, start_s=0.0)
    kind = kind or _kind(layout, reading, where)
    _check_useful(reading, kind, layout, where)
    if reading.start_s is not None:
        layout = dataclasses.replace(layout, start_s=reading.start_s)
    preloads = _columns_of_preloads(layout, reading, where) if kind == BY_AMPLITUDE else {}
    if preloads:
        parts = []
        for at, of_one in preloads.items():  # a blank name is not reported as unread
            shown = [' ' if i in preloads and i != at else n for i, n in enumerate(layout.names)]
            narrowed = dataclasses.replace(layout, names=tuple(shown))
            parts.append(_read(source, narrowed, origin, of_one, 0, kind, measured))
        return _concatenated(parts, origin)
    return _read_columns(source, layout, origin, reading, number, kind, measured or MEASURED[kind])


def _read_columns(
    source: Path | bytes,
    layout: TextForm,
    origin: str,
    reading: Reading,
    number: int,
    kind: str,
    measured: Sequence[str],
) -> MeasuredTable:
    where, specs = f'{origin}: line {layout.header or layout.first}', EXPERIMENT_COLUMNS[kind]
    names, places = find_columns(layout, specs, reading.headers, where)
    forces = names.get('force_n', [])
    if {*BACK, *BACK.values()} & names.keys() and [
        split_unit(layout.names[at])[0].lower() for [(at, _), *_] in forces
    ] == ['load']:
        names['load_n'] = names.pop('force_n')
    preload_n = reading.preload_n(number) if kind == BY_AMPLITUDE else None
    if preload_n is not None and 'preload_n' in names:
        hint = 'leave --preload away, or give as many as there are files'
        raise RecordingError(where, f'names a preload, and --preload {preload_n:g} too', hint)
    if 'preload_n' not in names and preload_n is None and kind == BY_AMPLITUDE:
        preload_n = reading.stand_n
    given = [*names] if preload_n is None else ['preload_n', *names]
    _check_present(given, kind, measured, layout, places, where)
    chosen = resolve_columns(names, layout, specs, where)
    numbers, lines, over, counts_from = _numbers(source, layout, chosen, origin)
    numbers, lines, gaps = _whole_rows(numbers, chosen, lines, over)
    gaps = counts_from + gaps
    for column, found in zip(chosen, numbers, strict=True):
        _check_values(column, found, lines, specs[column.name], layout, origin)
    values = {each.name: found for each, found in zip(chosen, numbers, strict=True)}
    if kind == OVER_TIME:
        hint = ', or '.join(filter(None, (epoch_of(layout), RATE)))
        values, changed = joined_clocks(chosen, numbers, lines, origin, hint)
        gaps += changed
        if measured != MEASURED[kind]:  # all rows have what was asked for
            known = ~np.isnan(next(values[name] for name in measured if name in values))
            values = {each: found[known] for each, found in values.items()}
    rows = len(next(iter(values.values())))
    if not rows:
        raise RecordingError(where, 'has no values below its header', 'give at least one row')
    firsts = [
        dataclasses.replace(each, first=float(found[np.argmax(~np.isnan(found))]))
        for each, found in zip(chosen, numbers, strict=True)
    ]
    if preload_n is not None:
        values = {'preload_n': np.full(rows, preload_n), **values}
    if kind == BY_AMPLITUDE:
        values, more = completed(values, where)
        gaps += more
    unread = [shown_column(layout, at) for at in places]
    notes = (*layout.notes, *(f'column {quoted(each)} was not read' for each in unread), *gaps)
    others = tuple(firsts), tuple(unread), tuple(gaps)
    experiment = MeasuredTable(origin, kind, values, notes, *others)
    if reading.report is not None:
        reading.report(experiment)
    return experiment


def _check_useful(reading: Reading, kind: str, layout: TextForm, where: str) -> None:
    """Refuse options that do not apply to a table of this kind."""
    known = EXPERIMENT_COLUMNS[kind]
    useless = [f'--map {name}=' for name in reading.headers if name not in known]
    if reading.preloads_n and kind == OVER_TIME and not reading.is_run:
        useless.append('--preload')
    if reading.rate_hz is not None and (kind == BY_AMPLITUDE or 'time_s' in reading.headers):
        useless.append('--rate' if kind == BY_AMPLITUDE else '--rate with --map time_s=')
    if reading.start_s is not None and layout.start_s is None:
        useless.append('--start without --rate')
    if useless:
        problem = f'{useless[0]} is without effect on an {kind}'
        raise RecordingError(where, problem, 'leave it away')


def _whole_rows(
    numbers: Sequence[Array], chosen: Sequence[Column], lines: Lines, over: Sequence[int]
) -> tuple[list[Array], Lines, list[str]]:
    """
    Return complete rows, their lines, and notes on omitted rows; count rows over range.

    Over time a row needs a time, by amplitude a number with its settings.

    """
    known = {each.name: ~np.isnan(found) for each, found in zip(chosen, numbers, strict=True)}
    clocks = [found for each, found in zip(chosen, numbers, strict=True) if each.name == 'time_s']
    found, is_kept = list(numbers), ~np.all(np.isnan(clocks), axis=0)
    is_lost = np.ones(len(lines), dtype=bool)
    if not clocks:
        whole = dict[str, Any]()
        for name in known.keys() & NUMBERS.keys():
            needs = (name, *NUMBERS[name].settings, sigma_name(name))
            whole[name] = np.all([known[each] for each in needs if each in known], axis=0)
        for at, each in enumerate(chosen):
            found[at] = np.where(whole.get(each.name, True), numbers[at], np.nan)
        is_kept = np.any([*whole.values()], axis=0)
        is_lost = ~is_kept | np.any([known[name] & ~whole[name] for name in whole], axis=0)
    gaps = []
    for each, values, left_out in zip(chosen, numbers, over, strict=True):
        if len(without := lines[np.isnan(values) & is_lost]):
            which = quoted(each.header) + f' ({left_out} over range)' * (left_out > 0)
            text = f'{len(without)} of {len(lines)} rows without {which} were left out'
            gaps.append(f'{text}, the first is line {without[0]}')
    return [each[is_kept] for each in found], lines[is_kept], gaps


def _columns_of_preloads(layout: TextForm, reading: Reading, where: str) -> dict[int, Reading]:
    """Return how to read each column of a table with one per preload, by place."""
    if reading.preloads_n or 'preload_n' in reading.headers:
        return {}
    found = {}
    for at, header in enumerate(layout.names):
        amounts = [' '.join(each).replace(',', '.') for each in AMOUNT.findall(header)]
        if len(amounts) == 1 and (preload_n := quantity(amounts[0], 'N')):
            found[at] = preload_n
    specs = {'preload_n': POINT_COLUMNS['preload_n']}
    if len(found) < 2 or find_columns(layout, specs, {}, where)[0]:
        return {}
    if len(set(found.values())) < len(found):
        problem = f'columns {listed(layout.names[at] for at in found)} name a preload twice'
        raise RecordingError(where, problem, 'keep one column of each, or a row for each point')
    shared = {name: text for name, text in reading.headers.items() if text.startswith(ALL_COLUMNS)}
    name, text = next(iter(shared.items()), ('', ''))
    others = {name: text for name, text in reading.headers.items() if name not in shared}
    readings = {}
    for at, preload_n in found.items():
        header = layout.names[at]
        units = (split_unit(text)[1], layout.units[at], *UNIT_WITHIN.findall(header))
        unit = next(filter(None, units), '')
        for each in [name] if name else _PER_PRELOAD:
            if factor_of(unit, POINT_COLUMNS[each].unit):
                headers, own = {**others, each: f'#{at + 1} ({unit})'}, (preload_n,)
                readings[at] = dataclasses.replace(reading, headers=headers, preloads_n=own)
    if len(readings) < len(found):
        problem = f'columns {listed(layout.names[at] for at in found)} are of one preload each'
        hint = f'say what they hold: --map force_n="{ALL_COLUMNS} (mN)"'
        raise RecordingError(where, problem, hint)
    return readings


def _kind(layout: TextForm, reading: Reading, where: str) -> str:
    """Return whether a table is over time or by amplitude."""
    points = (*_NEEDED[BY_AMPLITUDE], *MEASURED[BY_AMPLITUDE][1:])  # a force may be in time
    kinds = [(OVER_TIME, _NEEDED[OVER_TIME]), (BY_AMPLITUDE, points)]
    if reading.rate_hz is not None:  # which gives each table a time
        kinds.insert(0, (BY_AMPLITUDE, ('preload_n',)))
    for kind, needed in kinds:
        specs = {name: EXPERIMENT_COLUMNS[kind][name] for name in needed}
        if find_columns(layout, specs, reading.headers, where)[0]:
            return kind
    problem = f'columns {listed(filter(None, layout.names))} tell neither a time nor an amplitude'
    named = {at for text in reading.headers.values() for at, _ in places_of(layout, text)}
    free = [at for at, header in enumerate(layout.names) if header.strip() and at not in named]
    option = epoch_of(layout) or suggestion(['time_s'], layout, free, TIME_COLUMNS)[1]
    hint = f'which holds the time? {option}; {RATE}' if option else RATE
    raise RecordingError(where, problem, hint)


def _check_present(
    names: Sequence[str],
    kind: str,
    measured: Sequence[str],
    layout: TextForm,
    unread: Sequence[int],
    where: str,
) -> None:
    """Refuse a missing column, and suggest a candidate."""
    there = set(measured) & set(names)
    if PRELOAD_QUANTITY in there & set(MEASURED[BY_AMPLITUDE]) and set(_PER_PRELOAD) & there:
        hint = 'give it in a table of its own, a row for each preload'
        raise RecordingError(where, f'has both {PRELOAD_QUANTITY} and numbers by amplitude', hint)
    needed = list(_NEEDED[kind])
    if {'amplitude_m', 'voltage_v'} <= {*names} and kind == BY_AMPLITUDE:
        hint = 'take one away; a stroke is the gain times the voltage'
        raise RecordingError(where, 'has both amplitude_m and voltage_v', hint)
    asks = [each for each in there & NUMBERS.keys() if 'amplitude_m' in NUMBERS[each].settings]
    if kind == BY_AMPLITUDE and ('voltage_v' in names or (there and not asks)):
        needed.remove('amplitude_m')
    missing: list[tuple[str, ...]] = [(name,) for name in needed if name not in names]
    if not there:
        missing.append(tuple(measured))
    for each in missing[:1]:
        problem = f'there is no {" or ".join(each)}'
        name, option = suggestion(each, layout, unread, EXPERIMENT_COLUMNS[kind])
        hint = 'add one' if each[1:] else f'add it, in {EXPERIMENT_COLUMNS[kind][name].unit}'
        if unread:
            problem += f'; not understood: {listed(shown_column(layout, at) for at in unread)}'
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
        of_what = name.replace(SIGMA, '_')
        if of_what not in names:
            raise RecordingError(where, f'{name!r} is there without {of_what!r}', 'add that one')


def _numbers(
    source: Path | bytes, layout: TextForm, chosen: Sequence[Column], origin: str
) -> tuple[list[Array], Lines, list[int], list[str]]:
    """Return columns in SI units, the line of each row, counts of over range, and notes."""
    parts: list[list[Array]] = [[] for _ in chosen]
    lines, empty, over = list[Lines](), list[Lines](), [0] * len(chosen)
    named = 1 + max(at for at, name in enumerate(layout.names) if name)
    places = [at for each in chosen for at, *_ in each.parts if at != ROW]
    wide = [at for each in chosen for at, _, begin in each.parts if begin]
    for first, chunk in _chunks(source, layout, origin, wide):
        stop_if_asked()
        is_there = chunk.notna().to_numpy()
        beyond = np.flatnonzero(is_there[:, named:].any(axis=1))
        if len(beyond):
            problem = f'has more values than the {named} columns with names'
            raise RecordingError(f'{origin}: line {first + beyond[0]}', problem, ONE_PER_COLUMN)
        kept = is_there[:, places].any(axis=1)
        lines.append(first + np.flatnonzero(kept))
        empty.append(first + np.flatnonzero(~is_there.any(axis=1)))
        for number, column in enumerate(chosen):
            total: Array = np.zeros(len(lines[-1]))
            for at, factor, begin in column.parts:
                values = np.asarray(lines[-1] - layout.first, np.float64)
                if at != ROW:
                    place = partial(_place, origin, lines[-1], column)
                    ways = DIRECTIONS if column.name == 'direction' else {}
                    cells = chunk[at][kept]
                    values, left_out = _to_floats(cells, layout.decimal, begin, ways, place)
                    over[number] += left_out
                total = total + in_si(values, factor)
            start_s = (layout.start_s or 0.0) if column.name == 'time_s' else 0.0
            is_sum = start_s or column.parts[1:]
            parts[number].append(np.round(start_s + total, TIME_DECIMALS) if is_sum else total)
    numbers, rows = [np.concatenate(each) for each in parts], np.concatenate(lines)
    blank = np.concatenate(empty)
    if any(each.index == ROW for each in chosen) and len(rows) and (blank < rows[-1]).any():
        problem = 'is empty, so that the times of the rows below are not known'
        raise RecordingError(f'{origin}: line {blank[0]}', problem, 'take the line away')
    notes = []
    for column in chosen:
        if begin_s := column.begin_s:
            _check_values(column, np.array([begin_s]), rows, _START, layout, origin)
            notes.append(f'{quoted(column.header)} counts from {begin_s:.9f} s')
    return numbers, rows, over, notes


def _chunks(
    source: Path | bytes, layout: TextForm, origin: str, wide: Sequence[int]
) -> Iterator[tuple[int, Any]]:
    """Yield first line and cells (DataFrame) of chunks of rows; those of wide columns as text."""
    import pandas as pd  # noqa: PLC0415 - slow import

    line = layout.first
    try:
        stream = io.BytesIO(source) if isinstance(source, bytes) else source.open('rb')
        with io.TextIOWrapper(stream, layout.encoding) as text:
            for _ in range(layout.first - 1):  # a quotation above the first row ends there
                text.readline()
            for chunk in pd.read_csv(
                text,
                sep=layout.delimiter,
                decimal=layout.decimal,
                header=None,
                names=range(len(layout.names)),
                skip_blank_lines=False,
                skipinitialspace=True,
                keep_default_na=False,
                na_values=[form for each in EMPTY for form in (each, each.upper())],
                float_precision='round_trip',
                chunksize=CHUNK_ROWS,
                dtype=dict.fromkeys(wide, str),
            ):
                yield line, chunk
                line += len(chunk)
    except pd.errors.ParserError as error:
        where, problem = f'{origin}: below line {layout.first}', f'is no table ({error})'
        hint = 'save it again as CSV'
        if found := re.search(r'Expected (\d+) fields in line (\d+), saw (\d+)', str(error)):
            where, hint = f'{origin}: line {layout.first - 1 + int(found[2])}', ONE_PER_COLUMN
            problem = f'has {found[3]} values, the lines above {found[1]}'
        elif found := re.search(r'EOF inside string starting at row (\d+)', str(error)):
            where = f'{origin}: line {layout.first + int(found[1])}'
            problem = 'begins a quotation that does not end'
            hint = 'take the quotation mark away'
        raise RecordingError(where, problem, hint) from None
    except UnicodeDecodeError as error:
        problem = f'is not {layout.encoding} throughout (byte {error.object[error.start]:#x})'
        raise RecordingError(f'{origin}: after line {line}', problem, 'save it in UTF-8') from None


def _to_floats(
    cells: Any, decimal: str, begin: int, ways: Mapping[str, float], place: Callable[[int], str]
) -> tuple[Array, int]:
    """
    Return cells less a whole number, NaN for empty ones, and how many are over range.

    ``ways`` are words in place of numbers. Refuses the first other cell.

    """
    if cells.dtype.kind in 'iuf' and not ways:
        values = cells.to_numpy(dtype=np.float64)
        is_over = np.abs(values) >= BEYOND
        wrong = np.flatnonzero(np.isinf(values))
    else:
        texts = [str(cell).strip() for cell in cells.fillna('')]
        if ways:
            words = {**dict.fromkeys(EMPTY, ''), **ways}
            texts, decimal = [str(words.get(text.lower(), 'x')) for text in texts], '.'
        values = np.array([to_number(text, decimal) for text in texts])
        is_over = [OVER_RANGE.fullmatch(text) is not None for text in texts]
        is_over |= np.abs(values) >= BEYOND
        is_empty = [text.lower() in EMPTY for text in texts]
        wrong = np.flatnonzero(~np.isfinite(values) & ~is_over & ~np.array(is_empty, bool))
        if begin:  # whole numbers are subtracted before they are floats
            whole = [int(text) - begin if text.isdecimal() else np.nan for text in texts]
            values = np.where(np.isnan(whole), values - begin, whole)
            begin = 0
    if len(wrong):
        hint = 'correct the row, or leave the cell empty'
        wanted = 'up or down' if ways else 'a finite number'
        raise WrongKind(place(wrong[0]), str(cells.iloc[wrong[0]]), wanted, hint)
    return np.where(is_over, np.nan, values - begin), int(np.sum(is_over))


def _place(origin: str, lines: Lines, column: Column, row: int) -> str:
    return f'{origin}: line {lines[row]}, column {column.header or column.name}:'


def _check_values(
    column: Column, values: Array, lines: Lines, spec: Spec, layout: TextForm, origin: str
) -> None:
    """Refuse the first value out of range; a large one may have another unit."""
    below = values < (-np.inf if spec.minimum is None else spec.minimum)
    above = values > (np.inf if spec.maximum is None else spec.maximum)
    is_sigma = SIGMA in column.name
    wrong = np.flatnonzero(below | above | (is_sigma & (values == 0.0)))
    if not len(wrong):
        return
    value = float(values[wrong[0]])
    where = _place(origin, lines, column, wrong[0])
    if above[wrong[0]]:
        limit = f'above the largest {column.name}, {spec.maximum:g} {spec.unit}'
        unit, hint = likely_unit(layout, spec.unit, column.index), 'correct the row'
        if unit != column.unit and not column.parts[1:] and column.index != ROW:
            option = map_hint(column.name, layout, column.index, unit)
            hint = f'is it {unit}? give it by {option}'
    elif is_sigma:
        limit, hint = 'not above 0', 'give the standard deviation, or take the column away'
    else:
        limit, hint = f'below the minimum {spec.minimum:g} {spec.unit}', 'correct the row'
    raise OutOfRange(where, value, spec.unit, limit, hint)
