"""Which quantities a message carries, in which unit, and how to take them out."""

from collections.abc import Callable
from functools import partial
from typing import Final, NamedTuple

from stickslip_ros.errors import UnknownName
from stickslip_ros.recording import messages as m

#: Units of plain numbers, by the last part of their topic: such messages carry none themselves.
UNITS: Final = {'voltage': 'V', 'preload': 'N', 'jog': '1/s'}


class Quantity(NamedTuple):
    """
    One number of a message.

    Attributes
    ----------
    name : str
        The field: ``x``, ``force.x``, ``data``.
    unit : str
        SI unit; empty for a pure number.
    take : callable
        Gives the number of a message.

    """

    name: str
    unit: str
    take: Callable[[m.Message], float]


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
    quantities = _quantities(topic, type_name)
    for quantity in quantities:
        if field in ('', quantity.name):
            return quantity
    names = ', '.join(quantity.name for quantity in quantities) or 'no numbers'
    raise UnknownName(f'field of {topic}', field, f'a {type_name} has {names}')


def time_ns(message: m.Message, log_time_ns: int) -> int:
    """Give the time of a message: its own stamp where it has one."""
    if isinstance(message, (m.PointMessage, m.WrenchMessage)):
        return message.stamp_ns
    return log_time_ns


def _quantities(topic: str, type_name: str) -> list[Quantity]:
    if type_name == m.POINT_STAMPED:
        return [Quantity(axis, 'm', partial(_attribute, axis)) for axis in 'xyz']
    if type_name == m.WRENCH_STAMPED:
        return [*_components('force', 'N'), *_components('torque', 'N m')]
    if type_name in (m.FLOAT64, m.INT32, m.UINT32):
        return [Quantity('data', UNITS.get(topic.rpartition('/')[2], ''), _number)]
    return []


def _components(vector: str, unit: str) -> list[Quantity]:
    return [
        Quantity(f'{vector}.{axis}', unit, partial(_component, vector, index))
        for index, axis in enumerate('xyz')
    ]


def _attribute(name: str, message: m.Message) -> float:
    return float(getattr(message, name))


def _component(vector: str, index: int, message: m.Message) -> float:
    return float(getattr(message, vector)[index])


def _number(message: m.Message) -> float:
    assert isinstance(message, (int, float))
    return float(message)
