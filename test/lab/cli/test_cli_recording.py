# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``info``, ``plot``, ``recover`` and ``replay``: what a file holds, shows, and gives again."""

import json
from pathlib import Path
from typing import Any

import pytest
from mcap_records import foreign_numbers

from stickslip_ros.instrument.commands import Request
from stickslip_ros.interface import cdr
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.lab.cli.main import main
from stickslip_ros.message_types import FLOAT64
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.layout import FileForm
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.run import ReportingBench, RunWriter

MS_NS = 1_000_000
CHANNEL = Channel('/voltage', FLOAT64, Qos(10))


def test_info_of_a_file_without_parameters_does_not_invent_them(tmp_path: Path, capsys):
    path = str(foreign_numbers(tmp_path / 'theirs.mcap', [(1, 0, 1.5)]))
    assert main(['info', path]) == 0
    shown = capsys.readouterr().out
    assert 'parameters: unknown, since the file has no parameters.yaml' in shown
    assert 'the stand of the paper' not in shown
    assert main(['info', path, '--json']) == 0
    assert json.loads(capsys.readouterr().out)['changed_parameters'] is None


def test_parameters_that_are_no_text_are_refused(tmp_path: Path, capsys):
    path = tmp_path / 'run.mcap'
    attached = {'parameters.yaml': ('application/yaml', b'\xff')}
    Recorder(path, [CHANNEL], attachments=attached).close()
    for words in (['info', str(path)], ['compare', str(path), str(path)]):
        assert main(words) == 2
        assert (
            'its parameters.yaml is not text in UTF-8; record it again' in capsys.readouterr().err
        )


@pytest.fixture(scope='module')
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp('plot') / 'run.mcap'
    words = ('--voltage', '300', '--frequency', '1000', '--steps', '10', '-o', str(path))
    assert main(['simulate', *words]) == 0
    return path


def test_the_picture_lies_beside_the_recording_unless_told(capsys, recording, tmp_path):
    assert main(['info', str(recording)]) == 0
    assert 'the stand of the paper' in capsys.readouterr().out
    assert main(['plot', str(recording)]) == 0
    assert recording.with_suffix('.png').stat().st_size > 10_000
    out = capsys.readouterr().out
    assert 'position of the runner' in out
    assert 'sawtooth' in out
    assert f'picture {recording.with_suffix(".png")}' in out
    assert main(['plot', str(recording), '-o', str(tmp_path / 'run.pdf')]) == 0
    assert (tmp_path / 'run.pdf').read_bytes().startswith(b'%PDF')


def test_events_that_are_alike_take_one_line(tmp_path: Path, capsys: Any):
    bench, requests = ReportingBench(Parameters()), [Request('voltage', (v,)) for v in range(30)]
    with RunWriter(tmp_path / 'run.mcap', bench.bench.parameters, wait=True) as writer:
        bench.record(writer)
        for request in requests:
            bench.accept(request)
            bench.update(bench.bench.time_ns + MS_NS)
    assert main(['plot', str(tmp_path / 'run.mcap')]) == 0
    [line] = [each for each in capsys.readouterr().out.splitlines() if 'DONE' in each]
    assert line.split()[2:] == ['voltage', 'DONE', '30']


def test_the_json_says_what_is_in_the_picture(capsys: Any, recording: Path, tmp_path: Path):
    words = ('--window', '2ms@3ms', '-o', str(tmp_path / 'run.png'), '--json')
    assert main(['plot', str(recording), *words]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told['picture'] == str(tmp_path / 'run.png')
    assert (told['start_s'], told['end_s']) == (0.003, 0.005)
    assert {each['name']: each['unit'] for each in told['quantities']} == {
        'position_m': 'm',
        'force_n': 'N',
        'voltage_v': 'V',
        'foot_m': 'm',
    }
    assert told['quantities'][2]['samples'] == 101
    assert told['events'] == []


@pytest.fixture
def whole(tmp_path: Path) -> Path:
    form = FileForm(chunk_size_bytes=500)
    with Recorder(tmp_path / 'run.mcap', [CHANNEL], form=form) as recorder:
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


def test_a_cut_file_is_copied_and_its_losses_are_shown(cut: Path, tmp_path: Path, capsys):
    assert main(['recover', str(cut)]) == 0
    shown = capsys.readouterr().out
    assert 'chunk cut off, or a' in shown
    copy = cut.with_name('run.recovered.mcap')
    assert f'wrote {copy}' in shown
    assert main(['recover', str(cut), '-o', str(tmp_path / 'saved.mcap'), '--json']) == 0
    [file] = json.loads(capsys.readouterr().out)['files']
    [topic] = Recording(copy).channels
    assert file['messages'] == topic.messages == topic.last_ns / MS_NS + 1
    assert [loss['problem'] for loss in file['losses']] == [
        'chunk cut off, or a length in it is wrong'
    ]


FIRST = [
    'simulate', '--preload', '0.5', '--amplitude', '60nm', '--steps', '20', '-o', 'run.mcap',
]  # fmt: skip
MEASURED = 'time_s,voltage_v\n0.0,10.0\n0.005,60.0\n0.010,20.0\n'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'measured.csv').write_text(MEASURED, encoding='utf-8')
    return tmp_path


@pytest.fixture
def recorded(folder: Path) -> Path:
    """Give a recording, made as the page says."""
    assert main(FIRST) == 0
    return folder / 'run.mcap'


def test_a_replay_says_that_the_data_are_identical(recorded: Path, capsys: pytest.CaptureFixture):
    capsys.readouterr()
    assert main(['replay', str(recorded)]) == 0
    assert 'every message is identical, byte for byte' in capsys.readouterr().out
    assert main(['replay', str(recorded), '--json']) == 0
    told = json.loads(capsys.readouterr().out)
    assert told['identical'] is True
    assert told['requests'] == 1


def test_a_value_that_is_the_default_is_a_change_where_the_recording_has_another(folder, capsys):
    words = ['--voltage', '100', '--steps', '3', '--set', 'stand.preload=0.25']
    assert main(['simulate', *words, '-o', 'run.mcap']) == 0
    (folder / 'stand.yaml').write_text('/**: {ros__parameters: {stand: {preload: 0.5}}}')
    capsys.readouterr()
    assert main(['replay', 'run.mcap', '--params', 'stand.yaml', '--json']) == 0
    assert json.loads(capsys.readouterr().out)['changed'] == {'stand.preload': 0.5}
    assert main(['replay', 'run.mcap', '--set', 'stand.preload=0.25', '--json']) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told['changed'], told['identical']) == ({}, True)


def test_what_cannot_be_replayed_is_one_line_and_status_2(recorded, capsys):
    capsys.readouterr()
    assert main(['replay', 'measured.csv']) == 2
    assert 'name the recording to write with -o' in capsys.readouterr().err
    assert main(['replay', str(recorded), '-o', str(recorded)]) == 2
    assert 'it exists and is not overwritten' in capsys.readouterr().err
    assert main(['replay', 'nowhere.mcap']) == 2
    assert 'nowhere.mcap' in capsys.readouterr().err


def test_a_recording_carries_its_experiment_and_is_compared_with_it(folder, capsys):
    words = [*FIRST, '--set', 'record.experiment=measured.csv']
    assert main(words) == 0
    attached = Recording('run.mcap').attachments['experiment.csv']
    assert attached == ('text/csv', MEASURED.encode())
    assert main(['compare', 'run.mcap', '--json']) == 0
    assert 'run.mcap experiment.csv' in capsys.readouterr().out
