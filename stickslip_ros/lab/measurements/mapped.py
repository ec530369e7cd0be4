# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Recordings of other rigs: topics and fields mapped to quantities."""

from collections.abc import Iterable, Mapping

import numpy as np

from stickslip_ros.errors import OutOfRange, RecordingError, WrongKind
from stickslip_ros.lab.readers.measured import TIME_COLUMNS
from stickslip_ros.lab.readers.units import factor_of, in_si
from stickslip_ros.recording.any_message import numbers_of
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.series import Series
from stickslip_ros.units import NS_PER_S

_EXAMPLE = 'position_m=/rig/encoder.point.x, or "force_n=/rig/cell.data (mN)"'
_FINER = {'m': 'nm', 'N': 'mN', 'V': 'mV'}


def mapped_series(recording: Recording, topics: Mapping[str, str]) -> dict[str, Series]:
    """
    Return quantities over the time since the first of their messages.

    ``topics`` are topic, field and unit, ``{'force_n': '/rig/cell.wrench.force.x (mN)'}``; the
    default unit is SI.

    """
    read = {}
    for name, (field, factor) in parse_map(topics).items():
        si_unit = TIME_COLUMNS[name].unit
        topic = topic_of(field, recording.types)
        if topic is None:
            there = ', '.join(recording.types) or 'no topic'
            problem = f'has no topic and field {field!r}; it has {there}'
            raise RecordingError(recording.path, problem, f'write --map {_EXAMPLE}')
        times_ns, values = numbers_of(recording.files, topic, field[len(topic) + 1 :])
        if not len(values):
            hint = 'name another topic'
            raise RecordingError(recording.path, f'has no message on {topic}', hint)
        values = in_si(values, factor)
        typical, largest = float(np.nanmedian(np.abs(values))), TIME_COLUMNS[name].maximum
        if largest is not None and typical > largest:
            limit = f'in the median, above the largest {name}, {largest:g} {si_unit}'
            hint = f'give its unit, as --map {name}="{field} ({_FINER[si_unit]})"'
            raise OutOfRange(f'{name} of {recording.path}', typical, si_unit, limit, hint)
        read[name] = times_ns, values, si_unit, f'{recording.path.name} {field}'
    start_ns = min(times_ns[0] for times_ns, *_ in read.values())
    return {
        name: Series((times_ns - start_ns) / NS_PER_S, values, unit, origin)
        for name, (times_ns, values, unit, origin) in read.items()
    }


def parse_map(topics: Mapping[str, str]) -> dict[str, tuple[str, float]]:
    """Return topic with field, and factor to SI, of each quantity; refuse unknown ones."""
    found = {}
    for name, text in topics.items():
        if name == 'time_s' or name not in TIME_COLUMNS:
            known = ', '.join(each for each in TIME_COLUMNS if each != 'time_s')
            raise OutOfRange('quantity of --map', name, '', f'none of {known}', 'name one of them')
        si_unit = TIME_COLUMNS[name].unit
        field, _, behind = text.partition(' ')
        unit = behind.strip(' ()[]')
        factor = factor_of(unit, si_unit) if unit else 1.0
        if factor is None:
            raise WrongKind(f'unit of {name}', unit, f'a unit of {si_unit}', 'say mN, nm, mV ...')
        found[name] = field, factor
    return found


def topic_of(field: str, known: Iterable[str]) -> str | None:
    """Return the longest matching topic: /rig/cell.raw may exist next to /rig/cell."""
    return max((each for each in known if field.startswith(f'{each}.')), key=len, default=None)
