# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What a node has recorded is run again without ROS, or played into a node, to the byte."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from mcap_records import rows_of
from rosbags.highlevel import AnyReader
from sensor_msgs.msg import JointState
from test_rosbag2 import PLAN, record_bag

from stickslip_ros.interface.topics import COMMAND_TOPICS
from stickslip_ros.lab.runs.replay import replay
from stickslip_ros.recording.differences import compare_data
from stickslip_ros.recording.reader import Recording
from stickslip_ros.ros.interface import MESSAGE_TYPES, to_profile
from stickslip_ros.testing import LockstepClient

NAME = 'live.mcap'
RECORDED = {'record.on_start': True, 'record.name': NAME}


def replay_and_check(stand: Any, tmp_path: Path) -> Recording:
    """End the drive, replay what it recorded, together and each part alone, and compare."""
    stand.close()
    recording = Recording(tmp_path / NAME)
    for source in {recording.path, *recording.files}:
        result = replay(source, tmp_path / source.stem / 'again.mcap')
        assert result.identical, result.difference
        again = Recording(result.output)
        assert compare_data(Recording(source), again) is None
        assert [rows_of(each) for each in Recording(source).files] == [
            rows_of(each) for each in again.files
        ]
    return recording


@pytest.mark.parametrize(
    ('begins', 'split'),
    [
        ('with the drive', {}),
        ('in the middle', {}),
        (
            'with the drive',
            {'record.split_duration': 0.07, 'record.flush_period': 0.05, 'record.trace': False},
        ),
        ('in the middle', {'record.split_size': 200_000, 'record.chunk_size': 50_000}),
    ],
    ids=['with the drive', 'in the middle', 'in parts by duration', 'in parts by size'],
)
@pytest.mark.usefixtures('default_blocks')
def test_everything_asked_of_a_node_in_real_time_is_replayed(start_drive, tmp_path, begins, split):
    schedule = tmp_path / 'faults.yaml'
    schedule.write_text('- {at: 0.05, set: {missed_steps: 0.1}}\n- {at: 0.3, clear: true}\n')
    from_start = begins == 'with the drive'
    values = {**RECORDED, 'record.on_start': from_start, 'fault.schedule': str(schedule)}
    stand = start_drive({**values, **split})
    operator = stand.operator
    operator.command('sawtooth', (300.0, 1000.0, 0.0))
    if not from_start:
        operator.spin_for(0.123)
        operator.switch('set_recording', wanted=True)
    operator.command('load', 0.05)
    operator.spin_for(0.05)
    operator.set_parameter('fault.interferometer_offset', 1e-9)
    operator.command('jog', 200.0)
    operator.spin_for(0.05)
    operator.command('waveform', [(0.0, 0.0), (0.01, 50.0)])
    operator.wait_for_event('waveform', 0)
    operator.switch('set_paused', wanted=True)
    operator.command('voltage', 20.0)
    operator.trigger('tare_force')
    operator.trigger('step_simulation')
    operator.switch('set_paused', wanted=False)
    operator.command('position', 50e-9)
    operator.spin_for(0.05)
    operator.send('joint', JointState(name=['runner_joint'], velocity=[1e-5]))
    operator.spin_for(0.03)
    operator.send('joint', JointState(name=['runner_joint'], position=[1.0, 2.0], effort=[0.0]))
    operator.command('preload', 0.51)
    operator.wait_for_event('preload', 0)
    for name in ('stop', 'zero_position'):
        operator.trigger(name)
    operator.switch('enable_amplifier', wanted=False)
    operator.switch('enable_amplifier', wanted=True)
    operator.trigger('clear_faults')
    operator.trigger('reset')
    operator.spin_for(0.01)
    operator.switch('set_paused', wanted=True)
    operator.trigger('tare_force')
    recording = replay_and_check(stand, tmp_path)
    assert len(recording.files) > len(split)
    first_s = recording.series('position').time_s[0]
    assert first_s == pytest.approx(1e-3) if from_start else first_s > 0.1


def test_a_controller_over_topics_in_lockstep_is_replayed(start_drive: Callable, tmp_path: Path):
    stand = start_drive({**RECORDED, 'sim.lockstep': True}, wait=False)
    seen_m: list[float] = []

    def answer(_: float, position_m: float) -> list[tuple[str, float]]:
        seen_m.append(position_m)
        return [('steps', 2) if len(seen_m) % 10 == 0 else ('voltage', 100.0 + 1e6 * position_m)]

    controller = LockstepClient(stand.operator.node, 1e-3, answer)
    stand.operator.spin_until(lambda: len(seen_m) >= 100, 'a hundred readings')
    controller.close()
    recording = replay_and_check(stand, tmp_path)
    sent = [each for each in recording.channels if '/command/' in each.topic]
    assert sum(each.messages for each in sent) >= 99  # the last answer has no block


def test_a_played_bag_of_commands_is_carried_out(start_drive: Callable, tmp_path: Path):
    bag = record_bag(tmp_path, {})
    stand = start_drive({'sim.real_time_factor': 20.0, 'load_cell.contact': 'absent'})
    operator = stand.operator
    topics = {f'/{topic.name}': topic for topic in COMMAND_TOPICS}
    publishers = {
        name: operator.node.create_publisher(
            MESSAGE_TYPES[topic.type_name], name, to_profile(topic.qos)
        )
        for name, topic in topics.items()
    }
    operator.spin_until(
        lambda: all(
            each.get_subscription_count()
            for name, each in publishers.items()
            if name != '/command/grant'
        ),
        'the drive',
    )
    operator.shake_hands()  # the drive knows the publishers too
    played = 0
    with AnyReader([bag]) as reader:
        chosen = [each for each in reader.connections if each.topic in topics]
        for connection, _, data in reader.messages(chosen):
            publishers[connection.topic].publish(bytes(data))
            played += 1
            operator.spin_until(lambda n=played: len(operator.events) >= n, 'an event', 30.0)
    assert played == len(PLAN)
    results = {event['command']: event['result'] for event in operator.events}
    assert results == {request.name: 'DONE' for request in PLAN}
