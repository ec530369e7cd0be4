# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The twin as a lifecycle node: topics of a rig in, topics of twin and health out."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from importlib import import_module
from typing import Any, ClassVar

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PointStamped, WrenchStamped
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from std_msgs.msg import Float64MultiArray

from stickslip_ros.errors import StickSlipError, WrongKind
from stickslip_ros.interface.cdr import unpack
from stickslip_ros.interface.messages import ArrayMessage
from stickslip_ros.lab.measurements.mapped import Mapped, parse_map, topic_of
from stickslip_ros.lab.twin.settings import TwinParameters
from stickslip_ros.lab.twin.twin import Twin
from stickslip_ros.lab.twin.window import RigClock, Windows
from stickslip_ros.lab.twin.work import TWIN_OUTPUTS, Work
from stickslip_ros.message_types import FLOAT64_ARRAY, POINT_STAMPED, WRENCH_STAMPED
from stickslip_ros.parameters import Parameters, Spec, declared_by, specs
from stickslip_ros.process.signals import run
from stickslip_ros.recording.any_message import Joint, path_of
from stickslip_ros.recording.series import split_columns
from stickslip_ros.ros.diagnostics import verdict
from stickslip_ros.ros.executable import describe_node, guard_services, run_node
from stickslip_ros.ros.guard import GuardedNode
from stickslip_ros.ros.parameter_bridge import FOREIGN, CheckedNode, declare_all, given_values
from stickslip_ros.units import NS_PER_S

TWIN_NODE = 'stickslip_twin'
_PREFIX = 'twin.'
_LOOK_S, _REPORT_S = 0.2, 1.0
_DEPTH = 10_000  # most queued messages of the rig while the node is busy
_TIME_MAX_S = 1e10  # limit of converted times, above all times of a header
_TRACE_COLUMNS = {'voltage': 'voltage_v', 'position': 'position_m', 'force': 'force_n'}
"""Columns of a trace that the twin reads."""
_TYPES = {POINT_STAMPED: PointStamped, WRENCH_STAMPED: WrenchStamped}
_TYPES |= {FLOAT64_ARRAY: Float64MultiArray}
_Samples = dict[str, tuple[Sequence[int], Sequence[float]]]  # stamps in ns, values
_SUCCESS, _FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


class StickSlipTwin(CheckedNode, GuardedNode, LifecycleNode):
    """
    A fitted stand that follows a rig, as a ROS 2 lifecycle node.

    Its parameters, of the stand and of `TwinParameters` (``twin.*``), are read once at the start.

    """

    declared: ClassVar[Mapping[str, Spec]] = FOREIGN | {
        name: replace(spec, fixed=True, live=False)
        for name, spec in (specs() | declared_by(TwinParameters)).items()
    }

    def __init__(self, node_name: str = TWIN_NODE, **node_arguments: Any) -> None:
        super().__init__(
            node_name, automatically_declare_parameters_from_overrides=True, **node_arguments
        )
        guard_services(self)
        given, own = given_values(self), declared_by(TwinParameters)
        settings = {name: given.pop(name) for name in own if name in given}
        self.stand = Parameters().updated(given)
        values: dict[str, Any] = {n.removeprefix(_PREFIX): v for n, v in settings.items()}
        self.settings = TwinParameters(**values)
        of_twin = {name: getattr(self.settings, name.removeprefix(_PREFIX)) for name in own}
        declare_all(self, self.declared, self.stand.flat() | of_twin)
        self.get_logger().info(describe_node(self))
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self.create_timer(_REPORT_S, self._report, clock=steady)
        self.create_timer(_LOOK_S, self._join, clock=steady)
        self._outputs: dict[str, Any] = {}
        self._work: Work | None = None
        self._mapped: dict[str, Mapped] = {}
        self._begin_input()
        if self.stand.autostart and self.trigger_configure() == _SUCCESS:
            self.trigger_activate()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Check stand and topics, and create the publishers of the twin."""
        try:
            self._mapped = parse_map(self.settings.topics)
            if blocks := [each.field for each in self._mapped.values() if each.rate_hz]:
                hint = 'publish each sample, with a stamp'
                raise WrongKind('twin.map', blocks[0], 'a number of each message', hint)
            Twin(self.stand, self.settings)
        except StickSlipError as error:
            self.get_logger().error(f'not configured: {error}')
            return _FAILURE
        if self._mapped and 'voltage_v' not in self._mapped:
            hint = 'name it in twin.map: voltage_v=TOPIC.FIELD'
            self.get_logger().error(f'not configured: the topic of the voltage is missing; {hint}')
            return _FAILURE
        self._outputs = {
            key: self.create_lifecycle_publisher(_TYPES[kind], key, 1000)
            for key, kind in TWIN_OUTPUTS.items()
        }
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Subscribe to the rig, and restart its health."""
        result = super().on_activate(state)
        self._begin_input()
        self._work = Work(self.stand, self.settings, self._publish, self._tell)
        heard = [each.field for each in self._mapped.values()]
        heard = heard or [self.resolve_topic_name('trace')]
        names, cell = ', '.join(self.settings.free_names), self.stand.load_cell.contact
        self.get_logger().info(
            f'active: a stand under {self.stand.stand.preload:g} N, load cell {cell}, waits for '
            f'{", ".join(heard)}; fits {names} every {self.settings.period:g} s; see /diagnostics'
        )
        return result

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        self._end_work()
        return super().on_deactivate(state)

    def on_cleanup(self, _: LifecycleState) -> TransitionCallbackReturn:
        while self._outputs:
            self.destroy_lifecycle_publisher(self._outputs.popitem()[1])
        return _SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        self._end_work()
        return self.on_cleanup(state)

    def destroy_node(self) -> None:
        self._end_work()
        super().destroy_node()

    def _end_work(self) -> None:
        work, self._work = self._work, None
        while self._heard:
            self.destroy_subscription(self._heard.popitem()[1])
        if work is not None:
            work.close()

    # --- the rig

    def _begin_input(self) -> None:
        self._heard: dict[str, Subscription] = {}  # by topic
        self._windows = Windows(list(self._mapped), self.settings.window, self.settings.lag)
        self._rig_clock = RigClock()

    def _join(self) -> None:
        """Subscribe to new topics of the rig."""
        if self._work is None:
            return
        if not self._mapped:
            name = self.resolve_topic_name('trace')
            if name not in self._heard:
                self._heard[name] = self.create_subscription(
                    Float64MultiArray, name, self._take_trace, _DEPTH, raw=True
                )
            return
        types = dict(self.get_topic_names_and_types())
        wanted: dict[str, list[tuple[str, Mapped]]] = {}
        for name, each in self._mapped.items():
            topic = topic_of(each.field, types)
            if topic is not None:
                wanted.setdefault(topic, []).append((name, each))
        for topic, named in wanted.items():
            offered = self.get_publishers_info_by_topic(topic)
            if topic in self._heard or not offered:
                continue
            kinds = {each.qos_profile.reliability for each in offered}
            is_reliable = kinds == {ReliabilityPolicy.RELIABLE}
            kind = ReliabilityPolicy.RELIABLE if is_reliable else ReliabilityPolicy.BEST_EFFORT
            profile = QoSProfile(depth=_DEPTH, reliability=kind)
            try:
                package, _, type_name = types[topic][0].split('/')
                message_type = getattr(import_module(f'{package}.msg'), type_name)
                fields = [
                    (name, path_of(topic, each.field[len(topic) + 1 :]), each)
                    for name, each in named
                ]
                take: Any = partial(self._take, fields)
                self._heard[topic] = self.create_subscription(message_type, topic, take, profile)
            except Exception as error:  # noqa: BLE001 - the type is that of a foreign node
                why = f'{types[topic][0]} cannot be read: {error}'
                self._tell(f'{topic}: {why}; source its package')

    def _take(self, fields: Any, message: Any, info: Any) -> None:
        """Add numbers of a message, at its stamp or its send time in the clock of the rig."""
        sent_ns = info['source_timestamp'] or info['received_timestamp']
        header = getattr(message, 'header', None)
        stamp_ns = 0 if header is None else header.stamp.sec * NS_PER_S + header.stamp.nanosec
        if stamp_ns and not all(mapped.by_log for *_, mapped in fields):
            self._rig_clock.learn(stamp_ns, sent_ns)
        came_ns = self._rig_clock.stamp_of(sent_ns)
        samples = _Samples()
        for name, path, mapped in fields:
            at_ns = came_ns if mapped.by_log or not stamp_ns else stamp_ns
            value = message
            try:
                for part in path:
                    at = message.name.index(part) if isinstance(part, Joint) else part
                    value = value[at] if isinstance(at, int) else getattr(value, part)
                samples[name] = (at_ns,), (float(value) * mapped.factor,)
            except (AttributeError, LookupError, TypeError, ValueError) as error:
                why = f'a message has no number for {name}: {error}'
                raise StickSlipError(f'{why}; map a field that each message has') from error
        self._add(samples)

    def _take_trace(self, data: bytes) -> None:
        block = unpack(FLOAT64_ARRAY, data)
        assert isinstance(block, ArrayMessage)
        samples = _Samples()
        for name, series in split_columns([block], 'trace').items():
            is_force = name == 'force' and self.stand.load_cell.contact == 'absent'
            if name in _TRACE_COLUMNS and not is_force:
                time_s = np.clip(series.time_s, -1.0, _TIME_MAX_S)  # beyond: refused
                stamps_ns = np.round(time_s * NS_PER_S).astype(np.int64).tolist()
                samples[_TRACE_COLUMNS[name]] = stamps_ns, series.value.tolist()
        if 'voltage_v' not in samples:
            raise StickSlipError('a block of trace has no column voltage[V]; add it')
        known = self._windows.quantities
        if known != samples.keys():
            self._windows.expect(sorted(samples))
            if known:
                raise StickSlipError('the columns of trace have changed; the next block is taken')
        self._add(samples)

    def _add(self, samples: _Samples) -> None:
        """Add the samples of a message, and pass complete windows to the work."""
        for name, (stamps_ns, values) in samples.items():
            if why := self._windows.add(name, stamps_ns, values):
                raise StickSlipError(why)
        assert self._work is not None  # there are no subscriptions without it
        for window in self._windows.complete():  # a pause would clear them
            self._work.put(window)

    # --- the twin

    def _publish(self, key: str, data: bytes) -> None:
        if key in self._outputs:
            self._outputs[key].publish(data)

    def _tell(self, line: str) -> None:
        self.get_logger().warning(line)

    def _report(self) -> None:
        self.guard.begin_report()
        name, work, news = self.get_fully_qualified_name(), self._work, self.guard.news()
        values: dict[str, object] = {**self.guard.values()}
        if work is None:
            reports = [verdict(name, 'rig', news, 'not active', values)]
        else:
            counts = ('late', 'doubled', 'reordered', 'not_finite', 'pauses', 'restarts')
            values |= {each: getattr(self._windows, each) for each in counts}
            values |= {'lag_s': self.settings.lag, 'window_s': self.settings.window}
            values |= {'windows': work.shown, 'dropped': work.dropped}
            values |= {'topics': ' '.join(self._heard) or 'none yet'}
            bad = '; '.join(filter(None, [work.trouble, news]))
            rig = verdict(name, 'rig', bad, 'heard', values)
            health = work.health
            numbers: dict[str, object] = {'fits': work.fits, 'fits_left_out': work.left_out}
            bad, good = '', 'nothing fitted yet'
            if health is not None:
                bad, good = health.words, 'as at the start'
                numbers |= {'chi_square_per_reading': f'{health.chi_per_reading:.3g}'}
                found = zip(health.names, health.values, health.errors, strict=True)
                numbers |= {each: f'{value:.5g} +- {error:.2g}' for each, value, error in found}
            reports = [rig, verdict(name, 'health', bad, good, numbers)]
        array = DiagnosticArray(status=reports)
        array.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(array)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the twin until the end, see `run_node`; return its exit status."""
    return run_node('twin', StickSlipTwin, arguments)


if __name__ == '__main__':
    sys.exit(run('twin', main, is_node=True))
