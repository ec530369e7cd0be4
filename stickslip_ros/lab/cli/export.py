"""``stickslip export``: what a recording holds over time, as a table for other programs."""

import argparse
from typing import TYPE_CHECKING

import numpy as np

from stickslip_ros.errors import OutOfRange, RecordingError, StickSlipError, WrongKind
from stickslip_ros.extras import load_extra
from stickslip_ros.files import prepare_output, replacing
from stickslip_ros.lab.cli.experiment import said_of_tables
from stickslip_ros.lab.cli.printing import Answer
from stickslip_ros.lab.runs.mapped import mapped_series
from stickslip_ros.lab.runs.recorded import parse_window, recorded_series
from stickslip_ros.lab.runs.recorded_run import frame_of
from stickslip_ros.recording.reader import Recording

if TYPE_CHECKING:
    from pandas import DataFrame

NEEDS = {'.csv': '', '.parquet': 'pyarrow', '.xlsx': 'openpyxl'}
"""Ends of the names of the files, and packages without which they cannot be written."""
EXCEL_ROWS_MAX = 1_048_575
_ROUNDING = 6  # decimals, in intervals: a sample on a border belongs to the later one


def export_verb(arguments: argparse.Namespace) -> Answer:
    """Read, write."""
    output, suffix = arguments.output, arguments.output.suffix.lower()
    if suffix not in NEEDS:
        raise WrongKind('--output', str(output), f'one of {", ".join(NEEDS)}', 'end its name so')
    if NEEDS[suffix]:
        load_extra(f'a table {suffix}', NEEDS[suffix])
    topics = said_of_tables(arguments)['headers']
    if topics and arguments.readings:
        problem = '--readings are topics of our own recordings, --map names those of others'
        raise StickSlipError(f'{problem}; leave one of the two away')
    prepare_output(output)
    recording = Recording(arguments.file)
    if topics:
        found = mapped_series(recording, topics)
    else:
        found = recorded_series(recording, traced=not arguments.readings)
    if arguments.window:
        window = parse_window(arguments.window)
        found = {name: each.window(*window) for name, each in found.items()}
    frame = frame_of(found, str(recording.path))
    if frame.empty:
        problem = f'has nothing to write of {", ".join(recording.types) or "its topics"}'
        hint = 'say which topic is what by --map, or move the window'
        raise RecordingError(recording.path, problem, hint)
    frame = frame if arguments.rate is None else _means(frame, arguments.rate)
    if suffix == '.xlsx' and len(frame) > EXCEL_ROWS_MAX:
        problem = f'has {len(frame)} rows, above the {EXCEL_ROWS_MAX} of a sheet'
        raise RecordingError(recording.path, problem, 'choose a --rate, or write .parquet')
    with replacing(output) as part, part.open('wb') as file:
        if suffix == '.csv':
            frame.to_csv(file, lineterminator='\n')
        elif suffix == '.parquet':
            frame.to_parquet(file)
        else:
            frame.to_excel(file, engine='openpyxl')
    columns = [frame.index.name, *frame.columns]
    text = f'wrote {output}: {len(frame)} rows of {", ".join(columns)}'
    return Answer({'output': str(output), 'rows': len(frame), 'columns': columns}, [text])


def _means(frame: 'DataFrame', rate_hz: float) -> 'DataFrame':
    """Return the means over intervals of a frequency, at their middles, without empty ones."""
    if not rate_hz > 0.0:
        raise OutOfRange('--rate', rate_hz, 'Hz', 'not above 0 Hz', 'raise it')
    start_s = frame.index[0]
    means = frame.groupby(np.floor(np.round((frame.index - start_s) * rate_hz, _ROUNDING))).mean()
    means.index = ((means.index + 0.5) / rate_hz + start_s).rename(frame.index.name)
    return means
