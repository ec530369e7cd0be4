# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Layouts for Foxglove and PlotJuggler, and the description for ros2_control, fit the drive."""

import json
from pathlib import Path
from textwrap import indent
from xml.etree import ElementTree as ET

import pytest
import yaml
from pages import blocks_of

from stickslip_ros.instrument.commands import Request, check_request
from stickslip_ros.instrument.joints import Joints
from stickslip_ros.interface.schemas import SCHEMAS
from stickslip_ros.interface.topics import TOPICS
from stickslip_ros.parameters import load_yaml

ROOT = Path(__file__).resolve().parents[1]
FOXGLOVE, PLOTJUGGLER = 'config/foxglove_layout.json', 'config/plotjuggler_layout.xml'
TYPES = {
    topic.full_name(): topic.type_name for topic in TOPICS if not topic.name.startswith('command/')
}
NUMBERS = {'float64', 'int32', 'uint32'}


@pytest.fixture(scope='module')
def foxglove():
    return json.loads((ROOT / FOXGLOVE).read_text(encoding='utf-8'))


def kind_of_field(type_name: str, fields: list[str]) -> str:
    """Follow fields through the definitions that a recording carries; give the last one's type."""
    parts = SCHEMAS[type_name].split('=' * 80 + '\n')
    inner = {part.split('\n')[0].removeprefix('MSG: '): part for part in parts[1:]}
    text, package = parts[0], type_name.partition('/')[0]
    for number, field in enumerate(fields, start=1):
        kinds = [line.split()[0] for line in text.splitlines() if line.split()[1:] == [field]]
        assert kinds, f'{type_name} has no {field}'
        if number == len(fields):
            return kinds[0]
        name = kinds[0] if '/' in kinds[0] else f'{package}/{kinds[0]}'
        text, package = inner[name], name.partition('/')[0]
    raise AssertionError('no field')


def leaves(layout) -> list[str]:
    if isinstance(layout, str):
        return [layout]
    return [*leaves(layout['first']), *leaves(layout['second'])]


def test_foxglove_plots_numbers_and_shows_messages_of_topics_that_exist(foxglove):
    panels = foxglove['configById']
    paths = [path for panel in panels.values() for path in panel.get('paths', [])]
    assert {path['value'] for path in paths} == {
        '/position.point.x',
        '/force.wrench.force.x',
        '/voltage.vector.x',
        '/stickslip_drive/status.data',
    }
    for path in paths:
        topic, *fields = path['value'].split('.')
        assert kind_of_field(TYPES[topic], fields) in NUMBERS
        has_stamp = 'header' in SCHEMAS[TYPES[topic]].split('\n')[0]
        assert path['timestampMethod'] == ('headerStamp' if has_stamp else 'receiveTime')
    topics = {panel['topicPath'] for panel in panels.values() if 'topicPath' in panel}
    assert {'/stickslip_drive/event', '/stickslip_drive/info'} <= topics <= TYPES.keys()
    assert sorted(leaves(foxglove['layout'])) == sorted(panels)


def test_plotjuggler_draws_numbers_of_topics_that_exist_and_has_a_size_for_each_plot():
    root = ET.parse(ROOT / PLOTJUGGLER).getroot()
    curves = [curve.get('name', '') for curve in root.iter('curve')]
    assert len(curves) == 4
    for curve in curves:
        [topic] = [name for name in TYPES if curve.startswith(f'{name}/')]
        fields = curve.removeprefix(f'{topic}/').split('/')
        assert kind_of_field(TYPES[topic], fields) in NUMBERS
    for splitter in root.iter('DockSplitter'):
        sizes = [float(size) for size in splitter.get('sizes', '').split(';')]
        assert len(sizes) == len(list(splitter)) == int(splitter.get('count', '0'))
        assert sum(sizes) == pytest.approx(1.0, abs=1e-9)


def test_layouts_and_the_data_of_each_package_are_installed(keywords):
    config = dict(keywords['data_files'])['share/stickslip_ros/config']
    assert {FOXGLOVE, PLOTJUGGLER, 'config/test_stand.yaml'} <= set(config)
    for package, patterns in keywords['package_data'].items():
        for pattern in patterns:
            assert list((ROOT / package.replace('.', '/')).glob(pattern)), (package, pattern)


PAGE = (ROOT / 'docs' / 'howto' / 'ros2_control.md').read_text(encoding='utf-8')
STAND = load_yaml(ROOT / 'config' / 'realistic.yaml')


[DESCRIPTION] = blocks_of(ROOT / 'docs' / 'howto' / 'ros2_control.md', 'xml')


@pytest.fixture
def robot() -> ET.Element:
    return ET.fromstring(DESCRIPTION.text)


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
    assert indent(control, '  ') in DESCRIPTION.text
