# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What a twin publishes and records of the windows of a rig."""

from dataclasses import replace
from pathlib import Path
from threading import Event

import numpy as np
import pytest

from stickslip_ros.errors import StickSlipError
from stickslip_ros.interface.cdr import unpack
from stickslip_ros.interface.messages import ArrayMessage
from stickslip_ros.lab.experiments.experiment import Experiment, Seen, Voltage
from stickslip_ros.lab.experiments.predict import predict
from stickslip_ros.lab.measurements.recorded import (
    recorded_commands,
    recorded_series,
    recorded_stand,
)
from stickslip_ros.lab.twin.settings import TwinParameters
from stickslip_ros.lab.twin.twin import Look, Twin
from stickslip_ros.lab.twin.window import Window
from stickslip_ros.lab.twin.work import Work
from stickslip_ros.message_types import FLOAT64_ARRAY
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.reader import Recording

HZ, VOLTS, LENGTH_S, RATE_HZ, START_NS = 500.0, 300.0, 0.05, 50e3, 7_000_000_000
SETTINGS = TwinParameters(window=LENGTH_S, period=1e4, free='contact.friction, actuator.gain')
STAND = {'load_cell.contact': 'absent'}


def windows(count: int, shift_s: float) -> list[Window]:
    """Give windows of a rig like the stand, whose position is read so much after the voltage."""
    fall_s, starts_s = 2e-6, np.arange(int((count + 1) * LENGTH_S * HZ)) / HZ
    corners = [(s + t, v) for s in starts_s for t, v in ((0.0, 0.0), (1.0 / HZ - fall_s, VOLTS))]
    rows = np.array([*corners, (starts_s[-1] + 1.0 / HZ, 0.0)])
    time_s = np.arange(0.0, rows[-1, 0] - shift_s, 1.0 / RATE_HZ)
    seen = Seen('position_m', np.zeros(len(time_s)), time_s + shift_s)
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


@pytest.mark.parametrize('shift_s', [0.0, 7e-6], ids=['a trace', 'stamps of their own'])
def test_a_recording_of_the_twin_holds_every_reading_and_opens(tmp_path: Path, shift_s: float):
    stand = Parameters().updated(STAND | {'record.directory': str(tmp_path)})
    told = list[str]()
    work = Work(stand, SETTINGS, lambda *_: None, told.append)
    work.set_recording(wanted=True, namespace='/left')
    given = windows(3, shift_s)
    for window in given:
        work.put(window)
    work.close()
    assert (told, work.trouble, work.shown, work.dropped) == ([], '', 3, 0)
    [path] = tmp_path.iterdir()
    recording = Recording(path)
    found = recorded_series(recording)
    for quantity in ('voltage_v', 'position_m'):
        inside = [
            (time_s[time_s >= 0.0] + number * LENGTH_S, values[time_s >= 0.0])
            for number, (time_s, values) in enumerate(each.samples[quantity] for each in given)
        ]
        time_s, values = np.concatenate(inside, axis=1)
        assert found[quantity].time_s == pytest.approx(time_s, rel=0.0, abs=2e-9)
        assert np.array_equal(found[quantity].value, values)
    counts = {each.topic: each.messages for each in recording.channels}
    assert counts['/left/twin/steps'] == 3
    assert counts['/left/twin/parameters'] == 1
    assert counts['/left/twin/residual'] == pytest.approx(150, rel=0.0, abs=3)
    assert recorded_stand(recording).flat() == stand.flat()
    assert recorded_commands(recording) == []
    assert set(recording.trace('/left/twin/steps')['steps'].value) <= {23.0, 24.0}


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


def test_where_windows_wait_a_fit_is_left_out_rather_than_a_window(
    monkeypatch: pytest.MonkeyPatch,
):
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
