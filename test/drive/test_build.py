# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Memory of plants: the next plant takes it, never while a record of the last one is in use."""

import gc

import pytest

from stickslip_ros.drive import build
from stickslip_ros.drive.build import plant_of, separate_feet, set_preload
from stickslip_ros.drive.records import PLANT
from stickslip_ros.parameters import Parameters

CONTACTS_AT = PLANT.fields['contacts'][1]
STANDS = [
    {},
    {'load_cell.contact': 'one_sided', 'load_cell.gap': 2e-7, 'stand.stop_stiffness': 1e6},
    {'contact.law': 'epm', 'runner.mass': 5e-3},
]


def address_of(plants):
    return plants['contacts'].ctypes.data - CONTACTS_AT


def bits(plants):
    """Return the fields of a plant, without the padding between them."""
    parts = [plants[name] for name in PLANT.names if name not in ('contacts', 'track')]
    contacts = plants['contacts']
    parts += [contacts[name] for name in ('law', 'ageing', 'preload_n', 'preload_n_per_s')]
    parts += [contacts['curve']['cells'][:, :2], contacts['bank']['heights_m']]
    return [each.tobytes() for each in (*parts, plants['track']['laid'])]


@pytest.fixture
def fresh():
    """Return the bits of stands in memory that none has used; let no other plant give any."""
    gc.collect()
    gc.disable()
    build._ended.clear()
    plants = [plant_of(Parameters().updated(changes)) for changes in STANDS]
    found = [bits(each) for each in plants]
    del plants
    build._ended.clear()
    yield found
    gc.enable()


def test_a_plant_in_the_memory_of_an_ended_one_has_the_bits_of_fresh_memory(fresh):
    for changes, expected in zip(STANDS, fresh, strict=True):
        plants = plant_of(Parameters().updated({'contact.loss_factor': 0.1, 'stand.load': 0.1}))
        plants['stuck'], plants['dead'], plants['plain'] = True, 3, True
        plants['ratios'] = 2.0
        set_preload(plants, Parameters(), 0.2)
        place = address_of(plants)
        del plants
        again = plant_of(Parameters().updated(changes))
        assert address_of(again) == place
        assert bits(again) == expected


def test_the_memory_of_a_plant_is_not_taken_while_a_record_of_it_is_in_use(fresh):
    plant = plant_of(Parameters().updated({'runner.mass': 5e-2}))[0]
    others = [plant_of(Parameters()) for _ in range(3)]
    assert address_of(plant) not in {address_of(each) for each in others}
    assert plant.mass_kg == 5e-2
    assert fresh


@pytest.mark.parametrize('changes', [{'contact.profile': 'rough_line', 'contact.travel': 0.5}, {}])
def test_memory_with_contacts_of_single_feet_or_a_track_is_not_taken(changes, fresh):
    plants = plant_of(Parameters().updated(changes))
    if not changes:
        separate_feet(plants, Parameters())
    place = address_of(plants)
    del plants
    assert place not in {address_of(each) for each in build._ended}
    assert bits(plant_of(Parameters())) == fresh[0]
