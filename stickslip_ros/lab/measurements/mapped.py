# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Recordings of other rigs: topics and fields mapped to quantities."""

import re
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, RecordingError, UnknownName, WrongKind
from stickslip_ros.interface.messages import ArrayMessage
from stickslip_ros.lab.measurements.vocabulary import TIME_COLUMNS
from stickslip_ros.lab.readers.clocks import (
    LOG,
    STAMP,
    Clock,
    check_clocks,
    spread_blocks,
    times_in_blocks,
)
from stickslip_ros.lab.readers.units import factor_of, in_si
from stickslip_ros.message_types import FLOAT64_ARRAY
from stickslip_ros.recording.any_message import numbers_of
from stickslip_ros.recording.chunks import Places
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.series import Series
from stickslip_ros.units import NS_PER_S, parse_quantity

_EXAMPLE = 'position_m=/rig/encoder.point.x, or "force_n=/rig/cell.data (mN)"'
_BY_LOG = ' by log time'
_RATE = re.compile(r' at (\S+ ?k?M?Hz|\S+)(?= |$)')
_COLUMN = re.compile(r'\[([^\[\]]+)\](?:\.data)?')  # column of a table of samples
_FINER = {'m': 'nm', 'N': 'mN', 'V': 'mV'}


class Mapped(NamedTuple):
    """Source of a quantity."""

    field: str  # topic and path of the number, ``/rig/cell.wrench.force.x``
    factor: float = 1.0  # to SI
    by_log: bool = False  # timed by log times, not by stamps
    rate_hz: float | None = None  # sample rate of the array in each message


def mapped_series(
    recording: Recording, topics: Mapping[str, str]
) -> tuple[dict[str, Series], list[str]]:
    """
    Return quantities over the time since their first message, and notes on their clocks.

    ``topics`` are topic, field and unit, ``{'force_n': '/rig/cell.wrench.force.x (mN)'}``; the
    default unit is SI. A suffix ``at 10kHz`` reads blocks of samples, ``by log time`` ignores the
    stamps of the messages. A recording of this package keeps the times of its run.
    RecordingError: a topic is unknown, or the clocks differ.

    """
    read, clocks, notes = {}, list[Clock](), list[str]()
    for name, each in parse_map(topics).items():
        si_unit, field = TIME_COLUMNS[name].unit, each.field
        times_ns, values, logs_ns = _numbers(recording, each)
        if not len(values):
            hint = 'name another topic'
            raise RecordingError(recording.path, f'has no message with {field}', hint)
        values = in_si(values, each.factor)
        typical, largest = float(np.nanmedian(np.abs(values))), TIME_COLUMNS[name].maximum
        if largest is not None and typical > largest:
            limit = f'in the median, above the largest {name}, {largest:g} {si_unit}'
            hint = f'give its unit, as --map {name}="{field} ({_FINER[si_unit]})"'
            raise OutOfRange(f'{name} of {recording.path}', typical, si_unit, limit, hint)
        ahead_s = (times_ns - logs_ns) / NS_PER_S
        time_s = (times_ns - times_ns[0]) / NS_PER_S
        clocks.append(Clock(field, STAMP if np.any(ahead_s) else LOG, time_s, ahead_s))
        if each.rate_hz:
            where, is_first = f'{recording.path}: {field}', bool(np.any(ahead_s))
            time_s, note = times_in_blocks(time_s, each.rate_hz, where, is_first=is_first)
        else:
            time_s, note = spread_blocks(time_s)
        notes += [f'{field}: {note}'] if note else []
        read[name] = times_ns[0], time_s, values, si_unit, f'{recording.path.name} {field}'
    fields = {name: text.removesuffix(_BY_LOG) for name, text in topics.items()}
    given = ' '.join(f'--map {name}="{text}{_BY_LOG}"' for name, text in fields.items())
    notes += check_clocks(clocks, recording.path, f'take the log times of all: {given}')
    start_ns = min(e[0] + round(float(e[1][0]) * NS_PER_S) for e in read.values())
    start_ns = recording.time_origin_ns if recording.is_ours else start_ns
    return {
        name: Series((first_ns - start_ns) / NS_PER_S + time_s, values, unit, origin)
        for name, (first_ns, time_s, values, unit, origin) in read.items()
    }, notes


def _numbers(recording: Recording, mapped: Mapped) -> tuple[Places, Array, Places]:
    """Return times, ns, numbers and log times, ns, of a mapped field; refuse an unknown topic."""
    field, rate_hz, origin_ns = mapped.field, mapped.rate_hz, recording.time_origin_ns
    topic = topic_of(field, recording.types)
    if topic is None:
        there = ', '.join(recording.types) or 'no topic'
        problem = f'has no topic and field {field!r}; it has {there}'
        raise RecordingError(recording.path, problem, f'write --map {_EXAMPLE}')
    path = field[len(topic) :].removeprefix('.')
    column = _COLUMN.fullmatch(path)
    if column and recording.types[topic] == FLOAT64_ARRAY:
        _, at_ns, block = next(recording.messages([topic]))
        assert isinstance(block, ArrayMessage)
        names = [each.partition('[')[0] for each in ','.join(block.labels[1:]).split(',')]
        if column[1] not in names:
            raise UnknownName(f'column of {topic}', column[1], f'it has {", ".join(names)}')
        if rate_hz is None:
            if 't' not in names:
                hint = f'state the rate of its rows: "{field} at ...kHz"'
                raise RecordingError(recording.path, f'has no times, a column t, on {topic}', hint)
            series = recording.trace(topic)[column[1]]
            times_ns = np.rint(series.time_s * NS_PER_S).astype(np.int64) + origin_ns
            ahead_ns = round(block.data[-1, names.index('t')] * NS_PER_S) - at_ns
            logs_ns = times_ns - ahead_ns
            return logs_ns if mapped.by_log else times_ns, series.value, logs_ns
        path = f'data[{names.index(column[1])}]'
    times_ns, values, logs_ns = numbers_of(
        recording.files, topic, path, by_stamp=not mapped.by_log, in_blocks=rate_hz is not None
    )
    drive_ns = recording.drive_times(logs_ns)
    return np.where(times_ns == logs_ns, drive_ns, times_ns), values, drive_ns


def parse_map(topics: Mapping[str, str]) -> dict[str, Mapped]:
    """Parse field, unit, clock and rate of each quantity; refuse unknown quantities."""
    found = {}
    for name, text in topics.items():
        if name == 'time_s' or name not in TIME_COLUMNS:
            known = ', '.join(each for each in TIME_COLUMNS if each != 'time_s')
            raise OutOfRange('quantity of --map', name, '', f'none of {known}', 'name one of them')
        si_unit = TIME_COLUMNS[name].unit
        rate = _RATE.search(text)
        rest = _RATE.sub('', text).removesuffix(_BY_LOG)
        field, _, behind = rest.partition(' ')
        unit = behind.strip(' ()[]')
        factor = factor_of(unit, si_unit) if unit else 1.0
        if factor is None:
            raise WrongKind(f'unit of {name}', unit, f'a unit of {si_unit}', 'write mN, nm ...')
        rate_hz = parse_quantity(rate[1], 'Hz') if rate else None
        if rate and not rate_hz:
            raise WrongKind(f'rate of {name}', rate[1], 'a rate', 'write at 10kHz, at 2e4 ...')
        found[name] = Mapped(field, factor, text.endswith(_BY_LOG), rate_hz)
    return found


def topic_of(field: str, known: Iterable[str]) -> str | None:
    """Return the longest matching topic: both /rig/cell.raw and /rig/cell may exist."""
    found = (each for each in known if field.startswith((f'{each}.', f'{each}[')))
    return max(found, key=len, default=None)
