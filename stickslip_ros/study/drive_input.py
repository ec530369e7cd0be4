"""A measured voltage or stroke over time, as the waveform that the virtual drive shall follow."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.files import readable
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.run_file import RUN_RECORD
from stickslip_ros.study.experiment import read_experiment
from stickslip_ros.study.extras import load_extra
from stickslip_ros.study.sweep_table import PARQUET

MCAP = '.mcap'
TIME, VOLTAGE, FOOT = 'time_s', 'voltage_v', 'foot_m'
MEND = f'give {TIME} and {VOLTAGE}, or {TIME} and {FOOT}'


@dataclass(frozen=True, eq=False)
class DriveInput:
    """
    Voltages over time.

    Attributes
    ----------
    origin : str
        File that they came from.
    time_s : array, shape (rows,)
        Rising, from 0.
    voltage_v : array, shape (rows,)
        Voltage at these times; straight lines in between.

    """

    origin: str
    time_s: Array
    voltage_v: Array


def is_run(path: Path) -> bool:
    """
    Tell whether a file is the recording of a run of this package.

    Raises
    ------
    RecordingError
        If it is a recording that cannot be read.

    """
    if path.suffix.lower() != MCAP and not path.is_dir():
        return False
    return RUN_RECORD in Recording(path).metadata


def read_drive_input(
    path: Path, stand: Parameters, topic: str = '', field: str = '', *, is_stroke: bool = False
) -> DriveInput:
    """
    Read a voltage, or a stroke, over time.

    Parameters
    ----------
    path : Path
        CSV as docs/compare.md says, Parquet with the same columns, or an MCAP file.
    stand : Parameters
        Gives the gain that turns strokes into voltages.
    topic, field : str
        Of an MCAP file: where the numbers are.
    is_stroke : bool
        Whether that topic gives a stroke in m, from the lowest voltage on.

    Raises
    ------
    StickSlipError
        If the file cannot be read, or has no such columns or topic.

    """
    if readable(path).suffix.lower() == MCAP or path.is_dir():
        if not topic:
            mend = 'name the topic of the voltage with --topic'
            raise RecordingError(path, 'is no run of this package', mend)
        series = Recording(path).series(topic, field)
        columns = {TIME: series.time_s, FOOT if is_stroke else VOLTAGE: series.value}
    elif path.suffix.lower() == PARQUET:
        columns = _read_parquet(path)
    else:
        columns = read_experiment(path).columns
    return _as_input(path, columns, stand)


def _read_parquet(path: Path) -> dict[str, Array]:
    parquet = load_extra('a Parquet file', 'pyarrow.parquet')
    try:
        table = parquet.read_table(path)
    except (OSError, ValueError) as error:
        raise RecordingError(path, f'cannot be read ({error})', 'check the file') from None
    names = [name for name in (TIME, VOLTAGE, FOOT) if name in table.column_names]
    return {name: np.asarray(table[name].to_numpy(), dtype=float) for name in names}


def _as_input(path: Path, columns: dict[str, Array], stand: Parameters) -> DriveInput:
    if TIME not in columns or (VOLTAGE not in columns and FOOT not in columns):
        raise RecordingError(path, f'has no {VOLTAGE} and no {FOOT} over {TIME}', MEND)
    time_s = columns[TIME] - columns[TIME][:1]
    if len(time_s) < 2:
        raise RecordingError(path, f'has {len(time_s)} rows', 'give at least two')
    if VOLTAGE in columns:
        voltage_v = columns[VOLTAGE]
    else:
        voltage_v = stand.amplifier.voltage_min + columns[FOOT] / stand.actuator.gain
    for name, values in ((TIME, time_s), (VOLTAGE, voltage_v)):
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            row = int(bad[0])
            raise OutOfRange(
                f'{path} row {row + 1}: {name}', float(values[row]), '', 'no number', MEND
            )
    return DriveInput(str(path), time_s, voltage_v)
