# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Random rough lines: properties of every realisation, and refusals."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip_ros.contact.roughness import Spectrum, rough_line
from stickslip_ros.errors import OutOfRange

LENGTH_M = 1e-3
RMS_M = 1.1221e-6
FIRST = 2.0 * math.pi / LENGTH_M
"""Wave number of one wave in the length, rad/m."""
ROUNDING = 1e-12
"""Sums over all points of a grid, and transforms there and back."""


def spectrum_for(points: int, hurst: float = 0.7) -> Spectrum:
    """Give a spectrum that fills a grid from its first wave to its last."""
    return Spectrum(hurst, RMS_M, FIRST, math.pi * points / LENGTH_M)


def rms(heights_m) -> float:
    return float(np.sqrt(np.mean(heights_m**2)))


@given(
    seed=st.integers(0, 2**31),
    hurst=st.floats(0.01, 1.0),
    points=st.integers(8, 200),
    exponent=st.floats(-9.0, -3.0),
)
def test_every_realisation_has_exactly_the_asked_rms_and_mean_zero(seed, hurst, points, exponent):
    asked_m = 10.0**exponent
    spectrum = dataclasses.replace(spectrum_for(points, hurst), rms_height_m=asked_m)
    heights_m = rough_line(spectrum, LENGTH_M, points, seed)
    assert heights_m.dtype == np.float64
    assert heights_m.shape == (points,)
    assert rms(heights_m) == pytest.approx(asked_m, rel=ROUNDING, abs=0.0)
    assert abs(np.mean(heights_m)) < ROUNDING * asked_m


def test_the_spectrum_is_a_power_law_and_outside_the_cut_offs_empty():
    spectrum = Spectrum(0.7, RMS_M, 1e4, 1e6)
    assert spectrum.density_2d(1e4) == spectrum.plateau_m4
    ratio = float(spectrum.density_2d(2e4) / spectrum.density_2d(1e4))
    assert ratio == pytest.approx(2.0**-3.4, rel=ROUNDING, abs=0.0)
    assert np.all(spectrum.density_2d(np.array([0.0, 0.99e4, 1.01e6])) == 0.0)


def test_the_same_seed_makes_the_same_heights_and_another_one_others():
    first, again, other = (rough_line(spectrum_for(64), LENGTH_M, 64, seed) for seed in (7, 7, 8))
    assert first.tobytes() == again.tobytes()
    assert not np.allclose(first, other, rtol=0.0, atol=0.1 * RMS_M)


def test_twice_the_rms_is_the_same_line_twice_as_high():
    once = rough_line(spectrum_for(64), LENGTH_M, 64, 7)
    high = dataclasses.replace(spectrum_for(64), rms_height_m=2.0 * RMS_M)
    np.testing.assert_allclose(rough_line(high, LENGTH_M, 64, 7), 2.0 * once, rtol=1e-9)


@pytest.mark.parametrize('hurst', [0.0, -0.1, 1.0001, math.nan])
def test_a_hurst_exponent_outside_its_range_is_refused(hurst):
    with pytest.raises(OutOfRange, match=r'Hurst exponent .* is outside \(0, 1\]; take one such'):
        Spectrum(hurst, RMS_M, 1e4, 1e6)


@pytest.mark.parametrize('rms_m', [0.0, -1e-6, math.inf, math.nan])
def test_heights_that_are_none_are_refused(rms_m):
    with pytest.raises(OutOfRange, match=r'rms height .* m is not above 0 m; give a positive'):
        Spectrum(0.7, rms_m, 1e4, 1e6)


def test_cut_offs_in_the_wrong_order_are_refused():
    message = r'upper cut-off 10000 rad/m is not above the lower cut-off, 1e\+06 rad/m; raise it'
    with pytest.raises(OutOfRange, match=message):
        Spectrum(0.7, RMS_M, 1e6, 1e4)
    with pytest.raises(OutOfRange, match='lower cut-off 0 rad/m is not above 0 rad/m'):
        Spectrum(0.7, RMS_M, 0.0, 1e4)


def test_a_grid_that_does_not_resolve_the_cut_offs_is_refused():
    full = spectrum_for(64)
    with pytest.raises(OutOfRange, match=r'lower cut-off 6283\.19 rad/m is below .* or the len'):
        rough_line(full, 0.5 * LENGTH_M, 64, 1)
    with pytest.raises(OutOfRange, match=r'upper cut-off .* 32 points per wave; lower it or add'):
        rough_line(full, LENGTH_M, 32, 1)
    narrow = Spectrum(0.7, RMS_M, 1.1 * FIRST, 2.9 * FIRST)
    with pytest.raises(OutOfRange, match='is less than 2 grid waves above the lower one, '):
        rough_line(narrow, LENGTH_M, 64, 1)
    with pytest.raises(OutOfRange, match='length 0 m is not above 0 m'):
        rough_line(full, 0.0, 64, 1)
