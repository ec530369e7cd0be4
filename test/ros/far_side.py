# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The other host of a drive: it reads positions or sends loads, and prints what becomes of them.

    python far_side.py read|send RELIABILITY:DEPTH ...

"""

import json
import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PointStamped, WrenchStamped
from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import QoSProfile, ReliabilityPolicy
from waiting import wait_until

from stickslip_ros.testing import stamp_ns

SPAN_S, BLOCK_S = 6.0, 5e-3
"""Simulated time of the positions that are read, and of one of them."""
LOADS, LOAD_N, PERIOD_S = 600, 1e-9, 5e-3


class FarSide:
    """A node that is spun while it waits."""

    def __init__(self) -> None:
        rclpy.init()
        self.node = rclpy.create_node('far_side')

    def spin(self, time_s: float) -> None:
        rclpy.spin_once(self.node, timeout_sec=time_s)

    def wait(self, condition: Callable[[], Any], what: str, heard: list[Any]) -> None:
        wait_until(condition, what, progress=lambda: len(heard), pause=self.spin)

    def read(self, profile: QoSProfile) -> dict[str, float]:
        """Return which share of the positions arrives, how old they are, and what DDS says."""
        stamps, ages_s, lost = list[int](), list[float](), [0]

        def take(message: PointStamped) -> None:
            stamps.append(stamp_ns(message))
            ages_s.append(1e-9 * (time.time_ns() - stamps[-1]))

        def lose(event: Any) -> None:
            lost[0] = event.total_count

        events = SubscriptionEventCallbacks(message_lost=lose)
        subscription = self.node.create_subscription(
            PointStamped, 'position', take, profile, event_callbacks=events
        )
        self.wait(lambda: stamps and stamps[-1] - stamps[0] > 1e9 * SPAN_S, 'positions', stamps)
        self.node.destroy_subscription(subscription)
        wanted = 1e-9 * (stamps[-1] - stamps[0]) / BLOCK_S + 1.0
        return {
            'share': len(stamps) / wanted,
            'age_s': statistics.median(ages_s),
            'told_lost': lost[0],
        }

    def send(self, profile: QoSProfile) -> dict[str, str]:
        """
        Return what the diagnostics say of the loads when the last one is acknowledged.

        Loads of 0 N go ahead until the drive hears one; the others have `LOAD_N`.

        """
        said: dict[str, str] = {}
        reports: list[Any] = []

        def take(message: DiagnosticArray) -> None:
            reports.append(message)
            for status in message.status:
                if status.name.endswith(': connections'):
                    said.update({pair.key: pair.value for pair in status.values})

        self.node.create_subscription(DiagnosticArray, '/diagnostics', take, 10)
        loads = self.node.create_publisher(WrenchStamped, 'command/load', profile)
        sent: list[WrenchStamped] = []

        def send(force_n: float = LOAD_N) -> None:
            if len(sent) == LOADS:
                return
            sent.append(WrenchStamped())
            sent[-1].header.stamp = self.node.get_clock().now().to_msg()
            sent[-1].wrench.force.x = force_n
            loads.publish(sent[-1])

        def is_heard() -> bool:
            if len(sent) < len(reports):
                send(0.0)
            return 'command_age_median_s' in said

        self.wait(is_heard, 'the drive', reports)
        sent.clear()
        timer = self.node.create_timer(PERIOD_S, send)
        self.wait(lambda: len(sent) == LOADS, 'sent loads', sent)
        self.node.destroy_timer(timer)
        moment = Duration(seconds=0.1)
        self.wait(lambda: loads.wait_for_all_acked(moment), 'acknowledgements', reports)
        wanted = len(reports) + 2
        self.wait(lambda: len(reports) >= wanted, 'diagnostics', reports)
        return said


if __name__ == '__main__':
    side, answers = FarSide(), list[Any]()
    for word in sys.argv[2:]:
        reliability, depth = word.split(':')
        qos = QoSProfile(depth=int(depth), reliability=ReliabilityPolicy[reliability.upper()])
        answers.append({'read': side.read, 'send': side.send}[sys.argv[1]](qos))
    print(json.dumps(answers))  # noqa: T201
