# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip parameters``, ``interface`` and ``draw``: files made of parameters and code."""

import argparse
from collections.abc import Iterable, Iterator, Sequence

from stickslip_ros.errors import UnknownName
from stickslip_ros.files import prepare_output, replacing
from stickslip_ros.instrument.reports import Result, Status
from stickslip_ros.interface.topics import (
    COMMAND_TOPICS,
    READINGS,
    SERVICES,
    TRAJECTORY_ACTION,
    Topic,
)
from stickslip_ros.lab.cli.chosen import asked_output, chosen_parameters
from stickslip_ros.lab.cli.printing import Answer
from stickslip_ros.lab.drawing.picture import draw_stand
from stickslip_ros.lab.drawing.urdf import robot_description
from stickslip_ros.parameters import Parameters, dump_yaml

HEADING = """\
The test stand of Nguyen, Teidelt, Popov, Fatikow, Physical Mesomechanics (2014),
as ROS 2 parameters. SI units. In brackets: place in that paper, or "assumed".
Written by: stickslip parameters > config/test_stand.yaml
"""
_TITLE = """\
# Topics and services

For programmers who connect to the drive. `stickslip interface` writes this page.

Node `stickslip_drive`, executable `drive`. Names are relative, so a namespace moves them. All
numbers are SI. +x is the direction in which a slow ramp of positive frequency pulls the runner.
[Stamps](node.md#time) are simulated time. [Depths](node.md#quality-of-service) are those of the
default [parameters](parameters.md); every topic is reliable.
[Cost](../howto/several_drives.md#drives-per-core) of voltages, events and listeners.
"""


def parameters_verb(arguments: argparse.Namespace) -> Answer:
    """Return the parameters."""
    parameters = chosen_parameters(arguments)
    return Answer(parameters.flat(), [dump_yaml(parameters, HEADING).removesuffix('\n')])


def interface_verb(_: argparse.Namespace) -> Answer:
    """Return the page docs/reference/interface.md; as JSON the types of the topics."""
    return Answer({topic.name: topic.type_name for topic in (*COMMAND_TOPICS, *READINGS)}, _page())


def draw_verb(arguments: argparse.Namespace) -> Answer:
    """Write the drawing of a stand as SVG, or its bodies as URDF."""
    parameters, path = chosen_parameters(arguments), asked_output(arguments)
    if path.suffix not in {'.svg', '.urdf'}:
        raise UnknownName('kind of drawing', path.suffix, 'use .svg or .urdf')
    prepare_output(path)
    text = (robot_description if path.suffix == '.urdf' else draw_stand)(parameters)
    with replacing(path) as part:
        part.write_text(text, encoding='utf-8')
    return Answer({'drawing': str(path)}, [f'drawing {path}'])


def _page() -> Iterator[str]:
    yield _TITLE
    yield from _topic_table('Subscribed topics', COMMAND_TOPICS)
    yield from _topic_table('Published topics', READINGS)
    services = [(f'`{service.name}`', service.type_name, service.text) for service in SERVICES]
    yield from _markdown('Services', ('name', 'type', 'meaning'), services)
    actions = [(f'`{each.name}`', each.type_name, each.text) for each in [TRAJECTORY_ACTION]]
    yield from _markdown('Actions', ('name', 'type', 'meaning'), actions)
    bits = [(f'`0x{int(bit):08x}`', bit.name or '', bit.text) for bit in Status]
    yield from _markdown('Status bits', ('bit', 'name', 'meaning'), bits)
    results = [(f'`{result.name}`', result.value) for result in Result]
    yield from _markdown('Results of a command', ('result', 'meaning'), results)


def _topic_table(title: str, topics: tuple[Topic, ...]) -> Iterator[str]:
    rows = [(f'`{t.name}`', t.type_name, _qos_words(t), t.text) for t in topics]
    yield from _markdown(title, ('name', 'type', 'depth', 'meaning'), rows)


def _qos_words(topic: Topic) -> str:
    qos = topic.offered_qos(Parameters())
    latched = ', latched' if qos.latched else ''
    return f'{"" if qos.reliable else "best effort, "}{qos.depth}{latched}'


def _markdown(title: str, header: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    yield f'## {title}\n'
    yield f'| {" | ".join(header)} |'
    yield '|' + '---|' * len(header)
    yield from (f'| {" | ".join(row)} |' for row in rows)
    yield ''
