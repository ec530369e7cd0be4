"""``stickslip recover`` says what came back and what is lost."""

import json
from pathlib import Path

import pytest

from stickslip_ros.cli.main import main
from stickslip_ros.recording import Channel, FileForm, Qos, Recorder, cdr
from stickslip_ros.recording import messages as m

MS_NS = 1_000_000
CHANNEL = Channel('/voltage', m.FLOAT64, Qos(10))


@pytest.fixture
def whole(tmp_path: Path) -> Path:
    with Recorder(
        tmp_path / 'run.mcap', [CHANNEL], form=FileForm(flush_period_s=0.03)
    ) as recorder:
        for time_ms in range(100):
            recorder.put('/voltage', time_ms * MS_NS, cdr.pack_float64(time_ms), wait=True)
    return recorder.path


@pytest.fixture
def cut(whole: Path) -> Path:
    content = whole.read_bytes()
    whole.write_bytes(content[: content.index(b'\x28\xb5\x2f\xfd', len(content) // 2) + 10])
    return whole


def test_a_whole_file_says_so_and_nothing_is_written(whole: Path, capsys):
    assert main(['recover', str(whole)]) == 0
    shown = capsys.readouterr().out
    assert 'is whole: 100 messages' in shown
    assert 'nothing was written' in shown.replace('\n', ' ')
    assert [path.name for path in whole.parent.iterdir()] == ['run.mcap']


def test_a_cut_file_is_copied_and_its_topics_and_losses_are_shown(cut: Path, capsys):
    assert main(['recover', str(cut)]) == 0
    shown = capsys.readouterr().out
    assert '/voltage' in shown
    assert 'the last chunk is cut off' in shown
    assert f'wrote {cut.with_name("run.recovered.mcap")}' in shown
    assert main(['info', str(cut.with_name('run.recovered.mcap'))]) == 0


def test_the_same_comes_as_json(cut: Path, tmp_path: Path, capsys):
    output = tmp_path / 'saved.mcap'
    assert main(['recover', str(cut), '-o', str(output), '--json']) == 0
    result = json.loads(capsys.readouterr().out)
    assert result['written'] == str(output)
    [file] = result['files']
    assert file['is_whole'] is False
    assert file['messages'] == file['topics'][0]['messages'] == file['last_ns'] / MS_NS + 1
    assert [loss['problem'] for loss in file['losses']] == ['the last chunk is cut off']


def test_a_whole_file_comes_as_json(whole: Path, capsys):
    assert main(['recover', str(whole), '--json']) == 0
    result = json.loads(capsys.readouterr().out)
    assert result['written'] == ''
    assert result['files'][0]['is_whole'] is True


def test_an_unfinished_file_is_refused_with_the_words_that_mend_it(cut: Path, capsys):
    assert main(['info', str(cut)]) == 2
    assert f'"stickslip recover {cut}"' in capsys.readouterr().err.replace('\n', '')


def test_a_copy_that_exists_is_refused(cut: Path, capsys):
    assert main(['recover', str(cut)]) == 0
    assert main(['recover', str(cut)]) == 2
    assert 'exists and is not overwritten; choose another name with -o' in capsys.readouterr().err


def test_info_takes_a_bag_directory_as_one_run(tmp_path: Path, capsys):
    form = FileForm(bag=True, split_duration_s=0.05)
    with Recorder(tmp_path / 'run', [CHANNEL], form=form) as recorder:
        for time_ms in range(100):
            recorder.put('/voltage', time_ms * MS_NS, cdr.pack_float64(time_ms), wait=True)
    assert main(['info', str(tmp_path / 'run'), '--json']) == 0
    [topic] = json.loads(capsys.readouterr().out)['topics']
    assert (topic['messages'], topic['gaps']) == (100, 0)
