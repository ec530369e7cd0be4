# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Help comes before the long imports, and names every parameter."""

import sys

from processes import run_process

from stickslip_ros.parameters import specs

#: Calls the executable as its launcher does, then says which of the long imports it has made.
CALL = """\
import sys
from stickslip_ros.ros.start import drive
status = drive()
print('imported', sorted({'numba', 'rclpy', 'matplotlib'} & sys.modules.keys()))
sys.exit(status)
"""


def test_help_says_how_to_use_it_and_every_parameter():
    command = [sys.executable, '-c', CALL, '--help']
    ended = run_process(command)
    assert (ended.returncode, ended.stderr) == (0, '')
    assert ended.stdout.startswith('usage: drive [-h] [--stage STAGE]\n             [--ros-args ')
    assert ended.stdout.endswith('imported []\n')
    for each in specs():
        assert f'\n  {each}:=' in ended.stdout
    assert 'until Ctrl-C, SIGTERM or SIGHUP' in ended.stdout
