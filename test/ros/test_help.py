"""Help comes before the long imports, and names every parameter."""

import subprocess
import sys

import pytest

from stickslip_ros.ros.help import PROGRAMS

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


@pytest.mark.parametrize('name', PROGRAMS)
@pytest.mark.parametrize('word', ['-h', '--help'])
def test_help_says_how_to_use_it_and_every_parameter(name: str, word: str):
    command = [sys.executable, '-c', CALL, name, word]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=END_S, check=False)
    assert (ended.returncode, ended.stderr) == (0, '')
    assert ended.stdout.startswith(f'usage: {name} [-h] [--ros-args ')
    assert ended.stdout.endswith('imported []\n')
    for each in PROGRAMS[name][1]:
        assert f'\n  {each}:=' in ended.stdout
    assert 'until Ctrl-C, SIGTERM or SIGHUP' in ended.stdout
