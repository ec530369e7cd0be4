# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Damaged files for each reader: it reads them, or refuses them in a line."""

import io
import json
import sqlite3
import sys
import tempfile
import zipfile
import zlib
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
from mcap.writer import Writer
from nptdms import ChannelObject, TdmsWriter
from scipy.io import savemat

from stickslip_ros.errors import StickSlipError
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.interface.cdr import pack_float64, pack_float64_array, pack_stamped
from stickslip_ros.kernels.cache import load_whole, save_whole
from stickslip_ros.lab.fitting.result import read_draws
from stickslip_ros.lab.measurements.tables import read_experiment
from stickslip_ros.message_types import FLOAT64, FLOAT64_ARRAY, POINT_STAMPED
from stickslip_ros.parameters import Parameters, dump_yaml, load_yaml
from stickslip_ros.recording.any_message import numbers_of
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recover import recover

TABLE = pd.DataFrame({'time_s': np.arange(40) * 1e-3, 'position_m': np.linspace(0.0, 1e-6, 40)})
BYTES = (
    b'\0',
    b'\xff',
    b'\x7f',
    b'\xff\xff\xff\xff',
    b'\xff' * 8,
    b'!!float ""',
    b'[[',
    b'1e999',
    b'\x1b[',
)
"""What is put into a file."""
KERNEL_BYTES = 4096  # of a kernel in the cache, at most


def _recording(path: Path) -> None:
    with path.open('wb') as file:
        writer = Writer(file, chunk_size=400)
        writer.start('ros2', 'fuzz')
        writer.add_metadata('stickslip_run', {'time_origin_ns': '0'})
        kinds = {FLOAT64: '/u', POINT_STAMPED: '/x', FLOAT64_ARRAY: '/trace'}
        channels = [
            writer.register_channel(
                topic, 'cdr', writer.register_schema(kind, 'ros2msg', b''), {'qos': '[]'}
            )
            for kind, topic in kinds.items()
        ]
        note = writer.register_channel('/j', 'json', 0)
        for at in range(20):
            rows = TABLE.to_numpy()[2 * at : 2 * at + 2]
            block = pack_float64_array(rows, ('sample', 't[s],position[m]'))
            contents = pack_float64(at), pack_stamped(at, 'a', (at, 0, 0)), block
            for channel, content in zip(channels, contents, strict=True):
                writer.add_message(channel, at, content, at, at)
            writer.add_message(note, at, b'{"x": 1, "timestamp": {"sec": 1, "nsec": 2}}', at, at)
        writer.finish()


def _database(path: Path) -> None:
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute('CREATE TABLE topics(id INTEGER, name, type, serialization_format)')
        connection.execute('CREATE TABLE messages(id INTEGER, topic_id, timestamp, data)')
        connection.execute("INSERT INTO topics VALUES (1, '/u', 'std_msgs/msg/Float64', 'cdr')")
        rows = [(at, 1, at, pack_float64(at)) for at in range(1, 200)]
        connection.executemany('INSERT INTO messages VALUES (?, ?, ?, ?)', rows)


def _archive(path: Path) -> None:
    columns: Any = dict(TABLE)
    np.savez_compressed(path, **columns)


def _hdf5(path: Path) -> None:
    with h5py.File(path, 'w') as file:
        for name in TABLE:
            file.create_dataset(name, data=TABLE[name], chunks=(10,), compression='gzip')
            file[name].attrs['unit'] = ''


def _tdms(path: Path) -> None:
    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject('g', name, TABLE[name].to_numpy()) for name in TABLE])


def _matlab(path: Path) -> None:
    savemat(path, {name: TABLE[name].to_numpy() for name in TABLE}, do_compression=True)


def _fit(path: Path) -> None:
    row = {'name': 'contact.friction', 'unit': '', 'start': 0.2, 'lower': 0.01, 'upper': None}
    content = {
        'estimates': [{**row, 'undetermined': False}],
        'parameters': Parameters().flat(),
        'natural_coordinates': [0.0],
        'covariance_of_natural_coordinates': [[1e-6]],
        'holds': True,
    }
    path.write_text(json.dumps(content))


def _read_recording(path: Path) -> None:
    recover(path, path.with_name('copy.mcap'))
    recording = Recording(path)
    len(recording.channels)
    for topic, field in (('/u', 'data'), ('/x', 'point.x'), ('/j', 'x')):
        numbers_of(recording.files, topic, field)
    if '/trace' in recording.types:
        recording.trace('/trace')


def _read_checkpoint(path: Path) -> None:
    Bench.restore(path.read_bytes())


READERS: dict[str, tuple[Callable[[Path], Any], Callable[[Path], Any]]] = {
    '.mcap': (_recording, _read_recording),
    '.db3': (_database, _read_recording),
    '.yaml': (lambda path: path.write_text(dump_yaml(Parameters(), '')), load_yaml),
    '.json': (_fit, read_draws),
    '.checkpoint': (lambda path: path.write_bytes(Bench(Parameters()).save()), _read_checkpoint),
    '.csv': (lambda path: TABLE.to_csv(path, index=False), read_experiment),
    '.txt': (lambda path: TABLE.to_csv(path, index=False, sep='\t'), read_experiment),
    '.xlsx': (lambda path: TABLE.to_excel(path, index=False), read_experiment),
    '.parquet': (TABLE.to_parquet, read_experiment),
    '.npz': (_archive, read_experiment),
    '.h5': (_hdf5, read_experiment),
    '.tdms': (_tdms, read_experiment),
    '.mat': (_matlab, read_experiment),
}


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """Return a content with one to four damages; of an archive, in one of its parts."""
    if content.startswith(b'PK') and rng.random() < 0.7:
        packed = io.BytesIO()
        with zipfile.ZipFile(io.BytesIO(content)) as source, zipfile.ZipFile(packed, 'w', 8) as to:
            names = source.namelist()
            chosen = names[int(rng.integers(len(names)))]
            for name in names:
                part = source.read(name)
                to.writestr(name, _hit(part, rng) if name == chosen else part)
        return packed.getvalue()
    return _hit(content, rng)


def _hit(content: bytes, rng: np.random.Generator) -> bytes:
    for _ in range(int(rng.integers(1, 5))):
        at, end = sorted(rng.integers(0, len(content) + 1, 2).tolist())
        put = BYTES[int(rng.integers(len(BYTES)))]
        content = (
            content[:at] + put + content[at + len(put) :],
            content[:at] + put + content[at:],
            content[:at] + content[end:],
            content[:end] + content[at:],
            content[:at] + bytes(rng.integers(0, 256, 4, np.uint8)) + content[at + 4 :],
        )[int(rng.integers(5))]
    return content


def try_cache(case: int) -> bool:
    """Return whether a damaged file of the kernel cache is refused, and a whole one found."""
    rng = np.random.default_rng(case)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, 'kernel.nbc')
        save_whole(path, data := rng.bytes(int(rng.integers(KERNEL_BYTES))))
        found = load_whole(path) == data
        whole = path.read_bytes()
        path.write_bytes(broken := _hit(whole, rng))
        try:
            load_whole(path)
        except OSError:
            return found
        return found and broken == whole


def damage_files(cases: range) -> int:
    """Try damaged files of each reader; print and count what is neither read nor refused."""
    failed = 0
    for suffix, (write, read) in READERS.items():
        with tempfile.TemporaryDirectory() as folder:
            whole = Path(folder, f'whole{suffix}')
            write(whole)
            read(whole)
            for case in cases:
                rng = np.random.default_rng([case, zlib.crc32(suffix.encode())])
                path = Path(folder, f'{case}{suffix}')
                path.write_bytes(damaged(whole.read_bytes(), rng))
                try:
                    read(path)
                except StickSlipError as error:
                    if '\n' in str(error) or '\x1b' in str(error):
                        failed += 1
                        sys.stdout.write(f'{path.name}: not a line: {error!r}\n')
                except Exception as error:  # noqa: BLE001 - that is what is looked for
                    failed += 1
                    sys.stdout.write(f'{path.name}: {error!r}\n')
                path.unlink()
                path.with_name('copy.mcap').unlink(missing_ok=True)
    return failed


if __name__ == '__main__':
    number = int(sys.argv[1])
    found = damage_files(range(number))
    sys.stdout.write(f'{number} damaged files of each of {len(READERS)} readers, {found} failed\n')
    sys.exit(found > 0)
