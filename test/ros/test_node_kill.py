"""The recording of a node that was killed holds all but the last moments that it published."""

import json
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import killed_nodes
import pytest
from geometry_msgs.msg import PointStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from stickslip_ros.errors import RecordingError
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recover import recover
from stickslip_ros.ros.executable import end_node
from stickslip_ros.testing import open_context, stamp_ns
from stickslip_ros.units import NS_PER_S

PROCESSES, NODES_EACH = 2, 6
#: What a machine that is busy with other tests may need to write, beyond the flush period.
BUSY_S = 0.6
TIMEOUT_S = 90.0
SPIN_S = 0.2


class Listener:
    """
    Hears the positions of one node, on a thread and in a domain of its own.

    Fast DDS makes all publishers of a domain wait for a third of a second when a process was
    killed whose shared memory is full; nodes of one domain would hold each other up.

    """

    def __init__(self, ros_domain: int, number: int) -> None:
        self.heard: list[int] = []
        self._context = open_context(killed_nodes.domain_of(ros_domain, number))
        # Nodes of one name in one process would share one publisher of logs, in one's context:
        # rcl gives it away with whichever of them ends first.
        self._node = Node(f'listener{number}', context=self._context, enable_rosout=False)
        self._node.create_subscription(PointStamped, f'/n{number}/position', self._take, 1000)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        while not self._ended.is_set():
            self._executor.spin_once(timeout_sec=SPIN_S)

    def _take(self, message: PointStamped) -> None:
        self.heard.append(stamp_ns(message))

    def close(self) -> None:
        """Hear no more."""
        self._ended.set()
        self._thread.join()
        end_node(self._executor, self._node)
        self._context.try_shutdown()


@pytest.fixture(scope='module')
def killed(tmp_path_factory: pytest.TempPathFactory, ros_domain: int) -> Any:
    """Give the folder, when each node was killed, and what was heard of it."""
    folder = tmp_path_factory.mktemp('killed')
    listeners = [Listener(ros_domain, number) for number in range(PROCESSES * NODES_EACH)]
    command = [sys.executable, killed_nodes.__file__, str(folder), str(ros_domain)]
    processes = [
        subprocess.Popen(
            [*command, str(each * NODES_EACH), str(NODES_EACH)],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        for each in range(PROCESSES)
    ]
    try:
        said = [each.communicate(timeout=TIMEOUT_S)[0] for each in processes]
    finally:
        for each in processes:
            each.kill()
        for listener in listeners:
            listener.close()
    lines = [line for each in said for line in each.splitlines()]
    kills = [json.loads(line) for line in lines if line.startswith(b'{')]  # Fast DDS writes too
    return folder, kills, [each.heard for each in listeners]


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
        # By the time of the drive: what a starved process has not simulated, it cannot lose.
        listened_ns = heard[number][-1] - heard[number][0] if heard[number] else 0
        end_ns = recording.time_origin_ns + last_ns
        assert max(heard[number], default=0) - end_ns <= bound_ns
        is_long = listened_ns > bound_ns
        checked += is_long
        [sawtooth] = [each for each in recording.channels if each.topic.endswith('/sawtooth')]
        if is_long:
            assert sawtooth.messages == number % 2
    assert checked >= 5
