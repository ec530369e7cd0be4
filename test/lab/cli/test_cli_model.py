# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Verbs that ask the model, as they are typed: contact, bode, optimise, figures and validate."""

import json
import re
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from evidence.published import CONTACTS

from stickslip_ros.lab.cli.main import build_parser, main
from stickslip_ros.lab.cli.optimise import chosen_search, play_command
from stickslip_ros.lab.design.objectives import WaveGoal
from stickslip_ros.lab.design.search import WaveSearch
from stickslip_ros.lab.design.waves import PeriodicWave
from stickslip_ros.lab.runs import batch
from stickslip_ros.lab.validation.references import Reference, read_references
from stickslip_ros.parameters import Parameters

RELATIVE = 1e-5
"""The reference has six digits, or five behind the point; of the stiffness it has four."""
FRACTIONS = '0.1,0.25,0.5,0.75,0.9'
FRICTION = 0.3
KEYS = {
    'indentation_m', 'contact_radius_m', 'max_presliding_m', 'stick_stiffness_n_per_m',
    'effective_modulus_pa', 'effective_shear_modulus_pa',
}  # fmt: skip


def contact(capsys: Any, *words: str) -> dict[str, Any]:
    assert main(['contact', *words, '--json']) == 0
    return json.loads(capsys.readouterr().out)


def test_figures_and_curve_are_those_of_the_specification(capsys: Any):
    figures: Any = CONTACTS[0]
    case, depth, radius, presliding, stiffness, ratios = figures
    force_n = case['force_n']
    profile = ('--set', f'contact.profile={case["profile"]}')
    words = ('--normal-force', str(force_n), *profile, '--curve', FRACTIONS)
    seen = contact(capsys, *words)
    assert seen.keys() == KEYS | {'tangential_force_n'}
    assert seen['indentation_m'] == pytest.approx(float(depth) * 1e-9, rel=RELATIVE)
    assert seen['contact_radius_m'] == pytest.approx(float(radius) * 1e-6, rel=RELATIVE)
    assert seen['max_presliding_m'] == pytest.approx(float(presliding) * 1e-9, rel=RELATIVE)
    if stiffness:
        stick = pytest.approx(float(stiffness) * 1e6, rel=1e-4)
        assert seen['stick_stiffness_n_per_m'] == stick
    found = [each / (FRICTION * force_n) for each in seen['tangential_force_n']]
    assert found == pytest.approx([float(each) for each in ratios], rel=0.0, abs=0.5e-5)


def test_the_table_shows_the_same_figures_in_readable_units(capsys: Any):
    assert main(['contact', '--normal-force', '0.353553', '--curve', '0.5']) == 0
    shown = capsys.readouterr().out
    assert '263.21' in shown
    assert '95.885' in shown
    assert 'tangential force at 0.5 u_max' in shown
    assert 'N/um' in shown


pytestmark = pytest.mark.usefixtures('compiled_kernels')


def test_bode_measures_writes_and_draws(capsys: Any, tmp_path: Path):
    table, picture = tmp_path / 'bode.csv', tmp_path / 'bode.png'
    words = ['--frequency', '1000:5000:3', '--at-voltage', '60', '--preload', '0.25']
    assert main(['bode', *words, '-o', str(table), '--figure', str(picture), '--json']) == 0
    told = json.loads(capsys.readouterr().out)
    assert told['at_voltage_v'] == 60.0
    assert told['largest_deviation'] < 0.01
    assert [row['frequency_hz'] for row in told['rows']] == [1000.0, 3000.0, 5000.0]
    written = pd.read_csv(table, comment='#', float_precision='round_trip')
    assert written.to_dict('records') == told['rows']
    assert picture.read_bytes().startswith(b'\x89PNG')


def test_without_frequencies_bode_looks_around_the_resonance(capsys: Any):
    assert main(['bode', '--no-load-cell', '--json']) == 0
    told = json.loads(capsys.readouterr().out)
    hertz = [row['frequency_hz'] for row in told['rows']]
    assert told['cell_n_per_m'] == 0.0
    assert hertz[0] < 0.1 * told['resonance_hz'] < 2.0 * told['resonance_hz'] < hertz[-1]
    assert main(['bode', '--frequency', '20000']) == 0
    shown = capsys.readouterr().out
    assert 'resonance of the runner' in shown
    assert 'deviation' not in shown  # nothing below the resonance


STAND = Parameters()
SHORT = ['--evaluations', '6', '--knots', '6', '--workers', '1']


def test_it_writes_a_wave_that_simulate_plays_with_the_same_force(capsys: Any, tmp_path: Path):
    wave = tmp_path / 'wave.csv'
    words = ['optimise', 'force', *SHORT, '-o', str(wave), '--json']
    assert main(words) == 0
    told = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)  # no NaN
    assert told['file'] == str(wave)
    assert set(told['shapes']) > {'sawtooth', 'freeze-and-kick', 'spline', 'sawtooth, plain'}
    assert main(['simulate', '--waveform', str(wave), '--json']) == 0
    played = json.loads(capsys.readouterr().out)
    best = told['shapes'][told['best']]
    assert played['force_net_n'] == pytest.approx(best['value'], rel=0.01)
    assert played['steady']


def test_what_it_finds_is_a_table_with_the_command_that_plays_it(capsys: Any, tmp_path: Path):
    wave = tmp_path / 'wave.csv'
    assert main(['optimise', 'speed', *SHORT, '--preload', '0.4:0.5', '-o', str(wave)]) == 0
    shown = capsys.readouterr().out
    for said in ('freeze-and-kick', 'cycloid', 'errors of the integration'):
        assert said in shown
    assert f'simulate --waveform {wave}' in shown


def test_a_stopped_search_writes_its_best_wave(capsys, tmp_path, monkeypatch):
    wave = tmp_path / 'wave.csv'
    words = ['optimise', 'speed', *SHORT, '-o', str(wave)]
    looks: list[int] = []

    def stop_after_a_while() -> None:
        looks.append(1)
        if len(looks) > 1:
            raise KeyboardInterrupt

    monkeypatch.setattr(batch, 'stop_if_asked', stop_after_a_while)
    assert main(words) == 130
    assert 'best wave so far in' in capsys.readouterr().err
    assert wave.read_text().startswith('time_s,voltage_v\n0.0,0.0\n')


def test_a_wave_is_played_as_it_was_judged():
    plain, path = PeriodicWave('sawtooth', {}, 300.0, 1000.0, 0.5), Path('w')
    changes = {'load_cell.contact': 'one_sided', 'load_cell.gap': 1e-3}
    stand = STAND.updated(changes)
    command = 'stickslip simulate --waveform w --preload 0.5'
    assert play_command(WaveGoal('force'), STAND, plain, path) == command
    free = f'{command} --set load_cell.contact=absent'
    assert play_command(WaveGoal('speed'), STAND, plain, path) == free
    gap = f'{command} --set load_cell.gap=0.0'
    assert play_command(WaveGoal('force'), stand, plain, path) == gap


def test_without_options_optimise_is_the_search_of_the_library():
    parsed = build_parser(['optimise']).parse_args(['optimise', 'force', '-o', 'wave.csv'])
    expected = WaveSearch(WaveGoal('force'), STAND, (1000.0, 1000.0), (0.5, 0.5))
    assert chosen_search(parsed) == expected


TWO_POINTS = ['figures', '--points', '2']


def test_the_json_has_rows_and_files_of_the_chosen_figures(capsys, tmp_path):
    words = ['--output', str(tmp_path), '--only', 'fig2,fig7', '--workers', '2', '--json']
    assert main([*TWO_POINTS, *words]) == 0
    result = json.loads(capsys.readouterr().out)
    assert list(result) == ['fig2', 'fig7']
    assert result['fig2']['files'] == [
        str(tmp_path / f'fig2.{kind}') for kind in ('csv', 'md', 'png', 'svg')
    ]
    full = result['fig2']['rows'][1]
    assert (full['preload_n'], full['amplitude_m']) == (0.1, 160e-9)
    assert full['force_mean_n'] == pytest.approx(0.061, rel=0.01)
    assert result['fig7']['rows'][0]['zero_steps_m'] == pytest.approx(26e-9, abs=3e-9)
    assert main([*TWO_POINTS, '--output', str(tmp_path / 'new'), '--only', 'fig6b']) == 0
    assert re.search('fig6b(.|\n)*folder', capsys.readouterr().out)
    assert (tmp_path / 'new' / 'fig6b.png').stat().st_size > 0


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


def test_references_are_met_and_files_are_written(capsys, only, tmp_path):
    rows = [row for row in read_references() if row.family == '3-D half-space']
    only(*rows)
    assert main(['validate', '--output', str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert f'{len(rows)} references, all passed' in printed
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
    assert main(['validate', '--output', str(tmp_path), '--json']) == 1
    result = json.loads(capsys.readouterr().out)
    assert result['passed'] is False
    [row] = result['checks']
    assert (row['ours'], row['reference'], row['unit']) == (pytest.approx(2.0), 2.2, '')
    assert sorted(result['files']) == sorted(str(tmp_path / name) for name in FILES)
