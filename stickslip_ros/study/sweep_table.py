"""The table of a sweep in a file: CSV, or Parquet if its package is there."""

import contextlib
import csv
import json
from collections.abc import Sequence
from pathlib import Path

import stickslip_ros
from stickslip_ros.errors import RecordingError, WrongKind
from stickslip_ros.files import make_room
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.extras import load_extra
from stickslip_ros.study.journal import Row

CSV, PARQUET = '.csv', '.parquet'


def check_table_path(path: Path) -> None:
    """
    Refuse a file that could not be written, before the work is done.

    Raises
    ------
    WrongKind
        If it is neither CSV nor Parquet.
    MissingExtra
        If Parquet is asked for and its package is not installed.
    RecordingError
        If it cannot be written.

    """
    if path.suffix not in {CSV, PARQUET}:
        raise WrongKind('output', str(path), 'a .csv or .parquet file', 'end its name so')
    if path.suffix == PARQUET:
        load_extra('a Parquet file', 'pyarrow')
    make_room(path)


def write_table(rows: Sequence[Row], path: Path, parameters: Parameters) -> None:
    """
    Write rows with their names as header; the file appears when it is complete.

    Parameters
    ----------
    rows : sequence of dict
        At least one; all have the same names.
    path : Path
        The file, ``.csv`` or ``.parquet``; floats are written to the bit.
    parameters : Parameters
        The stand, for the metadata of a Parquet file.

    Raises
    ------
    RecordingError
        If the file cannot be written.

    """
    part = path.with_name(f'{path.name}.part')
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix == PARQUET:
            _write_parquet(rows, part, parameters)
        else:
            _write_csv(rows, part)
        part.replace(path)
    except OSError as error:
        with contextlib.suppress(OSError):
            part.unlink()
        problem = f'cannot be written ({error.strerror or error})'
        raise RecordingError(path, problem, 'choose another place') from None


def _write_csv(rows: Sequence[Row], path: Path) -> None:
    with path.open('w', newline='', encoding='utf-8') as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def _write_parquet(rows: Sequence[Row], path: Path, parameters: Parameters) -> None:
    pyarrow = load_extra('a Parquet file', 'pyarrow')
    parquet = load_extra('a Parquet file', 'pyarrow.parquet')
    table = pyarrow.table({name: [row[name] for row in rows] for name in rows[0]})
    metadata = {
        'stickslip_ros.version': stickslip_ros.__version__,
        'stickslip_ros.parameters': json.dumps(parameters.flat()),
    }
    parquet.write_table(table.replace_schema_metadata(metadata), path)
