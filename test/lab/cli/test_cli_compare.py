# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""`stickslip compare` as it is typed, and as docs/howto/compare.md shows it."""

import html
import json
import re
import shlex
from pathlib import Path
from typing import Any

import pytest
from pages import blocks_of, commands_of

from stickslip_ros.lab.cli.main import build_parser, main
from stickslip_ros.lab.measurements.vocabulary import POINT_COLUMNS, TIME_COLUMNS
from stickslip_ros.parameters import SENSORS

HOWTO = Path(__file__).resolve().parents[3] / 'docs/howto'
PAGE = (HOWTO / 'compare.md').read_text(encoding='utf-8')
DIGITS = 0.05
"""Of a number that the page gives to three digits; the machine may round another way."""


@pytest.fixture
def example(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Go where the experiment of the page is."""
    monkeypatch.chdir(tmp_path)
    [table] = blocks_of(HOWTO / 'compare.md', 'csv')
    (tmp_path / table.file).write_text(table.text, encoding='utf-8')
    return tmp_path


def test_the_commands_of_the_page_work_and_give_its_numbers(capsys: Any, example: Path):
    told = []
    for block in blocks_of(HOWTO / 'compare.md', 'sh'):
        for command in commands_of(block):
            assert main(shlex.split(command)[1:]) == 0
            told.append(capsys.readouterr().out)
    printed = ''.join(told[:2])
    found = [float(each) for each in re.findall(r'Chi-square of the force is ([\d.]+)', printed)]
    claim = re.search(
        r'chi-square is ([\d.]+) for 10 degrees of freedom, for smooth contacts (\d+)', PAGE
    )
    assert claim
    assert found == pytest.approx([float(each) for each in claim.groups()], rel=DIGITS)
    files = {'rough.html', 'smooth.html', 'window.png', 'one.mcap', 'other.mcap'}
    assert files <= {path.name for path in example.iterdir()}


def test_the_page_of_data_documents_every_column_of_an_experiment_file():
    page = (HOWTO / 'bring_your_data.md').read_text(encoding='utf-8')
    optional = {each.quantity for each in SENSORS if each.switch}
    for name in {**POINT_COLUMNS, **TIME_COLUMNS}:
        if optional & {name, name.replace('_sigma_', '_')}:
            continue
        if '_sigma_' not in name and name != 'row':  # that of a loop is counted
            assert f'`{name}`' in page
    assert {'force_sigma_n', 'speed_sigma_m_per_s'} <= {*POINT_COLUMNS, *TIME_COLUMNS}
    assert 'as `force_sigma_n` or `speed_sigma_m_per_s`' in page


def test_the_page_defines_every_number_of_the_table(capsys: Any, example: Path):
    assert main(['compare', 'experiment.csv', 'model', '--steps', '20']) == 0
    table = capsys.readouterr().out.partition('0-amplitude (nm)')[0]
    names = re.findall(r'^([A-Za-z].*?)   +\S', table, re.MULTILINE)
    assert {'points', 'bias (mean)', 'RMS', 'correlation', 'chi-square', 'p-value'} <= set(names)
    assert '**0-amplitude**' in PAGE
    assert '**Largest force**' in PAGE


def test_the_json_is_the_whole_tree_in_si_units(capsys: Any, example: Path):
    words = ('--steps', '20', '--set', 'contact.friction=0.2', '--json')
    assert main(['compare', 'experiment.csv', 'model', *words]) == 0
    out, err = capsys.readouterr()
    assert err == ''
    told = json.loads(out)
    keys = 'a b axis differences alignment quantities steps window_s'
    assert told.keys() == set(keys.split())
    assert told['a']['kind'] == 'experiment by amplitude'
    assert told['a']['notes'] == ['rough stand at 1 kHz, noise of 2 mN']
    assert told['b']['changed'] == {'contact.friction': 0.2}
    [force] = told['quantities']
    assert (force['name'], force['unit'], force['left_out']) == ('force_n', 'N', 0)
    assert force['agreement']['chi_square']['degrees_of_freedom'] == 10
    [low, high] = force['parts']
    assert (low['at'], high['at']) == ({'preload_n': 0.1}, {'preload_n': 0.5})
    assert low['curve']['amplitude_m'] == [3e-8, 4e-8, 7e-8, 1.1e-7, 1.5e-7]
    assert low['curve']['sigma'] == [0.002] * 5
    assert high['threshold_a']['saturation'] == 0.1597


def test_the_report_tells_its_command(capsys: Any, example: Path):
    (example / 'pages').mkdir()
    words = ['compare', 'experiment.csv', 'model', '--steps', '20', '--frequency', '500']
    words += ['--set', 'record.name=a b.mcap', '--output', 'pages/page.html']
    assert main(words) == 0
    assert 'report pages/page.html' in capsys.readouterr().out
    page = (example / 'pages/page.html').read_text(encoding='utf-8')
    command = re.search(r'<pre>(.*?)</pre>', page)
    assert command
    typed = shlex.split(html.unescape(command[1]))
    parsed = build_parser().parse_args(typed[1:])
    assert parsed == build_parser().parse_args(words)


def test_a_missing_0_amplitude_has_its_reason_below_the_table(capsys: Any, example: Path):
    head = 'preload (N),amplitude (nm),force (mN)'
    Path('one.csv').write_text(f'{head}\n0.5,160,30\n')
    assert main(['compare', 'one.csv', 'one.csv']) == 0
    reason = 'strokes with 10 to 50 % of the largest force: 0; give 2'
    assert f'0.5 N, A: {reason}\n0.5 N, B: {reason}\n' in capsys.readouterr().out


def test_two_runs_say_what_differs(capsys: Any, example: Path):
    for name, preload, mass in (('one', '0.25', '0.003'), ('two', f'{1 / 3}', '0.0030000000001')):
        words = ('--preload', preload, '--voltage', '200', '--steps', '5', '-o', f'{name}.mcap')
        assert main(['simulate', *words, '--set', f'runner.mass={mass}']) == 0
    capsys.readouterr()
    assert main(['compare', 'one.mcap', 'two.mcap', '--align']) == 0
    out = capsys.readouterr().out
    assert re.search(r'stand\.preload   0\.25 N +0\.33333 N\n', out)
    assert re.search(r'runner\.mass +0\.003 +0\.0030000000001\n', out)
    assert 'The times of B were shifted by' in out
    assert main(['compare', 'one.mcap', 'experiment.csv', 'model']) == 2
    told = capsys.readouterr().err
    assert 'one.mcap: is a recording next to other sources' in told
    assert 'give it alone' in told
    assert main(['compare', 'one.mcap', 'model']) == 0
    capsys.readouterr()
    assert main(['compare', 'one.mcap', 'one.mcap', '--json']) == 0
    told = json.loads(capsys.readouterr().out)
    assert told['axis'] == 'time_s'
    assert all(each['agreement']['rms'] == 0.0 for each in told['quantities'])
    assert all(part['curve'] is None for each in told['quantities'] for part in each['parts'])


def test_a_table_that_the_model_runs_beside_is_told_once(capsys: Any, example: Path):
    words = ['--voltage', '300', '--steps', '6', '--no-load-cell', '-o', 'run.mcap']
    assert main(['simulate', *words]) == 0
    assert main(['export', 'run.mcap', '-o', 'run.csv']) == 0
    capsys.readouterr()
    assert main(['compare', 'run.csv', 'model']) == 0
    assert capsys.readouterr().err.count('read    run.csv') == 1
