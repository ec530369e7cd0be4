"""Tables by amplitude and preload: of a sweep, of an experiment, of the model."""

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.errors import RecordingError, UnknownName
from stickslip_ros.parameters import Parameters, Scalar, Spec, spec_of
from stickslip_ros.study.comparison.result import Side
from stickslip_ros.study.experiment import BY_AMPLITUDE, POINT_COLUMNS, Experiment, sigma_name
from stickslip_ros.study.extras import load_extra
from stickslip_ros.study.journal import Row
from stickslip_ros.study.sweep_table import PARQUET

PRELOAD, AMPLITUDE, FREQUENCY = 'preload_n', 'amplitude_m', 'frequency_hz'
SWEEP = 'sweep'
SWEEP_MARK = 'stop_rule'
"""A column that every sweep has and no experiment."""
MEASURED = {
    'force_n': 'force_mean_n',
    'step_length_m': 'step_length_m',
    'energy_loss_per_step_j': 'energy_loss_per_step_j',
}
"""Quantities, and their columns in a sweep."""
OF_A_RUN = {'force_ramp_start_n', 'steady', 'steps', 'energy_residual', SWEEP_MARK}
"""Columns of a sweep that are neither compared nor asked for."""
NUMBER = Spec(float, 0.0, '', '', '')
SAME = 1e-9
"""Relative difference up to which two typed numbers are the same."""


@dataclass(frozen=True, eq=False)
class PointTable:
    """
    Points of a force curve, or of several.

    Attributes
    ----------
    side : Side
        Where they come from.
    amplitude_m : array, shape (rows,)
        Stroke of the feet.
    keys : dict of str to sequence of scalar
        Preload, frequency if known, and what else was varied, by column.
    values : dict of str to array, shape (rows,)
        Quantities that were measured.
    sigmas : dict of str to array, shape (rows,)
        Their uncertainties where they are known, and that of the amplitude.

    """

    side: Side
    amplitude_m: Array
    keys: dict[str, Sequence[Scalar]]
    values: dict[str, Array]
    sigmas: dict[str, Array]

    def varied(self) -> list[str]:
        """Return the columns, beside the preload, that take more than one value."""
        return [
            name
            for name, column in self.keys.items()
            if name != PRELOAD and not all(is_same(value, column[0]) for value in column)
        ]

    def rows_at(self, at: Mapping[str, Scalar]) -> list[int]:
        """Return the rows that have these values, in the order of their amplitudes."""
        rows = [
            row
            for row in range(len(self.amplitude_m))
            if all(is_same(self.keys[name][row], value) for name, value in at.items())
        ]
        return sorted(rows, key=lambda row: float(self.amplitude_m[row]))

    def groups(self, names: Sequence[str]) -> list[dict[str, Scalar]]:
        """Return the different values of some columns, in the order of their appearance."""
        found: list[dict[str, Scalar]] = []
        for row in range(len(self.amplitude_m)):
            at = {name: self.keys[name][row] for name in names}
            if not any(all(is_same(at[name], old[name]) for name in names) for old in found):
                found.append(at)
        return found


def is_same(one: Scalar, other: Scalar) -> bool:
    """Tell whether two values are the same, but for the rounding of typed numbers."""
    if isinstance(one, (bool, str)) or isinstance(other, (bool, str)):
        return one == other
    return abs(one - other) <= SAME * max(abs(one), abs(other))


def points_of_experiment(experiment: Experiment) -> PointTable:
    """Return the points of an experiment by amplitude."""
    columns = experiment.columns
    keys: dict[str, Sequence[Scalar]] = {
        name: columns[name].tolist() for name in (PRELOAD, FREQUENCY) if name in columns
    }
    side = Side(
        origin=experiment.origin,
        kind=BY_AMPLITUDE,
        rows=len(columns[AMPLITUDE]),
        described=_constants(keys),
        changed=None,
        notes=experiment.notes,
    )
    sigmas = {
        name: columns[sigma_name(name)]
        for name in (AMPLITUDE, *MEASURED)
        if sigma_name(name) in columns
    }
    values = {name: columns[name] for name in MEASURED if name in columns}
    return PointTable(side, columns[AMPLITUDE], keys, values, sigmas)


def points_of_rows(
    rows: Sequence[Row], origin: str, kind: str, described: dict[str, Scalar] | None = None
) -> PointTable:
    """
    Return the points of rows as a sweep makes them.

    Parameters
    ----------
    rows : sequence of dict
        At least one.
    origin, kind : str
        Where they come from.
    described : dict of str to scalar, optional
        All parameters and versions, where they are known; a column counts more.

    """
    not_keys = {AMPLITUDE, *MEASURED.values(), *OF_A_RUN}
    keys: dict[str, Sequence[Scalar]] = {
        name: [row[name] for row in rows] for name in rows[0] if name not in not_keys
    }
    in_columns = {'stand.preload', *map(bare_name, keys)}
    known = {name: each for name, each in (described or {}).items() if name not in in_columns}
    unsteady = sum(not row['steady'] for row in rows)
    side = Side(
        origin=origin,
        kind=kind,
        rows=len(rows),
        described={**known, **_constants(keys)},
        changed=None if described is None else _changed(known),
        notes=(f'{unsteady} of {len(rows)} runs were not steady',) if unsteady else (),
    )
    values = {
        name: np.array([row[column] for row in rows], dtype=np.float64)
        for name, column in MEASURED.items()
    }
    # A free runner makes steps and no force; of a held one that is steady it is the other way.
    del values['step_length_m' if np.any(values['force_n']) else 'force_n']
    amplitude_m = np.array([row[AMPLITUDE] for row in rows], dtype=np.float64)
    return PointTable(side, amplitude_m, keys, values, {})


def read_sweep(path: Path) -> PointTable:
    """
    Read the table that ``stickslip sweep`` wrote.

    Raises
    ------
    StickSlipError
        If it is damaged.

    """
    if path.suffix == PARQUET:
        rows, described = _parquet_rows(path)
        first = 1
    else:
        with path.open(newline='', encoding='utf-8') as file:
            rows, described = list(csv.DictReader(file)), None
        first = 2
    if not rows:
        raise RecordingError(path, 'has no rows', 'write it again with: stickslip sweep')
    checked = [_checked(row, f'{path}: line {first + index}') for index, row in enumerate(rows)]
    return points_of_rows(checked, str(path), SWEEP, described)


def bare_name(column: str) -> str:
    """Return the name of a column without its unit in brackets."""
    return column.partition(' [')[0]


def _parquet_rows(path: Path) -> tuple[list[dict[str, Any]], dict[str, Scalar] | None]:
    parquet = load_extra('a Parquet file', 'pyarrow.parquet')
    try:
        table = parquet.read_table(path)
    except (OSError, ValueError) as error:  # pyarrow's errors are both
        problem = f'is not a Parquet file ({str(error).splitlines()[0]})'
        raise RecordingError(path, problem, 'write it again with: stickslip sweep') from None
    metadata = table.schema.metadata or {}
    described = None
    if b'stickslip_ros.parameters' in metadata:
        described = {
            'stickslip_ros': metadata[b'stickslip_ros.version'].decode(),
            **json.loads(metadata[b'stickslip_ros.parameters']),
        }
    return table.to_pylist(), described


def _checked(row: Mapping[str, Any], where: str) -> Row:
    """Return a row with its values as what they are, or refuse it."""
    needed = {PRELOAD, AMPLITUDE, FREQUENCY, 'steady', *MEASURED.values()}
    missing = sorted(name for name in needed if row.get(name) in (None, ''))
    if missing:
        mend = 'write the table again with: stickslip sweep'
        raise RecordingError(where, f'column {missing[0]} has no value', mend)
    if None in row:
        raise RecordingError(where, 'has more values than columns', 'take them away')
    return {
        str(name): _value(str(name), value, f'{where}, column {name}:')
        for name, value in row.items()
    }


def _value(name: str, value: Any, where: str) -> Scalar:
    if name in {PRELOAD, AMPLITUDE, FREQUENCY}:
        return POINT_COLUMNS[name].check(where, value)
    if name in MEASURED.values():
        return NUMBER.check(where, value)
    if name == 'steady':
        return str(value).lower() == 'true'
    if name in OF_A_RUN:
        return str(value)
    try:
        spec = spec_of(bare_name(name))
    except UnknownName as error:
        raise RecordingError(where, str(error), 'take the column away') from None
    return spec.check(where, value)


def _constants(keys: Mapping[str, Sequence[Scalar]]) -> dict[str, Scalar]:
    """Return the columns that hold one value only."""
    return {
        bare_name(name): column[0]
        for name, column in keys.items()
        if all(is_same(value, column[0]) for value in column)
    }


def _changed(described: Mapping[str, Scalar]) -> dict[str, Scalar]:
    default = Parameters().flat()
    return {
        name: value
        for name, value in described.items()
        if name in default and value != default[name]
    }
