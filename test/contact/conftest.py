# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Contacts shared by the tests."""

import math

import pytest

from stickslip_ros.contact.hemisphere import elasticity_of, profile_of
from stickslip_ros.contact.mdr import Elasticity, Presliding, solve_presliding
from stickslip_ros.contact.virgin import tabulate
from stickslip_ros.kernels.record import Record
from stickslip_ros.parameters import ContactParameters

LOWER_N = math.sqrt(2.0) / 4.0
UPPER_N = math.sqrt(2.0) / 2.0
"""Normal forces of a lower and an upper contact under a preload of 1 N (Eq. 19)."""


@pytest.fixture(scope='session')
def steel_on_ruby() -> Elasticity:
    return elasticity_of(ContactParameters())


@pytest.fixture(scope='session')
def hemisphere():
    """Give a function that presses one hemisphere of Table 1 on the runner."""

    def press(profile: str, force_n: float) -> Presliding:
        contact = ContactParameters(profile=profile)
        return solve_presliding(
            profile_of(contact), elasticity_of(contact), contact.friction, force_n
        )

    return press


@pytest.fixture(scope='session', params=['rough', 'smooth', 'stand'])
def contacts(request: pytest.FixtureRequest, hemisphere) -> list[Presliding]:
    """Give one rough, one smooth, or all six contacts of the stand."""
    if request.param == 'stand':
        return [hemisphere('rough', UPPER_N)] * 2 + [hemisphere('rough', LOWER_N)] * 4
    return [hemisphere(request.param, LOWER_N)]


@pytest.fixture(scope='session')
def curve(contacts: list[Presliding]) -> Record:
    return tabulate(contacts)


@pytest.fixture(scope='session')
def smooth_curve(hemisphere) -> Record:
    return tabulate([hemisphere('smooth', LOWER_N)])


@pytest.fixture(scope='session')
def rough_curve(hemisphere) -> Record:
    return tabulate([hemisphere('rough', UPPER_N), hemisphere('rough', LOWER_N)])
