# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Without ROS 2, what needs it is refused in one line, and all else works."""

import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from processes import run_process

from stickslip_ros.extras import ROS_MODULES

ROOT = Path(__file__).parents[1]
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
REFUSES = """
import sys
from stickslip_ros.lab.cli.main import main
for each in sys.argv[1:]:
    assert main(each.split()) == 2
"""
STICKSLIP = 'import sys; from stickslip_ros.lab.cli.start import stickslip; sys.exit(stickslip())'


@pytest.fixture(scope='module')
def packages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give a folder with what is installed here, but for ROS."""
    folder = tmp_path_factory.mktemp('without_ros')
    for each in Path(sysconfig.get_path('purelib')).iterdir():
        if not ROS_MODULES.match(each.name):
            (folder / each.name).symlink_to(each)
    return folder


def run_without_ros(packages: Path, program: str, *words: str) -> 'subprocess.CompletedProcess':
    """Run a program; without ``site`` the interpreter finds only these packages and ours."""
    environment = {
        **os.environ, 'PYTHONPATH': f'{ROOT}:{packages}', '_ROS_WHEELS_BOOTSTRAP_COMPLETE': '1',
    }  # fmt: skip
    return run_process(
        [sys.executable, '-S', '-c', program, *words],
        env=environment,
        cwd=packages,
    )


@pytest.mark.parametrize(
    ('program', 'words', 'start'),
    [
        (DRIVE, (), 'drive: the drive needs ROS 2, but '),
        (STICKSLIP, ('drive',), 'stickslip: stickslip drive needs ROS 2, but '),
    ],
)
def test_what_needs_ros_is_refused_in_one_line(
    packages: Path, program: str, words: tuple[str, ...], start: str
):
    done = run_without_ros(packages, program, *words)
    assert (done.returncode, done.stdout) == (2, '')
    [line] = done.stderr.splitlines()
    assert line.startswith(start)
    assert line.endswith(REMEDY)


def test_every_verb_that_needs_ros_is_refused_in_one_line(packages: Path):
    verbs = ('command voltage 10V', 'demo', 'panel', 'twin')
    done = run_without_ros(packages, REFUSES, *verbs)
    assert (done.returncode, done.stdout) == (0, '')
    for line, verb in zip(done.stderr.splitlines(), verbs, strict=True):
        assert line.startswith(f'stickslip: stickslip {verb.split()[0]} needs ROS 2, but ')
        assert line.endswith(REMEDY)


def test_an_import_says_the_remedy_and_can_be_passed_over(packages: Path):
    done = run_without_ros(packages, 'import stickslip_ros.testing')
    assert done.stderr.splitlines()[-1].endswith(REMEDY)
    passed_over = 'try: import stickslip_ros.testing\nexcept ImportError: print("none")'
    assert run_without_ros(packages, passed_over).stdout == 'none\n'


def test_help_needs_none(packages: Path):
    assert run_without_ros(packages, DRIVE, '--help').stdout.startswith('usage: drive ')


@pytest.mark.usefixtures('compiled_kernels')
def test_simulation_comparison_fit_and_the_panel_of_a_recording_need_none(packages: Path):
    verbs = (
        'simulate --voltage 100 --steps 20 -o run.mcap',
        'export run.mcap -o run.csv',
        'compare run.csv run.mcap',
        'fit run.csv --free contact.friction --starts 1 --window 8ms@4ms',
    )
    done = run_without_ros(packages, ALL_OF, *verbs)
    assert (done.returncode, done.stdout.splitlines()[-1]) == (0, 'panel: run.mcap'), done.stderr
