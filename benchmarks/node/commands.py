# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What voltages at 1 kHz, their events and listeners cost the node; when a command is read."""

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager

import numpy as np
from geometry_msgs.msg import PointStamped
from rclpy.node import Node
from std_msgs.msg import Float64, String

from benchmarks.node.process import Helper, Lane, Process, serve
from benchmarks.node.spinning import ros, wait_for
from benchmarks.outcome import Outcome, Row
from benchmarks.sizes import Sizes
from stickslip_ros.arrays import Array
from stickslip_ros.parameters import NODE_NAME
from stickslip_ros.ros.executable import open_executor
from stickslip_ros.runtime.pacing import wake_in_time

RATE_HZ = 1000.0
LOW_V, HIGH_V = 100.0, 150.0
"""Voltages in turn: a change moves the runner by about 27 nm, without a slip."""
MOVED_M = 5e-9
"""Change of the position that no noise makes."""
WAIT_S = 10.0
BUSY = 3
TOPICS = {'event': (String, f'{NODE_NAME}/event'), 'position': (PointStamped, 'position')}


class Client:
    """Sends voltages, and reads positions without a thread of its own."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._executor = open_executor(node.context)
        self._executor.add_node(node)
        self._voltage = node.create_publisher(Float64, 'command/voltage', 10)
        self._position_m = 0.0

    def listen(self, topic: str) -> None:
        """Subscribe to a topic, and wait until the drive knows it."""
        kind, name = TOPICS[topic]
        take = self._take if topic == 'position' else lambda _: None
        heard = self._node.create_subscription(kind, name, take, 100)
        wait_for(heard.get_publisher_count, f'the publisher of {name}')

    def send(self, seconds: float) -> None:
        """Send voltages at 1 kHz."""
        wait_for(self._voltage.get_subscription_count, 'a drive that takes commands')
        begin_s, count = time.monotonic(), round(seconds * RATE_HZ)
        for number in range(count):
            self._voltage.publish(Float64(data=LOW_V + number % 50))
            time.sleep(max(0.0, begin_s + (number + 1) / RATE_HZ - time.monotonic()))

    def delays(self, count: int) -> list[float]:
        """Return the times from some commands to the first readings that show them, s."""
        found = []
        for number in range(count + 1):
            self._spin(0.02)
            before_m, begin_s = self._position_m, time.monotonic()
            self._voltage.publish(Float64(data=(LOW_V, HIGH_V)[number % 2]))
            while abs(self._position_m - before_m) < MOVED_M:
                self._executor.spin_once(timeout_sec=WAIT_S)
                assert time.monotonic() - begin_s < WAIT_S, 'no reading shows a command'
            found.append(time.monotonic() - begin_s)
        return found[1:]  # the first begins elsewhere

    def _spin(self, seconds: float) -> None:
        end_s = time.monotonic() + seconds
        while (left_s := end_s - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left_s)

    def _take(self, message: PointStamped) -> None:
        self._position_m = message.point.x


def run(sizes: Sizes) -> Outcome:
    """Measure costs with nobody else, then delays."""
    idle, sent, told, heard = (
        np.array([1e3 * each for each in its]) for its in zip(*_turns(sizes), strict=True)
    )
    costs = {
        'idle, a block': idle,
        'a voltage': sent - idle,
        'its event, heard': told - sent,
        'a reading, heard': heard - idle,
    }
    rows: list[Row] = [_row(what, its, 'us') for what, its in costs.items()]
    rows.append(_row('command to reading', _delays_ms(sizes), 'ms'))
    with busy(BUSY):
        beside = f'the same beside {BUSY} busy loops'
        rows.append(_row(beside, _delays_ms(sizes), 'ms'))
    return Outcome(
        'The node at 1 kHz: processor time of a message, and time from a command to its reading',
        rows,
        [f'{sizes.node_rounds} turns of {sizes.turn_s:g} s; blocks of 1 ms, nobody else listens'],
    )


def _row(what: str, values: Array | list[float], unit: str) -> Row:
    return {
        'what': what,
        'median': float(np.median(values)),
        'worst': float(np.max(values)),
        'unit': unit,
    }


def _turns(sizes: Sizes) -> Iterator[list[float]]:
    """Yield processor ms per ms: idle, with voltages, with their events heard, with a listener."""
    for _ in range(sizes.node_rounds):
        with ExitStack() as stack:
            lane, drive = _drive(stack)
            client = _client(stack, lane)
            client.ask('send', seconds=sizes.settle_s)

            def cost(client: Helper = client, drive: Process = drive, **asked: float) -> float:
                begin_s, cpu_s = time.monotonic(), drive.cpu_s()
                client.ask('send', **asked) if asked else time.sleep(sizes.turn_s)
                return (drive.cpu_s() - cpu_s) / (time.monotonic() - begin_s)

            costs = [cost(), cost(seconds=sizes.turn_s)]
            client.ask('listen', topic='event')
            costs.append(cost(seconds=sizes.turn_s))
            client.ask('listen', topic='position')
            yield [*costs, cost()]


def _delays_ms(sizes: Sizes) -> list[float]:
    with ExitStack() as stack:
        lane, _ = _drive(stack)
        client = _client(stack, lane)
        client.ask('listen', topic='position')
        client.ask('send', seconds=sizes.settle_s)
        found: list[float] = client.ask('delays', count=round(100 * sizes.turn_s))
    return [1e3 * each for each in found]


def _drive(stack: ExitStack) -> tuple[Lane, Process]:
    lane = Lane()
    drive = Process(['-m', 'stickslip_ros.ros.node', *lane.ros_arguments], lane)
    return lane, stack.enter_context(closing(drive))


def _client(stack: ExitStack, lane: Lane) -> Helper:
    client = Helper(['-m', 'benchmarks.node.commands', *lane.ros_arguments], lane)
    return stack.enter_context(closing(client))


@contextmanager
def busy(count: int) -> Iterator[None]:
    """Keep processors busy meanwhile."""
    loops = [subprocess.Popen([sys.executable, '-c', 'while True: pass']) for _ in range(count)]
    try:
        yield
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()


def main() -> None:
    """Command until nobody asks any more."""
    wake_in_time()
    with ros():
        serve(Client(Node('client')))


if __name__ == '__main__':
    main()
