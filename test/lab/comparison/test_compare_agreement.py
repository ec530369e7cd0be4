# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The numbers of a comparison: known answers, then what must hold for any two curves."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from stickslip_ros.lab.comparison.result import Part, agreement_of, threshold_of

ROUNDING = 1e-12
"""Relative; sums of a few dozen numbers."""
NM = 1e-9


def part(a, b, sigma=None, **at) -> Part:
    a, b = np.array(a, dtype=float), np.array(b, dtype=float)
    sigma = None if sigma is None else np.array(sigma, float)
    return Part(at, 'amplitude_m', np.arange(len(a), dtype=float) * NM, a, b, sigma)


def agreement(a, b, sigma=None):
    return part(a, b, sigma).agreement


def test_the_numbers_of_three_points_are_those_by_hand():
    told = agreement([0.0, 1.0, 2.0], [1.0, 1.0, 0.0])
    assert (told.points, told.bias, told.largest) == (3, pytest.approx(-1 / 3), -2.0)
    assert told.rms == pytest.approx(math.sqrt(5 / 3), rel=ROUNDING)
    assert told.relative_rms == pytest.approx(math.sqrt(5 / 3) / 2, rel=ROUNDING)
    assert told.largest_at == {'amplitude_m': 2 * NM}
    assert told.correlation == pytest.approx(-math.sqrt(3) / 2, rel=ROUNDING)
    assert told.chi_square is None


def test_the_numbers_of_two_parts_are_those_of_all_points():
    a, b, sigma = [0.0, 1.0, 2.0, 5.0], [1.0, 1.0, 0.0, 4.0], [1.0, 1.0, 2.0, 1.0]
    parts = [part(a[i], b[i], sigma[i], preload_n=i.start) for i in (slice(0, 3), slice(3, 4))]
    whole = agreement(a, b, sigma)
    told = agreement_of(parts)
    assert told.largest_at == {'preload_n': 0, 'amplitude_m': 2 * NM}
    assert vars(told) == {**vars(whole), 'largest_at': told.largest_at}
    assert agreement_of([parts[0], part([1.0], [2.0])]).chi_square is None


def test_a_constant_has_neither_correlation_nor_range():
    told = agreement([2.0, 2.0], [1.0, 3.0])
    assert told.correlation is None
    assert told.relative_rms is None
    assert agreement([0.1 + 0.2, 0.3], [1.0, 2.0]).correlation is None


def test_chi_square_is_the_sum_of_squared_residuals_with_its_p_value():
    chi = agreement([0.0, 0.0, 0.0, 0.0], [1.0, -2.0, 3.0, 0.5], [1.0, 2.0, 1.0, 1.0]).chi_square
    assert chi is not None
    assert chi.chi_square == pytest.approx(1 + 1 + 9 + 0.25, rel=ROUNDING)
    assert chi.degrees_of_freedom == 4
    assert chi.p_value == pytest.approx(stats.chi2.sf(11.25, 4), rel=1e-9)
    assert chi.largest_residual == 3.0
    assert (chi.within_one_sigma, chi.within_two_sigma) == (0.75, 0.75)


@pytest.mark.parametrize('sigma', [[1.0, 0.0], [1.0, math.nan], [1.0, math.inf]])
def test_without_a_usable_uncertainty_there_is_no_chi_square(sigma):
    assert agreement([0.0, 1.0], [1.0, 1.0], sigma).chi_square is None


LENGTH = st.integers(2, 40)


@st.composite
def pairs(draw):
    count = draw(LENGTH)
    seed = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    return rng.normal(size=count), rng.normal(size=count)


@given(pairs())
def test_the_numbers_are_those_of_numpy(pair):
    a, b = pair
    told = agreement(a, b)
    assert told.bias == pytest.approx(np.mean(b - a), rel=ROUNDING, abs=ROUNDING)
    assert told.rms == pytest.approx(np.linalg.norm(b - a) / math.sqrt(len(a)), rel=1e-9)
    assert told.correlation == pytest.approx(np.corrcoef(a, b)[0, 1], rel=1e-6, abs=1e-9)


@given(pairs(), st.sampled_from([1e-12, 1e-9, 1.0, 1e6]))
def test_nothing_falls_below_a_nanometre(pair, scale):
    a, b = pair
    one, scaled = agreement(a, b), agreement(scale * a, scale * b)
    assert scaled.rms == pytest.approx(scale * one.rms, rel=ROUNDING, abs=0.0)
    assert scaled.correlation == pytest.approx(one.correlation, rel=1e-9)
    assert scaled.relative_rms == pytest.approx(one.relative_rms, rel=1e-9)


def test_the_0_amplitude_of_a_straight_flank_is_its_foot():
    amplitude_m = np.arange(0, 161, 10, dtype=float) * NM
    force_n = np.clip((amplitude_m - 42 * NM) * 2e6, 0.0, 0.2)
    told = threshold_of(amplitude_m, force_n)
    assert told.zero_amplitude_m == pytest.approx(42 * NM, rel=1e-9, abs=0.0)
    assert told.saturation == 0.2
    assert told.saturation_at_m == pytest.approx(150 * NM)


def test_the_flank_ends_at_half_of_the_largest_force_and_begins_at_a_tenth():
    amplitude_m = np.array([10, 20, 30, 40, 50]) * NM
    # Below a tenth the runner follows elastically; above a half the curve bends.
    force_n = np.array([0.009, 0.02, 0.04, 0.09, 0.1])
    assert threshold_of(amplitude_m, force_n).zero_amplitude_m == pytest.approx(10 * NM)


@pytest.mark.parametrize(
    ('force_n', 'why'),
    [
        ([0.0, 0.0, 0.0], 'no force above 0'),
        ([0.0, 0.0, 0.1], 'strokes with 10 to 50 % of the largest force: 0; give 2'),
        ([0.0, 0.03, 0.1], 'strokes with 10 to 50 % of the largest force: 1; give 2'),
        ([-0.1, -0.2, -0.3], 'no force above 0'),
        ([0.04, 0.03, 0.1], 'the force does not rise with the stroke'),
    ],
)
def test_without_a_rising_flank_there_is_no_0_amplitude_and_a_reason(force_n, why):
    told = threshold_of(np.array([1.0, 2.0, 3.0]) * NM, np.array(force_n))
    assert (told.zero_amplitude_m, told.why) == (None, why)
    assert told.saturation == max(force_n)
