# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The lifecycle node: commands in, readings out; the drive itself runs in a session."""

import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import wraps
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message
from rclpy.service import Service

from stickslip_ros.errors import StickSlipError
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import FAULT, LIVE, Request
from stickslip_ros.instrument.compilation import KERNELS, progress_reporter
from stickslip_ros.instrument.reports import Event
from stickslip_ros.instrument.stand import is_other_drive
from stickslip_ros.interface.cdr import pack_string, pack_uint32
from stickslip_ros.interface.channels import Channel
from stickslip_ros.interface.feed import Packed
from stickslip_ros.interface.requests import receive_request
from stickslip_ros.interface.topics import Topic
from stickslip_ros.kernels.kernel import compilation_reported
from stickslip_ros.parameters import NODE_NAME, Parameters, differ_when_built, format_value
from stickslip_ros.process.signals import run
from stickslip_ros.process.stopping import StillBusy
from stickslip_ros.recording.run import RunWriter
from stickslip_ros.recording.run_file import info_json
from stickslip_ros.ros import diagnostics
from stickslip_ros.ros.connections import Connections, offer_services
from stickslip_ros.ros.executable import GarbageFreezer, describe_node, guard_services, run_node
from stickslip_ros.ros.guard import GuardedNode, Summons
from stickslip_ros.ros.parameter_bridge import (
    SIM_TIME,
    CheckedNode,
    check_clock,
    declare_parameters,
    fault_defaults,
    hand_over_overrides,
    judge_changes,
    live_settings,
    read_parameters,
)
from stickslip_ros.ros.trajectory_action import TrajectoryAction, installed_types
from stickslip_ros.runtime.orders import AT_ONCE, read_grant
from stickslip_ros.runtime.session import Session, await_reply, require, why_lost
from stickslip_ros.runtime.worker import UNTROUBLED, Callbacks
from stickslip_ros.units import KILO, NANO

DIAGNOSTICS_PERIOD_S = 1.0
SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE
ERROR = TransitionCallbackReturn.ERROR

Transition = Callable[[Any, LifecycleState], TransitionCallbackReturn]


def logs_failure(transition: Transition) -> Transition:
    """Log an error in a transition, which rclpy would turn into a failure without a word."""

    @wraps(transition)
    def run(node: Any, state: LifecycleState) -> TransitionCallbackReturn:
        try:
            return transition(node, state)
        except Exception:
            name = transition.__name__.removeprefix('on_')
            node.get_logger().error(f'{name} has failed:\n{traceback.format_exc()}')
            raise

    return run


class StickSlipDrive(CheckedNode, GuardedNode, LifecycleNode):
    """
    The virtual test stand as a ROS 2 lifecycle node.

    With the parameter ``autostart`` (the default) the node configures and activates itself. If
    that is refused, it logs the reason and keeps its state, so that a lifecycle manager can try
    again. Keyword arguments are those of ``rclpy.node.Node``: ``namespace``, ``context``,
    ``parameter_overrides`` and so on. Unknown parameters and values out of range are refused.

    """

    def __init__(self, node_name: str = NODE_NAME, **node_arguments: Any) -> None:
        super().__init__(
            node_name, automatically_declare_parameters_from_overrides=True, **node_arguments
        )
        self._active: Session | None = None
        self._session: Session | None = None
        self._stuck: list[StillBusy] = []  # Kilted destroys a node whose parameters are refused
        self._is_putting_back = False
        guard_services(self)
        overrides = hand_over_overrides(self)
        parameters = declare_parameters(self)
        self.get_logger().info(describe_node(self))
        self._topics = Connections(self, self._on_message, overrides)
        self._offered_services: list[Service] = []
        self._action: TrajectoryAction | None = None
        self._trouble = ''  # cause for which the drive does not run, if there is one
        clock = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(DIAGNOSTICS_PERIOD_S, self._publish_diagnostics, clock=clock)
        self._failed = Summons(self, self._leave_active)
        self._logged_block_ns = -1
        self.add_on_set_parameters_callback(
            lambda changes: judge_changes(self, changes, runs=self._active is not None)
        )
        self.add_post_set_parameters_callback(self._after_parameters)
        if parameters.autostart and self.trigger_configure() == SUCCESS:
            self.trigger_activate()

    @property
    def session(self) -> Session:
        """The running drive; raises StickSlipError while the node is not active."""
        return require(self._active, self._state_machine.current_state[1])

    @logs_failure
    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Build the drive, compile its kernels, offer topics and services."""
        try:
            check_clock(self)
            self._session = self._build(read_parameters(self))
            self._topics.offer(self._session.parameters)
            self.guard.lost.clear()
        except StickSlipError as error:
            self._release()
            return self._refuse(f'not configured: {error}')
        acts = {'set_recording': self._set_recording, 'clear_faults': self._clear_faults}
        refuse = self.guard.refuse
        self._offered_services = offer_services(self, lambda: self.session, refuse, acts)
        types = installed_types()
        if types is not None:
            self._action = TrajectoryAction(self, types, lambda: self.session, refuse)
        self._trouble = ''
        return super().on_configure(state)

    @logs_failure
    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start the drive, and a recording if ``record.on_start`` is true."""
        try:
            session = self._up_to_date()
        except StickSlipError as error:
            return self._refuse(f'not activated: {error}')
        result = super().on_activate(state)
        session.fix_time_origin(follows_clock=bool(self.get_parameter(SIM_TIME).value))
        info = info_json(session.parameters, session.worker.time_origin_ns)
        self._topics.publish(Packed('info', 0, pack_string(info)))
        self._topics.publish(Packed('status', 0, pack_uint32(int(session.worker.status))))
        try:
            if session.parameters.record.on_start:
                session.exchange_recording(session.open_recording(*self._recorded(session)))
        except StickSlipError as error:
            super().on_deactivate(state)
            return self._refuse(f'not activated: {error}')
        session.start()
        self._active, self._trouble = session, ''
        self._lag_log, self._loss_log = diagnostics.Doubling(), diagnostics.Doubling()
        self._late_s = 0.0  # sum of the lags since the activation
        self.get_logger().info(_describe_run(self, session.parameters, session.bench))
        return result

    def _refuse(self, why: str) -> TransitionCallbackReturn:
        """Refuse a transition; put the reason into the log and the diagnostics."""
        self.get_logger().error(why)
        self._trouble = why
        return FAILURE

    def _build(self, parameters: Parameters) -> Session:
        def report(line: str) -> None:
            self.get_logger().warning(line)
            self._send_diagnostics(diagnostics.compiling_status(self._full_name, line))

        callbacks = Callbacks(
            on_faults=lambda faults: self._send_diagnostics(
                diagnostics.fault_status(self._full_name, faults)
            ),
            on_lost_recording=self._on_lost_recording,
            on_end=self._on_end,
            on_failure=self._on_failure,
            say=self.get_logger().warning,
            is_heard=self._topics.is_heard,
        )
        with compilation_reported(progress_reporter(report, KERNELS)):
            return Session(parameters, self._topics.publish, callbacks)

    def _up_to_date(self) -> Session:
        """Return the drive, rebuilt if its parameters have changed while it was inactive."""
        check_clock(self)
        parameters = read_parameters(self)
        old = self._session
        if old is None or old.failure is not None or differ_when_built(old.parameters, parameters):
            new = self._build(parameters)  # a refused one leaves the old one as it is
            old = self._session = new
        if not self._topics.fit(parameters):
            self._topics.offer(parameters)
        return old

    @logs_failure
    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop the drive and finish its recording; its state stays unless it has failed."""
        return super().on_deactivate(state) if self._halt() else ERROR

    @logs_failure
    def on_cleanup(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Discard the drive, its topics and its services."""
        self._release()
        return SUCCESS

    @logs_failure
    def on_shutdown(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Stop the drive and finish its recording."""
        self._halt()
        self._release()
        return SUCCESS

    @logs_failure
    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Return to the unconfigured state after a failed transition or a failed drive."""
        return self.on_shutdown(state)

    def destroy_node(self) -> None:
        """
        Finish the recording, then destroy the node, from any state.

        Raises StillBusy after the destruction if a block of the drive has not ended.

        """
        self._halt()
        super().destroy_node()
        if self._stuck:
            raise self._stuck[0]

    def _release(self) -> None:
        self._session = None
        self._topics.release()
        while self._offered_services:
            self.destroy_service(self._offered_services.pop())
        if self._action is not None:
            self._action.close()
            self._action = None

    def _halt(self) -> bool:
        """Stop the drive, finish its recording; return whether neither has failed."""
        session = self._active
        if session is None:
            return True
        if self._action is not None:
            self._action.stop(session)
        self._active = None
        writer = session.stop()
        if self._action is not None:
            self._action.give_up('the drive was stopped')
        if writer is not None:
            with suppress(StickSlipError):  # a failed recording has been reported
                session.close_recording(writer, self.get_logger())
                session.worker.report_recorded(writer)
        if isinstance(session.failure, StillBusy):
            self.get_logger().error(
                f'the drive could not be stopped and is abandoned: {session.failure}'
            )
            self._stuck.append(session.failure)
        return session.failure is None

    def _on_failure(self) -> None:
        """Report a failure of the drive, on its thread; the executor leaves the active state."""
        session = self._session
        if session is not None:
            self._trouble = f'the drive has stopped: {session.failure}'
            self.get_logger().error(self._trouble)
            self._send_diagnostics(diagnostics.drive_status(self._full_name, session, self.guard))
        self._failed.send()

    def _on_end(self, event: Event) -> None:
        """Handle the end of a command, on the thread of the drive."""
        if event.result not in UNTROUBLED:
            self.guard.note(event)
        if self._action is not None:
            self._action.on_event(event)

    def _leave_active(self) -> None:
        """Leave the active state through its error transition, by the only way rclpy has."""
        if self._active is not None and self._active.failure is not None:
            self.trigger_deactivate()

    def _on_message(self, topic: Topic, data: bytes) -> None:
        """Pass a message to the drive; a message without meaning counts as received."""
        session = self.session
        if topic.request == 'grant':
            session.extend_grant(read_grant(topic, data))
            return
        request = None
        try:
            request = receive_request(topic, data)
        finally:
            session.receive(request)
        if request.stamp_ns:
            age_ns = self.get_clock().now().nanoseconds - request.stamp_ns
            self._topics.command_ages_s.append(NANO * age_ns)

    def _after_parameters(self, changes: list[Parameter]) -> None:
        """Pass live parameters to the drive, except faults that ~/clear_faults has reset."""
        session = self._session
        if session is None:
            return
        faults, others = live_settings(changes)
        changed = session.parameters.updated(dict(others))
        # Of a drive that does not run, another friction, mass or damping builds it anew.
        are_live = self._active or not is_other_drive(session.parameters, changed)
        if faults and not self._is_putting_back:
            session.submit(Request(FAULT, settings=faults), AT_ONCE)
        if others and are_live:
            session.parameters = changed
            session.submit(Request(LIVE, settings=others), AT_ONCE)

    def _clear_faults(self, session: Session, _: Any) -> str:
        await_reply(session.submit(Request('clear_faults'), AT_ONCE))
        changes = fault_defaults(self)
        if changes:
            self._is_putting_back = True
            self.set_parameters_atomically(changes)
            self._is_putting_back = False
        return ''

    def _set_recording(self, session: Session, request: Any) -> str:
        if request.data:
            return session.start_recording(*self._recorded(session))
        return session.end_recording(self.get_logger())

    def _recorded(self, session: Session) -> tuple[dict[str, Channel], str]:
        """Return the channels of a recording of this node, and its namespace."""
        return self._topics.channels(session.parameters), self.get_namespace()

    def _on_lost_recording(self, writer: RunWriter) -> None:
        self.get_logger().error(f'{why_lost(writer)}; the drive goes on')
        if self._session is not None:
            self._send_diagnostics(diagnostics.recorder_status(self._full_name, self._session))

    def _publish_diagnostics(self) -> None:
        self.guard.begin_report()
        session, name = self._active, self._full_name
        if session is None:
            state = self._state_machine.current_state[1]
            self._send_diagnostics(diagnostics.idle_status(name, state, self._trouble, self.guard))
            return
        self._topics.check_graph()
        late = diagnostics.long_block(session)
        if late and session.bench.time_ns != self._logged_block_ns:  # once, while it lasts
            self._logged_block_ns = session.bench.time_ns
            self.get_logger().error(late)
        if (writer := session.worker.writer) and self._loss_log.is_news(writer.recorder.dropped):
            lost = f'{writer.recorder.path} lacks readings, {writer.recorder.losses}'
            self.get_logger().warning(f'{lost}; record less (record.trace) or free the disk')
        report = session.pacer.report()
        pace = diagnostics.pace_status(name, report, session)
        self._late_s += diagnostics.lag_to_log_s(report)
        if self._lag_log.is_news(self._late_s):
            self.get_logger().warning(pace.message)
        self._send_diagnostics(
            pace,
            diagnostics.drive_status(name, session, self.guard),
            diagnostics.fault_status(name, session.worker.faults),
            diagnostics.recorder_status(name, session),
            diagnostics.connection_status(name, self._topics, self.guard),
        )

    @property
    def _full_name(self) -> str:
        return str(self.get_fully_qualified_name())

    def _send_diagnostics(self, *status: DiagnosticStatus) -> None:
        array = DiagnosticArray(status=status)
        array.header.stamp = self.get_clock().now().to_msg()
        self._topics.publish(Packed('diagnostics', 0, serialize_message(array)))


def _describe_run(node: Node, parameters: Parameters, bench: Bench) -> str:
    """Return a line for the log: rate, pace, preload and a command to try."""
    factor = parameters.sim.real_time_factor
    pace = 'in real time' if factor == 1.0 else f'{factor:g} times real time'
    if parameters.sim.lockstep:
        pace = 'in lockstep'
    elif factor == 0.0:
        pace = 'as fast as possible'
    rate = f'{1.0 / (KILO * parameters.sim.block):g} kHz blocks'
    start = f'active: {rate}, {pace}, preload {bench.state.preload_n:g} N'
    if parameters.sim.lockstep:
        return f'{start}; waits for grants on {node.resolve_topic_name("command/grant")}'
    amplifier = parameters.amplifier
    middle_v = format_value(0.5 * (amplifier.voltage_min + amplifier.voltage_max))
    topic = node.resolve_topic_name('command/voltage')
    command = f'ros2 topic pub --once {topic} std_msgs/msg/Float64 "{{data: {middle_v}}}"'
    return f'{start}; try: {command}'


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the drive by `run_node`; return its exit status."""

    def make() -> StickSlipDrive:
        node = StickSlipDrive()
        node.add_managed_entity(GarbageFreezer())
        return node

    return run_node('drive', make, arguments)


if __name__ == '__main__':
    sys.exit(run('drive', main, is_node=True))
