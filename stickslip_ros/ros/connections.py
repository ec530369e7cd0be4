# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The topics and services that a node offers, with overrides of their quality of service."""

from collections import Counter
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.exceptions import ParameterException
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.qos import QoSPolicyKind, QoSProfile, ReliabilityPolicy, qos_policy_name_from_kind
from rclpy.qos_overriding_options import InvalidQosOverridesError, QoSOverridingOptions
from rclpy.service import Service

from stickslip_ros.errors import StickSlipError, UnknownName
from stickslip_ros.instrument.commands import COMMANDS, Request
from stickslip_ros.interface.channels import Channel
from stickslip_ros.interface.feed import Packed
from stickslip_ros.interface.topics import READINGS, SERVICES, TOPICS, Topic
from stickslip_ros.message_types import SET_BOOL
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.run_file import save_checkpoint
from stickslip_ros.ros.interface import MESSAGE_TYPES, SERVICE_TYPES, to_profile, to_qos
from stickslip_ros.runtime.orders import AT_ONCE
from stickslip_ros.runtime.session import Session, await_reply
from stickslip_ros.units import NANO

POLICIES = {'depth': QoSPolicyKind.DEPTH, 'reliability': QoSPolicyKind.RELIABILITY}
"""Policies for ``qos_overrides.<topic>.<publisher or subscription>.*``."""
REFUSALS = (RuntimeError, ValueError, TypeError, ParameterException, InvalidQosOverridesError)
"""Errors of rclpy when it refuses an override."""
SHARED = ('diagnostics', 'joint_states')
"""Keys of the topics on which every node may publish."""
ALWAYS = 'diagnostics'
"""Key of the topic on which a node publishes in every state."""
LATCHED_KEYS = tuple(topic.key for topic in TOPICS if topic.qos.latched)
ATTEMPTS = 2
"""Attempts to send a message; the network may give up in a process that is held up."""

OnMessage = Callable[[Topic, bytes], None]
"""Receives the topic of a command and a message on it, as bytes."""
Act = Callable[[Session, Any], str]
"""Carries out a service request, and returns the message of its answer."""


class Connections:
    """Publishers and subscriptions of a drive."""

    def __init__(self, node: LifecycleNode, on_message: OnMessage, overrides: list[str]) -> None:
        self._node = node
        self._on_message = on_message
        self._overrides = overrides
        # Foreign endpoints of incompatible quality of service, by topic.
        self.incompatible: Counter[str] = Counter()
        # Messages since the configuration that the network refused, by key of the topic.
        self.unsent: Counter[str] = Counter()
        # Ages of the stamped commands since the last report, s: arrival less stamp.
        self.command_ages_s: list[float] = []
        # Texts on other nodes with the name of this node, or with publishers of its readings.
        self.conflicts: list[str] = []
        [always] = [topic for topic in TOPICS if topic.key == ALWAYS]
        self._offered: dict[str, Any] = {ALWAYS: self._open(always, Parameters())}

    def fit(self, parameters: Parameters) -> bool:
        """Return whether exactly the topics of these parameters are offered."""
        return {t.key for t in TOPICS if t.exists(parameters)} == self._offered.keys()

    def offer(self, parameters: Parameters) -> None:
        """
        Offer every topic that exists under these parameters, and no other.

        Refuses an override of quality of service that is not allowed or belongs to no topic.

        """
        self.release()
        self.incompatible.clear()
        self.unsent.clear()
        for topic in TOPICS:
            if topic.exists(parameters) and topic.key != ALWAYS:
                self._offered[topic.key] = self._open(topic, parameters)
        for name in self._overrides:
            if not self._node.has_parameter(name):
                hint = 'look at the topics and policies in docs/reference/node.md'
                raise UnknownName('override', name, hint)

    def release(self) -> None:
        """Remove all topics but the diagnostics."""
        for topic in TOPICS:
            if topic.key == ALWAYS or topic.key not in self._offered:
                continue
            entity = self._offered.pop(topic.key)
            if topic.is_command:
                self._node.destroy_subscription(entity)
            else:
                self._node.destroy_lifecycle_publisher(entity)

    def publish(self, packed: Packed) -> None:
        """Publish a packed message if its topic is offered and the state allows it."""
        publisher = self._offered.get(packed.key)
        if publisher is None:
            return
        for _ in range(ATTEMPTS):
            try:
                publisher.publish(packed.data)
            except RuntimeError:  # the base of RCLError
                continue
            return
        self.unsent[packed.key] += 1

    def is_heard(self, key: str) -> bool:
        """Return whether a topic is offered, and has subscriptions or keeps its last message."""
        publisher = self._offered.get(key)
        if publisher is None or key in LATCHED_KEYS:
            return publisher is not None
        return bool(publisher.handle.get_subscription_count())

    def check_graph(self) -> None:
        """Warn of conflicts of names in the graph."""
        node = self._node
        own = (node.get_name(), node.get_namespace())
        conflicts = []
        if node.get_node_names_and_namespaces().count(own) > 1:
            name = node.get_fully_qualified_name()
            conflicts.append(
                f'another node is called {name} too; start one of them with -r __ns:=/other'
            )
        for topic in READINGS:
            name = node.resolve_topic_name(topic.name)
            if topic.key in SHARED or topic.key not in self._offered:
                continue
            if node.count_publishers(name) > 1:
                there = node.get_publishers_info_by_topic(name)
                others = Counter((each.node_name, each.node_namespace) for each in there)
                others.subtract([own])
                words = ', '.join(f'{space.rstrip("/")}/{who}' for who, space in others.elements())
                conflicts.append(
                    f'{words} publishes on {name} too; start one of the two in another namespace'
                )
        for each in conflicts:
            if each not in self.conflicts:
                node.get_logger().warning(each)
        self.conflicts = conflicts

    def channels(self, parameters: Parameters) -> dict[str, Channel]:
        """Return the channels of a recording by key: actual names and quality of service."""
        return {
            topic.key: Channel(
                str(self._node.resolve_topic_name(topic.name)),
                topic.type_name,
                to_qos(self._offered[topic.key].qos_profile),
            )
            for topic in TOPICS
            if topic.is_recorded(parameters)
        }

    def _open(self, topic: Topic, parameters: Parameters) -> Any:
        """Make the publisher or the subscription of a topic."""
        node = self._node

        def note_incompatible(event: Any) -> None:
            self.incompatible[topic.name] = event.total_count
            policy = qos_policy_name_from_kind(event.last_policy_kind)
            other = 'publisher' if topic.is_command else 'subscription'
            ours = getattr(self._offered.get(topic.key), 'qos_profile', None)
            wanted = getattr(getattr(ours, policy.lower(), None), 'name', 'as the drive').lower()
            node.get_logger().warning(
                f'a {other} on {topic.name} does not fit its {policy}: nothing passes between '
                f'them; make that {other} {wanted}'
            )

        options: dict[str, Any] = {}
        if topic.overridable:
            options['qos_overriding_options'] = QoSOverridingOptions(
                [POLICIES[name] for name in topic.overridable], callback=_check_profile
            )
        message_type = MESSAGE_TYPES[topic.type_name]
        profile = to_profile(topic.offered_qos(parameters))
        try:
            if not topic.is_command:
                events = PublisherEventCallbacks(incompatible_qos=note_incompatible)
                is_always = topic.key == ALWAYS
                make = node.create_publisher if is_always else node.create_lifecycle_publisher
                return make(message_type, topic.name, profile, event_callbacks=events, **options)
            return node.create_subscription(
                message_type,
                topic.name,
                partial(self._on_message, topic),
                profile,
                raw=True,
                event_callbacks=SubscriptionEventCallbacks(incompatible_qos=note_incompatible),
                **options,
            )
        except REFUSALS as error:
            raise StickSlipError(f'{topic.name} cannot be offered: {error}') from error


def _check_profile(profile: QoSProfile) -> SetParametersResult:
    """Refuse a quality of service that the drive cannot offer."""
    reason = ''
    if profile.depth < 1:
        reason = f'depth {profile.depth} is below 1'
    elif profile.reliability not in (ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT):
        reason = f'{profile.reliability.name.lower()} is not reliable or best_effort'
    return SetParametersResult(successful=not reason, reason=reason)


def offer_services(
    node: Node,
    get_session: Callable[[], Session],
    on_refusal: Callable[[str, object], None],
    acts: Mapping[str, Act],
) -> list[Service]:
    """
    Offer every declared service on a node, and return the services.

    ``get_session`` returns the running drive, or refuses; ``on_refusal`` receives the name of a
    service and the reason of a refusal; ``acts`` are the services that only the node can do.

    """

    def answer(name: str, act: Act, request: Any, response: Any) -> Any:
        try:
            response.message = act(get_session(), request)
            response.success = True
        except StickSlipError as error:
            response.success = False
            response.message = f'{name} refused: {error}'
            on_refusal(name, error)
        return response

    offered = []
    for service in SERVICES:
        name = service.name.removeprefix('~/')
        callback = partial(answer, name, {**OF_THE_DRIVE, **acts}[name])
        offered.append(
            node.create_service(SERVICE_TYPES[service.type_name], service.name, callback)
        )
    return offered


def _ask_bench(name: str, session: Session, request: Any) -> str:
    """Pass a command to the bench; only a switch has a number."""
    values = (float(request.data),) if COMMANDS[name].interface == SET_BOOL else ()
    await_reply(session.submit(Request(name, values), AT_ONCE))
    return ''


def _set_paused(session: Session, request: Any) -> str:
    session.set_paused(request.data)
    return f'paused at {session.bench.time_ns * NANO:.9g} s' if request.data else 'running'


def _step_simulation(session: Session, _: Any) -> str:
    await_reply(session.step())
    return f'advanced to {session.bench.time_ns * NANO:.9g} s'


def _save_checkpoint(session: Session, _: Any) -> str:
    return str(save_checkpoint(await_reply(session.save()), session.parameters).absolute())


OF_THE_DRIVE: dict[str, Act] = {
    **{name: partial(_ask_bench, name) for name, row in COMMANDS.items() if row.has_service},
    'set_paused': _set_paused,
    'step_simulation': _step_simulation,
    'save_checkpoint': _save_checkpoint,
}
"""Services that a running drive carries out without its node."""
