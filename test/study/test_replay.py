"""A recording that is run again gives the same bytes; one that cannot is refused."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.channels import Channel, Qos
from stickslip_ros.recording.feed import Feed
from stickslip_ros.recording.fingerprint import compare_data
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.run_writer import RunWriter
from stickslip_ros.recording.topics import recorded_channels
from stickslip_ros.study.drive_input import DriveInput
from stickslip_ros.study.replay import replay, replay_input
from stickslip_ros.study.sawtooth_run import run_sawtooth

MS_NS = 1_000_000
END_MS = 120
NOBODY = (0.0,) * 5
Plan = Sequence[tuple[int, Request]]

MOVES: Plan = (
    (0, Request('sawtooth', (300.0, 1000.0, 20.0))),
    (5, Request('load', (0.05, *NOBODY))),
    (20, Request('steps', (-6.0,))),
    (30, Request('waveform', (0.0, 0.0, 2e-3, 80.0, 5e-3, 20.0))),
    (36, Request('waveform', ())),
    (36, Request('waveform', (1.0, 2.0, 3.0))),
    (40, Request('jog', (500.0,))),
    (90, Request('preload', (0.52,))),
    (95, Request('voltage', (9e9,))),
)
LOOP: Plan = (
    (0, Request('position', (100e-9, 0.0, 0.0))),
    (30, Request('position', (float('nan'), 0.0, 0.0))),
    (50, Request('stop')),
    (55, Request('zero_position')),
    (55, Request('tare_force')),
    (60, Request('enable_amplifier', (0.0,))),
    (62, Request('voltage', (20.0,))),
    (65, Request('enable_amplifier', (1.0,))),
    (70, Request('reset')),
    (75, Request('voltage', (20.0,))),
)
FAULTS: Plan = (
    (0, Request('sawtooth', (300.0, 1000.0, 0.0))),
    (10, Request('fault', settings=(('fault.interferometer', 'freeze'),))),
    (
        20,
        Request('fault', settings=(('fault.interferometer', 'none'), ('fault.missed_steps', 0.3))),
    ),
    (40, Request('fault', settings=(('fault.amplifier_off', True),))),
    (60, Request('clear_faults')),
    (60, Request('fault', settings=(('fault.command_delay', 3e-3),))),
    (61, Request('voltage', (50.0,))),
)
#: Of a drive that is held: asked after the last block.
HELD: Plan = ((5, Request('voltage', (50.0,))), (END_MS, Request('tare_force')))


def record(
    path: Path,
    plan: Plan,
    values: dict | None = None,
    channels: dict[str, Channel] | None = None,
    begin_ms: int = 0,
) -> Path:
    """Record a plan of requests and the times, ms, at which they take effect."""
    parameters = Parameters().updated(values or {})
    bench, feed = Bench(parameters), Feed(parameters)
    with RunWriter(path, parameters, wait=True, channels=channels) as writer:
        while bench.time_ns < END_MS * MS_NS:
            requests = [each for at, each in plan if at * MS_NS == bench.time_ns]
            is_on = bench.time_ns >= begin_ms * MS_NS
            if bench.time_ns == begin_ms * MS_NS:
                writer.begin(bench.time_ns, bench.status)
            if is_on:
                writer.write_requests(requests, bench.time_ns)
            output = bench.update(bench.time_ns + parameters.block_ns, requests)
            for packed in feed.pack(output):
                if is_on:
                    writer.write(packed)
        writer.write_requests([each for at, each in plan if at == END_MS], bench.time_ns)
    return writer.recorder.path


def data_bytes(path: Path) -> list[list[bytes]]:
    """Give each file's records up to the end of the data, but for metadata and attachments."""
    return [_data_bytes(file) for file in Recording(path).files]


def _data_bytes(file: Path) -> list[bytes]:
    content = file.read_bytes()
    records: list[bytes] = []
    at = 8
    while True:
        opcode = content[at]
        end = at + 9 + int.from_bytes(content[at + 1 : at + 9], 'little')
        if opcode == DATA_END:
            return records
        if opcode not in (ATTACHMENT, METADATA):
            records.append(content[at:end])
        at = end


ATTACHMENT, METADATA, DATA_END = 0x09, 0x0C, 0x0F


def assert_same(source: Path, output: Path) -> None:
    """Replay and compare, message by message and byte by byte."""
    result = replay(source, output)
    assert result.identical, result.difference
    again = Path(result.output)
    assert compare_data(Recording(source), Recording(again)) is None
    assert data_bytes(source) == data_bytes(again)


@pytest.mark.parametrize(
    'plan', [MOVES, LOOP, FAULTS, HELD], ids=['moves', 'loop', 'faults', 'held']
)
def test_every_kind_of_request_is_replayed_to_the_byte(plan: Plan, tmp_path: Path):
    source = record(tmp_path / 'run.mcap', plan)
    assert_same(source, tmp_path / 'again.mcap')
    assert len(data_bytes(source)[0]) > 1


def test_a_run_of_simulate_is_replayed_to_the_byte(tmp_path: Path):
    path = tmp_path / 'run.mcap'
    run_sawtooth(Parameters(), 300.0, 1000.0, 40, path=path)
    assert_same(path, tmp_path / 'again.mcap')


@pytest.mark.parametrize(
    'values',
    [
        {'record.split_duration': 0.04, 'record.flush_period': 0.03},
        {'record.format': 'bag'},
        {'record.format': 'bag', 'record.split_size': 20_000, 'record.chunk_size': 5_000},
        {'sim.publish_truth': True, 'record.compression': 'lz4', 'sim.seed': 7},
    ],
    ids=['parts', 'bag', 'bag in parts', 'truth'],
)
def test_parts_and_bags_are_replayed_to_the_byte(values: dict, tmp_path: Path):
    assert_same(record(tmp_path / 'run.mcap', MOVES, values), tmp_path / 'again.mcap')


def test_other_names_and_qualities_of_service_are_kept(tmp_path: Path):
    channels = {
        key: Channel(
            f'/left/x_{key}', each.type_name, Qos(3, reliable=False, latched=each.qos.latched)
        )
        for key, each in recorded_channels(Parameters()).items()
    }
    source = record(tmp_path / 'run.mcap', LOOP, channels=channels)
    assert_same(source, tmp_path / 'again.mcap')
    assert '/left/x_position' in Recording(tmp_path / 'again.mcap').types


def test_another_stand_gives_another_run_and_says_where_it_differs(tmp_path: Path):
    source = record(tmp_path / 'run.mcap', MOVES)
    result = replay(source, tmp_path / 'again.mcap', {'stand.preload': 0.25})
    assert not result.identical
    assert result.difference is not None
    assert result.changed == {'stand.preload': 0.25}


def test_truth_that_was_not_recorded_can_be_asked_for(tmp_path: Path):
    source = record(tmp_path / 'run.mcap', MOVES)
    replay(source, tmp_path / 'again.mcap', {'sim.publish_truth': True})
    recording = Recording(tmp_path / 'again.mcap')
    assert len(recording.series('truth/position')) == len(recording.series('/position'))


def test_another_block_keeps_the_times_of_requests(tmp_path: Path):
    source = record(
        tmp_path / 'run.mcap', ((10, Request('voltage', (50.0,))), (13, Request('stop')))
    )
    replay(source, tmp_path / 'again.mcap', {'sim.block': 5e-3})
    times = {
        t: at
        for t, at, _ in Recording(tmp_path / 'again.mcap').messages()
        if 'command' in t or 'request' in t
    }
    assert times == {'/command/voltage': 10 * MS_NS, '/stickslip_drive/request': 15 * MS_NS}


def test_a_recording_that_began_in_the_middle_is_refused_with_its_mend(tmp_path: Path):
    source = record(tmp_path / 'run.mcap', MOVES, begin_ms=10)
    with pytest.raises(RecordingError, match=r'begins 0\.011 s into the run.*--from-rest'):
        replay(source, tmp_path / 'again.mcap')
    assert not (tmp_path / 'again.mcap').exists()
    result = replay(source, tmp_path / 'again.mcap', from_rest=True)
    assert not result.identical
    assert result.simulated_s == pytest.approx((END_MS - 10) * 1e-3)


def test_a_recording_with_lost_messages_is_refused(tmp_path: Path):
    parameters = Parameters().updated({'record.queue_length': 10})
    bench, feed = Bench(parameters), Feed(parameters)
    with RunWriter(tmp_path / 'run.mcap', parameters) as writer:
        writer.begin(0, bench.status)
        while not writer.recorder.dropped:
            for packed in feed.pack(bench.update(bench.time_ns + parameters.block_ns)):
                for _ in range(20):
                    writer.write(packed)
    with pytest.raises(RecordingError, match=r'lacks \d+ messages of .*queue_length'):
        replay(tmp_path / 'run.mcap', tmp_path / 'again.mcap')


def test_a_recording_of_something_else_is_refused(tmp_path: Path):
    channel = Channel('/position', 'std_msgs/msg/Float64', Qos(1))
    Recorder(tmp_path / 'other.mcap', [channel]).close()
    with pytest.raises(RecordingError, match=r'has no attachment parameters\.yaml'):
        replay(tmp_path / 'other.mcap', tmp_path / 'again.mcap')


def test_another_schedule_of_faults_is_refused_instead_of_ignored(tmp_path: Path):
    source = record(tmp_path / 'run.mcap', ())
    with pytest.raises(OutOfRange, match='takes its faults from the recording'):
        replay(source, tmp_path / 'again.mcap', {'fault.schedule': 'faults.yaml'})


def test_a_measured_voltage_is_followed_and_its_recording_is_replayed_to_the_byte(tmp_path: Path):
    given = DriveInput('table.csv', np.array([0.0, 5e-3, 9e-3]), np.array([30.0, 90.0, 40.0]))
    replay_input(given, tmp_path / 'run.mcap', Parameters())
    voltage = Recording(tmp_path / 'run.mcap').trace()['voltage']
    assert voltage.value[0] == pytest.approx(30.0, abs=1.0)
    assert voltage.value.max() == pytest.approx(90.0, abs=2.0)
    assert voltage.value[-1] == pytest.approx(40.0, abs=0.1)
    assert_same(tmp_path / 'run.mcap', tmp_path / 'again.mcap')
