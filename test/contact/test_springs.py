# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Springs: the law of Section 3.4, the same as the memory, hand-overs, and one contact of them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip_ros import SpringContact, presliding
from stickslip_ros.contact.hemisphere import elasticity_of, profile_of
from stickslip_ros.contact.mdr import indent, solve_presliding
from stickslip_ros.contact.memory import fresh_memory, lost_energy, move, stored_energy
from stickslip_ros.contact.reaction import CONTACT_STATE, react, relax, switch_to_springs
from stickslip_ros.contact.springs import (
    BANK_ERROR,
    Group,
    bank_of_rows,
    depth_at,
    friction_limit,
    load_springs,
    move_springs,
    spring_bank,
    springs_kind,
    stored_in_springs,
)
from stickslip_ros.contact.virgin import tabulate
from stickslip_ros.drive.build import all_contacts
from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.kernels.record import record
from stickslip_ros.lab.validation.bank import random_turns
from stickslip_ros.parameters import ContactParameters, Parameters

depth_at = entry_point(depth_at)
move_springs = entry_point(move_springs)
friction_limit = entry_point(friction_limit)
lost_energy = entry_point(lost_energy)
move = entry_point(move)
stored_energy = entry_point(stored_energy)
stored_in_springs = entry_point(stored_in_springs)
load_springs = entry_point(load_springs)

CONTACT = ContactParameters()
PROFILE = profile_of(CONTACT)
FRICTION = CONTACT.friction
SOFT = elasticity_of(replace(CONTACT, young_sphere=5e10, poisson_sphere=0.45))
STUFFS = (elasticity_of(CONTACT), FRICTION), (SOFT, 0.2)
"""Moduli and friction of the contacts of the upper and lower feet."""
UPPER, LOWER = math.sqrt(2.0) / 2.0, math.sqrt(2.0) / 4.0
PRELOAD_MAX_N = 2.0
# Sums of a few hundred terms, each exact to rounding.
ROUNDING = 1e-11
# The normal law is exact at class boundaries and chord-like between them.
DEPTH_ERROR = 2e-3
# Energies are one order smoother than forces, but a spring more or less in slip counts whole.
ENERGY_ERROR = 5e-3

preloads = st.floats(0.1, PRELOAD_MAX_N)
strokes = st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=40)


def bank(springs=64):
    upper, lower = STUFFS
    groups = [Group(PROFILE, *upper, 2, UPPER), Group(PROFILE, *lower, 4, LOWER)]
    return spring_bank(groups, PRELOAD_MAX_N, springs)


def virgin_curve(preload_n):
    upper = solve_presliding(PROFILE, *STUFFS[0], UPPER * preload_n)
    lower = solve_presliding(PROFILE, *STUFFS[1], LOWER * preload_n)
    return tabulate([upper] * 2 + [lower] * 4)


BANK = bank()


def empty(of=BANK):
    return record(springs_kind(len(of.heights_m)))


def springs_of(group):
    return slice(BANK.first[group], BANK.first[group + 1])


@given(preloads)
def test_the_friction_limit_is_that_of_all_contacts(preload_n):
    limit_n = (FRICTION + STUFFS[1][1]) * math.sqrt(2.0) * preload_n
    assert friction_limit(BANK, preload_n) == pytest.approx(limit_n, rel=ROUNDING)


@given(preloads)
def test_depth_is_that_of_the_continuum(preload_n):
    for group, contacts_share in enumerate((UPPER, LOWER)):
        expected = indent(PROFILE, STUFFS[group][0], contacts_share * preload_n).depth_m
        assert depth_at(BANK, group, preload_n) == pytest.approx(expected, rel=DEPTH_ERROR)


@given(preloads, strokes)
@settings(max_examples=60)
def test_random_histories_at_constant_load_agree_with_the_turning_points(preload_n, strokes):
    curve = virgin_curve(preload_n)
    memory, springs = fresh_memory(), empty()
    lost_j = before_m = 0.0
    for u_m in np.array(strokes) * curve.limit_m:
        move(curve, memory, u_m)
        force_n, loss_j = move_springs(BANK, springs, u_m - before_m, preload_n, preload_n)
        lost_j, before_m = lost_j + loss_j, u_m
        assert abs(force_n - memory.force_n) <= BANK_ERROR * curve.force_max_n
    scale_j = curve.force_max_n * curve.limit_m
    assert abs(lost_j - lost_energy(curve, memory)) <= ENERGY_ERROR * len(strokes) * scale_j
    stored_j = stored_energy(curve, memory)
    assert abs(stored_in_springs(BANK, springs) - stored_j) <= ENERGY_ERROR * scale_j


@given(preloads, strokes)
@settings(max_examples=60)
def test_taking_over_from_the_turning_points_keeps_the_force(preload_n, strokes):
    curve = virgin_curve(preload_n)
    memory, springs = fresh_memory(), empty()
    for u_m in np.array(strokes) * curve.limit_m:
        move(curve, memory, u_m)
    load_springs(BANK, memory, preload_n, springs)
    force_n, loss_j = move_springs(BANK, springs, 0.0, preload_n, preload_n)
    assert abs(force_n - memory.force_n) <= ROUNDING * curve.force_max_n
    assert loss_j == 0.0


@given(strokes, st.lists(preloads, min_size=41, max_size=41))
@settings(max_examples=60)
def test_no_spring_exceeds_its_limit_and_friction_never_gives_energy(strokes, loads):
    springs = empty()
    for stroke, before_n, after_n in zip(strokes, loads, loads[1:], strict=False):
        _, loss_j = move_springs(BANK, springs, 2e-7 * stroke, before_n, after_n)
        assert loss_j >= 0.0
        for group in range(2):
            own = springs_of(group)
            pressed_m = depth_at(BANK, group, after_n) - BANK.heights_m[own]
            limit_n = BANK.limit_n_per_m[own] * np.maximum(pressed_m, 0.0)
            assert np.all(np.abs(springs.forces_n[own]) <= limit_n * (1 + ROUNDING))


def test_springs_that_lose_contact_forget_and_come_back_unloaded():
    springs = empty()
    move_springs(BANK, springs, 3e-8, 1.0, 1.0)
    loaded_n = springs.forces_n.copy()
    move_springs(BANK, springs, 0.0, 1.0, 0.1)
    upper = springs_of(0)
    high = BANK.heights_m[upper] > depth_at(BANK, 0, 0.1)
    assert np.any(loaded_n[upper][high] > 0.0)
    assert np.all(springs.forces_n[upper][high] == 0.0)
    move_springs(BANK, springs, 0.0, 0.1, 1.0)
    assert np.all(springs.forces_n[upper][high] == 0.0)


def test_a_lighter_load_lets_springs_slip_back_to_the_new_limit_and_loses_what_they_held():
    springs = empty()
    move_springs(BANK, springs, 1e-5, 1.0, 1.0)
    before_j = stored_in_springs(BANK, springs)
    force_n, loss_j = move_springs(BANK, springs, 0.0, 1.0, 0.5)
    assert force_n == pytest.approx(friction_limit(BANK, 0.5), rel=ROUNDING)
    assert loss_j == pytest.approx(before_j - stored_in_springs(BANK, springs), rel=1e-9)


def test_a_class_without_a_spring_has_no_force_and_no_energy():
    heights_m, stiffness = np.array([[0.0, 1e-9]]), np.array([[1e6, 0.0]])
    rows = (heights_m, FRICTION * stiffness, stiffness, np.array([[0.0, 1e-3]]))
    few = bank_of_rows(
        *rows,
        np.array([[1e6, 1e6]]),
        shares=[1.0],
        weights_n=[0.0],
        slips=(np.array([FRICTION]), np.array([FRICTION])),
    )
    springs = empty(few)
    force_n, loss_j = move_springs(few, springs, 1e-6, 0.5, 0.4)
    assert force_n == springs.forces_n[0] == pytest.approx(FRICTION * 0.4, rel=ROUNDING)
    assert springs.forces_n[1] == springs.losses_j[1] == 0.0
    assert 0.0 < loss_j < np.inf
    assert stored_in_springs(few, springs) == pytest.approx(0.5 * force_n**2 / 1e6, rel=ROUNDING)


react = entry_point(react)
switch_to_springs = entry_point(switch_to_springs)

STEP_S = 1e-6
FAR = 5.0
"""Displacement, in units of that of full slip, after which everything has slipped."""
SUMS = 1e-11
"""Rounding of sums over the springs, of the full-slip force."""


@pytest.mark.parametrize('preload_n', [0.1, 0.5, 1.0, 2.0])
def test_no_force_jumps_at_a_hand_over(preload_n):
    model = all_contacts(Parameters().updated({'stand.preload': preload_n}))
    contact = relax(record(CONTACT_STATE), preload_n)
    limit_n = 0.3 * 2.0 * math.sqrt(2.0) * preload_n
    for turn in random_turns(20140, 60):
        place_m = 1.2 * turn * model.curve.limit_m
        move(model.curve, contact.memory, place_m)
        there = contact.copy()
        switch_to_springs(model, there)
        after_n, _ = move_springs(model.bank, there.springs, 0.0, preload_n, preload_n)
        assert after_n == pytest.approx(contact.memory.force_n, rel=0.0, abs=SUMS * limit_n)
        far_m = place_m - np.sign(place_m) * FAR * model.curve.limit_m
        springs = there.springs.copy()
        slipping_n, _ = move_springs(model.bank, springs, far_m - place_m, preload_n, preload_n)
        react(model, there, far_m, STEP_S, 0.0)
        assert not there.on_springs
        assert there.memory.force_n == pytest.approx(slipping_n, rel=0.0, abs=SUMS * limit_n)


NORMAL_N = 0.2
MANY_SPRINGS_ERROR = 1e-5
"""1024 springs against the continuum; of the largest force."""


def test_a_contact_that_is_pulled_follows_the_virgin_curve_and_slips_at_its_limit():
    known, contact = (
        presliding(Parameters(), normal_force_n=NORMAL_N),
        SpringContact(Parameters(), 0.4),
    )
    assert contact.move(0.0, NORMAL_N) == 0.0
    step_m = known.max_displacement_m / 20
    for number in range(1, 26):
        found_n = contact.move(step_m, NORMAL_N)
        wanted_n = float(known.tangential_force(number * step_m))
        assert found_n == pytest.approx(wanted_n, abs=MANY_SPRINGS_ERROR * known.max_force_n)


def test_a_contact_that_is_lifted_forgets():
    contact = SpringContact(Parameters(), NORMAL_N)
    contact.move(0.0, NORMAL_N)
    assert contact.move(1e-8, NORMAL_N) > 0.0
    assert contact.move(0.0, 0.0) == contact.move(0.0, NORMAL_N) == 0.0


@pytest.mark.parametrize('largest_n', [0.0, -1.0, float('nan'), float('inf')])
def test_a_largest_normal_force_that_does_not_press_is_refused(largest_n):
    told = r'largest normal force .* give a positive number|normal_force_max_n .* finite number'
    with pytest.raises(StickSlipError, match=told):
        SpringContact(Parameters(), largest_n)


@pytest.mark.parametrize('normal_n', [-0.1, 0.3, float('nan')])
def test_a_normal_force_that_the_contact_was_not_made_for_is_refused(normal_n):
    with pytest.raises(OutOfRange, match=r'normal force .* N is not from 0 to 0\.2; give'):
        SpringContact(Parameters(), NORMAL_N).move(0.0, normal_n)
