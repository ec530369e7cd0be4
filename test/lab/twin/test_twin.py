# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A rig of springs, which shares no code with the twin, and what its twin says of it."""

import sys
from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1] / 'fitting'))
from spring_rig import Rig, voltage

from stickslip_ros.errors import StickSlipError
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.lab.fitting.report import Fit
from stickslip_ros.lab.twin.health import Doctor
from stickslip_ros.lab.twin.settings import TwinParameters
from stickslip_ros.lab.twin.twin import RigAtRest, Twin
from stickslip_ros.lab.twin.window import Window, Windows
from stickslip_ros.parameters import Parameters

STAND = Parameters().updated({'runner.damping': 20.0})
SETTINGS = TwinParameters(window=0.03)
ROWS = voltage((300.0, 500.0, 40), rest_s=0.0)
RATE_HZ, MONITOR_HZ = 19.3e3, 5170.0  # at a multiple of the steps each cycle looks the same

SLOW = pytest.mark.slow
NAMES, WINDOWS = ('voltage_v', 'position_m'), 2
OFF = 0.006
"""Share by which estimates may be off beside a drive of this package, as its page says: the
low-pass of the drive's sensor is one of samples, that of a fit is one in time."""


def seen(rig: Rig, number: int) -> Window:
    """Give a window of a rig that runs, with its lead."""
    time_s, position_m = rig.positions(ROWS, RATE_HZ, number)
    monitor_s = np.arange(1.3e-4, ROWS[-1, 0], 1.0 / MONITOR_HZ)
    voltage_v = np.interp(monitor_s, *ROWS.T)
    voltage_v += np.random.default_rng(number).normal(0.0, 0.05, len(monitor_s))
    start_ns = number * 10_000_000_000
    samples = {
        'voltage_v': (monitor_s - 0.05, voltage_v),
        'position_m': (time_s - 0.05, position_m),
    }
    return Window(start_ns, start_ns + 30_000_000, samples)


@pytest.fixture(scope='module')
def begun() -> tuple[Twin, Doctor]:
    """Give a twin and what examines it, after the three fits that make the start."""
    twin = Twin(STAND, SETTINGS)
    doctor = Doctor(twin, SETTINGS)
    assert [doctor.examine(twin.look(seen(Rig(), k))).words for k in range(3)] == ['', '', '']
    return twin, doctor


def test_the_twin_steps_as_the_rig_does_and_its_residual_is_noise():
    look = Twin(STAND, SETTINGS).look(seen(Rig(), 1))
    assert look.steps in (13, 14)  # by where the monitor sees the first begin
    assert look.step_twin_m == pytest.approx(look.step_rig_m, rel=2e-3, abs=0.0)
    assert look.shown[0].rms < 2.0 * Rig().noise_m


@pytest.mark.parametrize(
    ('field', 'factor', 'name', 'cause'),
    [
        pytest.param('friction', 0.8, 'contact.friction', 'dirt, moisture or wear', marks=SLOW),
        pytest.param('mass_kg', 1.1, 'runner.mass', 'put on the runner', marks=SLOW),
        pytest.param('mass_kg', 1.2, 'runner.mass', 'put on the runner', marks=SLOW),
        ('gain_m_per_v', 0.97, 'actuator.gain', 'the piezo or its amplifier'),
    ],
)
def test_what_changes_is_named_at_the_second_fit(begun, field, factor, name, cause):
    twin, doctor = deepcopy(begun)
    other = replace(Rig(), **{field: factor * getattr(Rig(), field)})
    _, found = (doctor.examine(twin.look(seen(other, k))) for k in (3, 4))
    assert found.words.startswith(name)
    assert cause in found.words
    place = found.names.index(name)
    true = factor * float(STAND.flat()[name])
    assert found.values[place] == pytest.approx(true, rel=0.0, abs=4.0 * found.errors[place])


@pytest.mark.slow
@pytest.mark.parametrize(
    ('change', 'name', 'cause'),
    [
        ({'load_n': 0.02}, 'contact.friction', 'as of a tilted rail, has the same effect'),
        ({'gains': (0.7, *(1.0,) * 5)}, 'actuator.gain', 'of all feet or of one'),
    ],
)
def test_a_change_that_acts_as_that_of_a_parameter_is_told_beside_it(begun, change, name, cause):
    twin, doctor = deepcopy(begun)
    other = replace(Rig(), **change)
    _, found = (doctor.examine(twin.look(seen(other, k))) for k in (3, 4))
    assert found.words.startswith(name)
    assert found.words.endswith(cause)


@pytest.mark.parametrize('late_s', [3e-4, pytest.param(-3e-4, marks=SLOW)])
def test_a_clock_that_has_moved_is_told_and_no_parameter_with_it(begun, late_s):
    twin, doctor = deepcopy(begun)
    other = replace(Rig(), late_s=late_s)
    first, found = (doctor.examine(twin.look(seen(other, k))) for k in (3, 4))
    assert first.words == ''
    assert found.words.startswith(f'the clock of position_m is {1e3 * late_s:+.1g} ms late')
    assert 'was' not in found.words  # as of a parameter


def test_a_clock_that_drifts_is_followed_from_window_to_window():
    twin, found_s = Twin(STAND, SETTINGS), list[float]()
    for number in range(8):
        window = seen(replace(Rig(), late_s=4e-4 * number), number)  # 1.4 periods in all
        found_s.append(twin.look(window).late_s)
    assert found_s == pytest.approx([4e-4 * number for number in range(8)], rel=0.0, abs=4e-5)


@pytest.mark.parametrize('quantity', NAMES)
def test_a_window_with_readings_only_before_it_or_a_part_of_the_voltage_is_refused(quantity: str):
    window = seen(Rig(), 1)
    time_s, values = window.samples[quantity]
    early = time_s < (0.02 if quantity == 'voltage_v' else 0.0)
    window.samples[quantity] = time_s[early], values[early]
    with pytest.raises(StickSlipError, match='set its clock, or raise'):
        Twin(STAND, SETTINGS).look(window)


def test_another_preload_is_told_as_no_change_of_a_single_parameter(begun: tuple[Twin, Doctor]):
    twin, doctor = deepcopy(begun)
    other = replace(Rig(), preload_n=0.8 * Rig().preload_n)
    _, found = (doctor.examine(twin.look(seen(other, k))) for k in (3, 4))
    assert found.words.startswith(
        'the change is not that of a single parameter: check the preload'
    )


@pytest.mark.parametrize('damping', [0.0, 20.0])
def test_fits_beside_a_drive_like_the_twin_are_off_by_no_more_than_is_stated(damping: float):
    stand = Parameters().updated({'runner.damping': damping, 'load_cell.contact': 'absent'})
    windows, twin, bench = Windows(NAMES, 0.03, 0.05), Twin(stand, SETTINGS), Bench(stand)
    bench.update(stand.block_ns, [Request('sawtooth', (300.0, 500.0, 0.0))])
    found = list[Fit]()
    while len(found) < WINDOWS:
        trace = bench.update(bench.time_ns + stand.block_ns).readings.trace
        for name, column in zip(NAMES, (1, 3), strict=True) if len(trace) else ():
            stamps_ns = np.round(1e9 * trace[:, 0]).astype(int).tolist()
            windows.add(name, stamps_ns, trace[:, column].tolist())
        for window in windows.complete():
            found.append(twin.fit(twin.look(window)))
            twin.follow(found[-1])
    for estimates in zip(*(each.estimates for each in found), strict=True):
        mean = np.mean([each.value for each in estimates])
        true = float(stand.flat()[estimates[0].name])
        assert mean == pytest.approx(true, rel=0.0, abs=1.5 * estimates[0].standard_error)
        if estimates[0].name != 'runner.damping':  # of which 0 has no share
            assert mean == pytest.approx(true, rel=OFF, abs=0.0)


def test_a_rig_that_rests_is_no_trouble():
    window = seen(Rig(), 1)
    still = np.full_like(window.samples['voltage_v'][1], 12.0)
    window.samples['voltage_v'] = window.samples['voltage_v'][0], still
    with pytest.raises(RigAtRest):
        Twin(STAND, SETTINGS).look(window)
