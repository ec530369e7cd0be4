"""The examples of the pages, as they stand there, do what the pages say."""

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

DOCS = Path(__file__).parents[2] / 'docs'
TIMEOUT_S = 120.0
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
    conftest, tests = examples('testing.md')
    (tmp_path / 'conftest.py').write_text(conftest)
    (tmp_path / 'test_controller.py').write_text(tests)
    return tmp_path


def run_pytest(project: Path) -> str:
    """Run the tests of a project in a process of their own; give the last line."""
    command = [sys.executable, '-m', 'pytest', '-q', '-p', 'no:cacheprovider', str(project)]
    done = subprocess.run(
        command, cwd=project, capture_output=True, text=True, timeout=TIMEOUT_S, check=False
    )
    return done.stdout.splitlines()[-1]


def test_the_example_of_the_page_passes(project: Path):
    assert run_pytest(project).startswith('2 passed')


def test_the_example_of_the_page_fails_where_its_controller_cannot_reach_the_target(
    project: Path,
):
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
    [example] = examples('control.md')
    program = MOVER.format(example=example, target_m=20e-9)
    done = subprocess.run(
        [sys.executable, '-c', program],
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
        check=True,
    )
    event = json.loads(done.stdout)
    assert (event['command'], event['number'], event['result']) == ('position', 2, 'DONE')
    assert event['stamp_ns'] > 0
