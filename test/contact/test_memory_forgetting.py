# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The stack is bounded: the error of forgetting is known, and full slip removes it."""

import numpy as np
import pytest
from guide import Guide
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip_ros.contact.memory import CAPACITY, FORGET_START

REVERSALS = 1_000_000
SPARE_ROWS = 10
KNOWN_ERROR = 1e-4
"""Largest bound of the force error after a million reversals, relative to the full-slip force."""
ROUNDING = 1e-13
"""A few operations on doubles, relative to the full-slip force."""
COUNT = np.arange(REVERSALS)
TURNS = 1.0 - 2.0 * (COUNT % 2)
LEFT = 1.0 - COUNT / REVERSALS

RING_DOWNS = {
    'evenly': TURNS * LEFT,
    'exponentially': TURNS * np.exp(-5.0 * COUNT / REVERSALS),
    'about another place': 0.3 + 0.6 * TURNS * LEFT,
    'breathing': TURNS * (0.5 + 0.45 * np.cos(2e-5 * np.pi * COUNT)) * (0.5 + 0.5 * LEFT),
    'irregularly': TURNS * LEFT * np.random.default_rng(5).uniform(0.7, 1.3, REVERSALS),
}
"""Displacements in units of that of full slip; the evidence has the even one."""


@pytest.mark.parametrize('kind', [pytest.param('smooth', marks=pytest.mark.slow), 'rough'])
@pytest.mark.parametrize('name', sorted(RING_DOWNS.keys() - {'evenly'}))
def test_a_ring_down_of_a_million_reversals_stays_within_its_known_error(
    kind, name, smooth_curve, rough_curve
):
    curve, ring_down = {'smooth': smooth_curve, 'rough': rough_curve}[kind], RING_DOWNS[name]
    bounded, endless = Guide(curve), Guide(curve, REVERSALS + SPARE_ROWS)
    for turns in (ring_down, ring_down[::-1]):
        exact_n, none_n = endless.forces(turns * curve.limit_m)
        force_n, bound_n = bounded.forces(turns * curve.limit_m)
        assert not none_n.any()
        assert np.all(np.abs(force_n - exact_n) <= bound_n + ROUNDING * curve.force_max_n)
        assert np.max(bound_n) < KNOWN_ERROR * curve.force_max_n
        assert bounded.memory.depth < CAPACITY


def test_the_bounded_stack_does_forget_in_a_ring_down(rough_curve):
    turns = RING_DOWNS['evenly'] * rough_curve.limit_m
    bounded, endless = Guide(rough_curve), Guide(rough_curve, REVERSALS + SPARE_ROWS)
    exact_n, _ = endless.forces(turns)
    force_n, bound_n = bounded.forces(turns)
    assert endless.memory.depth > 100 * CAPACITY
    assert CAPACITY // 4 < bounded.memory.depth < CAPACITY
    assert np.max(np.abs(force_n - exact_n)) > FORGET_START * rough_curve.force_max_n
    assert bound_n[-1] > 0.0
    assert np.all(np.diff(bound_n) >= 0.0)


def test_the_force_is_exact_as_long_as_nothing_is_forgotten(rough_curve):
    shares = 1.0 - np.arange(CAPACITY - 1) / CAPACITY
    turns = shares * (-1.0) ** np.arange(CAPACITY - 1) * rough_curve.limit_m
    bounded, endless = Guide(rough_curve), Guide(rough_curve, 2 * CAPACITY)
    np.testing.assert_array_equal(bounded.walk(turns), endless.walk(turns))
    assert bounded.memory.error_n == 0.0


def test_the_energies_survive_forgetting(rough_curve):
    odd = slice(None, None, 11)  # every other one would be no turn
    turns = RING_DOWNS['evenly'][odd] * rough_curve.limit_m
    bounded, endless = Guide(rough_curve), Guide(rough_curve, REVERSALS)
    for guide in (bounded, endless):
        guide.forces(turns)
    found, exact = bounded.go(turns[-1]), endless.go(turns[-1])
    # A force that is wrong by the bound all the way makes work wrong by bound times travel.
    travel_m = np.sum(np.abs(np.diff(turns)))
    assert bounded.memory.error_n > 0.0
    assert abs(found.lost_j - exact.lost_j) < bounded.memory.error_n * travel_m
    assert abs(found.stored_j - exact.stored_j) < KNOWN_ERROR * rough_curve.energy_max_j


def test_after_full_slip_the_error_of_forgetting_is_gone(rough_curve):
    limit_m = rough_curve.limit_m
    bounded, fresh = Guide(rough_curve), Guide(rough_curve)
    bounded.forces(RING_DOWNS['evenly'] * limit_m)
    assert bounded.memory.error_n > 0.0
    onward = np.array([5.0, 4.5, 4.9, 4.1, 4.8, 0.0]) * limit_m
    np.testing.assert_array_equal(bounded.walk(onward)[:, 0], fresh.walk(onward)[:, 0])


@settings(max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1),
    periods=st.integers(1, 12),
    noise=st.floats(0.0, 0.5),
    floor=st.floats(0.0, 0.3),
)
def test_no_irregular_ringing_leaves_the_known_error(seed, periods, noise, floor, rough_curve):
    count = np.arange(20_000)
    swell = floor + (1.0 - floor) * np.abs(np.cos(np.pi * periods * count / len(count)))
    random = np.random.default_rng(seed).uniform(1.0 - noise, 1.0 + noise, len(count))
    turns = (-1.0) ** count * swell * random * rough_curve.limit_m
    exact_n, _ = Guide(rough_curve, len(count) + SPARE_ROWS).forces(turns)
    force_n, bound_n = Guide(rough_curve).forces(turns)
    assert np.all(np.abs(force_n - exact_n) <= bound_n + ROUNDING * rough_curve.force_max_n)
    assert np.max(bound_n) < KNOWN_ERROR * rough_curve.force_max_n
