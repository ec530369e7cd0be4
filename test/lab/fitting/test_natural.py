# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Natural coordinates of a fit: there and back again, and where all forces grow alike."""

import numpy as np
import pytest

from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.lab.fitting.free import Natural, choose_free
from stickslip_ros.parameters import Parameters

STAND = Parameters().updated({'stand.preload': 0.4, 'runner.damping': 20.0})
MOVED = 'contact.friction contact.prefactor runner.mass runner.damping'
SETS = (
    f'{MOVED} actuator.gain actuator.hysteresis',
    'contact.friction runner.mass runner.damping',
    'contact.friction contact.rms_height runner.damping',
    'contact.radius contact.young_runner contact.friction',
    'runner.damping actuator.gain',
)


def natural_of(names: str, damping: float = 1.0) -> tuple[Natural, np.ndarray]:
    """Give a map and the coordinates of a place beside the start, with a share of the damping."""
    stand, free, _ = choose_free(STAND, names.split())
    z = np.array([one.to_coordinate(one.start) for one in free])
    z += np.random.default_rng(len(names)).uniform(-0.4, 0.4, len(free))
    return Natural(stand, free), z * [damping if 'damping' in one.name else 1.0 for one in free]


@pytest.mark.parametrize('names', SETS)
@pytest.mark.parametrize('damping', [0.0, 1.0])
def test_there_and_back_again_is_where_it_began_by_its_slopes_too(names: str, damping: float):
    natural, z = natural_of(names, damping)
    assert natural.back(natural.to(z)) == pytest.approx(z, rel=1e-12, abs=1e-12)
    place, way = natural.to(z), 1e-4 * np.random.default_rng(1).normal(size=len(z))
    moved = 0.5 * (natural.back(place + way) - natural.back(place - way))
    assert natural.slopes(place) @ way == pytest.approx(moved, rel=1e-4, abs=1e-9)


@pytest.mark.parametrize('rougher', [0.3, 3.0])
def test_where_all_forces_grow_alike_only_the_roughness_moves(rougher: float):
    natural, _ = natural_of(MOVED)
    begin = {one.name: one.start for one in natural.free}
    prefactor = {'contact.prefactor': rougher * begin['contact.prefactor']}
    soft, stiff = (
        sum(each.stick_stiffness_n_per_m for each in contacts_of(on))
        for on in (STAND, STAND.updated(prefactor))
    )
    alike = {name: stiff / soft * value for name, value in begin.items()} | prefactor
    assert abs(stiff / soft - 1.0) > 0.1, 'else nothing is tested'
    there, here = (
        natural.to(np.array([one.to_coordinate(each[one.name]) for one in natural.free]))
        for each in (alike, begin)
    )
    stays = [one.name != 'contact.prefactor' for one in natural.free]
    assert there[stays] == pytest.approx(here[stays], rel=1e-9, abs=1e-9)
    assert abs(there - here).max() > 0.5
