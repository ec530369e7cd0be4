# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Random rough surfaces, and what is seen of the spectrum of a line or a surface."""

import math

import numpy as np
import pytest

from stickslip_ros.contact.roughness import Spectrum, rough_line
from stickslip_ros.errors import OutOfRange
from stickslip_ros.lab.validation.surfaces import (
    fit_hurst,
    line_spectrum,
    rough_surface,
    surface_spectrum,
)

LENGTH_M = 1e-3
RMS_M = 1.1221e-6
FIRST = 2.0 * math.pi / LENGTH_M
"""Wave number of one wave in the length, rad/m."""
ROUNDING = 1e-12
"""Sums over all points of a grid, and transforms there and back."""
CUT_FIT = 0.01
"""Cuts miss the waves beyond the cut-offs: 25 waves far from both are nearly a power law."""
LONG_LINE = 2e-3
"""Half a wave out of 500."""
RING_MEAN = 0.02
"""A ring averages a convex law over wave numbers that differ by one: from the tenth on."""
PLACES = pytest.mark.parametrize('points', [64, 65], ids=['even', 'odd'])


def spectrum_for(points: int) -> Spectrum:
    """Give a spectrum that fills a grid from its first wave to its last."""
    return Spectrum(0.7, RMS_M, FIRST, math.pi * points / LENGTH_M)


@PLACES
def test_a_surface_has_exactly_the_asked_rms_and_mean_zero_and_another_seed_another_one(points):
    first_m, again_m, other_m = (
        rough_surface(spectrum_for(points), LENGTH_M, points, seed) for seed in (7, 7, 8)
    )
    assert first_m.shape == (points, points)
    assert np.sqrt(np.mean(first_m**2)) == pytest.approx(RMS_M, rel=ROUNDING, abs=0.0)
    assert abs(np.mean(first_m)) < ROUNDING * RMS_M
    assert first_m.tobytes() == again_m.tobytes()
    assert not np.allclose(first_m, other_m, rtol=0.0, atol=0.1 * RMS_M)


def test_cuts_through_a_surface_have_the_exponent_of_the_surface():
    surface_m = rough_surface(spectrum_for(512), LENGTH_M, 512, seed=5)
    spectra = [line_spectrum(row_m, LENGTH_M) for row_m in surface_m]
    wave, density = spectra[0][0], np.mean([density for _, density in spectra], axis=0)
    middle = slice(7, 32)
    assert abs(fit_hurst(wave[middle], density[middle], 1) - 0.7) < CUT_FIT


@PLACES
def test_the_waves_of_a_surface_are_its_spectrum_and_no_part_is_lost_by_being_imaginary(points):
    spectrum = spectrum_for(points)
    surface_m = rough_surface(spectrum, LENGTH_M, points, seed=2)
    amplitudes = np.abs(np.fft.fft2(surface_m)) / points**2
    along = np.fft.fftfreq(points, 1.0 / points)
    wave = FIRST * np.hypot(*np.meshgrid(along, along))
    wave[np.abs(along) == points / 2, :] = wave[:, np.abs(along) == points / 2] = 0.0
    expected = np.sqrt(spectrum.density_2d(wave))
    scale = RMS_M / np.sqrt(np.sum(expected**2))
    np.testing.assert_allclose(amplitudes, scale * expected, rtol=0.0, atol=ROUNDING * RMS_M)


def test_on_a_long_line_the_estimate_is_the_density_itself():
    """With 500 waves below the first one, the sum of the squares is the integral of Eq. 9."""
    points = 1 << 14
    spectrum = Spectrum(0.7, RMS_M, 500 * FIRST, 8000 * FIRST)
    wave, density = line_spectrum(rough_line(spectrum, LENGTH_M, points, 1), LENGTH_M)
    inside = spectrum.density_1d(wave) > 0.0
    ratio = density[inside] / spectrum.density_1d(wave[inside])
    np.testing.assert_allclose(ratio, 1.0, rtol=LONG_LINE)


def test_a_ring_of_a_surface_holds_the_scaled_density():
    spectrum = spectrum_for(256)
    wave, density = surface_spectrum(rough_surface(spectrum, LENGTH_M, 256, 4), LENGTH_M)
    ratio = (density / spectrum.density_2d(wave))[9:]
    np.testing.assert_allclose(ratio, ratio[-10:].mean(), rtol=RING_MEAN)


def test_a_grid_that_does_not_resolve_the_cut_offs_is_refused():
    with pytest.raises(OutOfRange, match=r'upper cut-off .* 32 points per wave; lower it or add'):
        rough_surface(spectrum_for(64), LENGTH_M, 32, 1)
