# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Without ROS 2, what needs it is refused in one line, and all else works."""

from pathlib import Path

import pytest
from test_without_lab import REFUSES, STICKSLIP, environment_without, run_there

from stickslip_ros.extras import ROS_MODULES

REMEDY = (
    "is missing; source its setup.bash, or take the wheels: pip install 'stickslip_ros[jazzy]'"
)
DRIVE = 'import sys; from stickslip_ros.ros.start import drive; sys.exit(drive())'
ALL_OF = """
import sys
from pathlib import Path
from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.panel import server  # noqa: F401
from stickslip_ros.lab.panel.player import Player
for each in sys.argv[1:]:
    assert main(each.split()) == 0
print('panel:', Player(Path('run.mcap')).overview()['name'])
"""


@pytest.fixture(scope='module')
def packages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give a folder with what is installed here, but for ROS."""
    return environment_without(ROS_MODULES, tmp_path_factory.mktemp('without_ros') / 'packages')


@pytest.mark.parametrize(
    ('program', 'words', 'start'),
    [
        (DRIVE, (), 'drive: the drive needs ROS 2, but '),
        (STICKSLIP, ('drive',), 'stickslip: stickslip drive needs ROS 2, but '),
    ],
)
def test_what_needs_ros_is_refused_in_one_line(packages, program, words, start):
    done = run_there(packages, program, *words)
    assert (done.returncode, done.stdout) == (2, '')
    [line] = done.stderr.splitlines()
    assert line.startswith(start)
    assert line.endswith(REMEDY)


def test_every_verb_that_needs_ros_is_refused_in_one_line(packages: Path):
    verbs = ('command voltage 10V', 'demo', 'panel', 'twin')
    done = run_there(packages, REFUSES, *verbs)
    assert (done.returncode, done.stdout) == (0, '')
    for line, verb in zip(done.stderr.splitlines(), verbs, strict=True):
        assert line.startswith(f'stickslip: stickslip {verb.split()[0]} needs ROS 2, but ')
        assert line.endswith(REMEDY)


def test_an_import_says_the_remedy_and_can_be_passed_over(packages: Path):
    done = run_there(packages, 'import stickslip_ros.testing')
    assert done.stderr.splitlines()[-1].endswith(REMEDY)
    passed_over = 'try: import stickslip_ros.testing\nexcept ImportError: print("none")'
    assert run_there(packages, passed_over).stdout == 'none\n'


def test_help_needs_none(packages: Path):
    assert run_there(packages, DRIVE, '--help').stdout.startswith('usage: drive ')


@pytest.mark.usefixtures('compiled_kernels')
def test_simulation_comparison_fit_and_the_panel_of_a_recording_need_none(packages: Path):
    verbs = (
        'simulate --voltage 100 --steps 20 -o run.mcap',
        'export run.mcap -o run.csv',
        'compare run.csv run.mcap',
        'fit run.csv --free contact.friction --starts 1 --window 8ms@4ms',
    )
    done = run_there(packages, ALL_OF, *verbs)
    assert (done.returncode, done.stdout.splitlines()[-1]) == (0, 'panel: run.mcap'), done.stderr
