# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip validate`` as it is typed."""

import json

import pytest

from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.validation.references import Reference, read_references

FILES = ['validation.csv', 'validation.html']
WRONG = Reference(
    'Wrong', 'hess_factor', 'exponent=2', 2.2, 0.01, 2.2,
    'one in a hundred is counted twice', 'a [bold] ruler', 'nobody', '1',
)  # fmt: skip


@pytest.fixture
def only(monkeypatch):
    def choose(*rows):
        monkeypatch.setattr('stickslip_ros.lab.validation.self_test.read_references', lambda: rows)

    return choose


def test_all_references_are_met_and_files_are_written(capsys, tmp_path):
    assert main(['validate', '--output', str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert f'{sum(row.is_compared for row in read_references())} references, all passed' in printed
    assert 'FAIL' not in printed
    assert '3-D half-space' in printed
    assert sorted(path.name for path in tmp_path.iterdir()) == FILES


def test_a_wrong_parameter_fails_with_status_1(capsys, monkeypatch, only, tmp_path):
    only(*(row for row in read_references() if row.quantity == 'rough_prefactor_1d'))
    monkeypatch.setattr('stickslip_ros.contact.roughness.POHRT_POPOV', 1.95)
    assert main(['validate', '--output', str(tmp_path)]) == 1
    printed = ' '.join(capsys.readouterr().out.split())
    assert 'FAIL rough_prefactor_1d of rms_height_m=1.1221e-06, hurst=0.7' in printed
    assert '3 references, 3 failed' in printed


def test_a_failure_says_against_what_and_what_error_was_expected(capsys, only, tmp_path):
    only(WRONG)
    assert main(['validate', '--output', str(tmp_path)]) == 1
    printed = ' '.join(capsys.readouterr().out.split())
    assert 'FAIL hess_factor of exponent=2: 2, not 2.2 (a [bold] ruler, nobody); ' in printed
    assert 'error 0.091 above 0.01: one in a hundred is counted twice' in printed


def test_the_json_has_every_reference_in_si_units(capsys, only, tmp_path):
    only(WRONG)
    assert main(['validate', '--output', str(tmp_path), '--json']) == 1
    result = json.loads(capsys.readouterr().out)
    assert result['passed'] is False
    [row] = result['checks']
    assert (row['ours'], row['reference'], row['unit']) == (pytest.approx(2.0), 2.2, '')
    assert row['why'] == 'one in a hundred is counted twice'
    assert sorted(result['files']) == sorted(str(tmp_path / name) for name in FILES)
