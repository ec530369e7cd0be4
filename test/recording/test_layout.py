# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A run's name stays in its folder, and nothing that is there is written over."""

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip_ros.errors import OutOfRange, RecordingError, StickSlipError
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.message_types import FLOAT64
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.layout import FileForm, Layout
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.run_file import NAME_MAX_BYTES, open_recorder, run_path

VOLTAGE = Channel('/voltage', FLOAT64, Qos(10))
SPLIT = FileForm(in_parts=True)
BAG = FileForm(bag=True)
#: What the longest name may still grow by: the number of a part and the mark of a recovery.
LONGEST_ENDING = '_4294967295.recovered.mcap'


def named(name: str, folder: str = 'runs') -> Path:
    values = {'record.name': name, 'record.directory': folder}
    return run_path(Parameters().updated(values))


@pytest.mark.parametrize('name', ['run_7', 'grün', 'a b', '#1', 'v1.2', 'run_7.mcap', 'nul'])
def test_a_plain_name_is_taken_and_ends_in_mcap(name: str):
    assert named(name) == Path('runs') / f'{name.removesuffix(".mcap")}.mcap'


def test_a_run_without_a_name_is_named_after_date_time_and_namespace():
    assert re.fullmatch(r'run_2\d{7}T\d{6}_\d{6}\.mcap', named('').name)
    for namespace, end in (('/', ''), ('/left', '_left'), ('/hall/left', '_hall_left')):
        assert re.fullmatch(rf'run_2[\dT_]+\d{end}', run_path(Parameters(), namespace).stem)


@pytest.mark.parametrize(
    ('name', 'problem'),
    [
        ('..', 'begins with a dot'),
        ('../run', 'separator'),
        ('/tmp/run', 'separator'),
        ('a\\b', 'separator'),
        ('.hidden', 'begins with a dot'),
        ('-rf', 'a dash'),
        (' run', 'or a space'),
        ('run.', 'ends with a dot'),
        ('run\n', 'cannot be printed'),
        ('run\0', 'cannot be printed'),
        ('\u202erun', 'cannot be printed'),
        ('run\ud800', 'cannot be printed'),
        ('.mcap', 'begins with a dot'),
        ('µ' * (NAME_MAX_BYTES // 2 + 1), f'longer than {NAME_MAX_BYTES} bytes'),
    ],
)
def test_a_name_that_is_no_plain_file_name_is_refused(name: str, problem: str):
    with pytest.raises(OutOfRange, match=problem) as refusal:
        named(name)
    assert 'record.name' in str(refusal.value)
    assert str(refusal.value).endswith('give a name such as run_7')


@given(st.text())
def test_whatever_the_name_the_run_stays_in_its_folder(tmp_path_factory, name: str):
    folder = tmp_path_factory.getbasetemp()
    try:
        path = named(name, str(folder))
    except StickSlipError:
        return
    assert path.parent == folder
    assert path.resolve().parent == folder.resolve()
    assert len((path.stem + LONGEST_ENDING).encode()) <= 255


@pytest.mark.parametrize(
    ('form', 'there'),
    [
        (FileForm(), 'run.mcap'),
        (SPLIT, 'run.mcap'),
        (SPLIT, 'run_0.mcap'),
        (SPLIT, 'run_17.mcap'),
        (BAG, 'run'),
    ],
)
def test_what_is_there_is_not_overwritten(tmp_path: Path, form: FileForm, there: str):
    (tmp_path / there).write_bytes(b'precious')
    with pytest.raises(RecordingError, match='exists and is not overwritten; choose another name'):
        Recorder(tmp_path / 'run.mcap', [VOLTAGE], form=form)
    assert [path.name for path in tmp_path.iterdir()] == [there]
    assert (tmp_path / there).read_bytes() == b'precious'


def test_a_link_to_nowhere_is_not_written_through(tmp_path: Path):
    (tmp_path / 'run.mcap').symlink_to(tmp_path / 'elsewhere.mcap')
    with pytest.raises(RecordingError, match='exists and is not overwritten'):
        Recorder(tmp_path / 'run.mcap', [VOLTAGE])
    assert not (tmp_path / 'elsewhere.mcap').exists()


@pytest.mark.parametrize('there', ['run_x.mcap', 'run_01.mcap', 'run_1.csv', 'runs_0.mcap'])
def test_other_files_are_no_parts_of_a_run(tmp_path: Path, there: str):
    (tmp_path / there).write_bytes(b'')
    assert Layout.plan(tmp_path / 'run.mcap', split=True).parts() == []


def test_parts_are_in_the_order_of_their_numbers(tmp_path: Path):
    for number in (10, 9, 0):
        (tmp_path / f'run_{number}.mcap').write_bytes(b'')
    layout = Layout.plan(tmp_path / 'run.mcap', split=True)
    assert [path.name for path in layout.parts()] == ['run_0.mcap', 'run_9.mcap', 'run_10.mcap']


def test_a_bag_that_cannot_be_begun_leaves_no_directory(tmp_path: Path, small_disk):
    small_disk(1000)
    big = {'big': ('text/plain', bytes(2000))}
    with pytest.raises(RecordingError, match='cannot be begun'):
        Recorder(tmp_path / 'run', [VOLTAGE], attachments=big, form=BAG)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ('values', 'refusal'),
    [
        ({'record.split_size': 1000}, 'record.split_size 1000 B is below record.chunk_size'),
        ({'record.split_duration': 0.5}, 'record.split_duration 0.5 s is below record.flush_per'),
        ({'record.keep_parts': 2}, 'record.keep_parts 2 is not possible for a run in one part'),
    ],
)
def test_parts_that_cannot_be_are_refused(tmp_path: Path, values: dict, refusal: str):
    with pytest.raises(OutOfRange, match=refusal):
        open_recorder(tmp_path / 'run.mcap', Parameters().updated(values), {})
    assert list(tmp_path.iterdir()) == []
