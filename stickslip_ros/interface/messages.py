# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Recorded messages without ROS: a record for each kind of message."""

from typing import Final, NamedTuple, TypeAlias

from stickslip_ros.arrays import Array
from stickslip_ros.errors import UnknownName, WrongKind
from stickslip_ros.instrument.commands import COMMANDS
from stickslip_ros.message_types import (
    FLOAT64,
    INT32,
    JOINT_STATE,
    POINT_STAMPED,
    UINT32,
    VECTOR3_STAMPED,
    WRENCH_STAMPED,
)

STAMPED_FIELDS: Final = {
    POINT_STAMPED: ('x', 'y', 'z'),
    VECTOR3_STAMPED: ('x', 'y', 'z'),
    WRENCH_STAMPED: ('force.x', 'force.y', 'force.z', 'torque.x', 'torque.y', 'torque.z'),
}
"""Numbers after the header of each type with a header."""
JOINT_UNITS: Final = {'position': 'm', 'velocity': 'm/s', 'effort': 'N'}
"""Units of the numbers of a sliding joint, in message order."""


class ArrayMessage(NamedTuple):
    """A ``std_msgs/msg/Float64MultiArray``."""

    labels: tuple[str, ...]  # one per dimension of the layout
    sizes: tuple[int, ...]  # length of each dimension
    data: Array  # shaped by `sizes` if the layout fits the data, otherwise flat
    strides: tuple[int, ...] = ()  # of each dimension, by the layout
    offset: int = 0  # numbers before the data, by the layout


class StampedMessage(NamedTuple):
    """A message of a type in STAMPED_FIELDS: time in ns, frame, numbers in SI units."""

    stamp_ns: int
    frame_id: str
    values: tuple[float, ...]


class JointMessage(NamedTuple):
    """A ``sensor_msgs/msg/JointState``."""

    stamp_ns: int
    frame_id: str
    names: tuple[str, ...]  # one per joint
    # One number per joint; m, m/s and N for sliding joints; may be empty:
    positions: tuple[float, ...] = ()
    velocities: tuple[float, ...] = ()
    efforts: tuple[float, ...] = ()

    @property
    def arrays(self) -> tuple[tuple[float, ...], ...]:
        """The three arrays, in the order of JOINT_UNITS."""
        return self.positions, self.velocities, self.efforts


Message: TypeAlias = float | int | str | ArrayMessage | StampedMessage | JointMessage


class Quantity(NamedTuple):
    """One number of the messages of a topic."""

    name: str  # the field: ``x``, ``force.x``, ``data``, ``velocity``
    unit: str  # SI unit; empty for a pure number
    place: int  # index in the numbers of a message

    def of(self, message: Message) -> float:
        """Return the number from a message; refuse several joints."""
        if isinstance(message, JointMessage):
            numbers = message.arrays[self.place]
            if len(numbers) != 1:
                hint = 'read a topic of one joint'
                raise WrongKind(self.name, numbers, 'the number of one joint', hint)
            return numbers[0]
        if isinstance(message, StampedMessage):
            return message.values[self.place]
        assert isinstance(message, (int, float))
        return float(message)


def find_quantity(topic: str, type_name: str, field: str) -> Quantity:
    """
    Look up a field of a topic's messages; an empty name means the first: x, force.x or data.

    The last part of the topic gives the unit of a plain number. Raises UnknownName if the type
    lacks the field, or has no numbers.

    """
    names = STAMPED_FIELDS.get(type_name, ())
    if type_name in (FLOAT64, INT32, UINT32):
        names = ('data',)
    if type_name == JOINT_STATE:
        names = tuple(JOINT_UNITS)
    if field not in ('', *names) or not names:
        known = ', '.join(names) or 'no numbers'
        raise UnknownName(f'field of {topic}', field, f'a {type_name} has {known}')
    name = field or names[0]
    return Quantity(name, _unit(topic, type_name, name), names.index(name))


def _unit(topic: str, type_name: str, field: str) -> str:
    if field == 'data' or type_name == VECTOR3_STAMPED:
        command = COMMANDS.get(topic.rpartition('/')[2])  # a reading has the unit of its command
        return command.numbers[0].partition(' ')[2] if command and command.numbers else ''
    units = {'force': 'N', 'torque': 'N m', **JOINT_UNITS}
    return units.get(field.partition('.')[0], 'm')
