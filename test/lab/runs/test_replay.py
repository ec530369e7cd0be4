# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A recording, or a measured voltage, that is run again; what cannot be run is refused."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from mcap_records import Row, rows_of
from wrong_checkpoints import with_value

from stickslip_ros.errors import OutOfRange, RecordingError, StickSlipError, WrongKind
from stickslip_ros.instrument.commands import Request
from stickslip_ros.interface.cdr import pack_float64
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.interface.feed import Packed
from stickslip_ros.interface.topics import recorded_channels
from stickslip_ros.lab.measurements.table_options import TableOptions
from stickslip_ros.lab.runs.replay import DriveInput, read_drive_input, replay, replay_input
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.differences import compare_data
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.run import ReportingBench, RunWriter

STAND = Parameters()
TIME_S = np.array([2.0, 2.01, 2.03])
VOLTAGE_V = np.array([10.0, 60.0, 20.0])
STROKE_M = (VOLTAGE_V - STAND.amplifier.voltage_min) * STAND.actuator.gain
ROUNDING = 1e-12
"""Strokes go through one product and one quotient."""

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
LIVE = Request(
    'parameters',
    settings=(
        ('closed_loop.velocity', 1e-5),
        ('limits.soft_max', 1e-6),
        ('contact.friction', 0.2),
        ('runner.mass', 0.012),
        ('runner.damping', 40.0),
    ),
)
LOOP: Plan = (
    (0, Request('position', (100e-9, 0.0, 0.0), stamp_ns=1_800_000_000_123_456_789, tag='a')),
    (20, LIVE),
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
    (0, Request('sawtooth', (300.0, 1000.0, 0.0), tag='left')),
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
    run = ReportingBench(parameters)
    with RunWriter(path, parameters, wait=True, channels=channels) as writer:
        while (now_ns := run.bench.time_ns) < END_MS * MS_NS:
            if now_ns == begin_ms * MS_NS:
                run.record(writer)
            requests = [each for at, each in plan if at * MS_NS == now_ns]
            run.update(now_ns + parameters.block_ns, requests)
        for request in (each for at, each in plan if at == END_MS):
            run.accept(request)
    return writer.recorder.path


def messages_of(path: Path) -> list[list[Row]]:
    """Give the messages of each file."""
    return [rows_of(file) for file in Recording(path).files]


def assert_same(source: Path, output: Path) -> None:
    """Replay and compare, message by message and byte by byte."""
    result = replay(source, output)
    assert result.identical, result.difference
    again = Path(result.output)
    assert compare_data(Recording(source), Recording(again)) is None
    assert messages_of(source) == messages_of(again)


@pytest.mark.parametrize(
    'plan', [MOVES, LOOP, FAULTS, HELD], ids=['moves', 'loop', 'faults', 'held']
)
def test_every_kind_of_request_is_replayed_to_the_byte(plan: Plan, tmp_path: Path):
    source = record(tmp_path / 'run.mcap', plan)
    assert_same(source, tmp_path / 'again.mcap')
    assert len(messages_of(source)[0]) > 1


def test_commands_stand_at_the_time_of_their_effect_whatever_their_stamps(tmp_path: Path):
    late, early = (Request('load', (0.1, *NOBODY), stamp_ns=stamp) for stamp in (2 * END_MS, 1))
    source = record(tmp_path / 'run.mcap', ((5, late), (9, early)))
    assert Recording(source).series('command/load').time_s.tolist() == [0.005, 0.009]


@pytest.mark.parametrize(
    'values',
    [
        {'record.split_duration': 0.04, 'record.flush_period': 0.03},
        {'record.format': 'bag'},
        {'record.format': 'bag', 'record.split_size': 20_000, 'record.chunk_size': 5_000},
        {'sim.publish_truth': True, 'record.compression': 'lz4', 'sim.seed': 7},
        {'feet.count': (2, 4), 'feet.gain': (1.0, 0.5), 'feet.delay': (3.1e-4, 0.0)},
    ],
    ids=['parts', 'bag', 'bag in parts', 'truth', 'walker'],
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


@pytest.mark.parametrize(
    ('plan', 'begin_ms'),
    [(MOVES, 27), (MOVES, 63), (FAULTS, 27), (FAULTS, 63), (HELD, 1)],
    ids=['moves', 'jog', 'faults', 'delayed', 'held'],
)
def test_a_recording_that_began_in_the_middle_is_replayed(tmp_path, plan, begin_ms):
    source = record(tmp_path / 'run.mcap', plan, begin_ms=begin_ms)
    assert_same(source, tmp_path / 'again.mcap')
    assert_same(tmp_path / 'again.mcap', tmp_path / 'third.mcap')


def test_a_replay_says_whether_other_sources_computed_the_recording(tmp_path, monkeypatch):
    monkeypatch.setattr('stickslip_ros.recording.run_file.sources_digest', lambda: 'before')
    source = record(tmp_path / 'run.mcap', HELD)
    monkeypatch.undo()
    assert replay(source, tmp_path / 'again.mcap').other_sources
    assert not replay(tmp_path / 'again.mcap', tmp_path / 'third.mcap').other_sources


def test_from_the_middle_on_another_drive_can_be_tried(tmp_path: Path):
    source = record(tmp_path / 'run.mcap', MOVES, begin_ms=27)
    result = replay(source, tmp_path / 'again.mcap', {'runner.mass': 0.05})
    assert result.difference is not None
    assert result.simulated_s == pytest.approx((END_MS - 27) * 1e-3)
    with pytest.raises(WrongKind, match=r'stand\.preload .*start from rest'):
        replay(source, tmp_path / 'third.mcap', {'stand.preload': 0.25})


def test_a_state_of_a_recording_that_would_index_beyond_is_refused(tmp_path, monkeypatch):
    save, place = ReportingBench.save, 'state.stand.states.contacts[0].memory.depth'
    monkeypatch.setattr(ReportingBench, 'save', lambda run: with_value(save(run), place, 100_000))
    source = record(tmp_path / 'run.mcap', MOVES, begin_ms=27)
    with pytest.raises(WrongKind, match='depth 100000 is not from 0 to 1023'):
        replay(source, tmp_path / 'again.mcap')
    assert not (tmp_path / 'again.mcap').exists()


def test_a_recording_that_began_in_the_middle_can_be_replayed_from_rest(tmp_path: Path):
    source = record(tmp_path / 'run.mcap', MOVES, begin_ms=10)
    result = replay(source, tmp_path / 'again.mcap', from_rest=True)
    assert not result.identical
    assert result.simulated_s == pytest.approx((END_MS - 10) * 1e-3)


BY_DURATION = {'record.split_duration': 0.0275, 'record.flush_period': 0.02}
BY_SIZE = {'record.format': 'bag', 'record.split_size': 50_000, 'record.chunk_size': 10_000}


@pytest.mark.parametrize('split', [BY_DURATION, BY_SIZE], ids=['by duration', 'by size'])
@pytest.mark.parametrize(
    ('plan', 'begin_ms'),
    [(MOVES, 0), (MOVES, 7), (LOOP, 0), (FAULTS, 0)],
    ids=['moves', 'from the middle', 'loop', 'faults'],
)
def test_every_part_taken_alone_is_replayed_to_the_byte(tmp_path, plan, begin_ms, split):
    source = record(tmp_path / 'run', plan, split, begin_ms=begin_ms)
    assert_same(source, tmp_path / 'again')
    parts = Recording(source).files
    assert len(parts) > 3
    for number, part in enumerate(parts):
        assert_same(part, tmp_path / f'part_{number}')


def test_what_a_held_drive_was_asked_is_replayed_with_the_part_that_holds_it(tmp_path: Path):
    run = ReportingBench(Parameters().updated(BY_DURATION))
    fault = Request('fault', settings=(('fault.interferometer', 'freeze'),))
    with RunWriter(tmp_path / 'run.mcap', run.bench.parameters, wait=True) as writer:
        run.accept(fault)  # before the first block: no status has been published
        run.record(writer)
        for block in range(1, 91):
            run.update(block * MS_NS)
            if block % 28 == 0:  # where a part ends
                run.accept(Request('clear_faults'))
                run.accept(Request('voltage', (float(block),)))
    parts = Recording(writer.recorder.path).files
    assert len(parts) == 4
    for number, part in enumerate(parts):
        assert_same(part, tmp_path / f'part_{number}')


def test_a_status_that_was_not_published_before_a_recording_is_replayed(tmp_path: Path):
    run = ReportingBench(Parameters())
    run.update(MS_NS)
    run.accept(Request('fault', settings=(('fault.interferometer', 'freeze'),)))
    with RunWriter(tmp_path / 'run.mcap', Parameters(), wait=True) as writer:
        run.record(writer)
        run.update(2 * MS_NS)
    assert_same(tmp_path / 'run.mcap', tmp_path / 'again.mcap')


def test_a_recording_without_the_state_in_which_it_begins_is_refused_with_its_mend(tmp_path: Path):
    run = ReportingBench(Parameters())
    for block in range(1, 41):
        run.update(block * MS_NS)
    with RunWriter(tmp_path / 'run.mcap', Parameters(), wait=True) as run.writer:
        run.writer.begin(run.bench.time_ns, run.status)
        run.update(41 * MS_NS)
    with pytest.raises(RecordingError, match=r'begins 0\.041 s into the run.*--from-rest'):
        replay(tmp_path / 'run.mcap', tmp_path / 'again.mcap')
    assert not (tmp_path / 'again.mcap').exists()


def test_a_recording_with_lost_messages_is_refused(tmp_path: Path):
    parameters = Parameters().updated({'record.queue_length': 10})
    with RunWriter(tmp_path / 'run.mcap', parameters) as writer:

        def write_often(packed: Packed) -> None:
            for _ in range(19):
                writer.write(packed)

        run = ReportingBench(parameters, write_often, writer)
        while not writer.recorder.dropped:
            run.update(run.bench.time_ns + parameters.block_ns)
    with pytest.raises(RecordingError, match=r'lacks \d+ messages of .*queue_length'):
        replay(tmp_path / 'run.mcap', tmp_path / 'again.mcap')


def test_a_recording_of_something_else_is_refused(tmp_path: Path):
    channel = Channel('/position', 'std_msgs/msg/Float64', Qos(1))
    Recorder(tmp_path / 'other.mcap', [channel]).close()
    with pytest.raises(RecordingError, match=r'by another program: .* they are /position'):
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


def csv_of(path: Path, name: str, values: Iterable[float]) -> Path:
    rows = ''.join(f'{t!r},{v!r}\n' for t, v in zip(TIME_S.tolist(), values, strict=True))
    path.write_text(f'time_s,{name}\n{rows}', encoding='utf-8')
    return path


def parquet_of(path: Path, **columns: object) -> Path:
    pq.write_table(pa.table(columns), path)
    return path


def mcap_of(path: Path, values: Iterable[float]) -> Path:
    with Recorder(path, [Channel('/lab/signal', 'std_msgs/msg/Float64', Qos(1))]) as recorder:
        for time_s, value in zip(TIME_S.tolist(), values, strict=True):
            recorder.put('/lab/signal', round(time_s * 1e9), pack_float64(value))
    return path


def assert_is_the_wave(given: DriveInput) -> None:
    np.testing.assert_allclose(given.time_s, TIME_S - TIME_S[0], atol=1e-9)
    np.testing.assert_allclose(given.voltage_v, VOLTAGE_V, rtol=ROUNDING)


@pytest.mark.parametrize(
    ('name', 'values'), [('voltage_v', VOLTAGE_V), ('foot_m', STROKE_M)], ids=['voltage', 'stroke']
)
def test_tables_and_topics_give_the_same_voltages(name: str, values: np.ndarray, tmp_path: Path):
    csv = csv_of(tmp_path / 'a.csv', name, values.tolist())
    table = parquet_of(tmp_path / 'a.parquet', time_s=TIME_S, **{name: values}, other=['x'] * 3)
    mcap = mcap_of(tmp_path / 'a.mcap', values.tolist())
    assert_is_the_wave(read_drive_input(csv, STAND))
    assert_is_the_wave(read_drive_input(table, STAND))
    with pytest.raises(StickSlipError, match='map its topics: --map voltage_v='):
        read_drive_input(mcap, STAND)
    said = TableOptions({name: '/lab/signal.data'})
    assert_is_the_wave(read_drive_input(mcap, STAND, said))
    nameless = mcap.rename(tmp_path / 'recorded')
    assert_is_the_wave(read_drive_input(nameless, STAND, said))


def test_a_voltage_that_was_not_measured_is_left_out(tmp_path: Path):
    path = tmp_path / 'a.csv'
    path.write_text('time_s,voltage_v\n1,10\n1.5,\n2,30\n', encoding='utf-8')
    given = read_drive_input(path, STAND)
    assert (given.time_s.tolist(), given.voltage_v.tolist()) == ([0.0, 1.0], [10.0, 30.0])


@pytest.mark.parametrize(
    ('times', 'values', 'message'),
    [
        ([0.0, 1e-3, 1e-3], [1.0, 2.0, 3.0], 'not after the 0.001 s of the row before'),
        ([0.0, float('inf'), 2e-3], [1.0, 2.0, 3.0], "column time_s: 'inf' is not a finite"),
        ([0.0, 1e-3, 2e-3], [1.0, 1e5, 3.0], 'waveform voltage of row 2 100000 V'),
        ([0.0], [1.0], 'has 1 rows; give at least two'),
        ([], [], 'has no rows of numbers'),
    ],
    ids=['not rising', 'no time', 'out of range', 'one row', 'empty'],
)
def test_what_cannot_be_played_is_refused(times, values, message, tmp_path):
    columns = {
        'time_s': pa.array(times, pa.float64()),
        'voltage_v': pa.array(values, pa.float64()),
    }
    path = parquet_of(tmp_path / 'bad.parquet', **columns)
    with pytest.raises(StickSlipError) as refusal:
        replay_input(read_drive_input(path, STAND), tmp_path / 'run.mcap', STAND)
    assert message in str(refusal.value)
    assert not (tmp_path / 'run.mcap').exists()


def test_too_many_rows_are_refused_with_the_most_that_go(tmp_path: Path):
    time_s = np.arange(1_000_001, dtype=float) * 1e-6
    with pytest.raises(StickSlipError, match='2 to 1000000 rows'):
        replay_input(DriveInput('x', time_s, 0.0 * time_s), tmp_path / 'run.mcap', STAND)
