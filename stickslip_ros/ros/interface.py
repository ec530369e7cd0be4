# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The declared topics and services as ROS types and quality of service."""

from importlib import import_module
from typing import Any

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from stickslip_ros.interface.channels import Qos
from stickslip_ros.interface.topics import SERVICES, TOPICS


def _class_of(type_name: str) -> Any:
    package, kind, name = type_name.split('/')
    return getattr(import_module(f'{package}.{kind}'), name)


MESSAGE_TYPES = {topic.type_name: _class_of(topic.type_name) for topic in TOPICS}
SERVICE_TYPES = {service.type_name: _class_of(service.type_name) for service in SERVICES}


def to_profile(qos: Qos) -> QoSProfile:
    """Return the ROS profile of a declared quality of service."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=qos.depth,
        reliability=ReliabilityPolicy.RELIABLE if qos.reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=(
            DurabilityPolicy.TRANSIENT_LOCAL if qos.latched else DurabilityPolicy.VOLATILE
        ),
    )


def to_qos(profile: QoSProfile) -> Qos:
    """Return the recorded policies of a ROS profile."""
    return Qos(
        depth=profile.depth,
        reliable=profile.reliability == ReliabilityPolicy.RELIABLE,
        latched=profile.durability == DurabilityPolicy.TRANSIENT_LOCAL,
    )
