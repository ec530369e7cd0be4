# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip export``: write a recording or tables as one table for other programs."""

import argparse
import itertools
import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from stickslip_ros.errors import OutOfRange, RecordingError, WrongKind
from stickslip_ros.extras import load_extra
from stickslip_ros.files import prepare_output, replacing
from stickslip_ros.lab.cli.chosen import asked_output
from stickslip_ros.lab.cli.experiment import chosen_reading
from stickslip_ros.lab.cli.printing import Answer
from stickslip_ros.lab.measurements.measurement import (
    Measurement,
    PointTable,
    TimeRun,
    measured_alone,
    table_of_series,
)
from stickslip_ros.lab.measurements.recorded import series_by_stretch, stretches_of
from stickslip_ros.recording.integrity import is_recording
from stickslip_ros.recording.reader import Recording

if TYPE_CHECKING:
    from pandas import DataFrame

NEEDS = {'.csv': '', '.parquet': 'pyarrow', '.xlsx': 'openpyxl'}
"""Suffixes of the files, and packages needed to write them."""
EXCEL_ROWS_MAX = 1_048_575
_ROUNDING = 6  # decimals, in intervals: a sample on a border belongs to the later interval


def export_verb(arguments: argparse.Namespace) -> Answer:
    """Read a recording or tables, and write a table."""
    if arguments.output is None:
        measured_alone(arguments.files, chosen_reading(arguments, arguments.files))
    output = asked_output(arguments)
    suffix = output.suffix.lower()
    if suffix not in NEEDS:
        raise WrongKind('--output', str(output), f'one of {", ".join(NEEDS)}', 'end its name so')
    if NEEDS[suffix]:
        load_extra(f'a table {suffix}', NEEDS[suffix])
    reading = chosen_reading(arguments, arguments.files)
    prepare_output(output)
    if arguments.readings and (reading.headers or not is_recording(arguments.files[0])):
        problem = 'is not read by the topics of this package'
        raise RecordingError(arguments.files[0], problem, 'leave out --readings or --map')
    run = measured_alone(arguments.files, reading)
    if isinstance(run, Recording):
        origin, there = run.origin, ', '.join(run.types) or 'it'
        notes = [] if arguments.window_s else [*run.notes]
    else:
        origin, notes, there = run.side.origin, [*run.side.notes], 'it'
    tables = _tables_of(run, arguments.window_s, arguments)
    frames: Iterator[DataFrame] = (each for each in tables if not each.empty)
    if arguments.rate is not None:
        frames = _means(frames, arguments.rate)
    first = next(frames, None)
    if first is None:
        hint = 'map its topics with --map, or move the window'
        raise RecordingError(origin, f'has no quantities to write in {there}', hint)
    with replacing(output) as part, part.open('wb') as file:
        rows = WRITERS[suffix](itertools.chain([first], frames), file, origin)
    columns = [first.index.name, *first.columns]
    line = f'wrote {output}: {rows} rows of {", ".join(columns)}'
    content = {'output': str(output), 'rows': rows, 'columns': columns, 'notes': notes}
    return Answer(content, [line, *notes])


def _tables_of(
    run: Measurement | Recording, window: Any, arguments: argparse.Namespace
) -> 'Iterable[DataFrame]':
    """Return the quantities of a recording, stretch by stretch, or of tables, in a window."""
    if isinstance(run, Recording):
        stretches = stretches_of(run, window)
        found = series_by_stretch(run, stretches, traced=not arguments.readings)
        return (table_of_series(each, run.origin) for each in found)
    if isinstance(run, PointTable) and (window or arguments.rate is not None):
        problem = 'is by amplitude and has no times'
        raise RecordingError(run.side.origin, problem, 'leave out --window and --rate')
    return [(run.within(*window) if isinstance(run, TimeRun) and window else run).frame]


def _write_csv(frames: 'Iterable[DataFrame]', file: BinaryIO, _: object) -> int:
    try:
        from pyarrow import Table, csv  # noqa: PLC0415 - an extra, and seven times as fast
    except ImportError:
        csv = None
    rows = 0
    for frame in frames:
        if not rows:
            frame.iloc[:0].to_csv(file, lineterminator='\n')
        if csv is None:
            frame.to_csv(file, header=False, lineterminator='\n')
        else:
            block = Table.from_pandas(frame.reset_index(), preserve_index=False)
            csv.write_csv(block, file, csv.WriteOptions(include_header=False))
        rows += len(frame)
    return rows


def _write_parquet(frames: 'Iterable[DataFrame]', file: BinaryIO, _: object) -> int:
    import pyarrow as pa  # noqa: PLC0415 - an extra
    from pyarrow.parquet import ParquetWriter  # noqa: PLC0415

    rows, writer = 0, None
    for frame in frames:
        groups = pa.Table.from_pandas(frame, schema=writer and writer.schema)
        writer = writer or ParquetWriter(file, groups.schema)
        writer.write_table(groups)
        rows += len(frame)
    if writer is not None:
        writer.close()
    return rows


def _write_excel(frames: 'Iterable[DataFrame]', file: BinaryIO, origin: object) -> int:
    import pandas as pd  # noqa: PLC0415 - takes long

    frame = pd.concat(frames)
    if len(frame) > EXCEL_ROWS_MAX:
        problem = f'has {len(frame)} rows, above the {EXCEL_ROWS_MAX} of a sheet'
        raise RecordingError(origin, problem, 'choose a --rate, or write .parquet')
    frame.to_excel(file, engine='openpyxl')
    return len(frame)


WRITERS = {'.csv': _write_csv, '.parquet': _write_parquet, '.xlsx': _write_excel}
"""By the suffix of the file: writes frames, and returns the number of rows."""


def _means(frames: 'Iterator[DataFrame]', rate_hz: float) -> 'Iterator[DataFrame]':
    """Yield the means over intervals at a rate, at their middles, without empty intervals."""
    import pandas as pd  # noqa: PLC0415 - takes long

    if not rate_hz > 0.0:
        raise OutOfRange('--rate', rate_hz, 'Hz', 'not above 0 Hz', 'raise it')
    start_s, sums, counts = math.nan, list['DataFrame'](), list['DataFrame']()
    for frame in frames:
        start_s = frame.index[0] if math.isnan(start_s) else start_s
        intervals = frame.groupby(np.floor(np.round((frame.index - start_s) * rate_hz, _ROUNDING)))
        sums.append(intervals.sum())
        counts.append(intervals.count())
    if sums:  # an interval may lie in two stretches
        total, count = (pd.concat(each).groupby(level=0).sum() for each in (sums, counts))
        means = total / count
        means.index = ((means.index + 0.5) / rate_hz + start_s).rename(frame.index.name)
        yield means
