"""What a node has recorded is run again without ROS, to the byte."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rclpy.parameter import Parameter

from stickslip_ros.recording.fingerprint import compare_data
from stickslip_ros.recording.reader import Recording
from stickslip_ros.ros.position_controller import PositionController
from stickslip_ros.study.replay import replay

NAME = 'live.mcap'
RECORDED = {'record.on_start': True, 'record.name': NAME}


def replay_and_check(stand: Any, tmp_path: Path) -> Recording:
    """End the drive, replay what it recorded, and compare."""
    stand.close()
    source = tmp_path / NAME
    result = replay(source, tmp_path / 'again.mcap')
    assert result.identical, result.difference
    recording = Recording(source)
    assert compare_data(recording, Recording(tmp_path / 'again.mcap')) is None
    assert _data(source) == _data(tmp_path / 'again.mcap')
    return recording


def _data(file: Path) -> list[bytes]:
    """Give the records of a file up to the end of the data, but for metadata and attachments."""
    content = file.read_bytes()
    records: list[bytes] = []
    at = 8
    while (opcode := content[at]) != DATA_END:
        end = at + 9 + int.from_bytes(content[at + 1 : at + 9], 'little')
        if opcode not in (ATTACHMENT, METADATA):
            records.append(content[at:end])
        at = end
    return records


ATTACHMENT, METADATA, DATA_END = 0x09, 0x0C, 0x0F


def test_everything_asked_of_a_node_in_real_time_is_replayed(
    start_drive: Callable, tmp_path: Path
):
    schedule = tmp_path / 'faults.yaml'
    schedule.write_text('- {at: 0.05, set: {missed_steps: 0.1}}\n- {at: 0.3, clear: true}\n')
    stand = start_drive({**RECORDED, 'fault.schedule': str(schedule)})
    operator = stand.operator
    operator.command('sawtooth', (300.0, 1000.0, 0.0))
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
    assert recording.series('position').time_s[0] == pytest.approx(1e-3)


def test_a_controller_over_topics_in_lockstep_is_replayed(start_drive: Callable, tmp_path: Path):
    stand = start_drive({**RECORDED, 'sim.lockstep': True}, wait=False)
    controller = PositionController(
        context=stand.context,
        parameter_overrides=[Parameter('lockstep', value=True)],
    )
    stand.operator.add_node(controller)
    controller.loop.aim(1e-6)
    stand.operator.spin_until(lambda: controller.loop.in_position, 'the target')
    controller.destroy_node()
    recording = replay_and_check(stand, tmp_path)
    sent = [each for each in recording.channels if '/command/' in each.topic]
    assert sum(each.messages for each in sent) > 5


def test_names_and_qualities_of_service_that_were_changed_are_replayed(
    start_drive: Callable, tmp_path: Path
):
    values = {
        **RECORDED,
        'qos_overrides./left/measured.publisher.reliability': 'best_effort',
        'sim.real_time_factor': 0.0,
    }
    stand = start_drive(values, namespace='/left', remaps=('position:=measured',), wait=False)
    session = stand.drive.session
    stand.operator.spin_until(lambda: session.bench.time_ns > 10**8, 'a tenth of a second')
    recording = replay_and_check(stand, tmp_path)
    assert '/left/measured' in recording.types
