"""What a recording says of a topic before its first message: name, type, quality of service."""

from dataclasses import dataclass
from typing import Final

_KEEP_LAST: Final = 1
_RELIABLE, _BEST_EFFORT = 1, 2
_TRANSIENT_LOCAL, _VOLATILE = 1, 2
_AUTOMATIC: Final = 1
_FOREVER: Final = '{sec: 9223372036, nsec: 854775807}'
_NAMES_IN_FILES: Final = {'command/position': 'target', 'voltage': 'piezo'}


@dataclass(frozen=True)
class Qos:
    """
    Quality of service that a topic offers.

    Parameters
    ----------
    depth : int
        Messages kept for a late reader.
    reliable : bool
        Whether lost messages are sent again.
    latched : bool
        Whether a subscriber that comes late still gets the last messages.

    """

    depth: int
    reliable: bool = True
    latched: bool = False

    def to_yaml(self) -> str:
        """
        Give the profile as a recording stores it: a YAML sequence of one complete entry.

        The numbers are those of ``rmw/types.h``; every distribution reads them, whereas names
        are read by the later ones only.

        """
        fields = {
            'history': _KEEP_LAST,
            'depth': self.depth,
            'reliability': _RELIABLE if self.reliable else _BEST_EFFORT,
            'durability': _TRANSIENT_LOCAL if self.latched else _VOLATILE,
            'deadline': _FOREVER,
            'lifespan': _FOREVER,
            'liveliness': _AUTOMATIC,
            'liveliness_lease_duration': _FOREVER,
            'avoid_ros_namespace_conventions': 'false',
        }
        return '- ' + '\n  '.join(f'{key}: {value}' for key, value in fields.items()) + '\n'


@dataclass(frozen=True)
class Channel:
    """
    A topic to record.

    Parameters
    ----------
    topic : str
        Full name, as ``/stand/position``.
    type_name : str
        Message type, as ``std_msgs/msg/Float64``.
    qos : Qos
        What the topic's publisher offers.

    """

    topic: str
    type_name: str
    qos: Qos


def name_in_file(key: str) -> str:
    """Return the name under which the metadata of a recording has the topic of a key."""
    return _NAMES_IN_FILES.get(key, key.removeprefix('command/').replace('/', '_'))
