"""Help and refusals that need no ROS come before the long imports, and refuse nothing else."""

import subprocess
import sys
from pathlib import Path

import pytest

from stickslip_ros.parameters import Parameters, dump_yaml
from stickslip_ros.ros.command_line import CONTROLLER, DRIVE, Program, help_or_refuse, of_verb

#: Calls an executable as its launcher does, then says which of the long imports it has made.
CALL = """\
import sys
name, *sys.argv[1:] = sys.argv[1:]
from stickslip_ros import entry
status = getattr(entry, name)()
print('imported', sorted({'numba', 'rclpy', 'matplotlib'} & sys.modules.keys()))
sys.exit(status)
"""
END_S = 60.0


def call(*words: str) -> subprocess.CompletedProcess[str]:
    """Call an entry by its name, with the words behind it."""
    command = [sys.executable, '-c', CALL, *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=END_S, check=False)


@pytest.mark.parametrize('program', [DRIVE, CONTROLLER], ids=lambda program: program.name)
@pytest.mark.parametrize('word', ['-h', '--help'])
def test_help_says_how_to_use_it_and_every_parameter(program: Program, word: str):
    ended = call(program.name, word)
    assert (ended.returncode, ended.stderr) == (0, '')
    assert ended.stdout.startswith(f'usage: {program.name} [-h] [--ros-args ')
    assert ended.stdout.endswith('imported []\n')
    for name in program.declared:
        assert f'\n  {name}:=' in ended.stdout
    assert 'until Ctrl-C or SIGTERM' in ended.stdout


@pytest.mark.parametrize(
    ('words', 'line'),
    [
        (
            ('drive', '--ros-args', '-p', 'stand.preload:=101.0'),
            'drive: stand.preload 101 N is above the maximum 100 N; lower it',
        ),
        (
            ('drive', '--ros-args', '-p', 'sim.block:=1.5e-5'),
            'drive: sim.block 1.5e-05 s is below the minimum 0.0001 s; raise it',
        ),
        (
            ('position_controller', '--ros-args', '-p', 'lockstep:=2'),
            'position_controller: lockstep 2 is not true or false; write true or false',
        ),
        (
            ('stickslip', 'drive', '--set', 'stand.preload=101'),
            'stickslip: stand.preload 101 N is above the maximum 100 N; lower it',
        ),
        (
            ('stickslip', 'drive', '--ros-args', '-p', 'contact.law:=newton'),
            (
                "stickslip: contact.law 'newton' is not one of the choices; "
                'use mdr, coulomb, dahl, lugre, epm'
            ),
        ),
    ],
)
def test_a_refused_parameter_is_told_before_the_long_imports(words: tuple[str, ...], line: str):
    ended = call(*words)
    assert ended.returncode == 2
    assert ended.stderr == f'{line}\n'
    assert ended.stdout == 'imported []\n'


def test_a_parameter_file_is_looked_at(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    path = tmp_path / 'stand.yaml'
    whole = dump_yaml(Parameters(), '')
    path.write_text(whole)
    words = ('--ros-args', '--params-file', str(path))
    assert help_or_refuse(DRIVE, words) is None
    assert help_or_refuse(CONTROLLER, words) is None  # which passes over parameters of the drive
    path.write_text(whole.replace('mass: 0.003', 'mass: -1.0'))
    for each in (words, of_verb(('--params', str(path)))):
        assert help_or_refuse(DRIVE, each) == 2
        assert 'runner.mass -1 kg is below the minimum' in capsys.readouterr().err
    path.write_text('no: [parameter file')
    assert help_or_refuse(DRIVE, words) is None  # rcl says what is wrong with it


@pytest.mark.parametrize(
    'assignment',
    [
        'sim.publish_clock:=yes',
        'actuator.gain:=1e-9',
        'record.name:=2024-01-01',
        "contact.law:='mdr'",
        'use_sim_time:=true',
        'qos_overrides./position.publisher.depth:=3',
        'other_node:stand.preload:=500.0',
        'sim.seed:=0x10',
    ],
)
def test_nothing_is_refused_that_the_node_may_take(assignment: str):
    assert help_or_refuse(DRIVE, ('--ros-args', '-p', assignment)) is None


def test_the_verb_hands_its_words_over_as_ros_writes_them():
    words = ('--set', 'stand.preload=0.3', '--json', '--ros-args', '-r', '__ns:=/left')
    assert of_verb(words) == [
        '--ros-args',
        '--ros-args',
        '-r',
        '__ns:=/left',
        '-p',
        'stand.preload:=0.3',
    ]
