"""Names can be remapped, and drives stand side by side; recordings tell the names as they were."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.topics import recorded_channels

STEPS = 20.0


def recorded_topics(stand: Any) -> set[str]:
    path = stand.operator.set_recording(wanted=True).message
    stand.operator.set_recording(wanted=False)
    return set(Recording(Path(path)).types)


def test_a_remapped_topic_is_published_and_recorded_under_its_new_name(
    start_drive: Callable,
):
    stand = start_drive(remaps=('position:=measured', 'command/voltage:=/lab/volts'), wait=False)
    node = stand.operator.node
    stand.operator.spin_until(lambda: node.count_publishers('/measured') == 1, 'the topic')
    stand.operator.spin_until(lambda: node.count_subscribers('/lab/volts') == 1, 'the topic')
    assert node.count_publishers('/position') == 0
    topics = recorded_topics(stand)
    assert {'/measured', '/lab/volts', '/force'} <= topics
    assert not {'/position', '/command/voltage'} & topics


def test_a_node_of_another_name_moves_what_is_under_it(start_drive: Callable):
    stand = start_drive(remaps=('__node:=twin', '__ns:=/lab'), wait=False)
    assert stand.drive.get_fully_qualified_name() == '/lab/twin'
    client = stand.operator.node
    stand.operator.spin_until(lambda: client.count_publishers('/lab/twin/status') == 1, 'status')


def test_a_recording_of_a_renamed_node_carries_its_names(start_drive: Callable):
    stand = start_drive(remaps=('__node:=twin',))
    expected = {c.topic for c in recorded_channels(Parameters(), '/', 'twin').values()}
    assert recorded_topics(stand) == expected
    heard = stand.operator.listen('diagnostics')
    stand.operator.spin_until(lambda: bool(heard), 'diagnostics')
    assert {part.name.partition(':')[0] for part in heard[0].status} == {'twin'}


def test_a_remapped_command_reaches_the_drive(start_drive: Callable):
    stand = start_drive(
        remaps=('command/voltage:=/command/preload', 'command/preload:=/command/voltage')
    )
    stand.operator.command('preload', 50.0)  # on the topic that now means a voltage
    assert stand.operator.wait_for_event('voltage', 0)['result'] == 'DONE'
    assert stand.drive.session.bench.state.voltage_v == 50.0


def test_two_drives_have_their_own_seed_motion_and_time(start_drive: Callable, tmp_path: Path):
    kept = {'record.on_start': True, 'interferometer.resolution': 0.0}
    left = start_drive({**kept, 'record.name': 'left', 'sim.seed': 1}, '/left')
    values = {'record.name': 'right', 'sim.seed': 2, 'stand.preload': 0.25}
    right = start_drive({**kept, **values}, '/right')
    left.operator.switch('set_paused', wanted=True)
    held_ns = left.drive.session.bench.time_ns
    right.operator.command('sawtooth', (300.0, 1000.0, STEPS))
    assert right.operator.wait_for_event('sawtooth', 0)['steps'] == STEPS
    assert left.drive.session.bench.time_ns == held_ns
    assert left.drive.session.bench.state.position_m == 0.0
    assert right.drive.session.bench.state.position_m > 1e-8
    right.operator.set_parameter('fault.dead_foot', 1)
    right.operator.trigger('stop')
    assert left.drive.session.worker.faults == {}
    assert left.operator.events == []
    first = {}
    for name, stand in (('left', left), ('right', right)):
        assert stand.operator.set_recording(wanted=False).success
        series = Recording(tmp_path / f'{name}.mcap').series('position')
        first[name] = (series.time_s[0], series.value[0])
    assert first['left'][0] == first['right'][0]  # both stand still then
    assert first['left'][1] != first['right'][1]


@pytest.mark.parametrize('namespace', ['/left', '/left/arm'])
def test_absolute_names_stay_where_they_are(start_drive: Callable, namespace: str):
    stand = start_drive({'sim.publish_clock': True}, namespace)
    node = stand.operator.node
    assert node.count_publishers('/diagnostics') == 1
    assert node.count_publishers('/clock') == 1
    assert node.count_publishers(f'{namespace}/position') == 1
