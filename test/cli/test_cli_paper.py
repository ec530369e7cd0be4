"""``stickslip roughness``, ``laws`` and ``figures`` as they are typed."""

import json
from pathlib import Path

import pytest

from stickslip_ros.cli.main import main
from stickslip_ros.parameters import specs

COARSE = ['--set', 'contact.line_points=16384', '--set', 'contact.cutoff_upper=2e7']
ROUGHNESS = ['roughness', *COARSE]
RATIOS = ('normal_force', 'max_displacement', 'stiffness')
ROUNDING = 1e-9
"""Sums over the points of a grid."""
RING_FIT = 0.005
"""The spectrum of a surface is averaged over rings, the first ones of which are wide."""


def printed(capsys, *words: str) -> dict:
    assert main([*ROUGHNESS, *words, '--json']) == 0
    return json.loads(capsys.readouterr().out)


def test_the_json_has_rms_exponents_and_ratios_with_units_in_the_names(capsys, tmp_path):
    result = printed(
        capsys, '--output', str(tmp_path), '--realisations', '3', '--set', 'contact.line_seed=7'
    )
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
    assert main([*ROUGHNESS, '--output', str(tmp_path), '--realisations', '2']) == 0
    text = capsys.readouterr().out
    assert 'rms (um)' in text
    assert 'springs' in text
    assert f'picture {tmp_path}' in text


VARIANTS = {*specs()['contact.profile'].choices, *specs()['contact.law'].choices} - {'mdr'}


def test_every_variant_is_run_at_every_preload_and_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    assert main(['laws', '--output', str(tmp_path), '--points', '1', '--json']) == 0
    points = json.loads(capsys.readouterr().out)['points']
    assert {point['variant'] for point in points} == VARIANTS
    assert len(points) == 3 * len(VARIANTS)
    # No law generates more than friction allows, and the full stroke always generates force.
    assert all(0.0 < p['force_mean_n'] <= 0.8486 * p['preload_n'] for p in points)
    force_n = {(p['variant'], p['preload_n']): p['force_mean_n'] for p in points}
    assert all(force_n['rough', n] < force_n['smooth', n] for n in (0.1, 0.5, 1.0))
    assert (tmp_path / 'laws.csv').read_text().count('\n') == 1 + len(points)
    assert (tmp_path / 'laws.png').read_bytes().startswith(b'\x89PNG')
    assert 'c = 0 N s/m' in (tmp_path / 'laws.md').read_text()


TWO_POINTS = ['figures', '--points', '2']
FIG2 = [*TWO_POINTS, '--only', 'fig2']


def test_the_json_has_rows_and_files_of_the_chosen_figures(capsys, tmp_path):
    words = ['--output', str(tmp_path), '--only', 'fig2,slew', '--workers', '2', '--json']
    assert main([*TWO_POINTS, *words]) == 0
    result = json.loads(capsys.readouterr().out)
    assert list(result) == ['fig2', 'slew']
    assert result['fig2']['files'] == [
        str(tmp_path / f'fig2.{kind}') for kind in ('csv', 'md', 'png', 'svg')
    ]
    full = result['fig2']['rows'][1]
    assert (full['preload_n'], full['amplitude_m']) == (0.1, 160e-9)
    assert full['force_mean_n'] == pytest.approx(0.061, rel=0.01)
    assert None in [row['zero_steps_m'] for row in result['slew']['rows']]


def test_the_table_names_the_figures_and_the_folder(capsys, tmp_path):
    assert main([*TWO_POINTS, '--output', str(tmp_path / 'new'), '--only', 'fig6b']) == 0
    text = capsys.readouterr().out
    assert 'fig6b' in text
    assert 'folder' in text
    assert (tmp_path / 'new' / 'fig6b.png').stat().st_size > 0


def test_parameters_are_taken_and_named_in_the_caption(tmp_path):
    words = ['--output', str(tmp_path), '--only', 'fig2', '--set', 'runner.damping=80']
    assert main([*TWO_POINTS, *words]) == 0
    assert 'damping c = 80 N s/m' in (tmp_path / 'fig2.md').read_text(encoding='utf-8')


@pytest.mark.parametrize(
    ('words', 'message'),
    [
        ([*ROUGHNESS, '--realisations', '1'], 'number of realisations 1 is below 2'),
        (
            [*ROUGHNESS, '--set', 'contact.cutoff_lower=1e8'],
            'upper cut-off 2e+07 rad/m is not above',
        ),
        (
            [*ROUGHNESS, '--set', 'contact.line_length=1e-4'],
            'lower cut-off 6283.19 rad/m is below 62831.9',
        ),
        (
            [*ROUGHNESS, '--set', 'contact.prefactor=1e-3'],
            'contact.prefactor 0.001 m^(1-H) is without effect',
        ),
        (
            [*ROUGHNESS, '--set', 'contact.line_seed=-1'],
            'contact.line_seed -1 is below the minimum 0; raise it',
        ),
        ([*FIG2, '--only', 'fig9'], "figure 'fig9' is not known; use fig2, fig6a, fig6b, fig7"),
        ([*FIG2, '--points', '1'], 'points 1 is below 2'),
        ([*FIG2, '--workers', '-1'], 'number of workers -1 is not from 0'),
        ([*FIG2, '--set', 'runner.damping=-1'], 'runner.damping -1 N s/m is below the minimum 0'),
        ([*FIG2, '--only', ''], "figure '' is not known; use fig2"),
        (['laws', '--points', '0'], '--points 0 is below 1; give the number of'),
    ],
)
def test_what_does_not_fit_is_refused_with_status_2(capsys, tmp_path, words, message):
    assert main([*words, '--output', str(tmp_path)]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
