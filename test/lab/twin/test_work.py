# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What a twin publishes of the windows of a rig."""

from collections import Counter
from dataclasses import replace
from threading import Event
from typing import Any

import numpy as np
import pytest

from stickslip_ros.errors import StickSlipError
from stickslip_ros.interface.cdr import unpack
from stickslip_ros.interface.messages import ArrayMessage
from stickslip_ros.lab.experiments.experiment import Experiment, Readout, Voltage
from stickslip_ros.lab.experiments.predict import predict
from stickslip_ros.lab.twin.settings import TwinParameters
from stickslip_ros.lab.twin.twin import Look, Twin
from stickslip_ros.lab.twin.window import Window
from stickslip_ros.lab.twin.work import Work
from stickslip_ros.message_types import FLOAT64_ARRAY, POINT_STAMPED
from stickslip_ros.parameters import Parameters

HZ, VOLTS, LENGTH_S, RATE_HZ, START_NS = 500.0, 300.0, 0.05, 50e3, 7_000_000_000
SETTINGS = TwinParameters(window=LENGTH_S, period=1e4, free='contact.friction, actuator.gain')
STAND = {'load_cell.contact': 'absent'}


def windows(count: int, shift_s: float) -> list[Window]:
    """Give windows of a rig like the stand, whose position is read so much after the voltage."""
    fall_s, starts_s = 2e-6, np.arange(int((count + 1) * LENGTH_S * HZ)) / HZ
    corners = [(s + t, v) for s in starts_s for t, v in ((0.0, 0.0), (1.0 / HZ - fall_s, VOLTS))]
    rows = np.array([*corners, (starts_s[-1] + 1.0 / HZ, 0.0)])
    time_s = np.arange(0.0, rows[-1, 0] - shift_s, 1.0 / RATE_HZ)
    seen = Readout('position_m', np.zeros(len(time_s)), time_s + shift_s)
    [[found]] = predict(Parameters().updated(STAND), [Experiment('', {}, Voltage(rows), (seen,))])
    made = []
    for number in range(count):
        begin_s = (number + 1) * LENGTH_S
        inside = (time_s >= begin_s - LENGTH_S) & (time_s < begin_s + LENGTH_S)
        since_s, volts = time_s[inside] - begin_s, np.interp(time_s[inside], *rows.T)
        samples = {
            'voltage_v': (since_s, volts),
            'position_m': (since_s + shift_s, found.values[inside]),
        }
        start_ns = START_NS + round(1e9 * begin_s)
        made.append(Window(start_ns, start_ns + round(1e9 * LENGTH_S), samples))
    return made


def test_a_twin_publishes_each_window_thinned_to_a_thousand_a_second():
    told, sent = list[str](), list[tuple[str, bytes]]()
    work = Work(
        Parameters().updated(STAND), SETTINGS, lambda *each: sent.append(each), told.append
    )
    for window in windows(3, 0.0):
        work.put(window)
    work.close()
    assert (told, work.trouble, work.shown, work.dropped) == ([], '', 3, 0)
    counts = Counter(key for key, _ in sent)
    assert counts['twin/steps'] == 3
    assert counts['twin/parameters'] == 1
    assert counts['twin/residual'] == counts['twin/position'] == pytest.approx(150, rel=0.0, abs=3)
    rows: list[Any] = [unpack(FLOAT64_ARRAY, data) for key, data in sent if key == 'twin/steps']
    assert {each.data[0, 1] for each in rows} <= {23.0, 24.0}
    residual: Any = unpack(POINT_STAMPED, dict(reversed(sent))['twin/residual'])
    assert residual.stamp_ns == START_NS + round(1e9 * LENGTH_S)


def test_a_fit_that_fails_is_the_health_of_the_rig(monkeypatch: pytest.MonkeyPatch):
    told = list[str]()
    work = Work(Parameters().updated(STAND), SETTINGS, lambda *_: None, told.append)

    def fail(*_: object) -> None:
        raise StickSlipError('a stand cannot follow')

    monkeypatch.setattr(Twin, 'fit', fail)
    for window in windows(1, 0.0):
        work.put(window)
    work.close()
    assert work.health is not None
    assert told == [work.health.words] == ['no fit: a stand cannot follow']


def test_where_windows_wait_a_fit_is_left_out_rather_than_a_window(monkeypatch):
    stand, all_wait, look = Parameters().updated(STAND), Event(), Twin.look

    def late_look(twin: Twin, window: Window) -> Look:
        all_wait.wait()
        return look(twin, window)

    monkeypatch.setattr(Twin, 'look', late_look)
    settings, fits = replace(SETTINGS, period=0.1), list[bytes]()
    work = Work(
        stand,
        settings,
        lambda key, data: fits.append(data) if key == 'twin/parameters' else None,
        pytest.fail,
    )
    given = windows(8, 0.0)
    for window in given:
        work.put(window)
    all_wait.set()
    work.close()
    assert (work.shown, work.dropped) == (8, 0)
    assert work.fits + work.left_out == 4  # every second window is due
    first = unpack(FLOAT64_ARRAY, fits[0])
    assert isinstance(first, ArrayMessage)
    assert first.data[0, 0] == given[4].end_ns / 1e9
