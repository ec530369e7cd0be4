# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Decode messages of any type by the definition that a recording carries."""

import os
import re
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, Final

from mcap.records import Channel, Schema

from stickslip_ros.budget import DEFINITION_MOST, load_json
from stickslip_ros.errors import RecordingError
from stickslip_ros.extras import load_extra

ENCODING_BYTES: Final = 4  # header of a message: encoding, byte order, options
_ENCODINGS: Final = 'ros2msg', 'ros2idl', ''  # of a definition; '' means a known type
BIG_ENDIAN, LITTLE_ENDIAN = 0, 1
"""First two bytes of a message in plain CDR."""
ELEMENTS_MOST: Final = 10_000
"""Largest array of fixed length, unless it holds numbers: rosbags writes code for each element."""
_SEPARATOR: Final = re.compile(r'^={3,}$', re.MULTILINE)
_NO_IDL: Final = re.compile(r'^(IDL:|#).*', re.MULTILINE)  # name and includes of each type
Decode = Callable[[bytes], Any]
Fields = tuple[list[Any], list[tuple[str, Any]]]  # constants, and name and type of each field


def decoder_of(channel: Channel, schema: Schema | None, path: Path) -> Decode:
    """
    Return a function that decodes messages of a channel to objects, or JSON to dictionaries.

    The fields of a message are attributes. Types missing in the definition are taken from ROS 2,
    then from installed packages. Raises RecordingError if the definition cannot be read; the
    function raises ValueError for malformed messages, and RecordingError for malformed JSON.

    """
    if channel.message_encoding == 'json':
        return partial(_load_json, path, channel.topic)
    if schema is None or channel.message_encoding != 'cdr' or schema.encoding not in _ENCODINGS:
        problem = f'has no definition of {channel.topic} that ROS 2 writes'
        raise RecordingError(path, problem, 'record it with ros2 bag record, or as JSON')
    typesys = load_extra(f'reading {schema.name}', 'rosbags.typesys')
    DEFINITION_MOST.check(len(schema.data), path)
    try:
        store = typesys.get_typestore(typesys.Stores.EMPTY)
        store.register(types := _types_of(typesys, schema))
        kind = store.get_msgdef(next(iter(types)))
    except (ValueError, LookupError, RecursionError, typesys.TypesysError) as error:
        form, reason = schema.encoding or 'no text', ' '.join(str(error).split())[:200]
        problem = f'has a definition ({form}) of {channel.topic} that cannot be read: {reason}'
        hint = 'source the ROS 2 workspace that has it, or record it anew'
        raise RecordingError(path, problem, hint) from None
    readers = {BIG_ENDIAN: kind.deserialize_cdr_be, LITTLE_ENDIAN: kind.deserialize_cdr_le}

    def decode(data: bytes) -> Any:
        read = readers.get(int.from_bytes(data[:2], 'big'))
        if read is None or len(data) < ENCODING_BYTES:
            begin = f'begins with "{data[:ENCODING_BYTES].hex(" ")}", not as plain CDR'
            raise ValueError(f'a message on {channel.topic} {begin}')
        try:  # the store's own method refuses the final padding of Fast CDR
            return read(memoryview(data)[ENCODING_BYTES:], 0, kind.cls, store)[0]
        except Exception as error:
            problem = f'a message on {channel.topic} is no {schema.name}: {error}'
            raise ValueError(problem) from error

    return decode


def _load_json(path: Path, topic: str, data: bytes) -> Any:
    try:
        return load_json(data, path)
    except ValueError:
        problem = f'has a message on {topic} that is not JSON'
        raise RecordingError(path, problem, 'name another topic') from None


def _types_of(typesys: Any, schema: Schema) -> dict[str, Fields]:
    """Return a type and its inner types; ValueError if a type is unknown or an array too long."""
    text, given = schema.data.decode() if schema.encoding else '', dict[str, Fields]()
    if schema.encoding == 'ros2idl':
        for section in filter(str.strip, _SEPARATOR.split(text)):
            given |= typesys.get_types_from_idl(_NO_IDL.sub('', section))
    elif text:
        given = typesys.get_types_from_msg(_SEPARATOR.sub('=' * 80, text), schema.name)
    known = typesys.get_typestore(typesys.Stores.LATEST).fielddefs
    # The first definition is the message's; rosbags adds `msg` to names without it.
    types, wanted = dict[str, Fields](), [next(iter(given), schema.name)]
    while wanted:
        if (name := wanted.pop()) not in types:
            fields = given.get(name) or known.get(name)
            types[name] = fields or typesys.get_types_from_msg(_installed_text(name), name)[name]
            _check_names(name, types[name])
            wanted += _inner_types(types[name])
    return types


def _check_names(kind: str, fields: Fields) -> None:
    """Raise ValueError for a name that is no identifier: rosbags runs code made of them."""
    for name in (*kind.split('/'), *(entry[0] for part in fields for entry in part)):
        if not name.isidentifier():
            raise ValueError(f'{name!r} is no name')


def _inner_types(fields: Fields) -> Iterator[str]:
    """Yield the type names of fields; ValueError if an array is too long."""
    for name, (node, content) in fields[1]:
        element, length = content if node.name in {'ARRAY', 'SEQUENCE'} else ((node, content), 0)
        is_type, inner = element[0].name == 'NAME', element[1]
        is_unrolled = node.name == 'ARRAY' and (is_type or inner[0] == 'string')
        if is_unrolled and length > ELEMENTS_MOST:
            raise ValueError(f'array {name} of {length} elements is above {ELEMENTS_MOST}')
        if is_type:
            yield inner


def _installed_text(name: str) -> str:
    """Return the definition of a type from an installed ROS 2 package, or raise ValueError."""
    package, _, kind = name.rpartition('/msg/')
    for prefix in (*os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep), sys.prefix):
        path = Path(prefix, 'share', package, 'msg', f'{kind}.msg')
        if re.fullmatch(r'\w+/msg/\w+', name) and prefix and path.is_file():
            return path.read_text(encoding='utf-8')
    raise ValueError(f'it lacks {name}, which is not installed here')
