"""What a recorded message says, without ROS: one small record per kind of message."""

from typing import Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.errors import UnknownName

FLOAT64: Final = 'std_msgs/msg/Float64'
INT32: Final = 'std_msgs/msg/Int32'
UINT32: Final = 'std_msgs/msg/UInt32'
STRING: Final = 'std_msgs/msg/String'
FLOAT64_ARRAY: Final = 'std_msgs/msg/Float64MultiArray'
POINT_STAMPED: Final = 'geometry_msgs/msg/PointStamped'
WRENCH_STAMPED: Final = 'geometry_msgs/msg/WrenchStamped'

STAMPED_FIELDS: Final = {
    POINT_STAMPED: ('x', 'y', 'z'),
    WRENCH_STAMPED: ('force.x', 'force.y', 'force.z', 'torque.x', 'torque.y', 'torque.z'),
}
"""Numbers behind the header of each type that has one."""
UNITS: Final = {'voltage': 'V', 'preload': 'N', 'jog': '1/s'}
"""Units of plain numbers, by the last part of their topic: such messages carry none themselves."""


class ArrayMessage(NamedTuple):
    """
    A ``std_msgs/msg/Float64MultiArray``.

    Attributes
    ----------
    labels : tuple of str
        One label per dimension of the layout.
    sizes : tuple of int
        Length of each dimension.
    data : ndarray of float
        Shaped by `sizes` where the layout fits the data, otherwise flat.
    strides : tuple of int
        Stride of each dimension, as the layout gives it.
    offset : int
        Numbers in front of the data, as the layout gives it.

    """

    labels: tuple[str, ...]
    sizes: tuple[int, ...]
    data: NDArray[np.float64]
    strides: tuple[int, ...] = ()
    offset: int = 0


class StampedMessage(NamedTuple):
    """A message of STAMPED_FIELDS: time in ns, frame, and its numbers in SI units."""

    stamp_ns: int
    frame_id: str
    values: tuple[float, ...]


Message: TypeAlias = float | int | str | ArrayMessage | StampedMessage


class Quantity(NamedTuple):
    """
    One number of the messages of a topic.

    Attributes
    ----------
    name : str
        The field: ``x``, ``force.x``, ``data``.
    unit : str
        SI unit; empty for a pure number.
    place : int
        Its place in a stamped message.

    """

    name: str
    unit: str
    place: int

    def of(self, message: Message) -> float:
        """Return the number."""
        if isinstance(message, StampedMessage):
            return message.values[self.place]
        assert isinstance(message, (int, float))
        return float(message)


def find_quantity(topic: str, type_name: str, field: str) -> Quantity:
    """
    Look up a field of a topic's messages.

    Parameters
    ----------
    topic : str
        Topic; its last part gives the unit of a plain number.
    type_name : str
        Type of its messages.
    field : str
        Name of the field; empty for the first, which is x, force.x or data.

    Raises
    ------
    UnknownName
        If the type has no such field, or none that is a number.

    """
    names = STAMPED_FIELDS.get(type_name, ())
    if type_name in (FLOAT64, INT32, UINT32):
        names = ('data',)
    if field not in ('', *names) or not names:
        known = ', '.join(names) or 'no numbers'
        raise UnknownName(f'field of {topic}', field, f'a {type_name} has {known}')
    name = field or names[0]
    return Quantity(name, _unit(topic, name), names.index(name))


def _unit(topic: str, field: str) -> str:
    if field == 'data':
        return UNITS.get(topic.rpartition('/')[2], '')
    return {'force': 'N', 'torque': 'N m'}.get(field.partition('.')[0], 'm')
