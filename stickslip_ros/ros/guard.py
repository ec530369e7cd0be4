# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Guard every subscription: count refused and lost messages, and raise nothing."""

import threading
from collections import Counter, deque
from collections.abc import Callable
from functools import cached_property
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription

from stickslip_ros.errors import PROBLEM, StickSlipError
from stickslip_ros.instrument.reports import Event


class Summons:
    """
    A call of a function by the executor of its node, asked for on any thread.

    It is a timer: EventsExecutor has no guard conditions, and a task with an error crashes it.

    """

    def __init__(self, node: Node, callback: Callable[[], object]) -> None:
        self._node, self._callback = node, callback
        clock = Clock(clock_type=ClockType.STEADY_TIME)
        self.timer = node.create_timer(0.0, self._call, clock=clock)
        self.timer.cancel()

    def send(self) -> None:
        self.timer.reset()
        if self._node.executor is not None:
            self._node.executor.wake()

    def _call(self) -> None:
        self.timer.cancel()
        self._callback()


class Guard:
    """
    Refusals of a node: counted, and logged once per name and report.

    ``count`` is the number of refused messages and calls, ``last`` the reason of the latest
    refusal. ``lost`` is the number of messages by topic that the network lost. ``tell`` takes a
    line, by default for the log, in the thread of the executor.

    """

    def __init__(self, node: Node) -> None:
        self.count, self.last = 0, ''
        self.lost: Counter[str] = Counter()
        self.tell: Callable[[str], object] = node.get_logger().warning
        self._lines: deque[str] = deque()
        self._log_soon = Summons(node, self._log)
        self._reported = 0
        self._logged: set[str] = set()  # names since the last report
        self._lock = threading.Lock()

    def refuse(self, name: str, error: object) -> None:
        """Count a message or a call that the node refuses, by the name of its topic or service."""
        is_foreseen = isinstance(error, StickSlipError | str)
        why = str(error) if is_foreseen else f'{type(error).__name__}: {error}'
        line = f'{name} refused: {why}'[:PROBLEM]
        with self._lock:  # executors may have several threads
            self.count, self.last = self.count + 1, line
        self._note(name, line)

    def note(self, event: Event) -> None:
        """Log a command that the drive has refused, or that has failed."""
        start = f'{event.command} (command {event.number})'
        self._note(event.command, f'{start} {event.result.name}: {event.message}')

    def _note(self, name: str, line: str) -> None:
        with self._lock:
            is_first = name not in self._logged
            self._logged.add(name)
        if is_first:
            self._lines.append(line)
            self._log_soon.send()

    def _log(self) -> None:
        while self._lines:
            self.tell(self._lines.popleft())

    def begin_report(self) -> None:
        """Let the next refusal of each name be logged again."""
        with self._lock:
            self._logged.clear()

    def news(self, others: int = 0) -> str:
        """Return a text on the refusals since the last call, with all ``others`` of a drive."""
        total = self.count + others
        news, self._reported = max(0, total - self._reported), total
        return f'{news} refused since the last report' if news else ''

    def values(self) -> dict[str, str]:
        """Return the values of the diagnostics on refused and lost messages."""
        return {
            'messages_refused': str(self.count),
            'last_refused': self.last,
            'messages_lost': str(self.lost.total()),
        }


class GuardedNode(Node):  # type: ignore[misc]
    """A node with a guard in front of all its subscriptions, those of rclpy included."""

    @cached_property
    def guard(self) -> Guard:
        return Guard(self)

    def create_subscription(
        self,
        msg_type: Any,
        topic: str,
        callback: Any,
        qos_profile: Any,
        *,
        raw: bool = False,
        **other: Any,
    ) -> Subscription:
        """Subscribe; count malformed and lost messages, and errors of ``callback``."""

        def take(data: bytes, *info: Any) -> None:
            why: object = f'{len(data)} bytes are no {msg_type.__name__}; check their publisher'
            try:
                message = data if raw else deserialize_message(data, msg_type)
                why = None
                callback(message, *info)
            except Exception as error:  # noqa: BLE001 - a message may be anything
                self.guard.refuse(topic, why or error)

        def lose(event: Any) -> None:
            self.guard.lost[topic] += event.total_count_change

        events = other.setdefault('event_callbacks', SubscriptionEventCallbacks())
        events.message_lost = lose
        take.__wrapped__ = callback  # type: ignore[attr-defined] # rclpy looks at its arguments
        return super().create_subscription(msg_type, topic, take, qos_profile, raw=True, **other)
