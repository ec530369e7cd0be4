# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Drives that go together in lanes have the bits that each has alone."""

import numpy as np
import pytest

from stickslip_ros.drive import advance as advance_module
from stickslip_ros.drive.advance import LANES_MIN, observe_all, observe_samples
from stickslip_ros.drive.build import plant_of, start_clock, state_at_rest
from stickslip_ros.drive.long_step import LANES
from stickslip_ros.drive.records import ALL
from stickslip_ros.drive.waveform import sawtooth, table
from stickslip_ros.errors import StickSlipError
from stickslip_ros.parameters import Parameters

pytestmark = pytest.mark.usefixtures('compiled_kernels')

PERIODS = 12
LINE = {'contact.profile': 'rough_line'}
WALLS = {'load_cell.contact': 'one_sided', 'load_cell.gap': 2e-7, 'stand.stop_stiffness': 1e6}
DRIVES = [
    ({}, sawtooth(0.0, 300.0, 1000.0, 0), 0.0),
    ({'stand.preload': 0.1, 'runner.damping': 5.0}, sawtooth(0.0, 200.0, 700.0, 0), 0.01),
    (
        {'stand.preload': 1.0, 'amplifier.slew_rate': 2e6, 'contact.loss_factor': 0.1},
        sawtooth(0.0, 300.0, -400.0, 0),
        -0.02,
    ),
    ({**WALLS, 'stand.travel_max': 1e-6}, sawtooth(0.0, 280.0, 900.0, 0), 0.0),
    (LINE, sawtooth(0.0, 150.0, 1500.0, 3), 0.0),
    ({**LINE, 'contact.travel': 0.5}, sawtooth(0.0, 300.0, 800.0, 0), 0.0),
    ({}, table([(0.0, 0.0), (4e-4, 250.0), (6e-4, 100.0), (1e-3, 0.0)], 0), 0.0),
    ({'load_cell.contact': 'absent', 'contact.law': 'epm'}, sawtooth(0.0, 260.0, 1e3, 0), 0.0),
]


def made(changes, wave, load_n):
    """Give what ``observe_samples`` takes, from rest."""
    parameters = Parameters().updated(changes)
    plants = plant_of(parameters)
    states = state_at_rest(plants, parameters.stand.preload)
    start_clock(states)
    ramps, truth = np.full((PERIODS, 3), np.nan), np.full((1, 5), np.nan)
    return plants, states, wave, load_n, PERIODS * wave.period_s, truth, ramps


def bits(record):
    """Give all fields of a record, without the padding between them."""
    if record.dtype.names is None:
        return [record.tobytes()]
    return [part for name in record.dtype.names for part in bits(record[name])]


@pytest.mark.parametrize(
    ('drives', 'kernel'),
    [(DRIVES, 'observe_long_together'), (DRIVES[3:7], 'observe_together')],
    ids=['some with a loss or a rival law', 'plain'],
)
def test_drives_that_go_together_have_the_bits_that_they_have_alone(drives, kernel, monkeypatch):
    assert len(drives) in {LANES, LANES_MIN}
    alone, together = ([made(*drive) for drive in drives] for _ in range(2))
    for drive in alone:
        observe_samples(*drive)
    in_lanes = []
    observe = getattr(advance_module, kernel)

    def noted(drives):
        in_lanes.append(len(drives))
        observe(drives)

    monkeypatch.setattr(advance_module, kernel, noted)
    observe_all(together)
    assert in_lanes == [LANES]
    for (_, one, *_, ramps), (_, other, *_, others) in zip(alone, together, strict=True):
        assert bits(one) == bits(other)
        assert ramps.tobytes() == others.tobytes()


def test_a_drive_that_cannot_go_in_lanes_goes_beside_them():
    changes = [each for each, *_ in DRIVES[: LANES - 1]] + [{'contact.law': 'coulomb'}]
    drives = [(each, *DRIVES[0][1:]) for each in changes]
    alone, together = ([made(*drive) for drive in drives] for _ in range(2))
    for drive in alone:
        observe_samples(*drive)
    observe_all(together)
    assert [bits(one[1]) for one in alone] == [bits(other[1]) for other in together]


def test_a_drive_that_fails_is_refused_among_others():
    together = [made(*drive) for drive in DRIVES]
    together[3][1]['velocity_m_per_s'] = np.nan
    with pytest.raises(StickSlipError, match=r'time stands still|no longer finite'):
        observe_all(together)


@pytest.mark.parametrize(('changes', 'wave', 'load_n'), DRIVES)
def test_the_memory_of_an_ended_drive_gives_the_bits_of_fresh_memory(changes, wave, load_n):
    plants, states, *rest = made(changes, wave, load_n)
    preload_n = float(plants[0].contacts[ALL].preload_n)
    fresh = bits(states)
    observe_samples(plants, states, *rest)
    assert bits(states) != fresh
    again = state_at_rest(plants, preload_n, states)
    start_clock(again)
    assert again is states
    assert bits(again) == fresh
