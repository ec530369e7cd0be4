"""``stickslip interface``: the page docs/interface.md, written from the code."""

import argparse
from collections.abc import Iterator, Mapping
from typing import Any

from stickslip_ros.cli.common import add_json, print_json
from stickslip_ros.instrument.reports import Result, Status
from stickslip_ros.parameters import (
    ControllerParameters,
    Spec,
    declared_by,
    format_value,
    specs,
)
from stickslip_ros.recording.topics import COMMANDS, READINGS, SERVICES, Topic

TITLE = """\
# Interface

Written by `stickslip interface > docs/interface.md`; a test keeps it in step with the code.

Node `stickslip_drive`, executable `drive` of the package `stickslip_ros`, a lifecycle node that
starts itself unless `autostart` is false. Names are relative, so a namespace moves them. All
numbers are SI. +x is the direction in which a slow ramp of positive frequency pulls the runner.
Stamps and recorded times are simulated time, from 0 at the configuration.
"""


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'interface',
        description='Print the ROS interface as Markdown.',
    )
    add_json(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print the page, or its content as JSON."""
    if arguments.json:
        print_json({topic.name: topic.type_name for topic in (*COMMANDS, *READINGS)})
    else:
        print(interface_page(), end='')
    return 0


def interface_page() -> str:
    """Return the page in Markdown."""
    return '\n'.join(_lines()) + '\n'


def _lines() -> Iterator[str]:
    yield TITLE
    yield from _topic_table('Subscribed topics', COMMANDS)
    yield from _topic_table('Published topics', READINGS)
    services = [(f'`{service.name}`', service.type_name, service.text) for service in SERVICES]
    yield from _table('Services', ('name', 'type', 'meaning'), services)
    bits = [(f'`0x{int(bit):08x}`', bit.name or '', bit.text) for bit in Status]
    yield from _table('Status bits', ('bit', 'name', 'meaning'), bits)
    results = [(f'`{result.name}`', result.value) for result in Result]
    yield from _table('Results of a command', ('result', 'meaning'), results)
    yield from _parameter_table('Parameters', specs())
    title = 'Parameters of `position_controller`, read at its start'
    yield from _parameter_table(title, declared_by(ControllerParameters))


def _topic_table(title: str, topics: tuple[Topic, ...]) -> Iterator[str]:
    rows = [(f'`{t.name}`', t.type_name, _qos_words(t), t.text) for t in topics]
    yield from _table(title, ('name', 'type', 'QoS', 'meaning'), rows)


def _qos_words(topic: Topic) -> str:
    latched = ', latched' if topic.qos.latched else ''
    return f'{"reliable" if topic.qos.reliable else "best effort"}, {topic.qos.depth}{latched}'


def _parameter_table(title: str, declared: Mapping[str, Spec]) -> Iterator[str]:
    rows = []
    for name, spec in declared.items():
        bounds = ' \\| '.join(spec.choices)
        if spec.minimum is not None and spec.maximum is not None:
            bounds = f'{spec.minimum:g} to {spec.maximum:g}'
        default = f'`{format_value(spec.default)}`'
        rows.append((f'`{name}`', default, spec.unit, bounds, spec.source, spec.text))
    header = ('name', 'default', 'unit', 'bounds or choices', 'source', 'meaning')
    yield from _table(title, header, rows)


def _table(title: str, header: tuple[str, ...], rows: Any) -> Iterator[str]:
    yield f'## {title}\n'
    yield f'| {" | ".join(header)} |'
    yield '|' + ' --- |' * len(header)
    yield from (f'| {" | ".join(row)} |' for row in rows)
    yield ''
