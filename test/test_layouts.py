# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The layouts for Foxglove and PlotJuggler name topics that exist, and fields that they have."""

import json
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from stickslip_ros.interface.schemas import SCHEMAS
from stickslip_ros.interface.topics import TOPICS

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


def test_foxglove_plots_numbers_of_topics_that_exist(foxglove):
    values = [
        path['value']
        for panel in foxglove['configById'].values()
        for path in panel.get('paths', [])
    ]
    assert set(values) == {
        '/position.point.x',
        '/force.wrench.force.x',
        '/voltage.data',
        '/stickslip_drive/status.data',
    }
    for value in values:
        topic, *fields = value.split('.')
        assert kind_of_field(TYPES[topic], fields) in NUMBERS


def test_foxglove_takes_the_stamp_only_of_messages_that_have_one(foxglove):
    for panel in foxglove['configById'].values():
        for path in panel.get('paths', []):
            has_stamp = 'header' in SCHEMAS[TYPES[path['value'].split('.')[0]]].split('\n')[0]
            assert path['timestampMethod'] == ('headerStamp' if has_stamp else 'receiveTime')


def test_foxglove_shows_messages_of_topics_that_exist(foxglove):
    topics = [
        panel['topicPath'] for panel in foxglove['configById'].values() if 'topicPath' in panel
    ]
    assert {'/stickslip_drive/event', '/stickslip_drive/info'} <= set(topics)
    assert set(topics) <= TYPES.keys()


def test_every_panel_of_foxglove_has_its_settings_and_its_place(foxglove):
    assert sorted(leaves(foxglove['layout'])) == sorted(foxglove['configById'])
    kinds = {name.partition('!')[0] for name in foxglove['configById']}
    assert kinds == {'Plot', 'RawMessages', 'StateTransitions'}


def test_plotjuggler_draws_numbers_of_topics_that_exist():
    root = ET.parse(ROOT / PLOTJUGGLER).getroot()
    curves = [curve.get('name', '') for curve in root.iter('curve')]
    assert len(curves) == 4
    for curve in curves:
        [topic] = [name for name in TYPES if curve.startswith(f'{name}/')]
        fields = curve.removeprefix(f'{topic}/').split('/')
        assert kind_of_field(TYPES[topic], fields) in NUMBERS


def test_plotjuggler_finds_a_size_for_each_of_its_plots():
    root = ET.parse(ROOT / PLOTJUGGLER).getroot()
    assert root.tag == 'root'
    for splitter in root.iter('DockSplitter'):
        sizes = [float(size) for size in splitter.get('sizes', '').split(';')]
        assert len(sizes) == len(list(splitter)) == int(splitter.get('count', '0'))
        assert sum(sizes) == pytest.approx(1.0, abs=1e-9)
    for tab in root.iter('Tab'):
        assert len(list(tab.iter('Container'))) == int(tab.get('containers', '0'))


def test_layouts_and_the_data_of_each_package_are_installed(keywords):
    config = dict(keywords['data_files'])['share/stickslip_ros/config']
    assert {FOXGLOVE, PLOTJUGGLER, 'config/test_stand.yaml'} <= set(config)
    for package, patterns in keywords['package_data'].items():
        for pattern in patterns:
            assert list((ROOT / package.replace('.', '/')).glob(pattern)), (package, pattern)
