# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Files of sweeps: CSV, or Parquet if pyarrow is installed."""

import csv
import io
import itertools
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import stickslip_ros
from stickslip_ros.budget import NUMBERS_MOST, load_json
from stickslip_ros.errors import RecordingError, UnknownName, WrongKind
from stickslip_ros.extras import load_extra
from stickslip_ros.files import SWEEP_PARTS, prepare_output, read_bytes, replacing
from stickslip_ros.lab.measurements.vocabulary import POINT_COLUMNS
from stickslip_ros.lab.readers.formats import DATA_FRAME, check_parquet
from stickslip_ros.parameters import Parameters, Scalar, Spec, bare_name, spec_of

if TYPE_CHECKING:
    from pandas import DataFrame

CSV, PARQUET = '.csv', '.parquet'
_VERSION, _PARAMETERS = 'stickslip_ros.version', 'stickslip_ros.parameters'
SWEEP_DIGEST = 'stickslip_ros.sweep'
"""Keys of metadata in Parquet, or of comment lines above the header in CSV."""
_COMMENT = '# '
Row = dict[str, Scalar]  # result of a case: names with units, JSON values
SETTINGS = ('preload_n', 'amplitude_m', 'frequency_hz')
SWEEP_COLUMNS = (
    *(*SETTINGS, 'force_mean_n', 'force_net_n', 'force_ramp_start_n', 'step_length_m'),
    *('energy_loss_per_step_j', 'steady', 'steps', 'energy_residual'),
)
"""Columns with results of a run, besides ``STOP_RULE``."""
STEP_BACK = 'step_back_m'  # size of the step backwards, if requested
STOP_RULE = 'stop_rule'  # column of every sweep, but of no experiment
_MEASURED = ('force_mean_n', 'step_length_m', 'energy_loss_per_step_j')
RUN_COLUMNS = {*SWEEP_COLUMNS, STOP_RULE} - {*SETTINGS, *_MEASURED}
"""Columns with details of a run; all other unknown columns are varied parameters."""
_NUMBERS = {name: POINT_COLUMNS[name] for name in SETTINGS}
_NUMBERS |= dict.fromkeys((*_MEASURED, STEP_BACK), Spec(float, 0.0, '', '', ''))
INDEX = ('', 'Unnamed: 0')  # names of the index column that pandas writes
_REWRITE = 'write the table again with: stickslip sweep'


def check_table_path(path: Path) -> None:
    """Refuse, before the runs, a file that is neither CSV nor Parquet or cannot be written."""
    if path.suffix not in {CSV, PARQUET}:
        raise WrongKind('output', str(path), 'a .csv or .parquet file', 'end its name so')
    if path.suffix == PARQUET:
        load_extra('a Parquet file', 'pyarrow')
    prepare_output(path)


def write_table(rows: Sequence[Row], path: Path, parameters: Parameters, digest: str = '') -> None:
    """Write rows and a header, floats exactly; the file appears when complete."""
    described = {_VERSION: stickslip_ros.__version__, _PARAMETERS: json.dumps(parameters.flat())}
    described |= {SWEEP_DIGEST: digest} if digest else {}
    with replacing(path) as part:
        if path.suffix == PARQUET:
            pyarrow = load_extra('a Parquet file', 'pyarrow')
            parquet = load_extra('a Parquet file', 'pyarrow.parquet')
            table = pyarrow.table({name: [row[name] for row in rows] for name in rows[0]})
            parquet.write_table(table.replace_schema_metadata(described), part)
            return
        with part.open('w', newline='', encoding='utf-8') as file:
            file.writelines(f'{_COMMENT}{name}: {text}\n' for name, text in described.items())
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)


def is_sweep(path: 'Path | DataFrame') -> bool:
    """Return whether a table is a sweep, by its header."""
    if not isinstance(path, Path):
        return STOP_RULE in getattr(path, 'columns', ())
    if path.suffix == PARQUET or path.is_dir():
        return any(STOP_RULE in each.column_names for each in _arrow_tables(path, 1))
    try:
        with path.open(newline='', encoding='utf-8') as file:
            head = io.StringIO(file.read(1 << 20), newline='')  # the header and the lines above it
            below = (line for line in head if not line.startswith(_COMMENT))
            return STOP_RULE in next(csv.reader(below), [])
    except (UnicodeDecodeError, csv.Error):
        return False


def read_table(path: 'Path | DataFrame') -> tuple[list[Row], dict[str, Scalar] | None]:
    """Read the table of a sweep; StickSlipError if damaged."""
    rows: list[dict[Any, Any]]
    if not isinstance(path, Path):
        known, rows, first = path.attrs.get('parameters'), path.to_dict('records'), 1
        described = known and {'stickslip_ros': stickslip_ros.__version__, **known}
        path = Path(DATA_FRAME)
    elif path.suffix == PARQUET or path.is_dir():
        tables = _arrow_tables(path)
        metadata = tables[0].schema.metadata or {}
        described = _described({name.decode(): text.decode() for name, text in metadata.items()})
        rows, first = list(itertools.chain(*(each.to_pylist() for each in tables))), 1
    else:
        text = read_bytes(path, _REWRITE).decode(errors='replace')
        lines = list(io.StringIO(text, newline=''))
        comments = list(itertools.takewhile(lambda line: line.startswith(_COMMENT), lines))
        pairs = (line.removeprefix(_COMMENT).partition(': ') for line in comments)
        described = _described({name: text.strip() for name, _, text in pairs})
        rows, first = list(csv.DictReader(lines[len(comments) :])), len(comments) + 2
    if not rows:
        raise RecordingError(path, 'has no rows', _REWRITE)
    checked = []
    for number, row in enumerate(rows, first):
        where = f'{path}: line {number}'
        needed = {*_NUMBERS, 'steady'} - {STEP_BACK}
        missing = sorted(name for name in needed if row.get(name) in (None, ''))
        if missing:
            raise RecordingError(where, f'column {missing[0]} has no value', _REWRITE)
        if None in row:
            raise RecordingError(where, 'has more values than columns', 'remove them')
        cells = ((name, each) for name, each in row.items() if name not in INDEX)
        checked.append({n: _value(n, each, f'{where}, column {n}:') for n, each in cells})
    return checked, described


def _arrow_tables(path: Path, most: int | None = None) -> list[Any]:
    """Return a file, or parts in a folder (at most ``most``); refuse missing parts."""
    if not path.is_dir():
        return [read_arrow(path, _REWRITE)]
    files = sorted(path.glob(SWEEP_PARTS))
    if files and len(files) != (count := parts_of(files[0])):
        hint = 'run the same sweep again: it makes the missing parts'
        raise RecordingError(path, f'has {len(files)} of {count} parts of a sweep', hint)
    sizes = [check_parquet(each) for each in files]
    NUMBERS_MOST.check(sum(each.num_rows * each.num_columns for each in sizes), path)
    return [read_arrow(each, _REWRITE) for each in files[:most]]


def parts_of(part: Path) -> int:
    """Return the number of parts of a sweep, from the name of a part."""
    count = part.stem.rpartition('-')[2]
    return int(count) if count.isdecimal() else 0


def read_arrow(path: Path, hint: str) -> Any:
    """Read a Parquet file as a pyarrow table; RecordingError with the hint if invalid."""
    parquet = load_extra('a Parquet file', 'pyarrow.parquet')
    try:
        check_parquet(path)
        return parquet.read_table(path)
    except (OSError, ValueError) as error:  # the errors of pyarrow
        problem = f'cannot be read as a Parquet file ({str(error).splitlines()[0]})'
        raise RecordingError(path, problem, hint) from None


def _described(metadata: Mapping[str, str]) -> dict[str, Scalar] | None:
    if _PARAMETERS not in metadata:
        return None
    values = load_json(metadata[_PARAMETERS])
    arrays = {name: tuple(value) for name, value in values.items() if isinstance(value, list)}
    return {'stickslip_ros': metadata[_VERSION], **values, **arrays}


def _value(name: str, value: Any, where: str) -> Any:
    """Check a value; return it with the right type."""
    if name in _NUMBERS:
        return _NUMBERS[name].check(where, value)
    if name == 'steady':
        return str(value).lower() == 'true'
    if name in RUN_COLUMNS:
        return str(value)
    try:
        spec = spec_of(bare_name(name))
    except UnknownName as error:
        raise RecordingError(where, str(error), 'remove the column') from None
    return spec.check(where, value)
