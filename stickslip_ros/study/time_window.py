"""A stretch of a run as it is typed: ``2ms@0.3s`` is two milliseconds from 0.3 s on."""

import math
import re
from typing import NamedTuple

from stickslip_ros.errors import OutOfRange, WrongKind

UNITS_S = {'': 1.0, 's': 1.0, 'ms': 1e-3, 'us': 1e-6, 'µs': 1e-6}
_TIME = re.compile(r'(?P<number>[-+.\deE]+?)\s*(?P<unit>s|ms|us|µs|)')


class TimeWindow(NamedTuple):
    """Start and end, s."""

    start_s: float
    end_s: float


def parse_window(text: str) -> TimeWindow:
    """
    Return the stretch of a text such as ``2ms@0.3s``, ``500us@10ms`` or ``0.5@1``.

    Raises
    ------
    WrongKind
        If it is not length, at sign and start.
    OutOfRange
        If the length is not above 0.

    """
    length, at, start = text.partition('@')
    if not at:
        raise _malformed('window', text, 'LENGTH@START')
    length_s, start_s = _seconds('length', length), _seconds('start', start)
    if not length_s > 0.0:
        raise OutOfRange('length of the window', length_s, 's', 'not above 0 s', 'raise it')
    return TimeWindow(start_s, start_s + length_s)


def check_window(window: TimeWindow, run: TimeWindow) -> TimeWindow:
    """
    Return the part of a stretch that lies within a run.

    Raises
    ------
    OutOfRange
        If nothing of it does.

    """
    if window.start_s > run.end_s or window.end_s < run.start_s:
        limit = f'outside of the run, {run.start_s:.6g} s to {run.end_s:.6g} s'
        raise OutOfRange('start of the window', window.start_s, 's', limit, 'move it')
    return TimeWindow(max(window.start_s, run.start_s), min(window.end_s, run.end_s))


def _seconds(part: str, text: str) -> float:
    match = _TIME.fullmatch(text.strip())
    try:
        number = float(match['number']) if match else math.nan
    except ValueError:
        number = math.nan
    if match is None or not math.isfinite(number):
        raise _malformed(f'{part} of the window', text, 'a time')
    return number * UNITS_S[match['unit']]


def _malformed(name: str, text: str, expected: str) -> WrongKind:
    return WrongKind(
        name, text, expected, 'write LENGTH@START with s, ms or us, as 2ms@0.3s or 0.002@0.3'
    )
