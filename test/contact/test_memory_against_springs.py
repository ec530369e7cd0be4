# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The memory against springs that are stepped one by one, over any history."""

from collections import Counter

import numpy as np
import pytest
from evidence.springs import plant_springs, pull
from guide import Guide
from hypothesis import given, settings
from hypothesis import strategies as st

ROUNDING = 1e-12
"""Relative to the full-slip force, or to that force times the displacement of full slip."""
EXAMPLES = 150
SPRINGS = 8000
"""Springs under a contact."""
SPRING_ERROR = 4e-6
"""Twice the error of the table, about 1e-6, since Masing's rule doubles it, and as much for the
springs (midpoint rule); relative to the full-slip force. For energies relative to that force times
the displacement of full slip, and the travel."""

SHARES = st.floats(-2.5, 2.5) | st.floats(-0.05, 0.05) | st.integers(-8, 8).map(lambda n: n / 4.0)
"""Displacements in units of that of full slip: any, small ones, and such as meet again."""
HISTORIES = st.lists(SHARES, min_size=1, max_size=40).map(np.array)
SHRINKING = st.tuples(HISTORIES, st.floats(0.5, 0.99)).map(
    lambda drawn: drawn[0] * drawn[1] ** np.arange(len(drawn[0]))
)


def _in_steps(turns, steps):
    """Cut the way between turning points, which starts at 0, into equal steps."""
    corners = np.concatenate(([0.0], turns))
    return np.interp(np.arange(1, len(turns) * steps + 1) / steps, range(len(corners)), corners)


def _one_by_one(contact, turns_m):
    history = pull(plant_springs(contact, contact.profile.height, SPRINGS), turns_m)
    return np.column_stack((history.force_n, history.stored_j, history.lost_j))


def _compare(contacts, curve, turns_m):
    expected = sum(count * _one_by_one(each, turns_m) for each, count in Counter(contacts).items())
    found = Guide(curve).walk(turns_m)
    travel_m = np.cumsum(np.abs(np.diff(turns_m, prepend=0.0)))
    force_error = np.abs(found - expected) / curve.force_max_n
    assert np.max(force_error[:, 0]) < SPRING_ERROR
    assert np.max(force_error[:, 1]) < SPRING_ERROR * curve.limit_m
    assert np.max(force_error[:, 2] / (curve.limit_m + travel_m)) < SPRING_ERROR


@settings(max_examples=EXAMPLES)
@given(turns=HISTORIES | SHRINKING)
def test_force_and_energies_are_those_of_the_springs(turns, contacts, curve):
    _compare(contacts, curve, turns * curve.limit_m)


def test_force_and_energies_are_those_of_the_springs_along_a_long_history(contacts, curve):
    random = np.random.default_rng(3)
    envelope = np.concatenate((np.geomspace(1.2, 0.01, 150), np.geomspace(0.01, 1.2, 150)))
    _compare(contacts, curve, random.uniform(-1.0, 1.0, 300) * envelope * curve.limit_m)


@given(turns=HISTORIES)
def test_friction_never_gives_energy_back(turns, curve):
    samples = Guide(curve).walk(_in_steps(turns, 20) * curve.limit_m)
    scale_j = curve.force_max_n * curve.limit_m
    assert np.min(np.diff(samples[:, 2], prepend=0.0)) >= -ROUNDING * scale_j
    assert np.min(samples[:, 1]) >= -ROUNDING * scale_j


@given(turns=HISTORIES)
def test_a_mirrored_history_has_the_mirrored_force(turns, curve):
    one, other = (Guide(curve).walk(sign * turns * curve.limit_m) for sign in (1.0, -1.0))
    np.testing.assert_array_equal(other[:, 0], -one[:, 0])
    np.testing.assert_array_equal(other[:, 1:], one[:, 1:])


@given(turns=HISTORIES, size=st.floats(1.5, 3.0))
def test_full_slip_erases_every_history(turns, size, curve):
    end_m = 10.0 * curve.limit_m
    for sense in (1.0, -1.0):
        guide = Guide(curve)
        guide.walk(turns * curve.limit_m)
        guide.go(sense * end_m)
        back = guide.go(sense * (end_m - size * curve.limit_m))
        fresh = Guide(curve)
        fresh.go(sense * end_m)
        expected = fresh.go(sense * (end_m - size * curve.limit_m))
        assert back.force_n == pytest.approx(expected.force_n, rel=1e-9, abs=0.0)
        assert back.stored_j == pytest.approx(expected.stored_j, rel=1e-9, abs=0.0)
