# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""`stickslip simulate` and `stickslip info`: a run without ROS, and what its file says."""

import json
import re
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from stickslip_ros.lab.cli.main import main
from stickslip_ros.recording.reader import ChannelSummary

KEYS = {
    'preload_n', 'voltage_v', 'amplitude_m', 'frequency_hz', 'force_mean_n', 'force_net_n',
    'force_ramp_start_n', 'step_length_m', 'step_scatter_m', 'step_correlation_m', 'steady',
    'steps', 'simulated_s', 'wall_s', 'real_time_factor', 'energy_residual', 'recording',
}  # fmt: skip
AMPLITUDE = ('--amplitude', '160e-9')


def simulate(capsys: Any, *words: str) -> dict[str, Any]:
    assert main(['simulate', *words, '--json']) == 0
    out, err = capsys.readouterr()
    assert err == ''
    return json.loads(out)


def test_voltage_and_amplitude_are_two_words_for_one_thing(capsys: Any):
    by_voltage = simulate(capsys, '--voltage', '300', '--steps', '20')
    assert by_voltage.keys() == KEYS
    by_amplitude = simulate(capsys, *AMPLITUDE, '--steps', '20')
    assert by_voltage['force_mean_n'] == pytest.approx(by_amplitude['force_mean_n'], rel=1e-6)


def test_both_ways_says_the_size_of_the_step_backwards(capsys: Any):
    words = (*AMPLITUDE, '--steps', '20', '--no-load-cell', '--both-ways')
    both = simulate(capsys, *words)
    assert both.keys() == {*KEYS, 'step_back_m'}
    assert both['step_back_m'] == pytest.approx(both['step_length_m'], rel=1e-6, abs=0.0)
    assert main(['simulate', *words]) == 0
    assert 'backwards   94.26' in capsys.readouterr().out
    assert main(['simulate', *words, '--frequency=-500']) == 2
    assert "wave of --both-ways '-500.0' is not a saw-tooth" in capsys.readouterr().err


def test_set_and_a_parameter_file_choose_the_stand(capsys: Any, tmp_path: Path):
    settings = tmp_path / 'stand.yaml'
    settings.write_text('/**:\n  ros__parameters:\n    stand: {preload: 0.2}\n', encoding='utf-8')
    words = (*AMPLITUDE, '--steps', '5', '--params', str(settings))
    assert simulate(capsys, *words)['preload_n'] == 0.2
    assert simulate(capsys, *words, '--set', 'stand.preload=0.3')['preload_n'] == 0.3
    both = ('--set', 'stand.preload=0.3', '--preload', '0.4')
    assert simulate(capsys, *words, *both)['preload_n'] == 0.4


def test_a_recorded_run_is_described_by_info(capsys: Any, tmp_path: Path):
    file = tmp_path / 'run.mcap'
    seen = simulate(
        capsys, '--preload', '0.25', *AMPLITUDE, '--steps', '30', '--no-load-cell', '-o', str(file)
    )
    assert seen['recording'] == str(file)
    assert main(['info', str(file), '--json']) == 0
    told = json.loads(capsys.readouterr().out)
    assert told.keys() == {'topics', 'changed_parameters', 'run', 'attachments', 'notes'}
    assert told['changed_parameters'] == {'stand.preload': 0.25, 'load_cell.contact': 'absent'}
    topics = {topic['topic']: topic for topic in told['topics']}
    blocks = round(seen['simulated_s'] * 1e3)
    assert topics['/position']['messages'] == topics['/force']['messages'] == blocks
    assert topics['/position']['rate_hz'] == pytest.approx(1000.0)
    assert topics['/position']['type_name'] == 'geometry_msgs/msg/PointStamped'
    assert topics['/command/sawtooth']['messages'] == 1
    assert {topic['gaps'] for topic in told['topics']} == {0}
    names = {each.name for each in fields(ChannelSummary)}
    assert all(topic.keys() == {*names, 'rate_hz'} for topic in told['topics'])
    assert told['run']['seed'] == '1'
    assert told['attachments'].keys() == {'parameters.yaml'}


def test_tables_are_printed_for_people(capsys: Any, tmp_path: Path):
    file = tmp_path / 'run.mcap'
    assert main(['simulate', *AMPLITUDE, '--steps', '5', '-o', str(file)]) == 0
    shown = capsys.readouterr().out
    assert 'generated force' in shown
    assert 'NOT steady' in shown
    assert main(['info', str(file)]) == 0
    shown = capsys.readouterr().out
    assert '/position' in shown
    assert 'none' in shown
    mass = ('--set', 'runner.mass=0.0006067006686656132')
    assert main(['simulate', *AMPLITUDE, *mass, '--steps', '5', '-o', f'{tmp_path}/m.mcap']) == 0
    assert main(['info', f'{tmp_path}/m.mcap']) == 0
    assert re.search(r'runner\.mass +0\.0006067 +kg', capsys.readouterr().out)


def test_a_run_that_ends_before_its_sawtooth_says_so(capsys: Any, tmp_path: Path):
    file, picture = tmp_path / 'run.mcap', tmp_path / 'run.svg'
    assert main(['simulate', *AMPLITUDE, '-o', str(file)]) == 0
    capsys.readouterr()
    assert main(['plot', str(file), '-o', str(picture)]) == 0
    why = 'the run ended before the sawtooth'
    table = ' '.join(capsys.readouterr().out.split())
    assert re.search(rf'sawtooth ABORTED 1 {why}: steady after \d+ steps', table)
    assert why in picture.read_text()
    assert main(['replay', str(file)]) == 0
    assert 'every message is identical' in capsys.readouterr().out


@pytest.mark.parametrize('words', [(), (*AMPLITUDE, '--voltage', '300')])
def test_exactly_one_of_amplitude_and_voltage_is_wanted(capsys: Any, words: tuple[str, ...]):
    assert main(['simulate', *words]) == 2
    assert '--amplitude' in capsys.readouterr().err


def test_a_waveform_of_a_table_is_played_at_a_frequency(capsys: Any, tmp_path: Path):
    table = tmp_path / 'wave.csv'
    table.write_text('time (ms),voltage (V)\n0,0\n0.998,300\n1,0\n')
    result = simulate(capsys, '--waveform', str(table), '--frequency', '500', '--steps', '210')
    assert (result['frequency_hz'], result['voltage_v'], result['steps']) == (500.0, 300.0, 210)
    assert 0.17 < result['force_mean_n'] < 0.19
    table.write_text('time (ms),voltage (V)\n0,0\n1,300\n')
    assert main(['simulate', '--waveform', str(table)]) == 2
    assert 'last waveform voltage 300 V is not the first voltage' in capsys.readouterr().err


def test_a_wave_with_columns_that_nobody_knows_is_sent_to_import(tmp_path: Path, capsys):
    (tmp_path / 'wave.csv').write_text('time (ms),CH1 (V)\n0,0\n1,5\n', encoding='utf-8')
    assert main(['simulate', '--waveform', str(tmp_path / 'wave.csv')]) == 2
    refusal = capsys.readouterr().err
    assert '--map voltage_v="... (V)" of stickslip import, and simulate its -o FILE' in refusal
