"""
A bare rclpy program with the outer shape of the node: an executor, and a thread that ticks.

It publishes what the node publishes, and answers ``command/voltage`` at its next tick; nothing is
simulated. As the node does, it asks for timely wake-ups and keeps its objects from garbage
collection, unless it is to be plain. ``python -m benchmarks.node.bare_loop`` is started by the
benchmarks.

"""

import argparse
import gc
import threading
import time
from array import array
from pathlib import Path
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Float64, Float64MultiArray

from benchmarks.node.lateness import Window, windows_of
from benchmarks.node.process import serve
from benchmarks.node.spinning import own_words, ros, spinning
from benchmarks.node.traffic import (
    BLOCK_NS,
    DEPTH,
    TYPES,
    Fresh,
    Objects,
    Packed,
    RecordedApart,
    RecordedInline,
    Traffic,
)
from stickslip_ros.runtime.pacing import wake_in_time
from stickslip_ros.units import NS_PER_S

PERIOD_S = BLOCK_NS / NS_PER_S
METRES_PER_VOLT = 1e-9


class Loop:
    """
    Ticks of one period.

    Parameters
    ----------
    traffic : Traffic
        What a tick does.
    pace : str
        ``absolute`` sleeps to deadlines, ``relative`` sleeps a period after each tick, ``timer``
        is a timer of the executor, ``grant`` ticks when it is told to.
    node : Node
        For the timer and the grants.

    """

    def __init__(self, traffic: Traffic, pace: str, node: Node) -> None:
        self._traffic = traffic
        self._tick = 0
        self._lateness_s = array('d')
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None
        self._pace = pace
        self._timer: Any = None
        self._node = node
        if pace == 'grant':
            node.create_subscription(
                Float64MultiArray, 'command/grant', self._on_grant, QoSProfile(depth=DEPTH)
            )

    def start(self) -> None:
        """Begin to tick."""
        self._ended.clear()
        self._lateness_s = array('d')
        if self._pace == 'timer':
            self._timer = self._node.create_timer(PERIOD_S, self._advance)
        elif self._pace != 'grant':
            run = self._run_absolute if self._pace == 'absolute' else self._run_relative
            self._thread = threading.Thread(target=run, name='loop', daemon=True)
            self._thread.start()

    def stop(self) -> None:
        """End the ticks."""
        self._ended.set()
        if self._timer is not None:
            self._node.destroy_timer(self._timer)
            self._timer = None
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def windows(self) -> list[Window]:
        """Return the lateness since the last call, or since the start."""
        lateness_s, self._lateness_s = self._lateness_s, array('d')
        return windows_of(lateness_s, PERIOD_S)

    def _advance(self) -> None:
        self._tick += 1
        self._traffic.send(self._tick)

    def _on_grant(self, message: Any) -> None:
        # Half a block on, against rounding: a grant taken twice would make two trips at once.
        if message.data[0] * NS_PER_S > (self._tick + 0.5) * BLOCK_NS:
            self._advance()

    def _run_absolute(self) -> None:
        deadline_s = time.monotonic()
        while not self._ended.is_set():
            self._advance()
            deadline_s += PERIOD_S
            pause_s = deadline_s - time.monotonic()
            if pause_s > 0.0:
                time.sleep(pause_s)
            self._lateness_s.append(max(0.0, time.monotonic() - deadline_s))

    def _run_relative(self) -> None:
        while not self._ended.is_set():
            self._advance()
            time.sleep(PERIOD_S)


def main() -> None:
    """Run until nobody asks any more."""
    parser = argparse.ArgumentParser()
    forms = ('objects', 'fresh', 'packed', 'none')
    parser.add_argument('--messages', choices=forms, default='objects')
    parser.add_argument('--topics', nargs='+', default=list(TYPES))
    pace = ('absolute', 'relative', 'timer', 'grant')
    parser.add_argument('--pace', choices=pace, default='absolute')
    parser.add_argument('--rate-hz', type=float, default=50e3)
    parser.add_argument('--record', type=Path, help='with mcap_ros2, in the thread that ticks')
    parser.add_argument('--record-apart', type=Path, help='with the recorder of the node')
    parser.add_argument('--plain', action='store_true', help='wake up as any program does')
    chosen = parser.parse_args(own_words())
    if not chosen.plain:
        wake_in_time()
    with ros():
        node = Node('bare_loop')
        traffic = traffic_of(chosen, node)

        def on_voltage(message: Any) -> None:
            traffic.reading_m = METRES_PER_VOLT * message.data

        node.create_subscription(Float64, 'command/voltage', on_voltage, QoSProfile(depth=DEPTH))
        loop = Loop(traffic, chosen.pace, node)
        if not chosen.plain:
            gc.freeze()
        with spinning(node):
            serve({'start': loop.start, 'stop': loop.stop, 'windows': loop.windows})
            loop.stop()
        traffic.close()


def traffic_of(chosen: argparse.Namespace, node: Node) -> Traffic:
    """Return what the loop sends."""
    if chosen.record is not None:
        return RecordedInline(node, chosen.rate_hz, chosen.record)
    if chosen.record_apart is not None:
        return RecordedApart(node, chosen.rate_hz, chosen.record_apart)
    if chosen.messages == 'none':
        return Traffic()
    if chosen.messages == 'packed':
        return Packed(node, chosen.rate_hz)
    kind = Fresh if chosen.messages == 'fresh' else Objects
    return kind(node, chosen.rate_hz, chosen.topics)


if __name__ == '__main__':
    main()
