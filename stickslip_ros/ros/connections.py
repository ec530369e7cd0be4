"""The topics of a node: offered as declared, unless their quality of service is overridden."""

from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.exceptions import ParameterException
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import (
    QoSPolicyKind,
    QoSProfile,
    ReliabilityPolicy,
    qos_policy_name_from_kind,
)
from rclpy.qos_overriding_options import InvalidQosOverridesError, QoSOverridingOptions

from stickslip_ros.errors import StickSlipError, UnknownName
from stickslip_ros.interface.channels import Channel
from stickslip_ros.interface.feed import Packed
from stickslip_ros.interface.topics import READINGS, TOPICS, Topic
from stickslip_ros.parameters import Parameters
from stickslip_ros.ros.interface import MESSAGE_TYPES, to_profile, to_qos

POLICIES = {'depth': QoSPolicyKind.DEPTH, 'reliability': QoSPolicyKind.RELIABILITY}
"""What ``qos_overrides.<topic>.<publisher or subscription>.*`` may change."""
REFUSALS = (RuntimeError, ValueError, TypeError, ParameterException, InvalidQosOverridesError)
"""What rclpy raises when it does not take an override."""

SHARED = ('diagnostics', 'joint_states')
"""Keys of the topics on which every node may publish."""
ATTEMPTS = 2
"""How often a message is given to the network, which may give up in a process that is held up."""

OnMessage = Callable[[Topic, bytes], None]
"""Receives the topic of a command and the message that came on it, not yet opened."""


class Connections:
    """
    Publishers and subscriptions of a drive.

    Attributes
    ----------
    incompatible : Counter of str
        Endpoints of others with which a quality of service did not agree, by topic.
    unsent : Counter of str
        Messages since the configuration that the network did not take, by key of the topic.
    conflicts : tuple of str
        Who else has the name of the node or publishes its readings, in words.

    """

    def __init__(self, node: LifecycleNode, on_message: OnMessage, overrides: list[str]) -> None:
        self._node = node
        self._on_message = on_message
        self._overrides = overrides
        self._offered: dict[str, Any] = {}
        self.incompatible: Counter[str] = Counter()
        self.unsent: Counter[str] = Counter()
        self.conflicts: tuple[str, ...] = ()

    def fit(self, parameters: Parameters) -> bool:
        """Return whether exactly the topics that exist under these parameters are offered."""
        return {t.key for t in TOPICS if t.exists(parameters)} == self._offered.keys()

    def offer(self, parameters: Parameters) -> None:
        """
        Offer every topic that exists under these parameters, and no other.

        Raises
        ------
        StickSlipError
            If an override of quality of service is not allowed, or belongs to no topic.

        """
        self.release()
        self.incompatible.clear()
        self.unsent.clear()
        for topic in TOPICS:
            if topic.exists(parameters):
                self._offered[topic.key] = self._open(topic, parameters)
        for name in self._overrides:  # of the names that were given at the start
            if not self._node.has_parameter(name):
                hint = 'look at the topics and policies in docs/node.md'
                raise UnknownName('override', name, hint)

    def release(self) -> None:
        """Take every topic away."""
        for topic in TOPICS:
            entity = self._offered.pop(topic.key, None)
            if entity is None:
                continue
            if topic.is_command:
                self._node.destroy_subscription(entity)
            else:
                self._node.destroy_lifecycle_publisher(entity)

    def publish(self, packed: Packed) -> None:
        """Publish a packed message, if its topic is offered and the node active."""
        self.send(packed.key, packed.data)

    def send(self, key: str, message: Any) -> None:
        """Publish a message, or its bytes."""
        publisher = self._offered.get(key)
        if publisher is not None and not any(_sent(publisher, message) for _ in range(ATTEMPTS)):
            self.unsent[key] += 1

    def check_graph(self) -> None:
        """Ask the graph for who else is there, and warn of conflicts."""
        seen = tuple(self._find_conflicts())
        for each in seen:
            if each not in self.conflicts:
                self._node.get_logger().warning(each)
        self.conflicts = seen

    def _find_conflicts(self) -> Iterator[str]:
        """Give what is wrong with the names in the graph."""
        node = self._node
        own = (node.get_name(), node.get_namespace())
        if node.get_node_names_and_namespaces().count(own) > 1:
            name = node.get_fully_qualified_name()
            yield f'another node is called {name} too; start one of them with -r __ns:=/other'
        for topic in READINGS:
            if topic.key in SHARED or topic.key not in self._offered:
                continue
            name = self._full_name(topic)
            if node.count_publishers(name) > 1:
                others = self._publishers(name)
                others.subtract([own])
                words = ', '.join(f'{space.rstrip("/")}/{who}' for who, space in others.elements())
                yield f'{words} publishes on {name} too; start one of the two in another namespace'

    def _publishers(self, name: str) -> Counter[tuple[str, str]]:
        there = self._node.get_publishers_info_by_topic(name)
        return Counter((each.node_name, each.node_namespace) for each in there)

    def _full_name(self, topic: Topic) -> str:
        return str(self._node.resolve_topic_name(topic.name))

    def channels(self) -> dict[str, Channel]:
        """Return what a recording holds: names and quality of service as they are, by key."""
        return {
            topic.key: Channel(
                self._full_name(topic),
                topic.type_name,
                to_qos(self._offered[topic.key].qos_profile),
            )
            for topic in TOPICS
            if topic.recorded and topic.key in self._offered
        }

    def _open(self, topic: Topic, parameters: Parameters) -> Any:
        """Make the publisher or the subscription of a topic."""
        note = partial(self._note_incompatible, topic)
        options: dict[str, Any] = {
            'event_callbacks': (
                SubscriptionEventCallbacks(incompatible_qos=note)
                if topic.is_command
                else PublisherEventCallbacks(incompatible_qos=note)
            ),
        }
        if topic.overridable:
            policies = [POLICIES[name] for name in topic.overridable]
            options['qos_overriding_options'] = QoSOverridingOptions(
                policies, callback=_check_profile
            )
        message_type = MESSAGE_TYPES[topic.type_name]
        profile = to_profile(topic.offered_qos(parameters))
        try:
            if not topic.is_command:
                return self._node.create_lifecycle_publisher(
                    message_type, topic.name, profile, **options
                )
            callback = partial(self._on_message, topic)
            return self._node.create_subscription(
                message_type, topic.name, callback, profile, raw=True, **options
            )
        except REFUSALS as error:
            raise StickSlipError(f'{topic.name} cannot be offered: {error}') from error

    def _note_incompatible(self, topic: Topic, event: Any) -> None:
        """Count and log that another node's endpoint does not fit."""
        self.incompatible[topic.name] = event.total_count
        policy = qos_policy_name_from_kind(event.last_policy_kind)
        other = 'publisher' if topic.is_command else 'subscription'
        self._node.get_logger().warning(
            f'a {other} on {topic.name} does not fit its {policy}: nothing passes between them'
        )


def _sent(publisher: Any, message: Any) -> bool:
    """Return whether the network has taken a message."""
    try:
        publisher.publish(message)
    except RuntimeError:  # the base of RCLError
        return False
    return True


def _check_profile(profile: QoSProfile) -> SetParametersResult:
    """Refuse a quality of service that the drive cannot offer."""
    if profile.depth < 1:
        return SetParametersResult(successful=False, reason=f'depth {profile.depth} is below 1')
    if profile.reliability not in (ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT):
        reason = f'{profile.reliability.name.lower()} is not reliable or best_effort'
        return SetParametersResult(successful=False, reason=reason)
    return SetParametersResult(successful=True)
