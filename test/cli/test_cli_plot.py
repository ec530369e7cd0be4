"""`stickslip plot` as it is typed."""

import json
from pathlib import Path
from typing import Any

import pytest

from stickslip_ros.cli.main import main


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
    assert 'runner position' in out
    assert 'sawtooth' in out
    assert f'picture {recording.with_suffix(".png")}' in out
    assert main(['plot', str(recording), '-o', str(tmp_path / 'a/run.pdf')]) == 0
    assert (tmp_path / 'a/run.pdf').read_bytes().startswith(b'%PDF')


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


@pytest.mark.parametrize(
    ('words', 'message'),
    [
        (('--window', '2ms'), "window '2ms' is not LENGTH@START; write LENGTH@START"),
        (('--window', '2ms@9s'), 'start of the window 9 s is outside of the run'),
        (('-o', 'run.txt'), "kind of picture '.txt' is not known; use .png, .svg, .pdf"),
    ],
)
def test_a_bad_wish_is_refused(capsys: Any, recording: Path, words: tuple[str, ...], message: str):
    assert main(['plot', str(recording), *words]) == 2
    assert message in capsys.readouterr().err


def test_a_missing_recording_is_refused(capsys: Any, tmp_path: Path):
    assert main(['plot', str(tmp_path / 'none.mcap')]) == 2
    assert 'none.mcap: it cannot be opened' in capsys.readouterr().err
