# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Generated messages of any type, most of them odd, and bytes that are no message."""

import json
import math
import random
import re
from array import array
from collections.abc import Callable
from importlib import import_module
from itertools import chain
from typing import Any

from rclpy.serialization import serialize_message
from std_msgs.msg import Float64MultiArray, MultiArrayDimension

NUMBERS = [0.0, -0.0, 1e-9, 0.1, 1.0, -1.0, 150.0, 1e10, 5e-324, 1e300, -1e300]
NUMBERS += [math.nan, math.inf, -math.inf]
WHOLE = (0, 1, 2, 3, 10, -1, 999_999_999, 2**31 - 1, 2**31, -(2**31), 2**32 - 1, 2**63 - 1)
EVENT: dict[str, Any] = {'message': '', 'result': 'DONE', 'command': 'position', 'number': 1}
EVENT |= {'steps': 0, 'time_ns': 5}
CHANGES: list[dict[str, Any]] = [{}, {}, {'command': []}, {'step_m': math.nan}, {'result': 1}]
CHANGES += [{'number': 10**400}]
TEXTS = ['', 'runner', 'runner#tag', '#', 'x' * 5000, 'ä\N{SNOWMAN}', '{', '[]', '[' * 5000]
TEXTS += [json.dumps(EVENT | change) for change in CHANGES]
LABELS = ['t[s],voltage[V],position[m]', 't[s],voltage[V],force[N]', 't[s],steps,rig[m],twin[m]']
LABELS += ['t[s],runner.mass,runner.mass_sigma', 'contact.friction', '', 't[s]', 't[s],t[s]']
LABELS += ['sample', 'cycle', 'cycle#tag', 'amplitude[V],frequency[Hz],steps', 'voltage[V]']
LENGTHS = (0, 0, 1, 1, 2, 3, 7, 40)


class OddMessages:
    """Generates messages, the same ones for a seed."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)
        self._now_s = 7.0

    def message(self, kind: Any) -> Any:
        """Return a message of a type."""
        if kind is Float64MultiArray and self._random.random() < 0.7:
            return self._table()
        message = kind()
        for name, typed in kind.get_fields_and_field_types().items():
            setattr(message, name, self._value(typed))
        return message

    def not_a_message(self, kind: Any) -> bytes:
        """Return bytes that are cut off, changed, of another type, or noise."""
        data = bytearray(serialize_message(self.message(kind)))
        match self._random.randrange(4):
            case 0:
                return bytes(data[: self._random.randrange(len(data))])
            case 1:
                for _ in range(4):
                    data[self._random.randrange(len(data))] = self._random.randrange(256)
                return bytes(data)
            case 2:
                return bytes(data[:4]) + b'\xff' * 64
        return self._random.randbytes(self._random.randrange(200))

    def _value(self, typed: str) -> Any:
        listed = re.fullmatch(r'(?:sequence<(.+?)(?:, \d+)?>|(.+)\[(\d+)\])', typed)
        if listed:
            inner, fixed = listed[1] or listed[2], listed[3]
            count = int(fixed) if fixed else self._random.choice(LENGTHS)
            values = [self._value(inner) for _ in range(count)]
            return array('d', values) if inner == 'double' else values
        plain: dict[str, Callable[[], Any]] = {
            'double': self._number,
            'string': lambda: self._random.choice(TEXTS + LABELS),
            'boolean': lambda: self._random.random() < 0.5,
            'octet': lambda: self._random.randbytes(1),
        }
        if typed in plain:
            return plain[typed]()
        if integer := re.fullmatch(r'(u?)int(\d+)', typed):
            bits = int(integer[2])
            low, high = (0, 2**bits) if integer[1] else (-(2 ** (bits - 1)), 2 ** (bits - 1))
            return min(max(self._random.choice(WHOLE), low), high - 1)
        package, _, name = typed.partition('/')
        return self.message(getattr(import_module(f'{package}.msg'), name))

    def _number(self) -> float:
        is_odd = self._random.random() < 0.5
        return self._random.choice(NUMBERS) if is_odd else self._random.uniform(0.0, 300.0)

    def _table(self) -> Float64MultiArray:
        """Return rows with labels; times that mostly go on, and a layout that mostly fits."""
        label, rows = self._random.choice(LABELS), self._random.choice(LENGTHS)
        width = label.count(',') + 1
        table = [[self._number() for _ in range(width)] for _ in range(rows)]
        for row in table:
            self._now_s += 1e-3
            row[0] = self._now_s
        if table and self._random.random() < 0.3:
            self._random.choice(table)[0] = self._number()
        message = Float64MultiArray(data=array('d', chain.from_iterable(table)))
        sizes = [rows, width] if self._random.random() < 0.9 else [width, rows + 1]
        message.layout.dim = [
            MultiArrayDimension(
                label=self._random.choice(('sample', 'row', 'cycle')), size=sizes[0]
            ),
            MultiArrayDimension(label=label, size=sizes[1], stride=width),
        ]
        message.layout.dim[0].stride = sizes[0] * sizes[1]
        message.layout.data_offset = self._random.choice((0, 0, 0, 0, 1, 2**32 - 1))
        return message
