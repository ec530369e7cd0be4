# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Channels of a recording: name, type, quality of service of topics."""

from dataclasses import dataclass
from typing import Final

_FOREVER: Final = '{sec: 9223372036, nsec: 854775807}'
_NAMES_IN_FILES: Final = {'command/position': 'target', 'voltage': 'piezo'}


@dataclass(frozen=True)
class Qos:
    """Quality of service that a topic offers."""

    depth: int  # messages kept for a late reader
    reliable: bool = True  # whether lost messages are sent again
    latched: bool = False  # whether a late subscriber gets the last messages

    def to_yaml(self) -> str:
        """
        Return the profile for a recording: a YAML sequence of one complete entry.

        The numbers are those of ``rmw/types.h``: only later distributions read names.

        """
        fields = {
            'history': 1,  # keep last
            'depth': self.depth,
            'reliability': 1 if self.reliable else 2,  # or best effort
            'durability': 1 if self.latched else 2,  # transient local, or volatile
            'deadline': _FOREVER,
            'lifespan': _FOREVER,
            'liveliness': 1,  # automatic
            'liveliness_lease_duration': _FOREVER,
            'avoid_ros_namespace_conventions': 'false',
        }
        return '- ' + '\n  '.join(f'{key}: {value}' for key, value in fields.items()) + '\n'


@dataclass(frozen=True)
class Channel:
    """A topic to record."""

    topic: str  # full name, as /stand/position
    type_name: str  # message type, as std_msgs/msg/Float64
    qos: Qos  # what the topic's publisher offers


def name_in_file(key: str) -> str:
    """Return the name of a topic, by its key, in the metadata of a recording."""
    return _NAMES_IN_FILES.get(key, key.removeprefix('command/').replace('/', '_'))
