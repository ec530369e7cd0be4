# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip optimise`` as it is typed."""

import json
from pathlib import Path
from typing import Any

import pytest

from stickslip_ros.lab.cli.main import build_parser, main
from stickslip_ros.lab.cli.optimise import chosen_search, play_command
from stickslip_ros.lab.design.objectives import WaveGoal
from stickslip_ros.lab.design.search import WaveSearch
from stickslip_ros.lab.design.waves import PeriodicWave
from stickslip_ros.lab.runs import batch
from stickslip_ros.parameters import Parameters

pytestmark = pytest.mark.usefixtures('compiled_kernels')

STAND = Parameters()
SHORT = ['--evaluations', '6', '--knots', '6', '--workers', '1']


def test_it_writes_a_wave_that_simulate_plays_with_the_same_force(capsys: Any, tmp_path: Path):
    wave, picture = tmp_path / 'wave.csv', tmp_path / 'wave.png'
    words = ['optimise', 'force', *SHORT, '-o', str(wave), '--figure', str(picture), '--json']
    assert main(words) == 0
    told = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)  # no NaN
    assert told['file'] == str(wave)
    assert set(told['shapes']) > {'sawtooth', 'freeze-and-kick', 'spline', 'sawtooth, plain'}
    assert picture.read_bytes().startswith(b'\x89PNG')
    assert not list(wave.parent.glob('*.journal'))
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


def test_a_stopped_search_writes_its_best_wave_and_goes_on(
    capsys: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    wave = tmp_path / 'wave.csv'
    words = ['optimise', 'speed', *SHORT, '-o', str(wave)]
    looks: list[int] = []

    def stop_after_a_while() -> None:
        looks.append(1)
        if len(looks) > 1:
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(batch, 'stop_if_asked', stop_after_a_while)
        assert main(words) == 130
    assert 'best wave so far in' in capsys.readouterr().err
    assert wave.read_text().startswith('time_s,voltage_v\n0.0,0.0\n')
    assert main([*words, '--json']) == 0
    resumed = json.loads(capsys.readouterr().out)
    assert main([*words, '--json']) == 0
    assert json.loads(capsys.readouterr().out) == resumed


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


def test_without_options_it_is_the_search_of_the_library():
    parsed = build_parser(['optimise']).parse_args(['optimise', 'force', '-o', 'wave.csv'])
    expected = WaveSearch(WaveGoal('force'), STAND, (1000.0, 1000.0), (0.5, 0.5))
    assert chosen_search(parsed) == expected
