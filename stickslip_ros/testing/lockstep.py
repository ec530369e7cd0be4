# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A user's node and a drive in lockstep: simulated time advances after the callbacks."""

import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from threading import Thread
from time import monotonic
from typing import Any
from unittest.mock import patch

import rclpy
from rclpy.clock_type import ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher

import stickslip_ros
from stickslip_ros.errors import StickSlipError
from stickslip_ros.interface.topics import COMMAND_TOPICS, PREFIX
from stickslip_ros.ros.client import Handshake
from stickslip_ros.ros.executable import end_node
from stickslip_ros.runtime.orders import Grant
from stickslip_ros.testing.operator import run_callbacks

WAIT_S = 0.02
"""Wall-clock time between two checks of a waiting thread."""
LEAVE_S = 1.0
"""Wall-clock time for a callback to return after the test has given up waiting."""
OURS = (
    *(f'{each.__path__[0]}/' for each in (rclpy, stickslip_ros)),
    threading.__file__,
)
"""Folders without callbacks of a user."""


class Lockstep:
    """
    Runs a drive in lockstep with the node that controls it, until a simulated time.

    The work is done on a separate thread, so that a callback which never returns is noticed.
    Inside a process DDS delivers a message before ``publish`` returns: the messages of a block
    wait in the node when the block is over. Commands are counted: the executor of the drive takes
    them later, and a grant states their number.

    """

    def __init__(self, drive: Any, node: Node, executor: SingleThreadedExecutor) -> None:
        self._drive, self._node, self._executor = drive, node, executor
        self._session = drive.session
        self._commands = {
            drive.resolve_topic_name(topic.name): topic
            for topic in COMMAND_TOPICS
            if topic.exists(self._session.parameters)
        }
        self._sent = 0  # commands to the drive since its activation
        self._doing = ''
        self._is_ending = False
        self.is_stuck = False  # whether a callback has never returned
        self._error: BaseException | None = None
        self._refuse()

    def run(self, end_ns: int, check: Callable[[], None], timeout_s: float) -> None:
        """Run until a simulated time; give up after a time-out without progress."""
        thread = Thread(target=self._work, args=(end_ns,), name='lockstep', daemon=True)
        seen, since_s = '', monotonic()
        with self._counted_commands():
            thread.start()
            try:
                while thread.is_alive():
                    thread.join(WAIT_S)
                    check()
                    now = f'{self._doing} {self._session.bench.time_ns}'
                    if now != seen:
                        seen, since_s = now, monotonic()
                    if monotonic() - since_s > timeout_s:
                        raise StickSlipError(self._why_stuck(thread, timeout_s))
            finally:
                self._is_ending = True
                thread.join(LEAVE_S)
                self.is_stuck = thread.is_alive()
        if self._error is not None:
            raise self._error

    def _refuse(self) -> None:
        """Refuse settings that stop time or make the result depend on the wall clock."""
        node, name = self._node, self._node.get_fully_qualified_name()
        if not self._session.parameters.sim.lockstep:
            raise StickSlipError("the drive has a pace; start it with {'sim.lockstep': True}")
        grants = self._drive.resolve_topic_name(f'{PREFIX}grant')
        if any(publisher.topic_name == grants for publisher in node.publishers):
            raise StickSlipError(f'{name} sends grants by itself; switch that off, or spin it')
        domains = [each.context.get_domain_id() for each in (node, self._drive)]
        if domains[0] != domains[1]:
            hint = 'make it without rclpy.init, or with context=stand.context'
            raise StickSlipError(f'{name} is in domain {domains[0]}, not {domains[1]}; {hint}')
        by_clock = [timer for timer in node.timers if timer.clock.clock_type == ClockType.ROS_TIME]
        if any(not timer.clock.ros_time_is_active for timer in by_clock):
            hint = 'set its parameter use_sim_time'
            raise StickSlipError(f'{name} has timers on wall-clock time; {hint}')
        if by_clock and not self._session.parameters.sim.publish_clock:
            hint = "start it with {'sim.publish_clock': True}"
            raise StickSlipError(f'{name} waits for /clock, which the drive lacks; {hint}')

    @contextmanager
    def _counted_commands(self) -> Iterator[None]:
        """Count the commands to the drive from any node of this process."""
        publish = Publisher.publish

        def count(publisher: Any, message: Any) -> None:
            topic = self._commands.get(publisher.topic_name)
            if topic is not None and topic.request != 'grant':
                self._sent += 1
            publish(publisher, message)

        with patch.object(Publisher, 'publish', count):
            yield

    def _work(self, end_ns: int) -> None:
        try:
            self._connect()
            self._doing = 'runs callbacks without end'
            self._await_callbacks()
            extra = 0  # uncounted commands
            while self._session.bench.time_ns < end_ns and not (extra or self._is_ending):
                self._doing = 'waits for the next block'
                until_ns = self._session.bench.time_ns + self._session.parameters.block_ns
                self._session.extend_grant(Grant(until_ns, self._sent))
                while not (self._drive.session.await_time(until_ns, WAIT_S) or self._is_ending):
                    pass
                extra = self._session.received - self._sent
                self._doing = 'runs callbacks without end'
                self._await_callbacks()
        except BaseException as error:  # noqa: BLE001 - it is raised where the test waits
            self._error = error
        else:
            if extra > 0:
                hint = 'let one node send all of them, by Publisher.publish'
                self._error = StickSlipError(f'{extra} commands came from elsewhere; {hint}')
            elif misspelling := self._find_misspelling():
                hint = 'If the topic is for another node, subscribe to it in the test'
                self._error = StickSlipError(f'{misspelling} {hint}')

    def _connect(self) -> None:
        """
        Wait until node and drive know each other and all messages sent so far have come.

        A helper node, made later than the user's node, shakes hands; no callback of the user's
        node runs meanwhile. The second of two successive answers comes after all messages that
        waited at the drive when it was requested.

        """
        helper = Node('lockstep', context=self._node.context)
        executor = SingleThreadedExecutor(context=self._node.context)
        executor.add_node(helper)
        try:
            while (name := self._find_unconnected()) and not self._is_ending:
                self._doing = f'has no other end on {name} that fits its type and quality'
                executor.spin_once(timeout_sec=WAIT_S)
            before = -1
            while before != self._session.received and not self._is_ending:
                before = self._session.received
                handshake = Handshake(helper, self._drive.get_fully_qualified_name())
                self._doing = 'waits for an answer of the drive'
                while not handshake.is_done() and not self._is_ending:
                    executor.spin_once(timeout_sec=WAIT_S)
                handshake.close()
            self._sent = before
        finally:
            end_node(executor, helper)

    def _find_unconnected(self) -> str:
        """Return a shared topic or service that is not connected yet, or ''."""
        published = {each.topic_name for each in self._drive.publishers}
        answered = {each.service_name for each in self._drive.services}
        node = self._node
        ends = [
            *((each.topic_name, each.get_subscription_count())
              for each in node.publishers if each.topic_name in self._commands),
            *((each.topic_name, each.get_publisher_count())
              for each in node.subscriptions if each.topic_name in published),
            *((each.service_name, each.service_is_ready())
              for each in node.clients if each.service_name in answered),
        ]  # fmt: skip
        return next((name for name, is_there in ends if not is_there), '')

    def _find_misspelling(self) -> str:
        """Return a text on a publisher of an unknown command without subscribers, or ''."""
        place = f'{self._drive.get_namespace().rstrip("/")}/{PREFIX}'
        for each in self._node.publishers:
            name = each.topic_name
            is_unknown = name.startswith(place) and name not in self._commands
            if is_unknown and not each.get_subscription_count():
                [near] = get_close_matches(name, self._commands, 1, 0.0)
                who = self._node.get_fully_qualified_name()
                return f'{name}, published by {who}, has no subscriber; did you mean {near}?'
        return ''

    def _await_callbacks(self) -> None:
        """Run the callbacks of the node, including those that wait for the drive's answer."""
        run_callbacks(self._executor, 0.0, lambda: self._is_ending)
        answered = {each.service_name for each in self._drive.services}
        while not self._is_ending:
            asked = [
                each.service_name
                for each in self._node.clients
                if each.service_name in answered and each._pending_requests  # noqa: SLF001
            ]
            if not asked:
                break
            self._doing = f'waits for an answer of {asked[0]}'
            run_callbacks(self._executor, WAIT_S, lambda: self._is_ending)

    def _why_stuck(self, thread: Thread, timeout_s: float) -> str:
        """Return the node's present action and line, and the simulated time, in words."""
        frame = sys._current_frames().get(thread.ident or 0)  # noqa: SLF001
        calls = [] if frame is None else traceback.extract_stack(frame)
        own = [each for each in calls if not each.filename.startswith(OURS)]
        at = f', at {own[-1].filename}:{own[-1].lineno}' if own else ''
        name = self._node.get_fully_qualified_name()
        return f'{name} {self._doing}{at}, for {timeout_s:g} s; {self._session.state}'
