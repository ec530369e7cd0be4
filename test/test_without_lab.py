# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A robot has neither the extra ``lab`` nor, from apt, mcap.

Its drive runs, and what it lacks is refused in one line. The interpreter of these tests finds all
that is installed here but those packages.

"""

import os
import re
import shutil
import signal
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from processes import finish, run_process, start_process
from test_public_calls import LINES, SERVED

import stickslip_ros
from stickslip_ros.extras import LAB
from stickslip_ros.lab.cli.verbs import VERBS

ROOT = Path(__file__).parents[1]
REMEDY = (
    "which is missing; install it with: pip install 'stickslip_ros[lab]', "
    'or pip install matplotlib pandas rich scipy'
)
MCAP = "a recording needs the package 'mcap', which is missing; install it with: pip install mcap"
OF_A_ROBOT = {
    'command', 'compile', 'contact', 'draw', 'drive', 'info', 'interface', 'panel', 'parameters',
    'recover', 'replay',
}  # fmt: skip
STICKSLIP = 'import sys; from stickslip_ros.lab.cli.start import stickslip; sys.exit(stickslip())'
REFUSES = """
import sys
from stickslip_ros.lab.cli.main import main
for each in sys.argv[1:]:
    assert main(each.split()) == 2, each
"""
VERBS_OF_A_ROBOT = f"""
import sys
from stickslip_ros.lab.cli.main import main
for each in sys.argv[1:]:
    assert main(each.split()) == 0, each
print(sorted({{each.partition('.')[0] for each in sys.modules}} & {{*{LAB}}}))
"""
DRIVE_AND_TEST = Path(__file__).with_name('robot.py').read_text(encoding='utf-8')
NAMES = """
import stickslip_ros
for name in stickslip_ros.PUBLIC:
    try:
        getattr(stickslip_ros, name)
        print(f'{name}: there')
    except ImportError as error:
        print(f'{name}: {error}')
"""


def environment_without(left_out: re.Pattern[str], folder: Path) -> Path:
    """Make a folder with what is installed here, but for packages whose names match."""
    folder.mkdir()
    for each in Path(sysconfig.get_path('purelib')).iterdir():
        if not left_out.match(each.name):
            (folder / each.name).symlink_to(each)
    return folder


def named(*names: str) -> re.Pattern[str]:
    """Return a pattern that packages of these names match."""
    return re.compile(rf'({"|".join(names)})\b')


@pytest.fixture(scope='module')
def robot(tmp_path_factory, compiled_kernels, recorded_run) -> Path:
    """Give the packages of a robot that has installed no extra."""
    folder = tmp_path_factory.mktemp('robot')
    shutil.copy(recorded_run[1], folder / 'run.mcap')
    (folder / 'run.csv').write_text('time_s,position_m\n0,0\n1,1e-9\n', encoding='utf-8')
    return environment_without(named(*LAB), folder / 'packages')


@pytest.fixture(scope='module')
def from_apt(tmp_path_factory: pytest.TempPathFactory, compiled_kernels: None) -> Path:
    """Give the packages of a robot without those of pip alone."""
    left_out = named(*LAB, 'mcap', 'mcap_ros2', 'lz4', 'zstandard')
    return environment_without(left_out, tmp_path_factory.mktemp('apt') / 'packages')


def surroundings(packages: Path) -> dict[str, str]:
    """Return what makes an interpreter without ``site`` find these packages and ours."""
    return {'PYTHONPATH': f'{ROOT}:{packages}', '_ROS_WHEELS_BOOTSTRAP_COMPLETE': '1'}


def run_there(packages: Path, program: str, *words: str) -> 'subprocess.CompletedProcess[str]':
    """Run a program with these packages, beside them."""
    environment = {**os.environ, **surroundings(packages)}
    return run_process(
        [sys.executable, '-S', '-c', program, *words], env=environment, cwd=packages.parent
    )


def test_a_robot_drives_records_and_tests_without_a_laboratory(robot: Path, quiet_ros: None):
    done = run_there(robot, DRIVE_AND_TEST)
    assert done.returncode == 0, done.stderr
    result, recording, imported = done.stdout.splitlines()
    recorded = f'True {robot.with_name("drive.mcap")}'
    assert (result, recording, imported) == ('DONE', recorded, "['mcap']")
    verbs = [f'{each} {LINES[each]}' for each in sorted(OF_A_ROBOT & LINES.keys())]
    verbs += ['info drive.mcap', 'replay drive.mcap']
    done = run_there(robot, VERBS_OF_A_ROBOT, *verbs)
    assert (done.returncode, done.stdout.splitlines()[-1]) == (0, '[]'), done.stderr
    assert 'every message is identical, byte for byte' in done.stdout


def test_without_mcap_a_drive_runs_and_refuses_to_record(from_apt: Path, quiet_ros: None):
    done = run_there(from_apt, DRIVE_AND_TEST)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == ['DONE', f'False set_recording refused: {MCAP}', '[]']
    done = run_there(from_apt, STICKSLIP, 'info', 'run.mcap')
    assert (done.returncode, done.stdout) == (2, '')
    assert done.stderr == f'stickslip: {MCAP.replace("a recording", "stickslip info")}\n'


def test_each_verb_of_the_laboratory_is_refused_in_one_line(robot: Path):
    verbs = sorted(VERBS.keys() - OF_A_ROBOT)
    lines = [f'{verb} {LINES.get(verb) or SERVED[verb][0]}' for verb in verbs]
    done = run_there(robot, REFUSES, *lines)
    assert (done.returncode, done.stdout) == (0, ''), done.stderr
    for line, verb in zip(done.stderr.splitlines(), verbs, strict=True):
        needs = rf"stickslip: stickslip {verb} needs the package '({'|'.join(LAB)})', "
        assert re.fullmatch(needs + re.escape(REMEDY), line), line


def test_command_and_panel_need_no_laboratory_either(robot, quiet_ros, ros_domain):
    environment = {**os.environ, **surroundings(robot), 'ROS_DOMAIN_ID': str(ros_domain)}
    words = [sys.executable, '-S', '-c', STICKSLIP]
    process = start_process(
        [*words, 'drive', '--ros-args', '-p', 'sim.block:=0.01'], env=environment
    )
    command = [*words, 'command', 'voltage', '10V', '--timeout', '300s']
    done = run_process(command, env=environment, check=True)
    assert done.stdout.startswith('voltage: DONE at ')
    panel = start_process(
        [*words, 'panel', '--port', '0'], env=environment, stdout=subprocess.PIPE
    )
    assert 'http://127.0.0.1:' in next(iter(panel.stdout))
    for each in (panel, process):
        each.send_signal(signal.SIGINT)
        finish(each)


def test_the_twin_too(robot: Path):
    program = 'import sys; from stickslip_ros.lab.twin.start import twin; sys.exit(twin())'
    done = run_there(robot, program)
    refused = f"twin: the twin needs the package 'scipy', {REMEDY}\n"
    assert (done.returncode, done.stdout, done.stderr) == (2, '', refused)


def test_a_function_of_the_laboratory_is_refused_and_an_import_can_be_passed_over(robot: Path):
    public = vars(stickslip_ros)['PUBLIC']
    done = run_there(robot, NAMES)
    assert done.returncode == 0, done.stderr
    told = dict(line.split(': ', 1) for line in done.stdout.splitlines())
    assert told.keys() == public.keys()
    for name, place in public.items():
        of_the_lab = f"stickslip_ros.{name} needs the package 'matplotlib', {REMEDY}"
        assert told[name] == (of_the_lab if place.startswith('lab.') else 'there')
