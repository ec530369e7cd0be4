"""``stickslip validate`` as it is typed."""

import json

import pytest

from stickslip_ros.cli.main import main
from stickslip_ros.validation.checks import Tolerance, compare
from stickslip_ros.validation.findings import Findings
from stickslip_ros.validation.normal_load import normal_load
from stickslip_ros.validation.roughness import roughness
from stickslip_ros.validation.three_dimensions import three_dimensions

FAMILIES = 'stickslip_ros.validation.families.FAMILIES'
FILES = ['validation.csv', 'validation.md', 'validation.png']


def wrong() -> Findings:
    tolerance = Tolerance(0.01, 'one in a hundred is counted twice')
    return Findings('Wrong', (compare('a [bold] length', 'a ruler', 1.0, 1.1, 'm', tolerance),))


def test_all_checks_pass_and_files_are_written(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(FAMILIES, (normal_load, three_dimensions))
    assert main(['validate', '--out', str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert 'all passed' in printed
    assert 'FAIL' not in printed
    assert 'rough, d = 80 nm: force (Eq. 24)' in printed
    assert sorted(path.name for path in tmp_path.iterdir()) == FILES


def test_a_wrong_parameter_fails_with_status_1(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(FAMILIES, (normal_load, roughness))
    monkeypatch.setattr('stickslip_ros.contact.roughness.POHRT_POPOV', 1.95)
    assert main(['validate', '--out', str(tmp_path)]) == 1
    printed = capsys.readouterr().out
    assert 'FAIL Q_1D with kappa cancelled: error 0.0077 of the reference' in printed
    assert '3 failed' in printed


def test_a_failure_says_against_what_and_what_error_was_expected(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(FAMILIES, (wrong,))
    assert main(['validate', '--out', str(tmp_path)]) == 1
    printed = ' '.join(capsys.readouterr().out.split())
    assert 'FAIL a [bold] length: error 0.1 of the reference (a ruler), above 0.01: one' in printed


def test_the_json_has_every_check_in_si_units(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(FAMILIES, (wrong,))
    assert main(['validate', '--out', str(tmp_path), '--json']) == 1
    result = json.loads(capsys.readouterr().out)
    assert result['passed'] is False
    assert result['checks'][0]['ours'] == pytest.approx(1.1)
    assert result['checks'][0]['unit'] == 'm'
    assert result['checks'][0]['reason'] == 'one in a hundred is counted twice'
    assert sorted(result['files']) == sorted(str(tmp_path / name) for name in FILES)


def test_a_folder_that_cannot_be_made_is_refused(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(FAMILIES, (wrong,))
    taken = tmp_path / 'taken'
    taken.write_text('')
    assert main(['validate', '--out', str(taken)]) == 2
    assert 'choose another folder' in capsys.readouterr().err
