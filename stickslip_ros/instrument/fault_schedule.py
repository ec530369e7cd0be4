# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Faults at given times, read from a YAML file."""

import difflib
from collections import deque
from collections.abc import Iterable, Mapping
from pathlib import Path

from stickslip_ros.errors import OutOfRange, RecordingError, UnknownName, WrongKind
from stickslip_ros.files import read_text
from stickslip_ros.instrument.commands import Request, TimedRequest
from stickslip_ros.parameters import (
    FeetParameters,
    Scalar,
    is_fault,
    read_yaml,
    spec_of,
    specs,
    to_nanoseconds,
)
from stickslip_ros.parameters.declaration import CONVERTERS

_PREFIX = 'fault.'
FAULTS = tuple(filter(is_fault, specs()))
"""Full names of the faults, in the order of declaration."""
FORM = 'write - {at: 0.5, set: {fault.interferometer: freeze}} or - {at: 1.0, clear: true}'


class FaultSchedule:
    """The future faults, sorted by time; entries of equal times keep their order."""

    def __init__(self, entries: Iterable[TimedRequest] = ()) -> None:
        self._waiting = deque(sorted(entries, key=lambda entry: entry.time_ns))

    @property
    def is_over(self) -> bool:
        return not self._waiting

    def due(self, now_ns: int) -> list[Request]:
        """Return each entry that has become due once, in the order of times."""
        found = []
        while self._waiting and self._waiting[0].time_ns <= now_ns:
            found.append(self._waiting.popleft().request)
        return found


def read_schedule(path: Path, feet: FeetParameters) -> FaultSchedule:
    """
    Read a schedule from a file, for a drive with these feet.

    Raises RecordingError if the file cannot be read, or is not YAML; UnknownName or WrongKind or
    OutOfRange if it is not a list of entries, or an entry is not allowed.

    """
    return parse_schedule(read_text(path, 'check fault.schedule', FORM), str(path), feet)


def parse_schedule(text: str, origin: str, feet: FeetParameters) -> FaultSchedule:
    """
    Read a YAML list of ``{at: seconds, set: {fault: value}}`` or ``{at: seconds, clear: true}``.

    Times count from the configuration. The prefix ``fault.`` of a name is optional.

    """
    document = read_yaml(text, origin, FORM)
    if not document:
        raise RecordingError(origin, 'holds no entry', f'{FORM}, or set fault.schedule to empty')
    if not isinstance(document, list):
        raise WrongKind(origin, document, 'a list of entries', FORM)
    return FaultSchedule(
        _entry(item, f'{origin}: entry {number}', feet)
        for number, item in enumerate(document, start=1)
    )


def _entry(item: object, place: str, feet: FeetParameters) -> TimedRequest:
    if not isinstance(item, dict) or set(item) not in ({'at', 'set'}, {'at', 'clear'}):
        raise WrongKind(place, item, 'a time with either set or clear', FORM)
    at_ns = _time_ns(item['at'], f'{place}: at')
    if 'clear' not in item:
        settings = _settings(item['set'], place, feet)
        return TimedRequest(at_ns, Request('fault', settings=settings))
    if item['clear'] is not True:
        raise WrongKind(f'{place}: clear', item['clear'], 'true', 'write clear: true')
    return TimedRequest(at_ns, Request('clear_faults'))


def _time_ns(value: object, name: str) -> int:
    time_s = CONVERTERS[float](name, value, 's')
    if time_s < 0.0:
        hint = 'give seconds since the configuration'
        raise OutOfRange(name, time_s, 's', 'below 0 s', hint)
    return to_nanoseconds(time_s)


def _settings(table: object, place: str, feet: FeetParameters) -> tuple[tuple[str, Scalar], ...]:
    if not isinstance(table, Mapping) or not table:
        raise WrongKind(f'{place}: set', table, 'a table of faults', FORM)
    settings = [_setting(str(key), value, place, feet) for key, value in table.items()]
    if len(dict(settings)) < len(settings):
        raise WrongKind(f'{place}: set', table, 'a table with each fault once', FORM)
    return tuple(settings)


def _setting(key: str, value: object, place: str, feet: FeetParameters) -> tuple[str, Scalar]:
    name = key if key.startswith(_PREFIX) else _PREFIX + key
    if name not in FAULTS:
        near = difflib.get_close_matches(name, FAULTS, n=1)
        hint = f'did you mean {near[0]}?' if near else f'use {", ".join(FAULTS)}'
        raise UnknownName(f'{place}: fault', key, hint)
    checked = spec_of(name).check(f'{place}: {name}', value)
    if name == 'fault.dead_foot':
        feet.check_foot(f'{place}: {name}', checked)
    return name, checked
