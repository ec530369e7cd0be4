# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The page of ros2_control: its description fits the drive, and its velocities are as it says."""

import re
from pathlib import Path
from textwrap import indent
from xml.etree import ElementTree as ET

import pytest
import yaml

from stickslip_ros.instrument.commands import Request, check_request
from stickslip_ros.instrument.joints import Joints
from stickslip_ros.interface.topics import TOPICS
from stickslip_ros.parameters import load_yaml

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / 'docs' / 'howto' / 'ros2_control.md').read_text(encoding='utf-8')
STAND = load_yaml(ROOT / 'config' / 'realistic.yaml')


def block(language: str) -> str:
    """Return the first block of the page in a language."""
    found = re.search(rf'```{language}\n(.*?)```', PAGE, re.DOTALL)
    assert found is not None
    return found.group(1)


@pytest.fixture
def robot() -> ET.Element:
    return ET.fromstring(block('xml'))


def test_joint_and_links_are_those_of_the_drive(robot: ET.Element):
    joint, control = robot.find('joint'), robot.find('ros2_control/joint')
    assert joint.get('name') == control.get('name') == STAND.sim.joint_name
    assert joint.find('parent').get('link') == STAND.frame_id.stage
    assert joint.find('child').get('link') == STAND.frame_id.runner
    controllers = (ROOT / 'config/ros2_control.yaml').read_text(encoding='utf-8')
    assert yaml.safe_load(controllers)['stage_trajectory']['ros__parameters']['joints'] == [
        STAND.sim.joint_name
    ]


def test_the_limits_of_the_joint_are_taken_by_the_drive(robot: ET.Element):
    limit = {name: float(text) for name, text in robot.find('joint/limit').attrib.items()}
    assert (limit['lower'], limit['upper']) == (STAND.stand.travel_min, STAND.stand.travel_max)
    name = (STAND.sim.joint_name,)
    for joints in (Joints(name, (limit['upper'],)), Joints(name, (), (limit['velocity'],))):
        assert check_request(Request('joint', joints=joints), STAND) is not None


def test_the_plugin_finds_the_topics_and_sends_every_command(robot: ET.Element):
    settings = {each.get('name'): each.text for each in robot.iterfind('ros2_control/*/param')}
    names = {topic.full_name() for topic in TOPICS}
    assert settings['joint_commands_topic'] in names
    remapped = f'joint_states:={settings["joint_states_topic"].lstrip("/")}'
    assert f'-r {remapped}\n' in PAGE
    assert settings['trigger_joint_command_threshold'] == '-1'
    states = {each.get('name') for each in robot.iterfind('ros2_control/joint/state_interface')}
    assert states == {'position', 'velocity', 'effort'}


def test_the_description_of_the_launch_file_is_that_of_the_page():
    control = (ROOT / 'config' / 'ros2_control.urdf').read_text(encoding='utf-8')
    assert indent(control, '  ') in block('xml')
