# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A rig of springs, which shares no code with the twin, and what its twin says of it."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1] / 'fitting'))
from spring_rig import Rig, voltage

from stickslip_ros.lab.twin.health import Doctor, Health
from stickslip_ros.lab.twin.settings import TwinParameters
from stickslip_ros.lab.twin.twin import RigRests, Twin
from stickslip_ros.lab.twin.window import Window
from stickslip_ros.parameters import Parameters

STAND = Parameters().updated({'runner.damping': 20.0})
SETTINGS = TwinParameters(window=0.1, frequency_max=1000.0)
ROWS = voltage((300.0, 500.0, 75), rest_s=0.0)
RATE_HZ, MONITOR_HZ = 19.3e3, 5170.0  # at a multiple of the steps each cycle looks the same


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
    return Window(start_ns, start_ns + 100_000_000, samples)


def examined(*rigs: Rig) -> list[Health]:
    twin = Twin(STAND, SETTINGS)
    doctor = Doctor(twin, SETTINGS)
    return [doctor.examine(twin.look(seen(rig, k))) for k, rig in enumerate(rigs)]


def test_the_twin_steps_as_the_rig_does_and_its_residual_is_noise():
    look = Twin(STAND, SETTINGS).look(seen(Rig(), 1))
    assert look.steps in (48, 49)  # by where the monitor sees the first begin
    assert look.step_twin_m == pytest.approx(look.step_rig_m, rel=2e-3, abs=0.0)
    assert look.shown[0].rms < 2.0 * Rig().noise_m


@pytest.mark.parametrize(
    ('field', 'factor', 'name', 'cause'),
    [
        ('friction', 0.8, 'contact.friction', 'dirt, moisture or wear'),
        ('mass_kg', 1.1, 'runner.mass', 'put on the runner'),
        ('gain_m_per_v', 0.97, 'actuator.gain', 'the piezo or its amplifier'),
    ],
)
def test_what_changes_is_named_at_the_second_fit(field: str, factor: float, name: str, cause: str):
    rig = Rig()
    other = replace(rig, **{field: factor * getattr(rig, field)})
    found = examined(rig, rig, rig, other, other)
    assert [each.words for each in found[:3]] == ['', '', '']
    assert found[-1].words.startswith(name)
    assert cause in found[-1].words
    place = found[-1].names.index(name)
    true = factor * float(STAND.flat()[name])
    assert found[-1].values[place] == pytest.approx(
        true, rel=0.0, abs=4.0 * found[-1].errors[place]
    )


def test_a_rig_that_rests_is_no_trouble():
    window = seen(Rig(), 1)
    still = np.full_like(window.samples['voltage_v'][1], 12.0)
    window.samples['voltage_v'] = window.samples['voltage_v'][0], still
    with pytest.raises(RigRests):
        Twin(STAND, SETTINGS).look(window)
