# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Natural coordinates of a fit: there and back again, and where all forces grow alike."""

import math

import numpy as np
import pytest

from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.lab.fitting.free import Free, choose_free
from stickslip_ros.lab.fitting.natural import Natural
from stickslip_ros.parameters import Parameters

STAND = Parameters().updated({'stand.preload': 0.4})
MOVED = ['contact.friction', 'contact.prefactor', 'runner.mass', 'runner.damping']
SETS = {
    'all': [*MOVED, 'actuator.gain', 'actuator.hysteresis'],
    'no roughness': ['contact.friction', 'runner.mass', 'runner.damping'],
    'no mass': ['contact.friction', 'contact.rms_height', 'runner.damping'],
    'two of the contact': ['contact.radius', 'contact.young_runner', 'contact.friction'],
    'none of the contact': ['runner.damping', 'actuator.gain'],
    'damping in logarithms': [*MOVED[:3], 'friction_law.stribeck_velocity'],
}


def natural_of(names: list[str], damping: float = 20.0) -> tuple[Natural, np.ndarray]:
    """Give a map and the coordinates of a place beside the start."""
    stand = STAND.updated({'runner.damping': damping or 20.0})
    stand, free, _ = choose_free(stand, [Free(name) for name in names])
    starts = np.array([one.to_coordinate(one.start) for one in free])
    z = starts + np.random.default_rng(len(names)).uniform(-0.4, 0.4, len(free))
    z[[one.name == 'runner.damping' for one in free]] *= bool(damping)
    return Natural(stand, free), z


@pytest.mark.parametrize('names', SETS.values(), ids=SETS)
@pytest.mark.parametrize('damping', [0.0, 20.0])
def test_there_and_back_again_is_where_it_began(names: list[str], damping: float):
    natural, z = natural_of(names, damping)
    assert natural.back(natural.to(z)) == pytest.approx(z, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize('names', SETS.values(), ids=SETS)
def test_slopes_are_those_of_differences(names: list[str]):
    natural, z = natural_of(names)
    place, way = natural.to(z), 1e-5 * np.random.default_rng(1).normal(size=len(z))
    moved = 0.5 * (natural.back(place + way) - natural.back(place - way))
    assert natural.slopes(place) @ way == pytest.approx(moved, rel=1e-5, abs=1e-11)


def stiffness(stand: Parameters) -> float:
    return sum(each.stick_stiffness_n_per_m for each in contacts_of(stand))


@pytest.mark.parametrize('rougher', [0.3, 3.0])
def test_where_stiffness_friction_mass_and_damping_grow_alike_only_the_roughness_moves(
    rougher: float,
):
    natural, _ = natural_of(MOVED)
    start = {one.name: one.start for one in natural.free}
    there = STAND.updated({'contact.prefactor': rougher * start['contact.prefactor']})
    growth = stiffness(there) / stiffness(STAND)
    assert abs(math.log(growth)) > 0.1, 'else nothing is tested'
    alike = {name: growth * value for name, value in start.items()}
    alike['contact.prefactor'] = there.contact.prefactor
    begin, end = (
        natural.to(np.array([one.to_coordinate(each[one.name]) for one in natural.free]))
        for each in (start, alike)
    )
    stays = [one.name != 'contact.prefactor' for one in natural.free]
    assert end[stays] == pytest.approx(begin[stays], rel=1e-9, abs=1e-9)
    assert abs(end - begin).max() > 0.5
