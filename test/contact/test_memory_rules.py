# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Rules of a frictional contact at constant load, for any profile."""

import math
from itertools import pairwise

import numpy as np
import pytest
from guide import Guide

from stickslip_ros.contact.memory import U, fresh_memory, lost_energy, move, set_memory
from stickslip_ros.contact.virgin import virgin_force
from stickslip_ros.kernels.kernel import entry_point

virgin_force = entry_point(virgin_force)
move = entry_point(move)
set_memory = entry_point(set_memory)
lost_energy = entry_point(lost_energy)

ROUNDING = 1e-12
"""A few operations on doubles, relative to the full-slip force."""


@pytest.fixture
def guide(curve) -> Guide:
    return Guide(curve)


@pytest.mark.parametrize('share', [0.1, 0.5, 0.9, 1.0, 1.5])
def test_the_virgin_path_is_the_virgin_curve_in_either_direction(share, curve):
    u_m = share * curve.limit_m
    expected_n = virgin_force(curve, u_m)
    assert Guide(curve).go(u_m).force_n == pytest.approx(expected_n, rel=ROUNDING, abs=0.0)
    assert Guide(curve).go(-u_m).force_n == pytest.approx(-expected_n, rel=ROUNDING, abs=0.0)


def test_a_closed_minor_loop_leaves_no_trace(curve):
    way = np.array([0.8, -0.3, 0.5]) * curve.limit_m
    direct, detour = Guide(curve), Guide(curve)
    before = direct.go(*way)
    after = detour.go(*way, 0.1 * curve.limit_m, 0.3 * curve.limit_m, 0.2 * curve.limit_m, way[-1])
    assert after.force_n == pytest.approx(before.force_n, rel=ROUNDING, abs=0.0)
    assert after.lost_j > before.lost_j
    onward = np.linspace(0.5, 1.3, 50) * curve.limit_m
    np.testing.assert_array_equal(direct.walk(onward)[:, 0], detour.walk(onward)[:, 0])


def test_minor_loops_between_the_same_displacements_are_congruent(curve):
    low_m, high_m = -0.1 * curve.limit_m, 0.2 * curve.limit_m
    heights = []
    for approach in ((0.9, -0.1), (-0.9, -0.5, -0.1), (-0.7, 0.3, -0.1)):
        guide = Guide(curve)
        bottom = guide.go(*(share * curve.limit_m for share in approach), low_m, high_m, low_m)
        heights.append(guide.go(high_m).force_n - bottom.force_n)
    np.testing.assert_allclose(heights, heights[0], rtol=1e-9)


def test_a_larger_loop_wipes_out_smaller_ones(curve):
    small = Guide(curve)
    small.go(*(np.array([0.6, -0.5, 0.4, -0.3, 0.2, -0.1, 0.0]) * curve.limit_m))
    assert small.memory.depth == 6
    outer = small.go(0.65 * curve.limit_m)
    assert small.memory.depth == 0
    virgin_n = virgin_force(curve, 0.65 * curve.limit_m)
    assert outer.force_n == pytest.approx(virgin_n, rel=ROUNDING, abs=0.0)


def test_full_slip_leaves_an_empty_stack_and_coulombs_force(guide, curve):
    guide.go(*(np.array([0.6, -0.5, 0.4, -0.3, 0.2]) * curve.limit_m))
    slipped = guide.go(3.0 * curve.limit_m)
    assert guide.memory.depth == 0
    assert slipped.force_n == pytest.approx(curve.force_max_n, rel=ROUNDING, abs=0.0)
    origin_m = guide.memory.turns[0, U]
    assert origin_m == pytest.approx(2.0 * curve.limit_m, rel=ROUNDING, abs=0.0)


def test_the_force_does_not_drift_under_a_cyclic_displacement(guide, curve):
    cycle = np.array([0.7, 0.1, 0.4, -0.6, 0.2, -0.2]) * curve.limit_m
    samples = guide.walk(np.tile(cycle, 1000)).reshape(1000, len(cycle), 3)
    np.testing.assert_array_equal(samples[2:, :, 0], np.tile(samples[1, :, 0], (998, 1)))
    losses_j = np.diff(samples[1:, -1, 2])
    np.testing.assert_allclose(losses_j, losses_j[0], rtol=1e-9)


def test_a_motion_may_be_cut_into_steps(curve):
    turns = np.array([0.0, 0.8, -0.4, 0.3, -0.9, 2.0, 1.0]) * curve.limit_m
    whole, cut = Guide(curve), Guide(curve)
    whole.walk(turns[1:])
    for start_m, end_m in pairwise(turns):
        cut.walk(np.append(np.linspace(start_m, end_m, 1000)[1:-1], end_m))
    (force_n, stored_j, lost_j), (cut_n, cut_stored_j, cut_lost_j) = (
        guide.go(1.01 * curve.limit_m) for guide in (whole, cut)
    )
    assert cut_n == pytest.approx(force_n, rel=1e-9, abs=0.0)
    assert cut_stored_j == pytest.approx(stored_j, rel=1e-9, abs=0.0)
    assert cut_lost_j == pytest.approx(lost_j, rel=1e-9, abs=0.0)


def test_inside_the_linear_core_nothing_is_lost_and_nothing_remembered(guide, curve):
    wiggle = np.array([0.9, -0.9, 0.5, -0.1, 0.8, 0.0]) * curve.core_m
    samples = guide.walk(wiggle)
    assert guide.memory.depth == 0
    np.testing.assert_allclose(samples[:, 0], curve.cells[0, 1] * wiggle, rtol=ROUNDING)
    assert np.max(np.abs(samples[:, 2])) < ROUNDING * curve.force_max_n * curve.core_m


def test_the_place_of_the_relaxed_contact_does_not_matter(curve):
    start_m = 1e3 * curve.limit_m
    memory = fresh_memory(start_m)
    guide = Guide(curve)
    for share in (0.8, -0.4, 0.3, -1.7):
        move(curve, memory, start_m + share * curve.limit_m)
        expected = guide.go(share * curve.limit_m)
        # A thousand times the displacement costs three digits.
        assert memory.force_n == pytest.approx(expected.force_n, rel=1e-11, abs=0.0)
    assert lost_energy(curve, memory) == pytest.approx(expected.lost_j, rel=1e-9, abs=0.0)


def test_a_contact_that_is_set_to_rest_is_a_fresh_one(guide, curve):
    guide.go(*(np.array([0.6, -0.5, 0.4]) * curve.limit_m))
    guide.memory.turns[0, U] = 0.25
    set_memory(guide.memory, 0.25, 0.0, 1.0, 0.0, 0.0)
    fresh = Guide(curve)
    fresh.memory = fresh_memory(0.25)
    assert fresh.memory.item()[:-1] == (0.25, 0.0, 0, 1.0, 0.0, 0.0, 0.0)
    assert guide.memory.item()[:-1] == fresh.memory.item()[:-1]
    assert np.count_nonzero(fresh.memory.turns) == 1
    assert math.isclose(fresh.memory.turns[0, U], 0.25)
    onward = 0.25 + np.array([0.5, -0.4, 0.3, 0.1, 0.2, -2.0]) * curve.limit_m
    np.testing.assert_array_equal(guide.walk(onward), fresh.walk(onward))
