"""Numbers of messages of any type, decoded by the definition that a recording carries of it."""

import re
from collections.abc import Iterator
from functools import reduce
from typing import Any

import numpy as np
from mcap_ros2.decoder import DecoderFactory
from numpy.typing import NDArray

from stickslip_ros.errors import RecordingError, UnknownName
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.recording.integrity import open_whole
from stickslip_ros.recording.reader import Recording
from stickslip_ros.units import NS_PER_S

PARTS = re.compile(r'([^\W\d]\w*)((?:\[\d+\])*)')
"""A name in the path of a field, and the places in the arrays behind it: ``position[0]``."""


def numbers_of(
    recording: Recording, topic: str, field: str
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """
    Return the time, ns, and one number of each message of a topic, in the order of time.

    The time is the stamp of the header where the message has one, else that of the file. A field
    is a path such as ``point.x``, ``wrench.force.x``, ``data`` or ``position[0]``. RecordingError:
    a message is damaged, or there is none; UnknownName: no such field, or it is no number.

    """
    rows = list(_rows(recording, topic, field))
    if not rows:
        raise RecordingError(recording.path, f'has no message on {topic}', 'name another topic')
    times, values = zip(*rows, strict=True)
    times_ns = np.array(times, dtype=np.int64)
    order = np.argsort(times_ns, kind='stable')
    return times_ns[order], np.array(values, dtype=np.float64)[order]


def _rows(recording: Recording, topic: str, field: str) -> Iterator[tuple[int, float]]:
    path = _path(topic, field)
    for file in recording.files:
        decoders: Any = DecoderFactory()  # it knows types by numbers that each file gives anew
        with open_whole(file) as reader:
            for schema, channel, message in reader.iter_messages([topic]):
                stop_if_asked()
                decode = decoders.decoder_for(channel.message_encoding, schema)
                if decode is None:
                    hint = 'record it with ros2 bag record -s mcap, or convert it'
                    problem = f'has no definition of {topic} that ROS 2 writes'
                    raise RecordingError(file, problem, hint)
                decoded = decode(message.data)
                stamp = getattr(getattr(decoded, 'header', None), 'stamp', None)
                stamp_ns = stamp.sec * NS_PER_S + stamp.nanosec if stamp else 0
                yield stamp_ns or message.log_time, _number(decoded, path, topic, field)


def _path(topic: str, field: str) -> list[str | int]:
    """Return the names and places on the way to a number."""
    path: list[str | int] = []
    for part in field.split('.'):
        if (found := PARTS.fullmatch(part)) is None:
            raise UnknownName(f'field of {topic}', field, 'write it as point.x or position[0]')
        path += [found[1], *map(int, re.findall(r'\d+', found[2]))]
    return path


def _number(decoded: Any, path: list[str | int], topic: str, field: str) -> float:
    try:
        value = reduce(_step, path, decoded)
    except (AttributeError, IndexError, TypeError):
        value = None
    if isinstance(value, int | float):
        return float(value)
    known = ', '.join(_numbers_in(decoded)) or 'none'
    raise UnknownName(f'field of {topic}', field, f'its numbers are {known}')


def _step(value: Any, part: str | int) -> Any:
    return value[part] if isinstance(part, int) else getattr(value, part)


def _numbers_in(value: Any, name: str = '') -> Iterator[str]:
    """Yield the paths of the numbers of a message; of an array the first."""
    if isinstance(value, int | float):
        yield name
    elif isinstance(value, list | tuple):
        yield from _numbers_in(value[0], f'{name}[0]') if value else ()
    else:
        for each in getattr(value, '__slots__', ()):
            yield from _numbers_in(getattr(value, each), f'{name}.{each}' if name else each)
