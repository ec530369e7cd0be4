"""Tables in the files of spreadsheets and measuring programs, as the text that they could be."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip_ros.errors import RecordingError, StickSlipError
from stickslip_ros.extras import load_extra
from stickslip_ros.files import readable

if TYPE_CHECKING:
    from pandas import DataFrame

    Table = str | Path | DataFrame

# ruff: noqa: PLC0415 - what reads text does without

FRAME = 'DataFrame'
"""What stands for the name of a file."""
Columns = Iterable[tuple[str, str, Any]]  # name, unit and numbers of each column


def as_text(path: 'Path | DataFrame') -> Path | bytes:
    """
    Return a frame, or a table of a known binary format, as CSV; of a text its path.

    Raises RecordingError if it cannot be read, or holds no columns of one length.

    """
    if not isinstance(path, Path):
        frame = path if path.index.name is None else path.reset_index()
    elif (read := READERS.get(path.suffix.lower())) is None:
        return path
    else:
        try:
            frame = read(readable(path))
        except StickSlipError:
            raise
        except Exception as error:  # noqa: BLE001 - nobody lists what six libraries raise
            problem = f'cannot be read as {path.suffix} ({" ".join(str(error).split())[:200]})'
            raise RecordingError(path, problem, 'check the file, or save it as CSV') from None
    content: str = frame.to_csv(index=False, header=frame.columns.dtype == object)
    return content.encode()


def _excel(path: Path) -> 'DataFrame':
    """Return the cells of the first sheet: lines above the header are read as those of a text."""
    load_extra(f'a table {path.suffix}', 'openpyxl')
    import pandas as pd

    return pd.read_excel(path, header=None, dtype=object, engine='openpyxl')


def _parquet(path: Path) -> 'DataFrame':
    load_extra(f'a table {path.suffix}', 'pyarrow')
    import pandas as pd

    return pd.read_parquet(path)


def _hdf5(path: Path) -> 'DataFrame':
    """Return the datasets of one length; their units are attributes, ``units`` or ``unit``."""
    h5py = load_extra(f'a table {path.suffix}', 'h5py')
    columns: list[tuple[str, str, Any]] = []

    def take(name: str, found: Any) -> None:
        if isinstance(found, h5py.Dataset) and found.dtype.kind in 'fiu':
            unit = found.attrs.get('units', found.attrs.get('unit', ''))
            told = unit.decode() if isinstance(unit, bytes) else str(unit)
            columns.append((name.rpartition('/')[2], told, found[()]))

    with h5py.File(path) as file:
        file.visititems(take)
    return _joined(columns)


def _matlab(path: Path) -> 'DataFrame':
    """Return the vectors of one length; since version 7.3 such a file is HDF5."""
    from scipy.io import loadmat

    try:
        found = loadmat(path)
    except NotImplementedError:
        return _hdf5(path)
    arrays = {name: each for name, each in found.items() if isinstance(each, np.ndarray)}
    return _joined((name, '', each) for name, each in arrays.items() if each.dtype.kind in 'fiu')


def _tdms(path: Path) -> 'DataFrame':
    """Return the channels, and their time where they say how far apart their samples are."""
    tdms = load_extra(f'a table {path.suffix}', 'nptdms').TdmsFile.read(path)
    if tdms.file_status.incomplete_final_segment:
        raise ValueError('it was cut off')
    channels = [each for group in tdms.groups() for each in group.channels() if len(each)]
    columns = [(each.name, each.properties.get('unit_string', ''), each[:]) for each in channels]
    if channels and 'wf_increment' in channels[0].properties:
        columns.insert(0, ('time', 's', channels[0].time_track()))
    return _joined(columns)


def _joined(columns: Columns) -> 'DataFrame':
    """Return a table of the vectors; refuse several lengths, of which nobody says which count."""
    import pandas as pd

    flat = {
        f'{name} ({unit})' if unit else name: np.ravel(values)
        for name, unit, values in columns
        if np.size(values) > 1 and np.size(values) == max(np.shape(values))
    }
    lengths = {name: len(values) for name, values in flat.items()}
    if len(set(lengths.values())) != 1:
        told = ', '.join(f'{name} has {count}' for name, count in lengths.items()) or 'none'
        raise ValueError(f'its vectors are not of one length: {told}')
    return pd.DataFrame(flat)


READERS: dict[str, Callable[[Path], 'DataFrame']] = {
    '.xlsx': _excel,
    '.parquet': _parquet,
    '.h5': _hdf5,
    '.hdf5': _hdf5,
    '.mat': _matlab,
    '.tdms': _tdms,
}
"""Formats by the ends of file names."""
