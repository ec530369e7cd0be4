# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Three drives as the launch file of the stage starts them: their topics, joints and moves."""

import math
import runpy
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import rclpy
from executables import DRIVE
from rclpy.node import Node
from sensor_msgs.msg import JointState

from stickslip_ros import Parameters, load_yaml
from stickslip_ros.lab.cli.main import main
from stickslip_ros.parameters import NODE_NAME, load_values
from stickslip_ros.parameters.stages import stage_files
from stickslip_ros.testing import Operator

LAUNCH = Path(__file__).parents[2] / 'launch'
TARGETS_M = {'x': 1e-6, 'y': -1e-6, 'z': 2e-6}
NEAR_M = 10e-9
Z_LOAD_N = -0.05
FREE = ['-p', 'load_cell.contact:=absent', '-p', 'runner.damping:=5.0', '-p', 'sim.block:=0.01']


@pytest.mark.parametrize('name', stage_files())
def test_ros_takes_the_values_of_a_stage_and_leaves_its_ranges(name: str, ros_domain: int):
    file, context = stage_files()[name], rclpy.Context()
    words = ['--ros-args', '--params-file', str(file)]
    rclpy.init(args=words, context=context, domain_id=ros_domain)
    node = Node(NODE_NAME, context=context, automatically_declare_parameters_from_overrides=True)
    taken = {each: node.get_parameter(each).value for each in load_values(file)}
    assert len(load_yaml(file).ranges) > 9
    assert load_yaml(file) == Parameters().updated(taken)
    assert not any(node.has_parameter(each) for each in load_yaml(file).ranges if '[' in each)
    node.destroy_node()
    context.shutdown()


@pytest.fixture
def stage(monkeypatch: pytest.MonkeyPatch) -> dict[str, list[str]]:
    """Give the ROS arguments of each drive of the stage, as its launch file has them."""
    names = ('launch', 'launch.actions', 'launch.substitutions', 'launch_ros.actions')
    for name in (*names, 'launch_ros', 'launch_ros.parameter_descriptions'):
        module = ModuleType(name)
        vars(module)['__getattr__'] = lambda _: object
        monkeypatch.setitem(sys.modules, name, module)
    own = runpy.run_path(str(LAUNCH / 'stage.launch.py'))['OWN']
    frames = runpy.run_path(str(LAUNCH / 'drive.launch.py'))['FRAMES']
    return {
        axis: [
            *('-r', f'__ns:=/stage/{axis}', '-r', 'joint_states:=/stage/joint_states'),
            *('-p', f'sim.seed:={each["seed"]}', '-p', f'sim.joint_name:={each["joint_name"]}'),
            *(
                word
                for name, frame in frames.items()
                for word in ('-p', f'{name}:={each["frame_prefix"]}{frame}')
            ),
        ]
        for axis, each in own.items()
    }


def test_three_drives_report_their_joints_on_one_topic_and_move_each_by_itself(
    stage: dict[str, list[str]],
    start: Callable[..., 'subprocess.Popen[str]'],
    meet: Callable[..., Operator],
    ros_domain: int,
    monkeypatch: pytest.MonkeyPatch,
):
    for arguments in stage.values():
        start(*DRIVE, '--ros-args', *arguments, *FREE)
    operators = {axis: meet(f'/stage/{axis}') for axis in stage}
    monkeypatch.setenv('ROS_DOMAIN_ID', str(ros_domain))
    load = ['command', 'load', f'force.x={Z_LOAD_N}', '--namespace', '/stage/z']
    assert main([*load, '--timeout', '60']) == 0  # as the launch file sends it
    places_m: dict[str, float] = {}

    def take(message: Any) -> None:
        [name], [place_m] = message.name, message.position
        places_m[name] = place_m

    x = operators['x']
    x.node.create_subscription(JointState, '/stage/joint_states', take, 100)
    for axis, operator in operators.items():
        operator.command('position', (TARGETS_M[axis],))
    for axis, operator in operators.items():
        event = operator.wait_for_event('position', 0)
        assert event['result'] == 'DONE', (axis, event)
    x.spin_until(  # what was published before the end of the moves may still come
        lambda: all(
            abs(places_m.get(f'{axis}_joint', math.inf) - target_m) < NEAR_M
            for axis, target_m in TARGETS_M.items()
        ),
        'the joints of all at their targets',
    )
    for axis, operator in operators.items():
        moved = [each['command'] for each in operator.events if each['command'] != 'load']
        assert moved == ['position'], axis  # of its own topic alone
