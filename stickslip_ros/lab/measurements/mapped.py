# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Recordings of other rigs: topics and fields mapped to quantities."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from stickslip_ros.errors import OutOfRange, RecordingError, WrongKind
from stickslip_ros.lab.readers.clocks import LOG, STAMP, Clock, check_clocks, spread_blocks
from stickslip_ros.lab.readers.measured import TIME_COLUMNS
from stickslip_ros.lab.readers.units import factor_of, in_si
from stickslip_ros.recording.any_message import numbers_of
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.series import Series
from stickslip_ros.units import NS_PER_S

_EXAMPLE = 'position_m=/rig/encoder.point.x, or "force_n=/rig/cell.data (mN)"'
_BY_LOG = ' by log time'
_FINER = {'m': 'nm', 'N': 'mN', 'V': 'mV'}


class Mapped(NamedTuple):
    """Where a quantity comes from."""

    field: str  # topic and path of the number, ``/rig/cell.wrench.force.x``
    factor: float = 1.0  # to SI
    by_log: bool = False  # timed by the log times of its messages, whatever their stamps say


def mapped_series(
    recording: Recording, topics: Mapping[str, str]
) -> tuple[dict[str, Series], list[str]]:
    """
    Return quantities over the time since the first of their messages, and notes on their clocks.

    ``topics`` are topic, field and unit, ``{'force_n': '/rig/cell.wrench.force.x (mN)'}``; the
    default unit is SI. ``by log time`` behind it leaves the stamps of the messages unread.
    RecordingError: no such topic, or clocks that are not the same.

    """
    read, clocks, notes = {}, list[Clock](), list[str]()
    for name, (field, factor, by_log) in parse_map(topics).items():
        si_unit = TIME_COLUMNS[name].unit
        topic = topic_of(field, recording.types)
        if topic is None:
            there = ', '.join(recording.types) or 'no topic'
            problem = f'has no topic and field {field!r}; it has {there}'
            raise RecordingError(recording.path, problem, f'write --map {_EXAMPLE}')
        path = field[len(topic) + 1 :]
        times_ns, values, logs_ns = numbers_of(recording.files, topic, path, by_stamp=not by_log)
        if not len(values):
            hint = 'name another topic'
            raise RecordingError(recording.path, f'has no message on {topic}', hint)
        values = in_si(values, factor)
        typical, largest = float(np.nanmedian(np.abs(values))), TIME_COLUMNS[name].maximum
        if largest is not None and typical > largest:
            limit = f'in the median, above the largest {name}, {largest:g} {si_unit}'
            hint = f'give its unit, as --map {name}="{field} ({_FINER[si_unit]})"'
            raise OutOfRange(f'{name} of {recording.path}', typical, si_unit, limit, hint)
        ahead_s = (times_ns - logs_ns) / NS_PER_S
        time_s = (times_ns - times_ns[0]) / NS_PER_S
        clocks.append(Clock(field, STAMP if np.any(ahead_s) else LOG, time_s, ahead_s))
        time_s, note = spread_blocks(time_s)
        notes += [f'{field}: {note}'] if note else []
        read[name] = times_ns[0], time_s, values, si_unit, f'{recording.path.name} {field}'
    fields = {name: text.removesuffix(_BY_LOG) for name, text in topics.items()}
    given = ' '.join(f'--map {name}="{text}{_BY_LOG}"' for name, text in fields.items())
    notes += check_clocks(clocks, recording.path, f'take the log times of all: {given}')
    start_ns = min(first_ns for first_ns, *_ in read.values())
    return {
        name: Series((first_ns - start_ns) / NS_PER_S + time_s, values, unit, origin)
        for name, (first_ns, time_s, values, unit, origin) in read.items()
    }, notes


def parse_map(topics: Mapping[str, str]) -> dict[str, Mapped]:
    """Return topic with field, factor to SI, and clock of each quantity; refuse unknown ones."""
    found = {}
    for name, text in topics.items():
        if name == 'time_s' or name not in TIME_COLUMNS:
            known = ', '.join(each for each in TIME_COLUMNS if each != 'time_s')
            raise OutOfRange('quantity of --map', name, '', f'none of {known}', 'name one of them')
        si_unit = TIME_COLUMNS[name].unit
        field, _, behind = text.removesuffix(_BY_LOG).partition(' ')
        unit = behind.strip(' ()[]')
        factor = factor_of(unit, si_unit) if unit else 1.0
        if factor is None:
            raise WrongKind(f'unit of {name}', unit, f'a unit of {si_unit}', 'say mN, nm, mV ...')
        found[name] = Mapped(field, factor, text.endswith(_BY_LOG))
    return found


def topic_of(field: str, known: Iterable[str]) -> str | None:
    """Return the longest matching topic: /rig/cell.raw may exist next to /rig/cell."""
    return max((each for each in known if field.startswith(f'{each}.')), key=len, default=None)
