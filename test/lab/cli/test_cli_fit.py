# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip fit`` as it is typed: files, tables, JSON and refusals."""

import json
import re
from pathlib import Path

import pytest

from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.runs.sawtooth_run import run_drive
from stickslip_ros.parameters import Parameters, load_yaml

TRUTH = {'contact.friction': 0.25, 'runner.damping': 80.0}
FREQUENCY_HZ = 2000.0
CYCLES = 400
POINTS = [(0.1, 50e-9), (0.1, 80e-9), (0.1, 140e-9), (0.2, 80e-9), (0.2, 140e-9)]
ERROR_N = (0.6e-3, -0.4e-3, -0.8e-3, 1.1e-3, 0.2e-3)
"""Errors of the points, as noise of 1 mN might be."""
FREE = ['--free', 'contact.friction,runner.damping', '--start', 'runner.damping=60']
QUICK = ['--starts', '2', '--workers', '2']


@pytest.fixture(scope='module')
def experiment(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give measured forces with their standard errors."""
    lines = ['preload_n,amplitude_m,frequency_hz,force_n,force_sigma_n']
    for (preload_n, amplitude_m), error_n in zip(POINTS, ERROR_N, strict=True):
        there = Parameters().updated({**TRUTH, 'stand.preload': preload_n})
        force_n = run_drive(there, amplitude_m, FREQUENCY_HZ, CYCLES).force_mean_n + error_n
        lines.append(f'{preload_n},{amplitude_m},{FREQUENCY_HZ},{force_n},1e-3')
    path = tmp_path_factory.mktemp('fit') / 'experiment.csv'
    path.write_text('\n'.join(lines), encoding='utf-8')
    return path


def fit(path: Path, *words: str) -> int:
    return main(['fit', str(path), *words])


def test_the_fitted_stand_runs_from_its_yaml_and_the_json_says_how_good_it_is(
    experiment, capsys, tmp_path
):
    names = 'fit.yaml', 'fit.json', 'fit.html', 'fit.png'
    yaml, text, page, picture = files = [tmp_path / name for name in names]
    words = [each for file in files[:3] for each in ('-o', str(file))]
    words += ['--figure', str(picture), '--json']
    assert fit(experiment, *FREE, *QUICK, *words) == 0
    result = json.loads(capsys.readouterr().out)
    assert json.loads(text.read_text(encoding='utf-8')) == result
    assert [one['name'] for one in result['estimates']] == list(TRUTH)
    for one, truth in zip(result['estimates'], TRUTH.values(), strict=True):
        assert abs(one['value'] - truth) < 3.0 * one['standard_error']
    assert (result['dof'], result['starts'], len(result['points'])) == (3, 2, 5)
    assert 0.0 < result['p_value'] < 1.0
    stand = load_yaml(yaml)
    assert stand.contact.friction == result['estimates'][0]['value']
    assert stand.changed() == result['parameters']
    written = yaml.read_text(encoding='utf-8')
    told = re.search(r'# contact.friction: (\S+) ± ', written)
    assert told is not None
    assert float(told[1]) == pytest.approx(stand.contact.friction, rel=1e-3)
    assert '# The experiments differ in stand.preload: the file has the values of' in written
    assert picture.read_bytes().startswith(b'\x89PNG')
    shown = page.read_text(encoding='utf-8')
    assert f'<td>contact.friction</td><td>{stand.contact.friction:.4g}</td>' in shown
    assert '<img src="data:image/svg+xml;base64,' in shown


def test_the_tables_show_errors_and_their_basis(experiment, capsys):
    assert fit(experiment, *FREE, '--starts', '1') == 0
    shown = ' '.join(capsys.readouterr().out.split())
    for words in (
        'std error',
        'per degree of freedom',
        'searches 1',
        'The fit holds. Errors: from the standard errors of the points; intervals of the normal',
    ):
        assert words in shown


def test_a_list_that_is_typed_in_two_options_is_that_of_one(experiment, capsys):
    words = [
        '--free',
        'contact.friction',
        '--free',
        'runner.damping',
        '--start',
        'runner.damping=60',
    ]
    assert fit(experiment, *words, '--starts', '1', '--json') == 0
    result = json.loads(capsys.readouterr().out)
    assert result['names'] == list(TRUTH)
    assert fit(experiment, *words, '--preload', '0.1', '--preload', '0.2') == 2
    assert 'number of preloads 2 is above the number of tables, 1' in capsys.readouterr().err


def test_a_fit_that_misses_its_points_ends_with_1_and_shows_no_errors(
    experiment, capsys, tmp_path
):
    sure = tmp_path / 'sure.csv'
    text = experiment.read_text(encoding='utf-8').replace(',1e-3', ',1e-5')
    sure.write_text(text, encoding='utf-8')
    assert fit(sure, *FREE, '--starts', '1') == 1
    shown = ' '.join(capsys.readouterr().out.split())
    assert 'The fit does not hold, so no errors are given: the numbers are missed by more' in shown
    assert '±' not in shown


@pytest.mark.parametrize(
    ('words', 'said'),
    [
        (['--start', 'runner.mass=3g'], "--start 'runner.mass' is not free; add it to --free"),
        (['--known', 'runner.mass=3g+-1%'], "--known 'runner.mass' is not free; add it"),
        (['--assume', 'contact.friction=+-1%'], 'of a free parameter; leave it out, or use'),
        (['--assume', 'contact.radius=1mm'], "'1mm' is not VALUE+-SHARE%; write contact.radius="),
        (['--bounds', 'runner.mas=1:2'], 'did you mean runner.mass'),
        (['--bounds', 'contact.friction=0.1'], "bounds of contact.friction '0.1' is not LOW:HIGH"),
        (['--bounds', 'contact.friction'], 'is not an assignment; write --bounds NAME=LOW:HIGH'),
        (['--start', 'contact.friction'], 'is not an assignment; write --start NAME=VALUE'),
    ],
)
def test_what_is_typed_of_a_parameter_is_refused_before_anything_is_read(words, said, capsys):
    assert fit(Path('none.csv'), '--free', 'contact.friction', *words) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert said in line


def test_ctrl_c_says_how_far_the_fit_came_and_ends_with_130(experiment, capsys, monkeypatch):
    def pressed(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr('stickslip_ros.lab.fitting.search.search', pressed)
    assert fit(experiment, *FREE, '--starts', '1') == 130
    assert 'stopped after 0 of 1 searches, ' in capsys.readouterr().err
