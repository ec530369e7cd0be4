# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The weight of the runner on the lower contacts."""

import math

import pytest

from stickslip_ros.contact.springs import friction_limit
from stickslip_ros.drive.build import plant_of
from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.drive.records import ALL
from stickslip_ros.kernels.kernel import in_python
from stickslip_ros.lab.runs.sawtooth_run import run_drive
from stickslip_ros.parameters import Parameters

WEIGHT_N = 3e-3 * 9.80665
ROUNDING = 1e-9
BANK_ERROR = 2.5e-3
"""Of the friction limit: 64 springs a group against the continuum."""


@pytest.fixture
def heavy() -> Parameters:
    return Parameters().updated({'stand.weight': True, 'stand.preload': 0.1})


def test_the_lower_contacts_carry_preload_and_weight_at_45_degrees(heavy):
    normal_n = [contact.max_force_n / 0.3 for contact in contacts_of(heavy)]
    upper_n, lower_n = normal_n[:2], normal_n[2:]
    assert sum(upper_n) * math.sqrt(0.5) == pytest.approx(0.1, rel=ROUNDING)
    assert sum(lower_n) * math.sqrt(0.5) == pytest.approx(0.1 + WEIGHT_N, rel=ROUNDING)


def test_the_springs_carry_the_weight_too_at_any_preload(heavy):
    for changes in ({}, {'actuator.gain_tolerance': 0.01}):
        plant = plant_of(heavy.updated(changes))[0]
        banks = [contact.bank for contact in plant.contacts[1 : 1 + plant.moved]]
        for preload_n in (0.05, 0.1, 0.3):
            upper_n = 0.3 * math.sqrt(2.0) * preload_n
            wanted_n = 2.0 * upper_n + 0.3 * math.sqrt(2.0) * WEIGHT_N
            for parts in ([plant.contacts[ALL].bank], banks or [plant.contacts[ALL].bank]):
                found_n = sum(in_python(friction_limit)(bank, preload_n) for bank in parts)
                assert found_n == pytest.approx(wanted_n, rel=ROUNDING)


def test_a_preload_that_comes_back_finds_the_same_force(heavy):
    straight = run_drive(heavy, 160e-9, 1000.0, 60)
    ramped = heavy.updated({'stand.preload': 0.15, 'stand.preload_end': 0.1})
    limit_n = sum(contact.max_force_n for contact in contacts_of(heavy))
    back = run_drive(ramped, 160e-9, 1000.0, 120)
    assert back.preload_n == 0.1
    assert back.force_mean_n == pytest.approx(straight.force_mean_n, abs=2 * BANK_ERROR * limit_n)
