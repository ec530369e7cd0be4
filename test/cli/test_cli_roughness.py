"""``stickslip roughness`` as it is typed."""

import json

import pytest

from stickslip_ros.cli.main import main

QUICK = ['--set', 'contact.line_points=16384', '--set', 'contact.cutoff_upper=2e7']
RATIOS = ('normal_force', 'max_displacement', 'stiffness')
ROUNDING = 1e-9
"""Sums over the points of a grid."""
RING_FIT = 0.005
"""The spectrum of a surface is averaged over rings, the first ones of which are wide."""


def printed(capsys, *words: str) -> dict:
    assert main(['roughness', *QUICK, *words, '--json']) == 0
    return json.loads(capsys.readouterr().out)


def test_the_json_has_rms_exponents_and_ratios_with_units_in_the_names(capsys, tmp_path):
    result = printed(capsys, '--out', str(tmp_path), '--realisations', '3', '--seed', '7')
    assert result['rms_line_m'] == pytest.approx(1.1221e-6, rel=ROUNDING)
    assert result['rms_surface_m'] == pytest.approx(1.1221e-6, rel=ROUNDING)
    assert result['hurst_line'] == pytest.approx(0.7, abs=ROUNDING)
    assert result['hurst_surface'] == pytest.approx(0.7, abs=RING_FIT)
    assert (result['seed'], result['realisations'], result['springs']) == (7, 3, 16384)
    assert result['loads_n'][0] == pytest.approx(0.01)
    assert result['loads_n'][-1] == pytest.approx(1.0)
    for name in RATIOS:
        means = result[f'{name}_ratio_mean']
        assert len(means) == len(result[f'{name}_ratio_spread']) == len(result['loads_n'])
        assert min(means) <= result[f'{name}_ratio'] <= max(means)
    assert (tmp_path / 'roughness.png').stat().st_size > 0
    assert result['picture'] == str(tmp_path / 'roughness.png')


def test_the_table_names_its_columns_and_the_picture(capsys, tmp_path):
    assert main(['roughness', *QUICK, '--out', str(tmp_path), '--realisations', '2']) == 0
    text = capsys.readouterr().out
    assert 'rms (um)' in text
    assert 'springs' in text
    assert f'picture {tmp_path}' in text


@pytest.mark.parametrize(
    ('words', 'message'),
    [
        (['--realisations', '1'], 'number of realisations 1 is below 2'),
        (['--set', 'contact.cutoff_lower=1e8'], 'upper cut-off 2e+07 rad/m is not above'),
        (['--set', 'contact.line_length=1e-4'], 'lower cut-off 6283.19 rad/m is below 62831.9'),
        (['--set', 'contact.prefactor=1e-3'], 'contact.prefactor 0.001 m^(1-H) is without effect'),
        (['--seed', '-1'], 'contact.line_seed -1 is below the minimum 0; raise it'),
    ],
)
def test_what_does_not_fit_is_refused_with_status_2(capsys, tmp_path, words, message):
    assert main(['roughness', *QUICK, '--out', str(tmp_path), *words]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / 'roughness.png').exists()
