"""A bag or a run in parts is recovered as one: what is whole in it is kept as it is."""

from pathlib import Path

import pytest
import yaml
from rosbags.rosbag2 import Reader

from stickslip_ros.errors import RecordingError
from stickslip_ros.recording import Channel, FileForm, Recorder, Recording
from stickslip_ros.recording.bag_metadata import METADATA_FILE
from stickslip_ros.recording.recover_run import recover

SPLIT = FileForm(split_duration_s=0.005, flush_period_s=0.005)
BAG = FileForm(split_duration_s=0.005, flush_period_s=0.005, bag=True)


def record(path: Path, channels: list[Channel], run: list, form: FileForm) -> Path:
    with Recorder(path, channels, form=form) as recorder:
        for each in run:
            recorder.put(*each, wait=True)
    assert len(recorder.files) == 4
    return recorder.path


@pytest.fixture
def bag(tmp_path: Path, channels: list[Channel], run: list) -> Path:
    return record(tmp_path / 'run', channels, run, BAG)


@pytest.fixture
def cut_bag(bag: Path) -> Path:
    """Give a bag whose process was killed: the last part is cut, nothing describes it."""
    (bag / METADATA_FILE).unlink()
    last = bag / 'run_3.mcap'
    last.write_bytes(last.read_bytes()[:-1000])
    return bag


def content_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def texts_of(path: Path) -> list[str]:
    return list(map(str, Recording(path).messages()))


def test_a_whole_bag_is_left_alone(bag: Path):
    before = content_of(bag)
    recoveries, written = recover(bag)
    assert written is None
    assert all(each.is_whole for each in recoveries)
    assert content_of(bag) == before


def test_a_bag_whose_description_is_missing_gets_one(bag: Path):
    before = content_of(bag)
    (bag / METADATA_FILE).unlink()
    _, written = recover(bag)
    assert written == bag / METADATA_FILE
    assert content_of(bag) == before


def test_a_bag_that_was_cut_off_is_recovered_beside_itself(cut_bag: Path, recorded: Path):
    before = content_of(cut_bag)
    recoveries, written = recover(cut_bag)
    assert written == cut_bag.with_name('run.recovered')
    assert content_of(cut_bag) == before
    assert [each.is_whole for each in recoveries] == [True, True, True, False]
    expected = texts_of(recorded)
    back = texts_of(written)
    assert expected[: len(back)] == back
    assert len(back) > 0.7 * len(expected)


def test_the_recovered_bag_opens_in_rosbags(cut_bag: Path):
    _, written = recover(cut_bag)
    names = [f'run.recovered_{number}.mcap' for number in range(4)]
    described = yaml.safe_load((written / METADATA_FILE).read_text())
    assert described['rosbag2_bagfile_information']['relative_file_paths'] == names
    with Reader(written) as reader:
        assert reader.message_count == sum(1 for _ in reader.messages())


def test_a_part_of_which_nothing_is_left_keeps_its_number(cut_bag: Path):
    (cut_bag / 'run_3.mcap').write_bytes(b'')
    recoveries, written = recover(cut_bag)
    assert [each.messages > 0 for each in recoveries] == [True, True, True, False]
    assert [part.name for part in Recording(written).files][-1] == 'run.recovered_3.mcap'


def test_a_run_in_parts_is_recovered_by_the_name_that_they_share(
    tmp_path: Path, channels: list[Channel], run: list, recorded: Path
):
    path = record(tmp_path / 'run.mcap', channels, run, SPLIT)
    part = tmp_path / 'run_1.mcap'
    part.write_bytes(part.read_bytes()[:-1000])
    _, written = recover(path)
    assert written == tmp_path / 'run.recovered.mcap'
    assert set(texts_of(written)) <= set(texts_of(recorded))
    assert len(Recording(written).files) == 4


def test_the_copy_goes_where_it_is_wanted(cut_bag: Path, tmp_path: Path):
    _, written = recover(cut_bag, tmp_path / 'else' / 'where')
    assert written == tmp_path / 'else' / 'where'
    assert len(Recording(written).files) == 4


def test_a_copy_that_exists_is_not_overwritten(cut_bag: Path):
    recover(cut_bag)
    before = content_of(cut_bag.with_name('run.recovered'))
    with pytest.raises(RecordingError, match='exists and is not overwritten'):
        recover(cut_bag)
    assert content_of(cut_bag.with_name('run.recovered')) == before


@pytest.mark.parametrize('name', ['missing', 'missing.mcap'])
def test_what_is_not_there_is_refused(tmp_path: Path, name: str):
    with pytest.raises(RecordingError, match='No such file'):
        recover(tmp_path / name)


def test_a_directory_without_a_recording_is_refused(tmp_path: Path):
    with pytest.raises(RecordingError, match='there is no MCAP file in it'):
        recover(tmp_path)


def test_a_bag_of_storage_sqlite3_is_refused(tmp_path: Path):
    (tmp_path / 'bag_0.db3').write_bytes(b'SQLite format 3\0')
    with pytest.raises(RecordingError, match='ros2 bag convert'):
        recover(tmp_path)
