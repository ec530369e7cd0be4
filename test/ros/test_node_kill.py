"""The recording of a node that was killed holds all but the last moments that it published."""

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import killed_nodes
import pytest
import rclpy
from geometry_msgs.msg import PointStamped
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from stickslip_ros.errors import RecordingError
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recover_run import recover

PROCESSES, NODES_EACH = 2, 10
#: What a machine that is busy with other tests may need to write, beyond the flush period.
BUSY_S = 0.6
TIMEOUT_S = 90.0
NS_PER_S = 1_000_000_000


class Listener:
    """Hears the positions of one node."""

    def __init__(self, node: Node, number: int) -> None:
        self.heard: list[tuple[int, int]] = []
        node.create_subscription(PointStamped, f'/n{number}/position', self._take, 1000)

    def _take(self, message: PointStamped) -> None:
        stamp = message.header.stamp
        self.heard.append((time.monotonic_ns(), stamp.sec * NS_PER_S + stamp.nanosec))


@pytest.fixture(scope='module')
def killed(tmp_path_factory: pytest.TempPathFactory, domain: int) -> Iterator[Any]:
    """Give the folder, when each node was killed, and what was heard of it."""
    folder = tmp_path_factory.mktemp('killed')
    context = Context()
    rclpy.init(context=context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    node = Node('listener', context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    listeners = [Listener(node, number) for number in range(PROCESSES * NODES_EACH)]
    command = [sys.executable, killed_nodes.__file__, str(folder), str(domain)]
    processes = [
        subprocess.Popen(
            [*command, str(each * NODES_EACH), str(NODES_EACH)],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        for each in range(PROCESSES)
    ]
    end_s = time.monotonic() + TIMEOUT_S
    while any(each.poll() is None for each in processes) and time.monotonic() < end_s:
        executor.spin_once(timeout_sec=0.02)
    kills = [
        json.loads(line)
        for each in processes
        for line in each.communicate(timeout=1)[0].splitlines()
    ]
    yield folder, kills, [each.heard for each in listeners]
    executor.shutdown()
    node.destroy_node()
    context.try_shutdown()


def test_nodes_killed_at_random_moments_lose_no_more_than_the_last_moments(killed: Any):
    folder, kills, heard = killed
    assert [each['killed'] for each in kills] == [True] * PROCESSES * NODES_EACH
    bound_ns = round((killed_nodes.FLUSH_PERIOD_S + BUSY_S) * NS_PER_S)
    checked = 0
    for kill in kills:
        number = kill['number']
        source = Path(folder) / f'run{number}.mcap'
        with pytest.raises(RecordingError, match='stickslip recover'):
            Recording(source)
        _, mended = recover(source)
        recording = Recording(mended)
        [position] = [each for each in recording.channels if each.topic == f'/n{number}/position']
        last_ns = position.last_ns or 0
        assert position.gaps == 0
        assert position.messages * 1_000_000 == last_ns
        old = [stamp for at, stamp in heard[number] if at < kill['killed_ns'] - bound_ns]
        assert last_ns >= max(old, default=0)
        checked += bool(old)
        [sawtooth] = [each for each in recording.channels if each.topic.endswith('/sawtooth')]
        if old:
            assert sawtooth.messages == number % 2
    assert checked >= 5
