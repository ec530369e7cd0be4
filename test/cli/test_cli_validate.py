"""``stickslip validate`` as it is typed."""

import json

import pytest

from stickslip_ros.cli.main import main
from stickslip_ros.validation.checks import Family, Tolerance, measures
from stickslip_ros.validation.evidence import validate
from stickslip_ros.validation.half_space import HALF_SPACE
from stickslip_ros.validation.load_curves import NORMAL_LOAD
from stickslip_ros.validation.roughness import ROUGHNESS

EVIDENCE = 'stickslip_ros.validation.evidence.EVIDENCE'
FILES = ['validation.csv', 'validation.md', 'validation.png']


@measures(
    ('a [bold] length', 'a ruler', 'm', Tolerance(0.01, 'one in a hundred is counted twice'))
)
def wrong():
    return ((1.0, 1.1),)


WRONG = Family('Wrong', (wrong,))


def test_all_checks_pass_and_files_are_written(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(EVIDENCE, (NORMAL_LOAD, HALF_SPACE))
    monkeypatch.setenv('COLUMNS', '120')
    assert main(['validate', '--output', str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert 'all passed' in printed
    assert 'FAIL' not in printed
    assert 'rough, d = 80 nm: force (Eq. 24)' in printed
    assert sorted(path.name for path in tmp_path.iterdir()) == FILES


def test_it_tells_how_many_families_are_done(monkeypatch):
    monkeypatch.setattr(EVIDENCE, (WRONG, WRONG))
    told = []
    validate(progress=lambda done, total: told.append((done, total)))
    assert told == [(0, 2), (1, 2)]


def test_a_wrong_parameter_fails_with_status_1(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(EVIDENCE, (NORMAL_LOAD, ROUGHNESS))
    monkeypatch.setattr('stickslip_ros.contact.roughness.POHRT_POPOV', 1.95)
    assert main(['validate', '--output', str(tmp_path)]) == 1
    printed = capsys.readouterr().out
    assert 'FAIL Q_1D with kappa cancelled: error 0.0077 of the reference' in printed
    assert '3 failed' in printed


def test_a_failure_says_against_what_and_what_error_was_expected(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(EVIDENCE, (WRONG,))
    assert main(['validate', '--output', str(tmp_path)]) == 1
    printed = ' '.join(capsys.readouterr().out.split())
    assert 'FAIL a [bold] length: error 0.1 of the reference (a ruler), above 0.01: one' in printed


def test_the_json_has_every_check_in_si_units(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(EVIDENCE, (WRONG,))
    assert main(['validate', '--output', str(tmp_path), '--json']) == 1
    result = json.loads(capsys.readouterr().out)
    assert result['passed'] is False
    assert result['checks'][0]['ours'] == pytest.approx(1.1)
    assert result['checks'][0]['unit'] == 'm'
    assert result['checks'][0]['reason'] == 'one in a hundred is counted twice'
    assert sorted(result['files']) == sorted(str(tmp_path / name) for name in FILES)


def test_a_folder_that_cannot_be_made_is_refused(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(EVIDENCE, (WRONG,))
    taken = tmp_path / 'taken'
    taken.write_text('')
    assert main(['validate', '--output', str(taken)]) == 2
    assert 'choose another folder' in capsys.readouterr().err
