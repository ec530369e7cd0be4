# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The table of a sweep in a file: CSV, or Parquet if its package is there."""

import csv
import itertools
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import stickslip_ros
from stickslip_ros.errors import RecordingError, UnknownName, WrongKind
from stickslip_ros.extras import load_extra
from stickslip_ros.files import prepare_output, replacing
from stickslip_ros.lab.runs.journal import Row
from stickslip_ros.lab.runs.sweep import ASKED, STOP_RULE, SWEEP_COLUMNS, bare_name
from stickslip_ros.lab.tables.experiment import POINT_COLUMNS
from stickslip_ros.lab.tables.formats import DATA_FRAME
from stickslip_ros.parameters import Parameters, Scalar, Spec, spec_of

if TYPE_CHECKING:
    from pandas import DataFrame

CSV, PARQUET = '.csv', '.parquet'
_VERSION, _PARAMETERS = 'stickslip_ros.version', 'stickslip_ros.parameters'
"""Metadata of a Parquet file, and comment lines above the header of CSV."""
_COMMENT = '# '
_MEASURED = ('force_mean_n', 'step_length_m', 'energy_loss_per_step_j')
OF_A_RUN = {*SWEEP_COLUMNS, STOP_RULE} - {*ASKED, *_MEASURED}
"""Columns that say how a run went; all that are none of these are varied parameters."""
_NUMBERS = {name: POINT_COLUMNS[name] for name in ASKED}
_NUMBERS |= dict.fromkeys(_MEASURED, Spec(float, 0.0, '', '', ''))
INDEX = ('', 'Unnamed: 0')
"""Names of a column that pandas writes in front, the numbers of the rows, and reads again."""
AGAIN = 'write the table again with: stickslip sweep'


def check_table_path(path: Path) -> None:
    """Refuse a file that is neither CSV nor Parquet, or could not be written, before the work."""
    if path.suffix not in {CSV, PARQUET}:
        raise WrongKind('output', str(path), 'a .csv or .parquet file', 'end its name so')
    if path.suffix == PARQUET:
        load_extra('a Parquet file', 'pyarrow')
    prepare_output(path)


def write_table(rows: Sequence[Row], path: Path, parameters: Parameters) -> None:
    """Write rows with their names as header, floats to the bit; the file appears when complete."""
    described = {_VERSION: stickslip_ros.__version__, _PARAMETERS: json.dumps(parameters.flat())}
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
    """Tell by its header whether a table is that of a sweep."""
    if not isinstance(path, Path):
        return STOP_RULE in path.columns
    if path.suffix == PARQUET:
        return STOP_RULE in read_parquet(path, AGAIN).column_names
    try:
        with path.open(newline='', encoding='utf-8') as file:
            below = (line for line in file if not line.startswith(_COMMENT))
            return STOP_RULE in next(csv.reader(below), [])
    except (UnicodeDecodeError, csv.Error):
        return False


def read_table(path: 'Path | DataFrame') -> tuple[list[Row], dict[str, Scalar] | None]:
    """Read the table of a sweep; StickSlipError if it is damaged."""
    rows: list[dict[Any, Any]]
    if not isinstance(path, Path):
        known, rows, first = path.attrs.get('parameters'), path.to_dict('records'), 1
        described = known and {'stickslip_ros': stickslip_ros.__version__, **known}
        path = Path(DATA_FRAME)
    elif path.suffix == PARQUET:
        table = read_parquet(path, AGAIN)
        metadata = table.schema.metadata or {}
        described = _described({name.decode(): text.decode() for name, text in metadata.items()})
        rows = table.to_pylist()
        first = 1
    else:
        with path.open(newline='', encoding='utf-8') as file:
            lines = list(file)
        comments = list(itertools.takewhile(lambda line: line.startswith(_COMMENT), lines))
        pairs = (line.removeprefix(_COMMENT).partition(': ') for line in comments)
        described = _described({name: text.strip() for name, _, text in pairs})
        rows, first = list(csv.DictReader(lines[len(comments) :])), len(comments) + 2
    if not rows:
        raise RecordingError(path, 'has no rows', AGAIN)
    checked = []
    for number, row in enumerate(rows, first):
        where = f'{path}: line {number}'
        missing = sorted(name for name in (*_NUMBERS, 'steady') if row.get(name) in (None, ''))
        if missing:
            raise RecordingError(where, f'column {missing[0]} has no value', AGAIN)
        if None in row:
            raise RecordingError(where, 'has more values than columns', 'take them away')
        place = f'{where}, column'
        checked.append(
            {
                name: _value(name, each, f'{place} {name}:')
                for name, each in row.items()
                if name not in INDEX
            }
        )
    return checked, described


def read_parquet(path: Path, hint: str) -> Any:
    """Return the pyarrow table of a Parquet file; RecordingError with this hint if it is none."""
    parquet = load_extra('a Parquet file', 'pyarrow.parquet')
    try:
        return parquet.read_table(path)
    except (OSError, ValueError) as error:  # pyarrow's errors are both
        problem = f'cannot be read as a Parquet file ({str(error).splitlines()[0]})'
        raise RecordingError(path, problem, hint) from None


def _described(metadata: Mapping[str, str]) -> dict[str, Scalar] | None:
    if _PARAMETERS not in metadata:
        return None
    return {'stickslip_ros': metadata[_VERSION], **json.loads(metadata[_PARAMETERS])}


def _value(name: str, value: Any, where: str) -> Scalar:
    """Return a value as what it is, or refuse it."""
    if name in _NUMBERS:
        return _NUMBERS[name].check(where, value)
    if name == 'steady':
        return str(value).lower() == 'true'
    if name in OF_A_RUN:
        return str(value)
    try:
        spec = spec_of(bare_name(name))
    except UnknownName as error:
        raise RecordingError(where, str(error), 'take the column away') from None
    return spec.check(where, value)
