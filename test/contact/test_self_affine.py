"""Random roughness: its realisations, what an estimate sees, and what is refused."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip_ros.contact.roughness import (
    Spectrum,
    fit_hurst,
    line_spectrum,
    rough_line,
    rough_surface,
    surface_spectrum,
)
from stickslip_ros.errors import OutOfRange

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


def spectrum_for(points: int, hurst: float = 0.7) -> Spectrum:
    """Give a spectrum that fills a grid from its first wave to its last."""
    return Spectrum(hurst, RMS_M, FIRST, math.pi * points / LENGTH_M)


def rms(heights_m) -> float:
    return float(np.sqrt(np.mean(heights_m**2)))


def test_cuts_through_a_surface_have_the_exponent_of_the_surface():
    surface_m = rough_surface(spectrum_for(512), LENGTH_M, 512, seed=5)
    spectra = [line_spectrum(row_m, LENGTH_M) for row_m in surface_m]
    wave, density = spectra[0][0], np.mean([density for _, density in spectra], axis=0)
    middle = slice(7, 32)
    assert abs(fit_hurst(wave[middle], density[middle], 1) - 0.7) < CUT_FIT


@given(
    seed=st.integers(0, 2**31),
    hurst=st.floats(0.01, 1.0),
    points=st.integers(8, 200),
    exponent=st.floats(-9.0, -3.0),
)
def test_every_realisation_has_exactly_the_asked_rms_and_mean_zero(seed, hurst, points, exponent):
    asked_m = 10.0**exponent
    spectrum = dataclasses.replace(spectrum_for(points, hurst), rms_height_m=asked_m)
    for make in (rough_line, rough_surface):
        heights_m = make(spectrum, LENGTH_M, points, seed)
        assert heights_m.dtype == np.float64
        assert rms(heights_m) == pytest.approx(asked_m, rel=ROUNDING, abs=0.0)
        assert abs(np.mean(heights_m)) < ROUNDING * asked_m


@PLACES
def test_a_line_and_a_surface_have_the_shape_of_their_grid(points):
    assert rough_line(spectrum_for(points), LENGTH_M, points, 1).shape == (points,)
    assert rough_surface(spectrum_for(points), LENGTH_M, points, 1).shape == (points, points)


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


def test_below_the_roll_off_the_spectrum_is_flat_and_outside_the_cut_offs_empty():
    spectrum = Spectrum(0.7, RMS_M, 1e4, 1e6, rolloff_per_m=1e5)
    assert spectrum.density_2d(1e4) == spectrum.density_2d(1e5) == spectrum.plateau_m4
    ratio = float(spectrum.density_2d(2e5) / spectrum.density_2d(1e5))
    assert ratio == pytest.approx(2.0**-3.4, rel=ROUNDING, abs=0.0)
    assert np.all(spectrum.density_2d(np.array([0.0, 0.99e4, 1.01e6])) == 0.0)


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


@pytest.mark.parametrize('make', [rough_line, rough_surface])
def test_the_same_seed_makes_the_same_heights_and_another_one_others(make):
    first, again, other = (make(spectrum_for(64), LENGTH_M, 64, seed) for seed in (7, 7, 8))
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


@pytest.mark.parametrize('rolloff_per_m', [0.99e4, 1e6, -1.0, math.nan])
def test_a_roll_off_outside_the_cut_offs_is_refused(rolloff_per_m):
    message = r'roll-off .* rad/m is outside the cut-offs, 10000 to 1e\+06 rad/m; move it inside'
    with pytest.raises(OutOfRange, match=message):
        Spectrum(0.7, RMS_M, 1e4, 1e6, rolloff_per_m)


@pytest.mark.parametrize('make', [rough_line, rough_surface])
def test_a_grid_that_does_not_resolve_the_cut_offs_is_refused(make):
    full = spectrum_for(64)
    with pytest.raises(OutOfRange, match=r'lower cut-off 6283\.19 rad/m is below .* or the len'):
        make(full, 0.5 * LENGTH_M, 64, 1)
    with pytest.raises(OutOfRange, match=r'upper cut-off .* 32 points per wave; lower it or add'):
        make(full, LENGTH_M, 32, 1)
    narrow = Spectrum(0.7, RMS_M, 1.1 * FIRST, 2.9 * FIRST)
    with pytest.raises(OutOfRange, match='no 2 waves of the grid; raise it or lengthen the grid'):
        make(narrow, LENGTH_M, 64, 1)
    with pytest.raises(OutOfRange, match='length 0 m is not above 0 m'):
        make(full, 0.0, 64, 1)
