# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Measured tables of laboratories, read into columns in SI units."""

import dataclasses
import io
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
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
    LIKELY,
    Column,
    find_columns,
    listed,
    map_hint,
    resolve_columns,
    suggestion,
)
from stickslip_ros.lab.tables.formats import tables_in
from stickslip_ros.lab.tables.layout import EMPTY, HEAD_BYTES, TextForm, layout_of, to_number
from stickslip_ros.lab.tables.numbers import (
    BACK,
    DIRECTIONS,
    NUMBERS,
    SIGMA,
    completed,
    sheet_as_table,
    sigma_name,
)
from stickslip_ros.lab.tables.units import factor_of, in_si, split_unit
from stickslip_ros.parameters import AMPLITUDE_SPEC, FREQUENCY_SPEC, SENSORS, Spec, spec_of
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.units import quantity, unit_of

if TYPE_CHECKING:
    from pandas import DataFrame

Lines = NDArray[np.intp]  # line numbers of rows, from 1
BY_AMPLITUDE, OVER_TIME = 'experiment by amplitude', 'experiment over time'
FEMTO = 15  # decimals of summed times, s
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
    'tolerance': Spec(float, 20.0, '%', 'measured', 'standard error', 1e-3, 1e3),
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

    def __post_init__(self) -> None:
        """Check column names and preloads."""
        for name in self.headers:
            if name not in {**POINT_COLUMNS, **TIME_COLUMNS}:
                points, times = ', '.join(POINT_COLUMNS), ', '.join(TIME_COLUMNS)
                hint = f'known are, by amplitude {points}; over time {times}'
                raise UnknownName('column of --map', name, hint)
        for preload_n in self.preloads_n:
            POINT_COLUMNS['preload_n'].check('--preload', preload_n)

    @property
    def topics(self) -> dict[str, str]:
        """Entries for recordings: topic and field, ``/rig/cell.wrench.force.x (mN)``."""
        return {name: text for name, text in self.headers.items() if text.startswith('/')}

    @property
    def columns(self) -> dict[str, str]:
        """Entries for tables."""
        return {name: text for name, text in self.headers.items() if not text.startswith('/')}

    def check_count(self, tables: int) -> None:
        """Refuse more preloads than tables."""
        if len(self.preloads_n) > tables:
            limit = f'above the number of tables, {tables}'
            hint = 'give one of all, or one of each'
            raise OutOfRange('number of preloads', len(self.preloads_n), '', limit, hint)

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
    for origin, source in tables_in(path, is_named=bool(reading.columns)):
        head = source
        if isinstance(head, Path):
            head = read_bytes(head, 'check the path', HEAD_BYTES + 1)
        try:
            layout = layout_of(head[: HEAD_BYTES + 1], origin)
            if (columns := sheet_as_table(head, layout)) != head:
                source, layout = columns, layout_of(columns, origin)  # noqa: PLW2901
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
    return _below_each_other(parts, ', '.join(part.origin for part in parts))


def _below_each_other(parts: Sequence[MeasuredTable], origin: str) -> MeasuredTable:
    names = list(dict.fromkeys(name for part in parts for name in part.columns))
    blanks = dict[str, float]()  # beside a data sheet
    if any(NUMBERS[name].is_of_sheet for name in names if name in NUMBERS):
        blanks = dict.fromkeys((*NUMBERS, *map(sigma_name, NUMBERS)), np.nan)
        blanks |= {'voltage_v': 0.0, 'load_n': 0.0}
    for name in names:
        for part in parts:
            if name in blanks and name not in part.columns:
                part.columns[name] = np.full(len(part.columns['preload_n']), blanks[name])
            if name not in part.columns:
                hint = 'give files with the same columns'
                raise RecordingError(part.origin, f'has no {name}, as another file has', hint)
    return MeasuredTable(
        origin=origin,
        kind=BY_AMPLITUDE,
        columns={name: np.concatenate([part.columns[name] for part in parts]) for name in names},
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
    kind = kind or _kind(layout, reading, where)
    _check_useful(reading, kind, where)
    preloads = _columns_of_preloads(layout, reading, where) if kind == BY_AMPLITUDE else {}
    if preloads:
        parts = []
        for at, of_one in preloads.items():  # a blank name is not reported as unread
            shown = [' ' if i in preloads and i != at else n for i, n in enumerate(layout.names)]
            alone = dataclasses.replace(layout, names=tuple(shown))
            parts.append(_read(source, alone, origin, of_one, 0, kind, measured))
        return _below_each_other(parts, origin)
    names, unread = find_columns(layout, EXPERIMENT_COLUMNS[kind], reading.columns, where)
    steps = {*BACK, *BACK.values()} & names.keys()
    if steps and [
        split_unit(layout.names[at])[0].lower() for at, _ in names.get('force_n', [])
    ] == ['load']:
        names['load_n'] = names.pop('force_n')
    preload_n = reading.preload_n(number) if kind == BY_AMPLITUDE else None
    if preload_n is not None and 'preload_n' in names:
        hint = 'leave --preload away, or give as many as there are files'
        raise RecordingError(where, f'names a preload, and --preload {preload_n:g} too', hint)
    if 'preload_n' not in names and preload_n is None and kind == BY_AMPLITUDE:
        preload_n = reading.stand_n
    given = [*names] if preload_n is None else ['preload_n', *names]
    _check_there(given, kind, measured or MEASURED[kind], unread, where)
    chosen = resolve_columns(names, layout, EXPERIMENT_COLUMNS[kind], where)
    numbers = _numbers(source, layout, chosen, origin)
    values, lines, gaps = _whole_rows(*numbers, chosen, kind, measured)
    if not len(lines):
        raise RecordingError(where, 'has no values below its header', 'give at least one row')
    for column in chosen:
        spec = EXPERIMENT_COLUMNS[kind][column.name]
        _check_values(column, values[column.name], lines, spec, origin)
    time_s = values.get('time_s', np.empty(0))
    wrong = np.flatnonzero(np.diff(time_s) <= 0.0)
    if len(wrong):
        before_s, after_s = map(float, time_s[wrong[0] :][:2])
        limit = f'not after the {before_s:.9g} s of the row before'
        place = f'{origin}: line {lines[wrong[0] + 1]}, column time_s:'
        raise OutOfRange(place, after_s, 's', limit, 'sort the rows, and keep one per time')
    firsts = [
        dataclasses.replace(each, first=float(found[np.argmax(~np.isnan(found))]))
        for each in chosen
        for found in [values[each.name]]
    ]
    if preload_n is not None:
        values = {'preload_n': np.full(len(lines), preload_n), **values}
    if kind == BY_AMPLITUDE:
        values, more = completed(values, where)
        gaps += more
    notes = (*layout.notes, *(f'column {quoted(each)} was not read' for each in unread), *gaps)
    others = tuple(firsts), tuple(unread), tuple(gaps)
    experiment = MeasuredTable(origin, kind, values, notes, *others)
    if reading.report is not None:
        reading.report(experiment)
    return experiment


def _check_useful(reading: Reading, kind: str, where: str) -> None:
    """Refuse options that do not apply to a table of this kind."""
    known = EXPERIMENT_COLUMNS[kind]
    useless = [f'--map {name}=' for name in reading.columns if name not in known]
    if reading.preloads_n and kind == OVER_TIME and not reading.is_run:
        useless.append('--preload')
    if useless:
        problem = f'{useless[0]} is without effect on an {kind}'
        raise RecordingError(where, problem, 'leave it away')


def _whole_rows(
    values: dict[str, Array],
    lines: Lines,
    chosen: Sequence[Column],
    kind: str,
    measured: Sequence[str],
) -> tuple[dict[str, Array], Lines, list[str]]:
    """
    Return complete rows, their lines, and notes on omitted rows.

    By amplitude a row needs a number with its settings; over time, the time and the first of
    ``measured``.

    """
    is_known = {name: ~np.isnan(each) for name, each in values.items()}
    wanted = [name for name in measured if name in values][:1]
    is_kept = np.all([is_known[name] for name in ('time_s', *wanted) if name in values], axis=0)
    is_kept &= np.any([is_known[name] for name in values if name not in _NEEDED[kind]], axis=0)
    is_lost = np.ones(len(lines), dtype=bool)
    if kind == BY_AMPLITUDE:
        numbers = {name: is_known[name] for name in values if name in NUMBERS}
        for name, is_there in numbers.items():
            needs = (*NUMBERS[name].settings, sigma_name(name))
            numbers[name] = np.all([is_there, *(is_known.get(x, is_there) for x in needs)], axis=0)
            values[name] = np.where(numbers[name], values[name], np.nan)
        is_kept = np.any([*numbers.values()], axis=0)
        is_lost = np.any(
            [~is_kept, *(is_known[name] & ~numbers[name] for name in numbers)], axis=0
        )
    gaps = []
    for each in chosen:
        out = ~is_known[each.name] & is_lost
        if np.any(out):
            text = f'{np.sum(out)} of {len(lines)} rows without {quoted(each.header)}'
            gaps.append(f'{text} were left out, the first is line {lines[out][0]}')
    return {name: each[is_kept] for name, each in values.items()}, lines[is_kept], gaps


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
                headers, own = {**others, each: f'{header} ({unit})'}, (preload_n,)
                readings[at] = dataclasses.replace(reading, headers=headers, preloads_n=own)
    if len(readings) < len(found):
        problem = f'columns {listed(layout.names[at] for at in found)} are of one preload each'
        hint = f'say what they hold: {map_hint("force_n", ALL_COLUMNS, "mN")}'
        raise RecordingError(where, problem, hint)
    return readings


def _kind(layout: TextForm, reading: Reading, where: str) -> str:
    """Return whether a table is over time or by amplitude."""
    by_amplitude = (*_NEEDED[BY_AMPLITUDE], *MEASURED[BY_AMPLITUDE][1:])  # a force may be in time
    for kind, needed in ((OVER_TIME, ('time_s',)), (BY_AMPLITUDE, by_amplitude)):
        specs = {name: EXPERIMENT_COLUMNS[kind][name] for name in needed}
        if find_columns(layout, specs, reading.columns, where)[0]:
            return kind
    problem = f'columns {listed(filter(None, layout.names))} tell neither a time nor an amplitude'
    example = next(filter(None, layout.names))
    hint = f'which one is it? {map_hint("time_s", example, "s")}, or --map amplitude_m=…'
    raise RecordingError(where, problem, hint)


def _check_there(
    names: Sequence[str], kind: str, measured: Sequence[str], unread: Sequence[str], where: str
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
        name = each[0]
        hint = 'add one' if each[1:] else f'add it, in {EXPERIMENT_COLUMNS[kind][name].unit}'
        if unread:
            problem += f'; not understood: {listed(unread)}'
            name, option = suggestion(each, unread, EXPERIMENT_COLUMNS[kind])
            hint = f'say which column it is, as {option}'
        if name == 'preload_n':
            hint += ', or give the preload of the file in N, as --preload 0.5'
        elif name == 'amplitude_m' and not unread:
            hint += ', or voltage_v, in V'
        raise RecordingError(where, problem, hint)
    for name in names:
        of_what = name.replace(SIGMA, '_')
        if of_what not in names:
            raise RecordingError(where, f'{name!r} is there without {of_what!r}', 'add that one')


def _numbers(
    source: Path | bytes, layout: TextForm, chosen: Sequence[Column], origin: str
) -> tuple[dict[str, Array], Lines]:
    """Return columns in SI units, and the line of each row; blank lines are skipped."""
    parts: dict[str, list[Array]] = {column.name: [] for column in chosen}
    lines, named = [], 1 + max(at for at, name in enumerate(layout.names) if name)
    for first, chunk in _chunks(source, layout, origin):
        stop_if_asked()
        beyond = np.flatnonzero(chunk.iloc[:, named:].notna().any(axis=1).to_numpy())
        if len(beyond):
            problem = f'has more values than the {named} columns with names'
            raise RecordingError(f'{origin}: line {first + beyond[0]}', problem, ONE_PER_COLUMN)
        kept = chunk.iloc[:, [column.index for column in chosen]].notna().any(axis=1).to_numpy()
        lines.append(first + np.flatnonzero(kept))
        for column in chosen:
            cells = chunk[column.index][kept]
            values = _to_floats(cells, lines[-1], layout.decimal, column, origin)
            values = in_si(values, column.factor)
            if column.name == 'time_s' and layout.start_s:
                values = np.round(layout.start_s + values, FEMTO)
            parts[column.name].append(values)
    return {name: np.concatenate(each) for name, each in parts.items()}, np.concatenate(lines)


def _chunks(source: Path | bytes, layout: TextForm, origin: str) -> Iterator[tuple[int, Any]]:
    """Yield first line and cells (DataFrame) of chunks of rows."""
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


def _to_floats(cells: Any, lines: Lines, decimal: str, column: Column, origin: str) -> Array:
    """Return cells as numbers, NaN for empty ones; refuse the first other cell."""
    if cells.dtype.kind in 'iuf' and column.name != 'direction':
        values = cells.to_numpy(dtype=np.float64)
        wrong = np.flatnonzero(np.isinf(values))
    else:
        texts = [str(cell).strip() for cell in cells]
        if column.name == 'direction':
            ways = {**dict.fromkeys(EMPTY, ''), **DIRECTIONS}
            texts, decimal = [str(ways.get(text.lower(), 'x')) for text in texts], '.'
        values = np.array([to_number(text, decimal) for text in texts])
        is_empty = [text.lower() in EMPTY for text in texts]
        wrong = np.flatnonzero(~np.isfinite(values) & ~np.array(is_empty))
    if len(wrong):
        where = _place(origin, lines[wrong[0]], column)
        hint = 'correct the row, or leave the cell empty'
        wanted = 'up or down' if column.name == 'direction' else 'a finite number'
        raise WrongKind(where, str(cells.iloc[wrong[0]]), wanted, hint)
    return np.asarray(values)


def _place(origin: str, line: int, column: Column) -> str:
    return f'{origin}: line {line}, column {column.header or column.name}:'


def _check_values(column: Column, values: Array, lines: Lines, spec: Spec, origin: str) -> None:
    """Refuse the first value out of range; a large one may have another unit."""
    below = values < (-np.inf if spec.minimum is None else spec.minimum)
    above = values > (np.inf if spec.maximum is None else spec.maximum)
    is_sigma = SIGMA in column.name
    wrong = np.flatnonzero(below | above | (is_sigma & (values == 0.0)))
    if not len(wrong):
        return
    value = float(values[wrong[0]])
    where = _place(origin, lines[wrong[0]], column)
    if above[wrong[0]]:
        limit = f'above the largest {column.name}, {spec.maximum:g} {spec.unit}'
        unit, hint = LIKELY[spec.unit], 'correct the row'
        if unit != column.unit:
            hint = f'is it {unit}? give it by {map_hint(column.name, column.header, unit)}'
    elif is_sigma:
        limit, hint = 'not above 0', 'give the standard deviation, or take the column away'
    else:
        limit, hint = f'below the minimum {spec.minimum:g} {spec.unit}', 'correct the row'
    raise OutOfRange(where, value, spec.unit, limit, hint)
