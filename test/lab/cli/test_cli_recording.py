# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip info``, ``plot`` and ``recover``: what a file holds, shows, and what came back."""

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
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.run import ReportingBench, RunWriter

MS_NS = 1_000_000
CHANNEL = Channel('/voltage', FLOAT64, Qos(10))


def test_info_of_a_file_without_parameters_does_not_invent_them(tmp_path: Path, capsys):
    path = str(foreign_numbers(tmp_path / 'theirs.mcap', [(1, 0, 1.5)]))
    assert main(['info', path]) == 0
    shown = capsys.readouterr().out
    assert 'parameters: unknown, as the file has no parameters.yaml' in shown
    assert 'the stand of the paper' not in shown
    assert main(['info', path, '--json']) == 0
    assert json.loads(capsys.readouterr().out)['changed_parameters'] is None


def test_info_of_a_run_with_the_default_parameters_says_so(recording: Path, capsys):
    assert main(['info', str(recording)]) == 0
    assert 'the stand of the paper' in capsys.readouterr().out


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


def test_the_picture_lies_beside_the_recording_unless_told(
    capsys: Any, recording: Path, tmp_path: Path
):
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
    bits = ('MOVING', 'SENSOR_PRESENT', 'AMPLIFIER_ENABLED')
    assert told['status'] == [{'bit': bit, 'start_s': 0.003, 'end_s': 0.005} for bit in bits]


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


def test_a_cut_file_is_copied_and_its_topics_and_losses_are_shown(cut: Path, capsys):
    assert main(['recover', str(cut)]) == 0
    shown = capsys.readouterr().out
    assert '/voltage' in shown
    assert 'chunk cut off, or a' in shown
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
    assert [loss['problem'] for loss in file['losses']] == [
        'chunk cut off, or a length in it is wrong'
    ]
