# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A run in parts: each part is a recording, all parts together are the run."""

import dataclasses
from pathlib import Path

import pytest
import yaml
from mcap_records import rows_of

from stickslip_ros.errors import RecordingError
from stickslip_ros.interface import cdr
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.message_types import FLOAT64, STRING, UINT32
from stickslip_ros.recording.bag import METADATA_FILE, METADATA_ROOT
from stickslip_ros.recording.layout import FileForm
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recorder import Recorder

MS_NS = 1_000_000
STATUS = Channel('/status', UINT32, Qos(1, latched=True))
INFO = Channel('/info', STRING, Qos(1, latched=True))
VOLTAGE = Channel('/voltage', FLOAT64, Qos(10))
FORM = FileForm(flush_period_s=0.1, in_parts=True)
STARTS_MS = (0, 100, 200, 300)
METADATA = {'stickslip_run': {'seed': '7'}}
ATTACHMENTS = {'parameters.yaml': ('application/yaml', b'seed: 7\n')}


def record(path: Path, form: FileForm) -> Recorder:
    """Record 0.35 s at 1 kHz, in parts of 0.1 s; the status changes at 150 ms."""
    channels = [INFO, STATUS, VOLTAGE]
    with Recorder(
        path, channels, metadata=METADATA, attachments=ATTACHMENTS, form=form
    ) as recorder:
        for time_ms in range(350):
            if form.in_parts and time_ms in STARTS_MS:
                state = {'state.bin': ('application/octet-stream', b'%d' % time_ms)}
                recorder.begin_part(time_ms * MS_NS, state)
            if time_ms == 0:
                recorder.put('/info', 0, cdr.pack_string('about'))
                recorder.put('/status', 0, cdr.pack_uint32(1))
            if time_ms == 150:
                recorder.put('/status', time_ms * MS_NS, cdr.pack_uint32(2))
            recorder.put('/voltage', time_ms * MS_NS, cdr.pack_float64(time_ms), wait=True)
    assert recorder.error is None
    return recorder


@pytest.fixture(scope='module')
def split(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give the name that the parts of a run share."""
    path = tmp_path_factory.mktemp('split') / 'run.mcap'
    record(path, FORM)
    return path


@pytest.fixture
def parts(split: Path, tmp_path: Path) -> Path:
    """Give a copy of the run whose parts may be moved."""
    for part in split.parent.iterdir():
        (tmp_path / part.name).write_bytes(part.read_bytes())
    return tmp_path / 'run.mcap'


def test_a_part_begins_where_it_is_asked_for(split: Path):
    files = sorted(split.parent.iterdir())
    assert [file.name for file in files] == [f'run_{number}.mcap' for number in range(4)]
    times = [Recording(file).series('voltage').time_s for file in files]
    assert [round(each[0], 9) for each in times] == [0.0, 0.1, 0.2, 0.3]


def test_every_part_tells_about_the_run_and_about_itself(split: Path):
    for number, file in enumerate(sorted(split.parent.iterdir())):
        recording = Recording(file)
        state = {'state.bin': ('application/octet-stream', b'%d' % STARTS_MS[number])}
        assert recording.attachments == {**ATTACHMENTS, **state}
        assert recording.metadata['stickslip_run'] == {'seed': '7'}
        told = {'run': 'run', 'part': str(number), 'first': '0'}
        assert recording.metadata['stickslip_part'] == told
        follower = f'run_{number + 1}.mcap' if number < 3 else ''
        assert recording.metadata['stickslip_recorder']['followed_by'] == follower


def test_a_part_begins_with_what_is_latched_at_its_first_time(split: Path):
    begins = [list(Recording(file).messages())[:2] for file in sorted(split.parent.iterdir())]
    assert begins == [
        [('/info', at_ms * MS_NS, 'about'), ('/status', at_ms * MS_NS, status)]
        for at_ms, status in [(0, 1), (100, 1), (200, 2), (300, 2)]
    ]


def test_what_the_run_begins_with_is_attached_to_its_first_part(split: Path):
    assert Recording(split).attachments['state.bin'] == ('application/octet-stream', b'0')


def test_parts_together_are_the_run_without_repetitions_and_gaps(split: Path, tmp_path: Path):
    record(tmp_path / 'one.mcap', FileForm())
    assert list(Recording(split).messages()) == list(Recording(tmp_path / 'one.mcap').messages())
    assert Recording(split).channels == Recording(tmp_path / 'one.mcap').channels


def test_the_ends_of_the_parts_tell_what_a_pass_over_all_messages_tells(split: Path):
    told, counted = Recording(split).channels, Recording(split)
    counted._counts = [{}]  # files that do not say how many messages they hold
    assert told == counted.channels


def test_equal_runs_give_equal_parts(split: Path, tmp_path: Path):
    record(tmp_path / 'run.mcap', FORM)
    for file in split.parent.iterdir():
        assert rows_of(tmp_path / file.name) == rows_of(file)


def test_the_recorder_tells_of_files_that_exist_and_counts_what_is_in_them(tmp_path: Path):
    recorder = record(tmp_path / 'run.mcap', FORM)
    assert recorder.place == f'{tmp_path}/run_0.mcap to run_3.mcap'
    in_files = sum(
        channel.messages for part in recorder.files for channel in Recording(part).channels
    )
    assert recorder.stored == in_files == recorder.written + 2 * 3  # latched, in later parts
    bag = record(tmp_path / 'bag.mcap', dataclasses.replace(FORM, bag=True))
    assert Path(bag.place) == tmp_path / 'bag'
    described = yaml.safe_load((tmp_path / 'bag' / METADATA_FILE).read_text())[METADATA_ROOT]
    assert bag.stored == described['message_count'] == recorder.stored


@pytest.mark.parametrize('number', [0, 1, 3], ids=['first', 'middle', 'last'])
def test_a_missing_part_is_named(parts: Path, number: int):
    (parts.parent / f'run_{number}.mcap').unlink()
    missing = rf'run_{number}\.mcap: this part of the run is missing'
    with pytest.raises(RecordingError, match=missing):
        Recording(parts)


def test_only_the_last_parts_are_kept_and_the_run_says_where_it_begins(tmp_path: Path):
    recorder = record(tmp_path / 'run.mcap', dataclasses.replace(FORM, keep_parts=2))
    assert recorder.place == f'{tmp_path}/run_2.mcap to run_3.mcap'
    assert sorted(file.name for file in tmp_path.iterdir()) == ['run_2.mcap', 'run_3.mcap']
    run = Recording(tmp_path / 'run.mcap')
    assert run.series('voltage').value.tolist() == list(range(200, 350))
    assert run.attachments['state.bin'] == ('application/octet-stream', b'200')
    assert {channel.gaps for channel in run.channels} == {0}
    (tmp_path / 'run_2.mcap').unlink()
    with pytest.raises(RecordingError, match=r'run_2\.mcap: this part of the run is missing'):
        Recording(tmp_path / 'run.mcap')


def test_a_bag_keeps_its_last_parts_too(tmp_path: Path):
    record(tmp_path / 'bag', dataclasses.replace(FORM, bag=True, keep_parts=1))
    described = yaml.safe_load((tmp_path / 'bag' / METADATA_FILE).read_text())[METADATA_ROOT]
    assert described['relative_file_paths'] == ['bag_3.mcap']
    assert len(Recording(tmp_path / 'bag').series('voltage').value) == 50


def test_a_part_whose_followers_are_missing_opens_by_its_own_name(parts: Path):
    (parts.parent / 'run_3.mcap').unlink()
    assert len(Recording(parts.parent / 'run_2.mcap').series('voltage').value) == 100


def test_a_damaged_part_is_named_with_what_mends_it(parts: Path):
    part = parts.parent / 'run_1.mcap'
    part.write_bytes(part.read_bytes()[:-100])
    with pytest.raises(RecordingError, match=r'"stickslip recover .*run_1\.mcap"'):
        Recording(parts)


def test_a_next_part_that_cannot_be_made_stops_the_writing_and_is_told(tmp_path: Path):
    with Recorder(tmp_path / 'run.mcap', [VOLTAGE], form=FORM) as recorder:
        (tmp_path / 'run_1.mcap').write_bytes(b'precious')
        for time_ms in range(200):
            if time_ms == 100:
                recorder.begin_part(time_ms * MS_NS)
            recorder.put('/voltage', time_ms * MS_NS, cdr.pack_float64(time_ms), wait=True)
    assert isinstance(recorder.error, RecordingError)
    assert (tmp_path / 'run_1.mcap').read_bytes() == b'precious'
    assert len(Recording(tmp_path / 'run_0.mcap').series('voltage').value) == 100


def test_a_part_whose_state_the_disk_cannot_take_is_not_begun(tmp_path, small_disk):
    with Recorder(tmp_path / 'run.mcap', [VOLTAGE], form=FORM) as recorder:
        small_disk(20_000)
        for time_ms in range(100):
            recorder.put('/voltage', time_ms * MS_NS, cdr.pack_float64(time_ms), wait=True)
        recorder.begin_part(100 * MS_NS, {'state.bin': ('', bytes(30_000))})
        recorder.put('/voltage', 100 * MS_NS, cdr.pack_float64(100.0), wait=True)
    assert 'it cannot be begun' in str(recorder.error)
    assert [file.name for file in tmp_path.iterdir()] == ['run_0.mcap']
    assert len(Recording(tmp_path / 'run_0.mcap').series('voltage').value) == 100
