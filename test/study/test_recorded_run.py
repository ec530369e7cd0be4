"""The recording of a run: the same bytes whenever it is made, and never in place of another."""

import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from stickslip_ros.errors import RecordingError
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.parameters import Parameters, parse_yaml
from stickslip_ros.recording.messages import ArrayMessage
from stickslip_ros.recording.reader import Recording
from stickslip_ros.study.sawtooth_run import run_sawtooth

MAGIC_BYTES = 8
METADATA = 0x0C
DATA_END = 0x0F
"""Opcode of a metadata record of MCAP."""


@pytest.fixture(scope='module')
def again(tmp_path_factory) -> Path:
    """Give another recording of the run that `recorded_run` gives."""
    path = tmp_path_factory.mktemp('again') / 'other_name.mcap'
    run_sawtooth(Parameters(), 300.0, 1000.0, 20, path=path)
    return path


def _records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Give opcode, first and last byte of each record of an MCAP file."""
    at = MAGIC_BYTES
    while at < len(data) - MAGIC_BYTES:
        opcode, length = struct.unpack_from('<BQ', data, at)
        end = at + 9 + length
        yield opcode, at, end
        at = end


def _written(message) -> object:
    if isinstance(message, ArrayMessage):
        return message.labels, message.sizes, message.data.tobytes()
    return message


def test_two_recordings_of_a_run_differ_only_in_the_wall_clock_time_and_its_checksum(
    recorded_run, again
):
    one, other = recorded_run[1].read_bytes(), again.read_bytes()
    assert len(one) == len(other)
    assert [record[:3] for record in _records(one)] == [record[:3] for record in _records(other)]
    pairs = np.frombuffer(one, np.uint8), np.frombuffer(other, np.uint8)
    differing = np.flatnonzero(pairs[0] != pairs[1])
    # The end of the data section holds a checksum over all of it, wall-clock time included.
    allowed = [
        (start, end)
        for opcode, start, end in _records(one)
        if opcode == DATA_END or (opcode == METADATA and b'wall_start' in one[start:end])
    ]
    assert len(allowed) == 2
    assert all(any(start < byte < end for start, end in allowed) for byte in differing)


def test_two_recordings_of_a_run_hold_the_same_messages(recorded_run, again):
    one, other = (
        [
            (topic, time_ns, _written(message))
            for topic, time_ns, message in Recording(path).messages()
        ]
        for path in (recorded_run[1], again)
    )
    assert len(one) > 60
    assert one == other


def test_another_seed_gives_another_recording(recorded_run, stand, tmp_path):
    run_sawtooth(stand.updated({'sim.seed': 2}), 300.0, 1000.0, 20, path=tmp_path / 'run.mcap')
    one, other = (
        Recording(path).trace()['position'].value
        for path in (recorded_run[1], tmp_path / 'run.mcap')
    )
    assert not np.array_equal(one, other)


def test_the_recording_holds_what_the_bench_tells(recorded_run, stand):
    bench, request = Bench(stand), [Request('sawtooth', (300.0, 1000.0, 20.0))]
    blocks = []
    for _ in range(30):
        blocks.append(bench.update(bench.time_ns + stand.block_ns, request).readings.trace)
        request = []
    told = np.concatenate(blocks)
    trace = Recording(recorded_run[1]).trace()
    np.testing.assert_array_equal(trace['position'].time_s, told[:, 0])
    for column, name in enumerate(('voltage', 'foot', 'position', 'force'), start=1):
        np.testing.assert_array_equal(trace[name].value, told[:, column])


def test_the_recording_explains_itself(recorded_run):
    recording = Recording(recorded_run[1])
    _, text = recording.attachments['parameters.yaml']
    assert parse_yaml(text.decode(), 'attachment') == Parameters()
    run = recording.metadata['stickslip_run']
    assert (run['seed'], run['dt_s']) == ('1', '5e-06')
    (command,) = recording.messages(['command/sawtooth'])
    assert command[1] == 0
    assert command[2].data.tolist() == [300.0, 1000.0, 20.0]


def test_a_run_never_replaces_a_file(stand, tmp_path):
    path = tmp_path / 'run.mcap'
    path.write_bytes(b'the old one')
    with pytest.raises(RecordingError) as caught:
        run_sawtooth(stand, 300.0, 1000.0, 5, path=path)
    assert 'exists' in str(caught.value)
    assert 'choose another name' in str(caught.value)
    assert path.read_bytes() == b'the old one'


def test_a_recording_that_cannot_be_made_is_refused(stand, tmp_path):
    (tmp_path / 'file').write_bytes(b'')
    with pytest.raises(RecordingError):
        run_sawtooth(stand, 300.0, 1000.0, 5, path=tmp_path / 'file/run.mcap')
