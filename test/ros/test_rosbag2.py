# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Real ``ros2 bag`` plays a bag of commands into a drive and records it back."""

import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from executables import end
from mcap_records import rows_of
from processes import run_process, start_process

from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.joints import Joints
from stickslip_ros.interface.messages import StampedMessage
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.run import ReportingBench, RunWriter
from stickslip_ros.recording.run_file import run_path

BLOCK_NS = 1_000_000
PLAN = (
    Request('steps', (3.0,)),
    Request('voltage', (150.0,)),
    Request('sawtooth', (200.0, 1000.0, 2.0)),
    Request('waveform', (0.0, 0.0, 0.002, 30.0)),
    Request('load', (0.05, 0.0, 0.0, 0.0, 0.0, 0.0)),
    Request('preload', (0.45,)),
    Request('jog', (0.0,)),
    Request('position', (0.0, 0.0, 0.0)),
    Request('joint', joints=Joints(('runner_joint',), (50e-9,))),
)
FREE = {'load_cell.contact': 'absent'}
ROS2_BAG = ('bash', '-c', 'source /opt/ros/*/setup.bash; exec ros2 bag "$@"', 'bash')
"""``ros2 bag`` of /opt/ros, or of the ROS 2 that was sourced."""
MISSING = 'no real rosbag2 here: apt install ros-jazzy-ros2bag ros-jazzy-rosbag2-storage-mcap'
DISCRETE = {'steps', 'voltage', 'sawtooth', 'waveform', 'load', 'preload', 'jog'}
"""Moves whose end does not depend on when the controller of a closed loop looks."""
NEAR_M = 0.8e-9
"""Largest difference at the ends of discrete moves that was seen with rosbag2 0.26."""


def record_bag(folder: Path, values: dict[str, Any], every_blocks: int = 60) -> Path:
    """Record the plan, one request after the other, as a bag directory."""
    given = {**values, 'record.format': 'bag', 'record.directory': str(folder)}
    stand = Parameters().updated(given)
    with RunWriter(run_path(stand), stand, wait=True) as writer:
        run = ReportingBench(stand, writer=writer)
        for request in PLAN:
            run.accept(request)
            for _ in range(every_blocks):
                run.update(run.bench.time_ns + BLOCK_NS)
    return writer.recorder.path


def commands_of(bag: Path) -> list[tuple[str, bytes]]:
    """Give topic and bytes of each command in a bag."""
    rows = [row for file in sorted(bag.glob('*.mcap')) for row in rows_of(file)]
    return [(topic, data) for topic, _, _, data in rows if topic.startswith('/command/')]


def ends_of(bag: Path) -> dict[str, float]:
    """Give the last position before the next command, or the end, by command."""
    ends_m, command = dict[str, float](), ''
    for topic, _, message in Recording(bag).messages():
        if topic.startswith('/command/'):
            command = topic.removeprefix('/command/')
        elif topic == '/position' and isinstance(message, StampedMessage):
            ends_m[command] = message.values[0]
    return ends_m


@pytest.mark.slow  # in real time, and nowhere but beside an installed ROS 2
def test_real_rosbag2_plays_every_command_and_records_the_motion_of_the_bag(
    start_drive: Callable, perfect_sensors: dict[str, float], ros_domain: int, tmp_path: Path
):
    surroundings = {**os.environ, 'ROS_DOMAIN_ID': str(ros_domain)}
    if surroundings.pop('_ROS_WHEELS_BOOTSTRAP_COMPLETE', ''):
        surroundings.pop('LD_LIBRARY_PATH', '')  # that of the wheels
    if run_process([*ROS2_BAG, 'play', '--help'], env=surroundings).returncode:
        pytest.skip(MISSING)
    bag, back = record_bag(tmp_path, {**FREE, **perfect_sensors}, 300), tmp_path / 'back'
    operator = start_drive({**FREE, **perfect_sensors}).operator
    topics = sorted({topic for topic, _ in commands_of(bag)})
    words = ['record', '-s', 'mcap', '-o', back, '--include-unpublished-topics']
    recorder = start_process(
        [*ROS2_BAG, *words, '--topics', *topics, '/position'], env=surroundings
    )
    for topic in topics:  # the drive hears it, and the recorder
        operator.spin_until(lambda name=topic: operator.node.count_subscribers(name) > 1, topic)
    words = ['play', bag, '--delay', '3', '--regex', '/command/.*']
    run_process([*ROS2_BAG, *words], env=surroundings, check=True)
    operator.spin_until(lambda: len(operator.events) == len(PLAN), 'the end of every command')
    operator.spin_for(0.1)
    end(recorder, signal.SIGINT)
    assert commands_of(back) == commands_of(bag)
    wanted_m, found_m = ends_of(bag), ends_of(back)
    for command in DISCRETE:
        assert found_m[command] == pytest.approx(wanted_m[command], abs=NEAR_M), command
