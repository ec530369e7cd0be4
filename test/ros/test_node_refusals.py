# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Nothing that comes over a topic stops the drive, or moves it where it must not go."""

import math
from collections.abc import Callable, Iterator
from itertools import product
from typing import Any

import numpy as np
from geometry_msgs.msg import WrenchStamped
from std_msgs.msg import Float64, Float64MultiArray

from stickslip_ros.instrument.reports import Status

NAN, INF = math.nan, math.inf
IDLE = Status.SENSOR_PRESENT | Status.AMPLIFIER_ENABLED
NOT_FINITE = (NAN, INF, -INF)
BATCH = 40
"""Bad messages on the way at once: fewer than the depth of a command topic."""
HUGE = 300_000
"""Numbers in an array that nobody could mean."""


def bad_voltages() -> Iterator[Float64]:
    """Give voltages that are no numbers or lie outside 0 to 300 V."""
    beyond = (np.nextafter(300.0, INF), 301.0, 1e300, -1e-300, -5e-324, -1.0, -1e300)
    yield from (Float64(data=float(value)) for value in (*NOT_FINITE, *beyond) * 10)


def bad_sawteeth() -> Iterator[Float64MultiArray]:
    """Give saw-teeth of a wrong length, with no numbers, or outside the limits."""
    rows: list[Any] = [[300.0] * length for length in (0, 1, 2, 4, 5, 100)]
    good = (100.0, 1000.0, 10.0)
    for place, value in product(range(3), (*NOT_FINITE, 1e300, -1e300)):
        rows.append([value if index == place else each for index, each in enumerate(good)])
    rows += [[0.0, 1000.0, 10.0], [-1.0, 1000.0, 10.0], [300.1, 1000.0, 10.0]]
    rows += [[100.0, 0.0, 10.0], [100.0, 20001.0, 10.0], [100.0, -20001.0, 10.0]]
    rows += [[100.0, 1000.0, -1.0], [100.0, 1000.0, 0.5], [100.0, 1000.0, 2.0**31]]
    rows += [np.zeros(HUGE), np.full(HUGE, NAN)]
    for row in rows * 4:
        yield Float64MultiArray(data=np.asarray(row, dtype=float))


def bad_loads() -> Iterator[WrenchStamped]:
    """Give loads that are no numbers, too large, or not along x."""
    vectors = [('force', 'x', value) for value in (*NOT_FINITE, 10.001, -10.001, 1e300)]
    for vector, axis in (('force', 'y'), ('force', 'z'), *product(['torque'], 'xyz')):
        vectors += [(vector, axis, value) for value in (*NOT_FINITE, 1.0, -5e-324)]
    for vector, axis, value in vectors * 4:
        message = WrenchStamped()
        setattr(getattr(message.wrench, vector), axis, value)
        yield message


def bad_preloads() -> Iterator[Float64]:
    """Give preloads that are no numbers, do not press, or lie above the limit of 2 N."""
    beyond = (0.0, -0.0, 9e-4, -1.0, -1e300, np.nextafter(2.0, INF), 2.1, 1e300)
    yield from (Float64(data=float(value)) for value in (*NOT_FINITE, *beyond) * 5)


BAD = {
    'voltage': bad_voltages,
    'sawtooth': bad_sawteeth,
    'load': bad_loads,
    'preload': bad_preloads,
}


def send_in_batches(stand: Any, key: str, messages: list[Any]) -> None:
    """Send messages, never more at once than a topic holds, and wait for an event of each."""
    operator = stand.operator
    for start in range(0, len(messages), BATCH):
        batch = messages[start : start + BATCH]
        expected = len(operator.events) + len(batch)
        for message in batch:
            operator.send(key, message)
        operator.spin_until(lambda: len(operator.events) >= expected, f'{expected} events')  # noqa: B023


def refused_by_diagnostics(stand: Any) -> int:
    """Give what the second report from now on counts: the first may be on its way already."""
    operator = stand.operator
    seen = len(operator.diagnostics)
    operator.spin_until(lambda: len(operator.diagnostics) > seen + 1, 'diagnostics')
    title = 'stickslip_drive: drive'
    return int(operator.diagnostics[-1][title]['commands_refused'])


def test_hundreds_of_bad_messages_neither_stop_nor_move_a_drive_that_records(
    start_drive: Callable, perfect_sensors: dict[str, float]
):
    stand = start_drive(perfect_sensors)
    operator = stand.operator
    assert operator.set_recording(wanted=True).success
    sent = 0
    for key, make in BAD.items():
        messages = list(make())
        send_in_batches(stand, key, messages)
        sent += len(messages)
    assert sent > 300
    assert {event['result'] for event in operator.events} == {'INVALID_PARAMETER'}
    assert [event['number'] for event in operator.events] == list(range(1, sent + 1))
    assert stand.drive.session.failure is None
    assert refused_by_diagnostics(stand) == sent
    assert operator.status == IDLE | Status.REFUSED
    assert set(operator.positions.values()) == {0.0}
    operator.command('voltage', 150.0)
    assert operator.wait_for_event('voltage', sent)['result'] == 'DONE'
    operator.spin_until(lambda: operator.positions[operator.time_ns] != 0.0, 'motion')
