# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip replay`` does what docs/howto/replay.md says, with the commands that stand there."""

import json
import shlex
from pathlib import Path

import pytest

from stickslip_ros.lab.cli.main import main
from stickslip_ros.recording.reader import Recording

DOCS = Path(__file__).parents[3] / 'docs' / 'howto' / 'replay.md'
MEASURED = 'time_s,voltage_v\n0.0,10.0\n0.005,60.0\n0.010,20.0\n'


def commands() -> list[list[str]]:
    """Give the commands of the page, in its order."""
    lines = DOCS.read_text(encoding='utf-8').splitlines()
    return [shlex.split(line)[1:] for line in lines if line.startswith('stickslip ')]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'measured.csv').write_text(MEASURED, encoding='utf-8')
    return tmp_path


@pytest.fixture
def run(folder: Path) -> Path:
    """Give a recording, made as the page says."""
    assert main(commands()[0]) == 0
    return folder / 'run.mcap'


def test_the_commands_of_the_page_work_in_their_order(folder: Path):
    assert len(commands()) == 6
    for words in commands():
        assert main(words) == 0, words
    files = {'run.mcap', 'again.mcap', 'softer.mcap', 'measured.mcap', 'measured.csv'}
    assert {path.name for path in folder.iterdir()} == files


def test_a_replay_says_that_the_data_are_identical(run: Path, capsys: pytest.CaptureFixture):
    capsys.readouterr()
    assert main(['replay', str(run)]) == 0
    assert 'every message is identical, byte for byte' in capsys.readouterr().out
    assert main(['replay', str(run), '--json']) == 0
    told = json.loads(capsys.readouterr().out)
    assert told['identical'] is True
    assert told['requests'] == 1


def test_a_value_that_is_the_default_is_a_change_where_the_recording_has_another(
    folder: Path, capsys: pytest.CaptureFixture
):
    words = ['--voltage', '100', '--steps', '3', '--set', 'stand.preload=0.25']
    assert main(['simulate', *words, '-o', 'run.mcap']) == 0
    (folder / 'stand.yaml').write_text('/**: {ros__parameters: {stand: {preload: 0.5}}}')
    capsys.readouterr()
    assert main(['replay', 'run.mcap', '--params', 'stand.yaml', '--json']) == 0
    assert json.loads(capsys.readouterr().out)['changed'] == {'stand.preload': 0.5}
    assert main(['replay', 'run.mcap', '--set', 'stand.preload=0.25', '--json']) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told['changed'], told['identical']) == ({}, True)


def test_what_cannot_be_replayed_is_one_line_and_status_2(
    run: Path, capsys: pytest.CaptureFixture
):
    capsys.readouterr()
    assert main(['replay', 'measured.csv']) == 2
    assert 'name the recording to write with -o' in capsys.readouterr().err
    assert main(['replay', str(run), '-o', str(run)]) == 2
    assert 'it exists and is not overwritten' in capsys.readouterr().err
    assert main(['replay', 'nowhere.mcap']) == 2
    assert 'nowhere.mcap' in capsys.readouterr().err


def test_a_recording_carries_its_experiment_and_is_compared_with_it(
    folder: Path, capsys: pytest.CaptureFixture
):
    words = [*commands()[0], '--set', 'record.experiment=measured.csv']
    assert main(words) == 0
    attached = Recording('run.mcap').attachments['experiment.csv']
    assert attached == ('text/csv', MEASURED.encode())
    assert main(['compare', 'run.mcap', '--json']) == 0
    assert 'run.mcap experiment.csv' in capsys.readouterr().out


def test_a_measured_voltage_on_a_runner_that_the_load_cell_holds_is_said(
    folder: Path, capsys: pytest.CaptureFixture
):
    held = 'the runner is fixed to the load cell'
    assert main(['replay', 'measured.csv', '-o', 'held.mcap']) == 0
    assert held in capsys.readouterr().out
    free = ['--set', 'load_cell.contact=absent']
    assert main(['replay', 'measured.csv', '-o', 'free.mcap', *free]) == 0
    assert held not in capsys.readouterr().out
