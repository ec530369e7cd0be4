"""`stickslip simulate` and `stickslip info`: a run without ROS, and what its file says."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stickslip_ros.cli.main import main
from stickslip_ros.recording.reader import Recording

KEYS = {
    'preload_n',
    'voltage_v',
    'amplitude_m',
    'frequency_hz',
    'force_mean_n',
    'force_net_n',
    'force_ramp_start_n',
    'step_length_m',
    'step_scatter_m',
    'step_correlation_m',
    'steady',
    'steps',
    'simulated_s',
    'wall_s',
    'real_time_factor',
    'energy_residual',
    'recording',
}
#: What integration may lose of the work of the feet.
ENERGY = 1e-3
#: The references are given to two or three digits.
DIGITS = 0.01
#: One step length is given as slope 0.99 to 1.00 of amplitude minus a 0-amplitude of about 26 nm
#: that moves by a few nm with frequency.
FREE_STEP_TOLERANCE_M = 6e-9
STIFFNESS_N_PER_M = 1e5
AMPLITUDE = ('--amplitude', '160e-9')


def simulate(capsys: Any, *words: str) -> dict[str, Any]:
    assert main(['simulate', *words, '--json']) == 0
    out, err = capsys.readouterr()
    assert err == ''
    return json.loads(out)


@pytest.mark.parametrize(
    ('preload', 'force_n'),
    [('0.1', 61e-3), ('0.5', 172e-3), ('1.0', 224e-3)],
)
def test_generated_force_is_that_of_the_reference(capsys: Any, preload: str, force_n: float):
    words = ('--preload', preload, *AMPLITUDE, '--frequency', '1000', '--steps', '200')
    seen = simulate(capsys, *words)
    assert seen.keys() == KEYS
    assert (seen['preload_n'], seen['steps'], seen['frequency_hz']) == (float(preload), 200, 1e3)
    assert seen['amplitude_m'] == pytest.approx(160e-9, rel=1e-9)
    assert seen['voltage_v'] == pytest.approx(300.0, rel=1e-9)
    assert seen['force_mean_n'] == pytest.approx(force_n, rel=3 * DIGITS)
    swing_n = STIFFNESS_N_PER_M * seen['amplitude_m']  # the foot takes the runner along
    assert abs(seen['force_ramp_start_n'] - seen['force_mean_n']) < swing_n
    following_n = seen['force_mean_n'] - seen['force_net_n']  # less than k A/2: contacts give way
    assert 0.97 * 0.5 * swing_n < following_n < 0.5 * swing_n
    assert abs(seen['energy_residual']) < ENERGY
    assert seen['simulated_s'] == pytest.approx(0.2, abs=2e-3)
    assert seen['real_time_factor'] == pytest.approx(seen['simulated_s'] / seen['wall_s'])
    assert seen['recording'] == ''


def test_a_free_runner_steps_by_amplitude_minus_the_0_amplitude(capsys: Any):
    words = ('--preload', '0.1', *AMPLITUDE, '--frequency', '200', '--steps', '120')
    seen = simulate(capsys, *words, '--no-load-cell')
    assert seen['step_length_m'] == pytest.approx(160e-9 - 26e-9, abs=FREE_STEP_TOLERANCE_M)
    assert seen['force_mean_n'] == 0.0


def test_a_run_backwards_is_the_mirror_image(capsys: Any):
    words = (*AMPLITUDE, '--steps', '30')
    forth = simulate(capsys, *words, '--frequency', '1000')
    back = simulate(capsys, *words, '--frequency=-1000')
    for key in ('force_mean_n', 'force_net_n', 'force_ramp_start_n', 'step_length_m'):
        assert back[key] == pytest.approx(-forth[key], rel=1e-6)


def test_without_steps_it_runs_until_the_force_is_steady(capsys: Any):
    seen = simulate(capsys, '--preload', '0.1', '--amplitude', '100e-9')
    assert seen['steady'] is True
    assert 200 <= seen['steps'] < 5000
    assert seen['frequency_hz'] == 1000.0


def test_few_steps_are_not_steady(capsys: Any):
    seen = simulate(capsys, *AMPLITUDE, '--steps', '20')
    assert (seen['steady'], seen['steps']) == (False, 20)


def test_voltage_and_amplitude_are_two_words_for_one_thing(capsys: Any):
    by_voltage = simulate(capsys, '--voltage', '300', '--steps', '20')
    by_amplitude = simulate(capsys, *AMPLITUDE, '--steps', '20')
    assert by_voltage['force_mean_n'] == pytest.approx(by_amplitude['force_mean_n'], rel=1e-6)


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
    assert told.keys() == {'topics', 'changed_parameters', 'run', 'attachments'}
    assert told['changed_parameters'] == {'stand.preload': 0.25, 'load_cell.contact': 'absent'}
    topics = {topic['topic']: topic for topic in told['topics']}
    blocks = round(seen['simulated_s'] * 1e3)
    assert topics['/position']['messages'] == topics['/force']['messages'] == blocks
    assert topics['/position']['rate_hz'] == pytest.approx(1000.0)
    assert topics['/position']['type_name'] == 'geometry_msgs/msg/PointStamped'
    assert topics['/command/sawtooth']['messages'] == 1
    assert {topic['gaps'] for topic in told['topics']} == {0}
    assert told['run']['seed'] == '1'
    assert told['attachments'].keys() == {'parameters.yaml'}


def test_the_recorded_trace_is_whole(capsys: Any, tmp_path: Path):
    file = tmp_path / 'run.mcap'
    seen = simulate(capsys, *AMPLITUDE, '--steps', '30', '-o', str(file))
    trace = Recording(file).trace()
    assert np.diff(trace['position'].time_s) == pytest.approx(1.0 / 50e3, rel=1e-6)
    assert len(trace['voltage']) == round(seen['simulated_s'] * 50e3)


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


@pytest.mark.parametrize(
    ('words', 'message'),
    [
        (('--amplitude', '161e-9'), 'amplitude 1.61e-07 m is above the 1.6e-07 m'),
        (('--amplitude', 'nan'), "--amplitude 'nan' is not a finite number in m"),
        (('--amplitude', '0'), 'amplitude 0 V is not above 0 V'),
        (
            ('--voltage', '301'),
            (
                "amplitude 301 V is above the amplifier's 300 V; "
                'lower it or raise amplifier.voltage_max'
            ),
        ),
        (('--voltage', '300', '--frequency', '0'), 'frequency 0 Hz is not a frequency'),
        (('--voltage', '300', '--frequency', '30e3'), 'frequency 30000 Hz is above'),
        (('--voltage', '300', '--steps', '-1'), 'steps -1 is not a whole number'),
        (('--voltage', '300', '--preload', '-1'), 'stand.preload -1 N is below'),
    ],
)
def test_bad_requests_are_refused(capsys: Any, words: tuple[str, ...], message: str):
    assert main(['simulate', *words]) == 2
    out, err = capsys.readouterr()
    assert out == ''
    assert err.startswith('stickslip: ')
    assert message in err


@pytest.mark.parametrize('words', [(), (*AMPLITUDE, '--voltage', '300')])
def test_exactly_one_of_amplitude_and_voltage_is_wanted(capsys: Any, words: tuple[str, ...]):
    with pytest.raises(SystemExit) as ended:
        main(['simulate', *words])
    assert ended.value.code == 2
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


def test_an_existing_recording_is_kept(capsys: Any, tmp_path: Path):
    file = tmp_path / 'run.mcap'
    file.write_bytes(b'mine')
    assert main(['simulate', *AMPLITUDE, '--steps', '5', '-o', str(file)]) == 2
    assert 'is not overwritten' in capsys.readouterr().err
    assert file.read_bytes() == b'mine'
