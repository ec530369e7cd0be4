# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The examples of the pages, as they stand there, do what the pages say."""

import importlib
import json
import os
import runpy
import shutil
import sys
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pytest
from pages import DOCS, blocks_of
from processes import run_process

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


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Write the two Python blocks of the page about tests into the files that it names."""
    for block in blocks_of(DOCS / 'howto/test_a_controller.md', 'python'):
        (tmp_path / block.file).write_text(block.text)
    return tmp_path


def run_pytest(project: Path) -> str:
    """Run the tests of a project in a process of their own; give the last line."""
    own = ['-c', os.devnull, '--rootdir', str(project)]  # not the settings of a folder above
    command = [sys.executable, '-m', 'pytest', '-q', '-p', 'no:cacheprovider', *own, str(project)]
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


def test_five_lines_wait_for_the_end_of_ones_own_command(stand, ros_domain, monkeypatch):
    stand.operator.command('load', 0.01)
    stand.operator.wait_for_event('load', 0)
    monkeypatch.setenv('ROS_DOMAIN_ID', str(ros_domain))
    [example] = blocks_of(DOCS / 'reference/moves.md', 'python')
    program = MOVER.format(example=example.text, target_m=20e-9)
    done = run_process([sys.executable, '-c', program], check=True)
    event = json.loads(done.stdout)
    assert (event['command'], event['number'], event['result']) == ('position', 2, 'DONE')
    assert event['sent_ns'] > 0


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
    names: dict[str, Any] = {}
    for cell in blocks_of(DOCS / 'howto' / 'design_a_controller.md', '{code-cell}'):
        exec(compile(cell.text, 'design_a_controller.md', 'exec'), names)
    plt.close('all')
    assert abs(names['read_um'] - names['predicted_um']).max() < PREDICTED_UM
    assert names['margins'][:2] == pytest.approx((8.67, 81.3), rel=1e-2)
    assert names['late'][:2] == pytest.approx((4.16, 69.9), rel=1e-2)
    inside = importlib.import_module('scan_controller.loop')
    for mine, designed in zip(
        inside.ScanController().system, names['controller'].system, strict=True
    ):
        assert (mine == designed).all()
