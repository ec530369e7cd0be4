# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The line of the runner and the windows on it: waves added up one by one, and sorted heights."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from stickslip_ros.contact.hemisphere import elasticity_of, lines_of, profile_of, spectrum_of
from stickslip_ros.contact.mdr import solve_presliding
from stickslip_ros.contact.profile import LineProfile, line_profile
from stickslip_ros.contact.roughness import line_power, rough_line
from stickslip_ros.contact.travel import AMPLITUDE, ANGLE, RING, window_profile
from stickslip_ros.contact.virgin import TABLE_ERROR, tabulate
from stickslip_ros.drive.build import plant_of, state_at_rest
from stickslip_ros.drive.layout import groups_of
from stickslip_ros.drive.ledger import take_ledger
from stickslip_ros.drive.records import ALL
from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters import Parameters

TRAVELS = Parameters().updated({'contact.profile': 'rough_line', 'contact.travel': 1.0})
PLACES = (0, 1, -1, 63, 64, 5_000, -131_072, 600_000)
"""Springs; the last is 4.6 mm away, the travel of the stand is 5."""
FAR = PLACES[-2:]
WIDTH = 11_328
"""Springs of a window of TRAVELS, whose spectrum alone decides it."""
ROUNDING = 1e-12
SAMPLING = 0.1
"""Relative error of a mean over six lines of a millimetre."""


def heights_m(track, foot, place):
    profile = window_profile(track, foot, place)
    return profile.heights_m - profile.heights_m[0]


@cache
def drive_of(stand):
    """Return constants and state of a drive, whose curves no earlier place of it changes."""
    plants = plant_of(stand)
    return plants, state_at_rest(plants, stand.stand.preload)


def plant_at(stand, place):
    """Return a plant with its windows at a place, in springs."""
    plants, states = drive_of(stand)
    states['contacts']['window_m'] = place * lines_of(stand.contact).spacing_m
    take_ledger(plants, states)
    return plants[0]


@pytest.mark.parametrize('place', PLACES)
def test_a_window_is_what_stays_and_the_waves_one_by_one(place):
    track, foot = plant_at(TRAVELS, place).track, 3
    springs = int(track.springs)
    line_m = track.ring_m[foot, (np.arange(springs) - place) % RING]
    line_m = line_m + track.fixed_m[foot, :springs]
    tolerance_m = 1e-7 * TRAVELS.contact.rms_height  # phases of 1e5 rad
    expected_m = window_profile(track, foot, place).heights_m
    np.testing.assert_allclose(line_m - line_m.min(), expected_m, rtol=0.0, atol=tolerance_m)
    places_m = (np.arange(springs) - springs / 2 + 0.5) * track.spacing_m
    parabola_m = places_m**2 / TRAVELS.contact.radius
    np.testing.assert_allclose(track.fixed_m[foot, :springs], parabola_m, rtol=1e-9)


def test_whoever_goes_away_and_back_finds_the_same_surface():
    contact = TRAVELS.updated({'contact.travel': 0.5}).contact
    plants = plant_of(TRAVELS.updated({'contact.travel': 0.5}))
    states = state_at_rest(plants, 0.5)
    seen: dict[int, bytes] = {}
    for place in (*PLACES, *reversed(PLACES)):
        states['contacts']['window_m'][0, ALL] = place * lines_of(contact).spacing_m
        take_ledger(plants, states)
        curve = plants[0].contacts[ALL].curve.tobytes()
        assert seen.setdefault(place, curve) == curve
    assert len(set(seen.values())) == len(PLACES)


@pytest.mark.parametrize(
    ('separate', 'place'),
    [(False, 0), (False, 63), *((separate, place) for separate in (False, True) for place in FAR)],
)
def test_the_curve_at_a_place_is_that_of_the_sorted_heights_there(separate, place):
    stuffs = {'feet.friction': (0.0, 0.1), 'feet.young': (1e11, 0.0)}
    changes = {
        'actuator.gain_tolerance': 0.1 * separate,
        'stand.weight': True,
        **stuffs,
        'contact.poisson_sphere': 0.4,
    }
    stand = TRAVELS.updated(changes)
    plant, track = plant_at(stand, place), lines_of(stand.contact)
    weight_n = stand.runner.mass * 9.80665
    contacts = [
        solve_presliding(
            window_profile(track, foot, place),
            elasticity_of(replace(stand.contact, young_sphere=(1e11 if foot < 2 else 370e9))),
            0.3 if foot < 2 else 0.1,
            group.share * stand.stand.preload + group.weight_n,
        )
        for foot, group in enumerate(groups_of(stand.contact, stand.feet, weight_n))
    ]
    feet = [[contact] for contact in contacts] if separate else [contacts]
    for k, own in enumerate(feet, start=1 if separate else ALL):
        found, expected = plant.contacts[k].curve, tabulate(own)
        assert found.limit_m == pytest.approx(expected.limit_m, rel=1e-8)
        assert found.force_max_n == pytest.approx(expected.force_max_n, rel=ROUNDING)
        assert found.energy_max_j == pytest.approx(expected.energy_max_j, rel=TABLE_ERROR)
        missed = np.abs(found.cells - expected.cells) / np.abs(expected.cells).max(axis=0)
        assert missed[:, [0, 3]].max() < TABLE_ERROR
        assert missed[:, 1].max() < 2e-3  # of a spring that is counted in the next cell


@pytest.mark.parametrize('seed', [1, 29, 52, 102, 197])
def test_windows_are_as_wide_whatever_waves_a_seed_draws_and_whatever_share_of_them_travels(seed):
    widths = {
        int(lines_of(TRAVELS.updated(changes | {'contact.line_seed': seed}).contact).springs)
        for changes in ({}, {'contact.travel': 0.05})
    }
    assert widths == {WIDTH}


@pytest.mark.parametrize('seed', [315, 476])
def test_a_window_holds_all_springs_that_touch_where_peaks_lie_far_out(seed):
    contact = TRAVELS.updated({'contact.line_seed': seed, 'contact.travel': 0.05}).contact
    track, points = lines_of(contact), contact.line_points
    places_m = track.spacing_m * (np.arange(points) - 0.5 * points + 0.5)
    line_m = rough_line(spectrum_of(contact), contact.line_length, points, seed)
    profile = line_profile(places_m**2 / contact.radius + line_m, float(track.spacing_m))
    depth_m = profile.depth_for(np.sqrt(2.0) / (2.0 * elasticity_of(contact).normal_pa))  # 2 N
    farthest_m = np.abs(places_m[profile.heights_m < depth_m]).max()
    assert 0.05 * contact.radius < farthest_m < 0.8 * 0.5 * track.springs * track.spacing_m


def test_the_waves_have_the_power_and_the_cut_offs_of_the_periodic_line():
    contact, spectrum = TRAVELS.contact, spectrum_of(TRAVELS.contact)
    track = lines_of(contact)
    waves = track.waves[: track.waves_in_all]
    power_m2 = 0.5 * waves[:, AMPLITUDE] ** 2
    assert power_m2.sum() == pytest.approx(contact.rms_height**2, rel=ROUNDING)
    wave_per_m = waves[:, ANGLE] / track.spacing_m
    assert np.all(np.diff(wave_per_m) > 0.0)
    assert spectrum.lower_cutoff_per_m <= wave_per_m[0] * (1.0 + ROUNDING)
    assert wave_per_m[-1] <= spectrum.upper_cutoff_per_m
    periodic_m2 = 2.0 * line_power(spectrum, contact.line_length, contact.line_points)
    modes_per_m = 2.0 * np.pi / contact.line_length * np.arange(len(periodic_m2))
    for low, high in pairwise(np.geomspace(modes_per_m[8], modes_per_m[8192], 6)):
        found = power_m2[(low <= wave_per_m) & (wave_per_m < high)].sum()
        expected = periodic_m2[(low <= modes_per_m) & (modes_per_m < high)].sum()
        assert found == pytest.approx(expected, rel=SAMPLING)


def test_the_foot_keeps_its_share_of_the_roughness():
    still, half = (
        profile_of(TRAVELS.updated({'contact.travel': share}).contact) for share in (0.0, 0.5)
    )
    assert isinstance(still, LineProfile)
    assert isinstance(half, LineProfile)
    track = lines_of(TRAVELS.updated({'contact.travel': 0.5}).contact)
    springs = int(track.springs)
    middle = slice((len(still.heights_m) - springs) // 2, (len(still.heights_m) + springs) // 2)
    places_m = (np.arange(springs) - springs / 2 + 0.5) * track.spacing_m
    parabola_m = places_m**2 / TRAVELS.contact.radius
    frozen_m = track.fixed_m[0, :springs] - parabola_m
    line_m = still.heights_m[middle] - parabola_m
    np.testing.assert_allclose(np.diff(frozen_m), np.sqrt(0.5) * np.diff(line_m), atol=1e-18)


def test_the_lines_take_as_much_memory_for_a_millimetre_as_at_rest():
    track = lines_of(TRAVELS.contact)
    assert track.nbytes < 4e6
    assert track.ring_m.shape[1] * track.spacing_m < 0.1e-3


@pytest.mark.parametrize('points', [1 << 21, 16])
def test_a_window_of_too_many_or_no_springs_is_refused(points):
    cut_off = {'contact.cutoff_upper': 2e4} if points == 16 else {}
    with pytest.raises(OutOfRange, match=r'contact\.line_points \d+ is unfit .* springs'):
        lines_of(TRAVELS.updated({'contact.line_points': points, **cut_off}).contact)
