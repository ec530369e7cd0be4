# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Cycles of a course, and memory of plants: never taken while another drive uses it."""

import numpy as np
import pytest

from stickslip_ros.drive.build import plant_of, start_clock
from stickslip_ros.drive.long_step import LANES
from stickslip_ros.drive.waveform import sawtooth
from stickslip_ros.lab.runs import courses
from stickslip_ros.lab.runs.courses import cycles_of, drive_at_rest, run_course, shared_plant
from stickslip_ros.parameters import Parameters

ROUNDING = 1e-9
"""A run in two parts has other last digits, since its steps end elsewhere."""


@pytest.fixture
def taken(monkeypatch):
    """Return the addresses of memory that plants have taken from ended ones."""
    addresses = []

    def noted_and_made(parameters, ended=None):
        if ended is not None:
            addresses.append(ended.ctypes.data)
        return plant_of(parameters, ended)

    monkeypatch.setattr(courses, 'plant_of', noted_and_made)
    return addresses


def make_plants(mass_kg, changes=None):
    """Make as many plants as are kept, so that those before them are kept no longer."""
    for i in range(LANES):
        values = {'runner.mass': mass_kg * (1.0 + i / LANES), **(changes or {})}
        stand = Parameters().updated(values)
        preloads_n = [of(stand)[0].contacts['preload_n'] for of in (shared_plant, plant_of)]
        assert np.array_equal(*preloads_n)


def test_a_plant_gives_its_memory_when_the_last_record_of_it_is_gone(taken):
    make_plants(4e-3)
    plant = shared_plant(Parameters().updated({'runner.mass': 5e-2}))[0]
    place = plant.contacts.ctypes.data
    make_plants(5e-3)
    make_plants(1e-2)
    inside = place - np.dtype(plant.dtype).fields['contacts'][1]
    assert taken
    assert inside not in taken
    assert plant.mass_kg == 5e-2
    del plant
    make_plants(2e-2)
    assert inside in taken


def test_the_memory_of_feet_that_move_separately_is_not_taken():
    make_plants(6e-3, {'actuator.gain_tolerance': 0.1})
    make_plants(7e-3)
    make_plants(8e-3)
    make_plants(9e-3)


def test_cycles_come_in_the_order_of_time_whatever_number_went_before():
    stand, wave = Parameters(), sawtooth(0.0, 250.0, 1000.0, 5)
    parts = []
    for counts in ([5], [3, 2]):
        plants, states = drive_at_rest(stand)
        start_clock(states)
        each = [run_course(cycles_of(plants, states, wave, cycles)) for cycles in counts]
        parts.append(np.concatenate(each))
    np.testing.assert_allclose(*parts, rtol=ROUNDING)
