# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The examples of the pages, as they stand there, do what the pages say."""

import importlib
import json
import re
import runpy
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pytest
from executables import BIN, end
from processes import run_process, start_process

from stickslip_ros import CompareOptions, compare, open_run
from stickslip_ros.lab.cli.main import main
from stickslip_ros.process.signals import STOPPED

DOCS = Path(__file__).parents[2] / 'docs'
CLOCK_AHEAD_S = 5021.3
HALF_A_ROW_S = 1e-4
NOISE_M = 1e-9
EXAMPLE = DOCS / 'examples' / 'scan_controller'
PREDICTED_UM = 1e-3
"""A twentieth of the way of the example; its page says half of that."""
MOVER = """\
import json

import rclpy
from geometry_msgs.msg import Point, PointStamped
from std_msgs.msg import Header, String

from stickslip_ros.testing import Handshake

{example}
rclpy.init()
node = rclpy.create_node('mover')
events = []
publisher = node.create_publisher(PointStamped, 'command/position', 10)
node.create_subscription(
    String, '/stickslip_drive/event', lambda message: events.append(json.loads(message.data)), 10
)
handshake = Handshake(node, 'stickslip_drive')
while not handshake.is_done():
    rclpy.spin_once(node, timeout_sec=0.05)
print(json.dumps(move(node, publisher, events, {target_m})))
"""


def examples(page: str) -> list[str]:
    """Give the blocks of Python of a page."""
    text = (DOCS / page).read_text(encoding='utf-8')
    return re.findall(r'^```python\n(.*?)^```', text, re.DOTALL | re.MULTILINE)


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Write the two Python blocks of the page about tests into the files that it names."""
    conftest, tests = examples('howto/test_a_controller.md')
    (tmp_path / 'conftest.py').write_text(conftest)
    (tmp_path / 'test_controller.py').write_text(tests)
    return tmp_path


def run_pytest(project: Path) -> str:
    """Run the tests of a project in a process of their own; give the last line."""
    command = [sys.executable, '-m', 'pytest', '-q', '-p', 'no:cacheprovider', str(project)]
    done = run_process(command, cwd=project)
    return done.stdout.splitlines()[-1]


def test_the_example_of_the_page_passes(project: Path):
    assert run_pytest(project).startswith('2 passed')


@pytest.mark.slow
def test_the_example_of_the_page_fails_where_its_controller_cannot_reach_the_target(project: Path):
    tests = project / 'test_controller.py'
    below_0_v = tests.read_text().replace('TARGET_M = 40e-9', 'TARGET_M = -40e-9')
    tests.write_text(below_0_v)
    assert run_pytest(project).startswith('1 failed, 1 passed')


def test_five_lines_wait_for_the_end_of_ones_own_command(
    stand: Any, ros_domain: int, monkeypatch: pytest.MonkeyPatch
):
    stand.operator.command('load', 0.01)
    stand.operator.wait_for_event('load', 0)
    monkeypatch.setenv('ROS_DOMAIN_ID', str(ros_domain))
    [example] = examples('reference/moves.md')
    program = MOVER.format(example=example, target_m=20e-9)
    done = run_process([sys.executable, '-c', program], check=True)
    event = json.loads(done.stdout)
    assert (event['command'], event['number'], event['result']) == ('position', 2, 'DONE')
    assert event['sent_ns'] > 0


def typed(page: str, folder: Path) -> list[list[str]]:
    """Write the blocks of Python of a page into the files that they name; give its commands."""
    for block in examples(page):
        (folder / block.split()[1]).write_text(block)
    text = (DOCS / page).read_text(encoding='utf-8').replace('\\\n', ' ')
    lines = ''.join(re.findall(r'^```sh\n(.*?)^```', text, re.DOTALL | re.MULTILINE)).splitlines()
    return [shlex.split(line) for line in lines]


def start(*command: str) -> 'subprocess.Popen[str]':
    """Start what a page types beside other programs; the panel takes a free port."""
    words = [*command, '--port', '0'] if command[1] == 'panel' else command
    return start_process([BIN / words[0], *words[1:]], stdout=subprocess.PIPE)


def walk(commands: Iterable[list[str]]) -> None:
    """Carry out commands; Ctrl-C ends the drive after its controller, and the panel."""
    with ExitStack() as processes:
        for program, *words in commands:
            if words[0] == 'drive':
                drive = processes.enter_context(start(program, *words))
                processes.callback(drive.kill)
            elif words[0] == 'panel':
                panel = processes.enter_context(start(program, *words))
                processes.callback(panel.kill)
                assert panel.stdout.readline().startswith('the panel is at http://127.0.0.1:')
                assert end(panel, signal.SIGINT)[0] == STOPPED
            elif program == 'python':
                run_process([sys.executable, *words], check=True)
                if words == ['controller.py']:
                    assert end(drive, signal.SIGINT)[0] == 0
            else:
                assert main(words) == 0, words


@pytest.mark.slow  # a drive and six verbs
def test_the_walk_leads_from_a_drive_to_the_comparison_with_a_measurement(
    ros_domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv('ROS_DOMAIN_ID', str(ros_domain))
    monkeypatch.chdir(tmp_path)
    commands = typed('start/ros_developer.md', tmp_path)
    walk(commands)
    assert ['stickslip', 'replay', 'runs/walk.mcap'] in commands  # ends with 0 if it is identical
    position_m = open_run('runs/walk.mcap').frame['position_m'].iloc[-1]
    assert position_m == pytest.approx(1e-6, abs=NOISE_M)
    aligned = compare('runs/stage.mcap', 'measured.csv', options=CompareOptions(align=True))
    assert aligned.alignment.shift_s == pytest.approx(-CLOCK_AHEAD_S, abs=HALF_A_ROW_S)
    assert abs(aligned.quantities[0].agreement.bias) < NOISE_M
    assert Path('runs/walk.html').exists()


def test_the_map_of_steps_is_the_table_of_its_page_and_a_load_speeds_the_runner_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setenv('MPLBACKEND', 'agg')
    steps_m = runpy.run_path(str(DOCS / 'examples' / 'step_map.py'))['main'](tmp_path)
    plt.close('all')
    page = (DOCS / 'explanation' / 'linear_drive.md').read_text(encoding='utf-8')
    assert capsys.readouterr().out in page
    assert (steps_m[:, 1:, -1] > steps_m[:, :-1, -1]).all()  # from -100 to 100 mN
    assert (tmp_path / 'step_map.png').exists()


@pytest.mark.slow
def test_the_tests_of_the_example_package_pass(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    project = Path(shutil.copytree(EXAMPLE, tmp_path / 'scan_controller'))
    monkeypatch.setenv('PYTHONPATH', str(project))
    assert run_pytest(project).startswith('4 passed, 1 skipped')  # launch_testing has no wheel


def test_the_cells_of_the_design_predict_what_the_drive_does(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(str(EXAMPLE))
    monkeypatch.setenv('MPLBACKEND', 'agg')
    text = (DOCS / 'howto' / 'design_a_controller.md').read_text(encoding='utf-8')
    names: dict[str, Any] = {}
    for cell in re.findall(r'```{code-cell}\n(.*?)```', text, re.DOTALL):
        exec(compile(cell, 'design_a_controller.md', 'exec'), names)
    plt.close('all')
    assert abs(names['read_um'] - names['predicted_um']).max() < PREDICTED_UM
    assert names['margins'][:2] == pytest.approx((8.67, 81.3), rel=1e-2)
    assert names['late'][:2] == pytest.approx((4.16, 69.9), rel=1e-2)
    inside = importlib.import_module('scan_controller.loop')
    for mine, designed in zip(
        inside.ScanController().system, names['controller'].system, strict=True
    ):
        assert (mine == designed).all()
