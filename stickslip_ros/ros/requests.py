"""From ROS messages to requests: numbers only, nothing is judged here."""

from typing import Any

from stickslip_ros.instrument.commands import Request


def to_request(key: str, message: Any) -> Request:
    """
    Return what a message on a command topic asks for.

    Parameters
    ----------
    key : str
        Key of the topic: ``voltage``, ``preload``, ``sawtooth`` or ``load``.
    message : ROS message
        As received.

    """
    values: tuple[float, ...]
    if key == 'load':
        force, torque = message.wrench.force, message.wrench.torque
        values = (force.x, force.y, force.z, torque.x, torque.y, torque.z)
    elif key == 'sawtooth':
        values = tuple(message.data)
    else:
        values = (message.data,)
    return Request(key, values)
