"""Every group of parameters acts on the running node, and refuses what is out of its bounds."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter

from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters import specs
from stickslip_ros.ros.parameter_bridge import declare_parameters

END_S = 0.05
"""Simulated time of a run; the drive is in lockstep, so that equal runs give equal bytes."""
BLOCK_S = 1e-3
TOPICS = ('position', 'force', 'piezo', 'trace')
STEPPING = (('steps', 10),)
JOGGING = (('jog', 1000.0),)
LUGRE = {'contact.law': 'lugre'}

#: Per group: what all its runs share, the change, the commands, and where the change is seen.
CASES: Mapping[str, tuple[Mapping[str, Any], Mapping[str, Any], tuple[Any, ...], str]] = {
    'sim': ({}, {'sim.seed': 2}, (), 'position'),
    'contact': ({}, {'contact.friction': 0.2}, STEPPING, 'position'),
    'friction_law': (LUGRE, {'friction_law.viscous': 5.0}, STEPPING, 'position'),
    'stand': ({}, {'stand.preload': 0.2}, STEPPING, 'position'),
    'runner': ({}, {'runner.mass': 0.006}, STEPPING, 'position'),
    'amplifier': ({}, {'amplifier.slew_rate': 1e4}, (('voltage', 300.0),), 'piezo'),
    'actuator': ({}, {'actuator.gain': 2e-10}, STEPPING, 'trace'),
    'step': ({}, {'step.frequency': 500.0}, STEPPING, 'trace'),
    'jog': ({}, {'jog.timeout': 0.01}, JOGGING, 'event'),
    'closed_loop': ({}, {'closed_loop.timeout': 0.01}, (('position', 1e-4),), 'event'),
    'limits': ({}, {'limits.soft_max': 1e-8}, JOGGING, 'event'),
    'load_cell': ({}, {'load_cell.stiffness': 2e5}, STEPPING, 'force'),
    'interferometer': ({}, {'interferometer.resolution': 1e-8}, STEPPING, 'position'),
    'trace': ({}, {'trace.sample_rate': 1e4}, (), 'trace'),
    'record': ({}, {'record.on_start': True}, (), 'files'),
    'fault': ({}, {'fault.runner_stuck': True}, STEPPING, 'position'),
}


def numbers_of(message: Any) -> Any:
    """Give what a message says, stamps left out; texts make what is no number comparable."""
    if hasattr(message, 'point'):
        return repr(message.point.x)
    if hasattr(message, 'wrench'):
        return repr(message.wrench.force.x)
    return repr(message.data)


def run(stand: Any, commands: tuple[Any, ...], folder: Path) -> dict[str, list[Any]]:
    """Run a drive in lockstep to the end; give all that it said, topic by topic."""
    operator = stand.operator
    heard = {key: stand.operator.listen(key) for key in TOPICS}
    operator.wait_for_topics()
    for name, value in commands:
        operator.command(name, value)
    operator.command('grant', (END_S, len(commands)))
    blocks = round(END_S / BLOCK_S)
    operator.spin_until(lambda: len(heard['position']) >= blocks, 'the run')
    operator.command('load', 0.0)  # its event comes after those of the run
    operator.command('grant', (END_S + BLOCK_S, len(commands) + 1))
    operator.wait_for_event('load', 0)
    traces = stand.drive.session.parameters.trace.period
    operator.spin_until(
        lambda: (
            len(heard['force']) > blocks
            and min(len(heard['piezo']), len(heard['trace'])) >= round(END_S / traces)
        ),
        'the readings',
    )
    said: dict[str, list[Any]] = {
        key: [numbers_of(message) for message in messages[:blocks]]
        for key, messages in heard.items()
    }
    said['event'] = [(each['command'], each['result']) for each in operator.events]
    said['files'] = sorted(path.suffix for path in folder.iterdir())
    return said


@pytest.fixture
def said(start_drive: Callable, tmp_path: Path) -> Callable[..., dict[str, list[Any]]]:
    """Give a function that runs a drive of its own with parameters; what it said is returned."""

    def run_one(given: Mapping[str, Any], commands: tuple[Any, ...]) -> dict[str, list[Any]]:
        folder = tmp_path / str(len(list(tmp_path.iterdir())))
        folder.mkdir()
        stand = start_drive(
            {'sim.lockstep': True, 'record.directory': str(folder), **given}, wait=False
        )
        found = run(stand, commands, folder)
        stand.close()
        return found

    return run_one


@pytest.fixture(scope='module')
def unchanged() -> dict[str, dict[str, list[Any]]]:
    """Keep what drives without a change have said, since several groups need the same run."""
    return {}


def test_equal_parameters_say_the_same(said: Callable[..., dict[str, list[Any]]]):
    assert said({}, STEPPING) == said({}, STEPPING)


@pytest.mark.parametrize('group', CASES)
def test_a_group_has_its_effect_on_the_node(
    said: Callable[..., dict[str, list[Any]]],
    unchanged: dict[str, dict[str, list[Any]]],
    group: str,
):
    shared, change, commands, key = CASES[group]
    assert {name.partition('.')[0] for name in change} == {group}
    which = repr((shared, commands))
    if which not in unchanged:
        unchanged[which] = said(shared, commands)
    assert said({**shared, **change}, commands)[key] != unchanged[which][key]


def test_every_group_has_a_case():
    assert CASES.keys() | {'autostart'} == {name.partition('.')[0] for name in specs()}


def beyond() -> Iterator[Any]:
    """Give every parameter with values just and far out of its bounds, or not of its choices."""
    for name, spec in specs().items():
        if spec.choices:
            yield pytest.param(name, 'nonsense', id=name)
        elif spec.minimum is not None and spec.maximum is not None:
            span = 1 if spec.kind is int else 1e-3 * max(abs(spec.minimum), abs(spec.maximum))
            yield pytest.param(name, spec.minimum - span, id=f'{name} below')
            yield pytest.param(name, spec.maximum + span, id=f'{name} above')


@pytest.fixture(scope='module')
def context(ros_domain: int) -> Iterator[Context]:
    context = Context()
    rclpy.init(context=context, domain_id=ros_domain)
    yield context
    context.try_shutdown()


@pytest.fixture(scope='module')
def make_node(context: Context) -> Callable[..., Node]:
    """Give a function that makes a bare node whose start sets a parameter."""

    def make(name: str, value: Any) -> Node:
        return Node(
            'declarer',
            context=context,
            parameter_overrides=[Parameter(name, value=value)],
            automatically_declare_parameters_from_overrides=True,
            start_parameter_services=False,
            enable_rosout=False,
        )

    return make


@pytest.mark.parametrize(('name', 'value'), list(beyond()))
def test_a_value_out_of_its_bounds_is_refused_at_the_start(
    make_node: Callable[..., Node], name: str, value: Any
):
    node = make_node(name, value)
    with pytest.raises(OutOfRange) as caught:
        declare_parameters(node)
    node.destroy_node()
    message = str(caught.value)
    assert message.startswith(f'{name} ')
    assert '; ' in message


def test_a_value_out_of_its_bounds_is_refused_by_the_parameter_service(manual: Any):
    taken = [
        case.id for case in beyond() if manual.operator.set_parameter(*case.values).successful
    ]
    assert taken == []
