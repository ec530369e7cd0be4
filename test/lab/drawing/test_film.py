# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""How much of a contact slips, against the closed form; and which cycles a film shows."""

import math
import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from stickslip_ros import Parameters
from stickslip_ros.contact.mdr import Presliding
from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.lab.drawing.film import (
    CYCLES_BEFORE,
    FILM_CYCLES,
    FRAMES,
    film_of,
    slipping_shares,
)
from stickslip_ros.lab.drawing.picture import SECONDS, stand_svg

RINGS_ERROR = 0.02
"""Of 64 rings, the largest part of the area that one of them has, and the 2 % of a limit."""
PERIOD_S, STROKE_M = 1e-3, 150e-9


def way(*places: float) -> np.ndarray:
    """Go from 0 through places, in 400 pieces each."""
    ends = [0.0, *places]
    return np.concatenate([np.linspace(a, b, 400) for a, b in zip(ends, places, strict=False)])


def alike(contacts: tuple[Presliding, ...], *places: float) -> np.ndarray:
    """Return the same way for each contact."""
    return np.tile(way(*places), (len(contacts), 1))


@pytest.mark.parametrize('profile', ['smooth', 'rough'])
@pytest.mark.parametrize('share', [0.2, 0.5, 0.9])
def test_the_ring_that_slips_is_that_of_cattaneo_and_mindlin(profile: str, share: float):
    parameters = Parameters().updated({'contact.profile': profile})
    contacts = contacts_of(parameters)
    for contact, foot in zip(contacts[::5], (0, 5), strict=True):
        u_m, a_m = share * contact.max_displacement_m, contact.indentation.radius_m
        sticks = (float(contact.stick_radius(u_m)) / a_m) ** 2
        shares = slipping_shares(contacts, alike(contacts, u_m))
        assert shares[foot, -1] == pytest.approx(1.0 - sticks, abs=RINGS_ERROR)
        # Back from full slip the same happens within twice the way (Masing).
        full_m = 2.0 * contact.max_displacement_m
        shares = slipping_shares(contacts, alike(contacts, full_m, full_m - 2.0 * u_m))
        assert shares[foot, 399] == pytest.approx(1.0, abs=1e-12)
        assert shares[foot, -1] == pytest.approx(1.0 - sticks, abs=RINGS_ERROR)


def test_a_contact_that_turns_sticks_at_first_and_a_loop_that_closes_is_forgotten():
    contacts = contacts_of(Parameters())
    limit_m = contacts[0].max_displacement_m
    straight = slipping_shares(contacts, alike(contacts, 0.8 * limit_m))[0]
    turns_m = 0.6 * limit_m, 0.3 * limit_m, 0.8 * limit_m
    turned = slipping_shares(contacts, alike(contacts, *turns_m))[0]
    assert turned[399] > 0.4
    assert turned[425] < 0.05
    assert turned[-1] == straight[-1]


def trace(cycles: int, backwards: bool = False) -> tuple[np.ndarray, ...]:
    """Return a trace of feet that follow a saw-tooth, under a runner that stays."""
    time_s = np.arange(round(cycles * PERIOD_S * 50e3)) / 50e3
    ramp = (time_s / PERIOD_S) % 1.0
    share = 1.0 - ramp if backwards else ramp
    return time_s, 300.0 * share, STROKE_M * share, np.zeros_like(share)


@pytest.mark.parametrize('backwards', [False, True])
def test_the_film_shows_whole_cycles_from_a_fall_to_a_fall(backwards: bool):
    film = film_of(Parameters(), *trace(8, backwards))
    assert film.length_s == pytest.approx(FILM_CYCLES * PERIOD_S)
    assert len(film.foot_m) == FRAMES
    assert np.ptp(film.foot_m) == pytest.approx(STROKE_M, rel=0.03)
    assert film.foot_m[0] == film.runner_m[0] == 0.0
    # The feet go to and fro by more than all contacts can stick.
    assert film.slipping.max() == pytest.approx(1.0, abs=1e-12)
    assert film.slipping.min() < 0.05
    late = film_of(Parameters(), *trace(8 + CYCLES_BEFORE, backwards))
    assert np.allclose(late.slipping, film.slipping, atol=0.03)


def test_there_is_no_film_of_a_drive_that_rests_or_of_too_few_cycles():
    time_s = np.arange(500) / 50e3
    rest = np.zeros(500)
    assert film_of(Parameters(), time_s, rest, rest, rest) is None
    assert film_of(Parameters(), *trace(FILM_CYCLES)) is None


def test_each_foot_goes_its_own_way_by_its_gain_after_its_delay():
    shift = 30
    late_s = shift * FILM_CYCLES * PERIOD_S / (FRAMES - 1)
    values = {'feet.count': [1] * 4, 'feet.share': 0.3}
    values |= {'feet.gain': [1.0, 0.0, -2.0, 1.0], 'feet.delay': [0.0, 0.0, 0.0, late_s]}
    film = film_of(Parameters().updated(values), *trace(12))
    first, guide, against, walker = film.feet_m
    assert np.array_equal(first, film.foot_m)
    assert not guide.any()
    assert np.array_equal(against, -2.0 * film.foot_m)
    later_m = walker[shift:] - walker[shift]
    assert np.allclose(later_m, film.foot_m[:-shift], rtol=0.0, atol=1e-15)
    # The runner rests: a foot slips with its own way, the guide never.
    slips, _, _, slips_later = film.slipping
    assert np.allclose(slips_later[shift:], slips[:-shift], rtol=0.0, atol=RINGS_ERROR)
    assert not film.slipping[1].any()


def values_of(svg: str, path: str) -> list[float]:
    """Return the values of the one animation that a path finds."""
    [found] = {each.attrib['values'] for each in ET.fromstring(svg).findall(path, SVG)}
    return [float(each.split()[0]) for each in found.split(';')]


SVG = {'s': 'http://www.w3.org/2000/svg'}


def test_the_film_moves_feet_and_runner_by_the_factor_that_it_states():
    time_s, voltage_v, foot_m, _ = trace(8)
    svg = stand_svg(Parameters(), film_of(Parameters(), time_s, voltage_v, foot_m, 50e-6 * time_s))
    times = float(re.search(r'magnified ([\d ]+) times', svg)[1].replace(' ', ''))
    scale = 16e3  # pixels a metre: the runner, 20 mm long, is drawn 320 pixels long
    foot = values_of(svg, ".//s:g[@id='foot']/s:g/s:animateTransform[@type='translate']")
    assert np.ptp(foot) == pytest.approx(times * scale * np.ptp(foot_m), rel=0.02)
    runner = values_of(svg, "./s:g/s:animateTransform[@type='translate']")
    assert runner[-1] - runner[0] == pytest.approx(times * scale * 50e-6 * FILM_CYCLES * PERIOD_S)
    # The piezo shears: fixed at one end, with the hemisphere at the other.
    piezo = ET.fromstring(svg).find(".//s:g[@id='foot']/s:g/s:rect", SVG)
    angles = values_of(svg, ".//s:animateTransform[@type='skewX']")
    tops = [-math.tan(math.radians(each)) * float(piezo.attrib['height']) for each in angles]
    assert np.allclose(tops, foot, atol=0.2)
    assert {each.attrib['dur'] for each in ET.fromstring(svg).iter() if 'dur' in each.attrib} == {
        f'{SECONDS:g}s'
    }


def test_noise_looks_like_rest_and_a_jump_of_the_runner_stays_in_the_picture():
    noise_m = 0.2e-9 * np.random.default_rng(1).standard_normal(round(8 * PERIOD_S * 50e3))
    time_s, voltage_v, foot_m, _ = trace(8)
    jump_m = np.where(time_s < 6.5e-3, 2e-3, 0.0)
    for way_m, runner_m, limit in ((1e-6 * foot_m, noise_m, 5.0), (foot_m, jump_m, 70.0)):
        svg = stand_svg(Parameters(), film_of(Parameters(), time_s, voltage_v, way_m, runner_m))
        assert np.ptp(values_of(svg, "./s:g/s:animateTransform[@type='translate']")) < limit
