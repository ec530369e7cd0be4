# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
``make foreign``: ask codes that others wrote; their answers are references of the self-test.

Writes stickslip_ros/lab/validation/foreign.csv. tamaas and ContactMechanics press the smooth and
the rough body of closed_forms.py on a half-space without images, slippy pulls at them; tamaas
presses random rough spheres; SurfaceTopography fits exponents. Of the package only the random
lines and surfaces are used. Minutes on one core.
"""

import sys
from collections.abc import Callable, Iterator, Mapping
from importlib.metadata import version
from typing import Any

import numpy as np
import tamaas
from ContactMechanics import FreeFFTElasticHalfSpace
from ContactMechanics.Systems import NonSmoothContactSystem
from numpy.typing import NDArray
from slippy.core import bccg, elastic_influence_matrix_spatial, plan_convolve, polonsky_and_keer
from SurfaceTopography import Topography, UniformLineScan

from evidence.closed_forms import (
    E_STAR_PA,
    FRICTION,
    HURST,
    POISSON,
    RMS_HEIGHT_M,
    TERMS,
    YOUNG_PA,
    Array,
    contact_of,
    height,
)
from evidence.group import csv_text
from evidence.half_space import GAPS, smooth_gap
from evidence.roughness import HURSTS
from stickslip_ros.contact.roughness import Spectrum
from stickslip_ros.lab.validation.references import TABLES, Reference, case_of
from stickslip_ros.lab.validation.roughness import LENGTH_M, line_and_surface
from stickslip_ros.lab.validation.surfaces import rough_surface

MESH = 2e-5, 'its mesh of 256 x 256'
ELEMENTS = 3e-3, 'its elements in contact, counted: each is 1 % of the radius wide'
SLIP = 2e-5, 'of mu F_n: its mesh of 128 x 128'
BINS = {
    'line': (3e-3, 'its means over bins, ten a decade, of a steep power law'),
    'surface': (1e-2, 'its bins, our rings: the first ones average waves that differ by 20 %'),
}
STANDS_FOR = 0.1, 'it stands for their mean, which the shortest wave moves: 7 % seen'
NOT_COMPARED = float('nan'), ''
PRESSED, FITTED = '3-D, boundary elements', 'fit of its spectrum'
BODIES = ('smooth', 'rough')
PULLED_N = 0.3535534
"""Normal force of the contacts that slippy pulls."""
SPHERES = 48
SPHERE_LOADS_N = (0.035, 0.1, 0.354, 0.707)
LOADS_N = (0.03535534, 0.3535534, 0.7071068)
POINTS, PULL_POINTS = 256, 128
MARGIN = 1.25
"""Half the side of the grid, in contact radii."""
EXACT, ENOUGH = 1e-11, 1e-8
"""Tolerances of tamaas for one body and for random ones; it does not reach 1e-14."""
SHARES = (0.25, 0.5, 0.75)
"""u/u_max at which slippy pulls."""
SURFACE_POINTS, WINDOW_POINTS = 2048, 128
"""Of a random surface as wide as the sphere, and of the part around its first contact."""
STEP_M = LENGTH_M / SURFACE_POINTS
WAVE_MIN_M = 4.0 * STEP_M
LOAD_STEP = 0.05
"""Share of a load by which it is lowered and raised for the stiffness."""


def main() -> int:
    """Ask one after the other, and write the table."""
    tamaas.set_log_level(tamaas.LogLevel.warning)
    asked = (press_bodies, pull, fit_exponents, press_random_spheres)
    TABLES[2].write_text(csv_text(row for ask in asked for row in ask()), encoding='utf-8')
    return 0


def digits(value: float) -> float:
    """Return nine digits of a value."""
    return float(f'{value:.9g}')


def row_of(
    code: str,
    quantity: str,
    case: Mapping[str, float | str],
    answer: float,
    tolerance: tuple[float, str],
    source: str,
    relative_to: float | None = None,
) -> Reference:
    """Return a row of the table."""
    value = digits(answer)
    return Reference(
        'Codes of others', quantity, case_of(case), value, tolerance[0],
        value if relative_to is None else relative_to, tolerance[1], source, code, version(code),
    )  # fmt: skip


def shape(body: str, radius_m: float, points: int) -> tuple[Array, float]:
    """Return the gap of a body on a square, m, and the length of the square, m."""
    length_m = 2.0 * MARGIN * radius_m
    x_m = (np.arange(points) - points / 2 + 0.5) * (length_m / points)
    return GAPS[body](np.hypot(x_m[:, None], x_m[None, :])), length_m


class Press:
    """A body on a half-space without images, by tamaas; each load starts from the one before."""

    def __init__(self, gap_m: Array, length_m: float, tolerance: float) -> None:
        self.gap_m, self.length_m, self.tolerance = gap_m, length_m, tolerance
        self.model = tamaas.Model(tamaas.model_type.basic_2d, [length_m] * 2, list(gap_m.shape))
        self.model.E, self.model.nu = E_STAR_PA, 0.0
        tamaas.ModelFactory.registerNonPeriodic(self.model, 'dcfft')
        self.solver = tamaas.PolonskyKeerRey(self.model, -gap_m, tolerance)
        self.solver.setIntegralOperator('dcfft')

    def at(self, load_n: float) -> tuple[float, NDArray[np.bool_]]:
        """Return depth, m, and which elements touch."""
        if not self.solver.solve(load_n / self.length_m**2) < self.tolerance:
            raise SystemExit(f'tamaas does not converge at {load_n} N')
        touches, sunk_m = self.model.traction > 0.0, np.zeros_like(self.gap_m)
        self.model.operators['dcfft'](self.model.traction, sunk_m)
        return float(np.mean((sunk_m + self.gap_m)[touches])), touches


def press_bodies() -> Iterator[Reference]:
    """Return depth and radius of loads by tamaas, forces of depths by ContactMechanics."""
    for body in BODIES:
        for load_n in LOADS_N:
            contact = contact_of(body, load_n)
            gap_m, length_m = shape(body, contact.radius_m, POINTS)
            depth_m, touches = Press(gap_m, length_m, EXACT).at(load_n)
            radius_m = length_m * float(np.sqrt(np.mean(touches) / np.pi))
            case: dict[str, Any] = {'profile': body, 'force_n': load_n}
            yield row_of('tamaas', 'depth_m', case, depth_m, MESH, PRESSED)
            yield row_of('tamaas', 'radius_m', case, radius_m, ELEMENTS, PRESSED)
            depth_m = float(height(contact.terms, contact.radius_m))
            substrate = FreeFFTElasticHalfSpace((POINTS, POINTS), E_STAR_PA, (length_m, length_m))
            surface = Topography(-gap_m, (length_m, length_m))
            system = NonSmoothContactSystem(substrate, surface)
            if not system.minimize_proxy(offset=depth_m, pentol=1e-6 * depth_m).success:
                raise SystemExit(f'ContactMechanics does not converge at {depth_m} m')
            force_n = float(system.compute_normal_force())
            case = {'profile': body, 'depth_m': digits(depth_m)}
            yield row_of('ContactMechanics', 'normal_force_n', case, force_n, MESH, PRESSED)


def pull() -> Iterator[Reference]:
    """
    Return forces of displacements by slippy, at a constant load.

    Its influence in space is exact; its default, in the frequency domain, repeats the contact.
    Friction limits each element, shear across the pull is left out.
    """
    for body in BODIES:
        contact = contact_of(body, PULLED_N)
        gap_m, length_m = shape(body, contact.radius_m, PULL_POINTS)
        step_m = length_m / PULL_POINTS
        guess_pa = (np.asarray(gap_m) < height(TERMS[body], contact.radius_m)).astype(float)
        press = influence('zz', step_m, guess_pa)
        _, pressure_pa, _ = polonsky_and_keer(press, guess_pa, gap_m, PULLED_N, step_m, 1e-9)
        touches = pressure_pa > 0.0
        limits_pa = FRICTION * pressure_pa[touches]
        drag = influence('xx', step_m, guess_pa, touches)
        for share in SHARES:
            moved_m = share * float(contact.displacement(0.0))
            moved = np.full(limits_pa.shape, moved_m)
            between = (0.5 * limits_pa, -limits_pa, limits_pa)
            shear_pa, failed = bccg(drag, moved, 1e-8, 5000, *between)
            if failed:
                raise SystemExit(f'slippy does not converge at {moved_m} m')
            force_n = float(np.sum(shear_pa)) * step_m**2
            case: dict[str, Any] = {
                'profile': body,
                'force_n': PULLED_N,
                'displacement_m': digits(moved_m),
            }
            limit_n = FRICTION * PULLED_N
            yield row_of('slippy', 'pull_n', case, force_n, SLIP, '3-D, partial slip', limit_n)


def influence(
    component: str, step_m: float, like: Array, touches: NDArray[np.bool_] | None = None
) -> Callable[..., Array]:
    """Return the displacements of both bodies by the stresses in elements, as slippy wants it."""
    span, steps_m = tuple(2 * points for points in like.shape), (step_m, step_m)
    kernel = sum(
        elastic_influence_matrix_spatial(component, span, steps_m, modulus_pa, POISSON)
        for modulus_pa in (young_pa / (2.0 * (1.0 + POISSON)) for young_pa in YOUNG_PA)
    )
    convolve: Callable[..., Array] = plan_convolve(
        like, kernel, touches, (False, False), fft_im=False
    )
    return convolve


def fit_exponents() -> Iterator[Reference]:
    """Return the exponents of random lines and surfaces by the spectra of SurfaceTopography."""
    for hurst in HURSTS:
        line_m, surface_m = line_and_surface(hurst)
        line = UniformLineScan(line_m, LENGTH_M, periodic=True)
        surface = Topography(surface_m, (LENGTH_M, LENGTH_M), periodic=True)
        for body, spectrum, dimensions in (
            ('line', line.power_spectrum_from_profile(), 1),
            ('surface', surface.power_spectrum_from_area(), 2),
        ):
            waves, density = (each.filled(0.0) for each in spectrum)
            inside = (waves > 0.0) & (waves < 0.5 * waves.max()) & (density > 0.0)
            slope, _ = np.polyfit(np.log(waves[inside]), np.log(density[inside]), 1)
            exponent = -0.5 * (float(slope) + dimensions)
            case: dict[str, Any] = {'body': body, 'hurst': hurst}
            yield row_of('SurfaceTopography', 'fitted_hurst', case, exponent, BINS[body], FITTED)


def press_random_spheres() -> Iterator[Reference]:
    """Return mean and scatter of the depth and stiffness of random rough spheres by tamaas."""
    found = np.array([press_sphere(seed, WINDOW_POINTS) for seed in range(SPHERES)])
    for k, load_n in enumerate(SPHERE_LOADS_N):
        case: dict[str, Any] = {'profile': 'rough', 'force_n': load_n}
        for quantity, values in zip(
            ('depth_m', 'normal_stiffness_n_per_m'), found[:, k].T, strict=True
        ):
            for answer, tolerance, words in (
                (np.mean(values), STANDS_FOR, 'mean'),
                (np.std(values, ddof=1), NOT_COMPARED, 'standard deviation'),
            ):
                source = f'{SPHERES} random rough spheres, {words}'
                yield row_of('tamaas', quantity, case, float(answer), tolerance, source)


def press_sphere(seed: int, points: int) -> list[tuple[float, float]]:
    """Return depth since first contact and stiffness of a random sphere, at each load."""
    first_per_m, last_per_m = 2.0 * np.pi / LENGTH_M, 2.0 * np.pi / WAVE_MIN_M
    spectrum = Spectrum(HURST, RMS_HEIGHT_M, first_per_m, last_per_m)
    x_m = (np.arange(SURFACE_POINTS) - SURFACE_POINTS / 2) * STEP_M
    gap_m = smooth_gap(np.hypot(x_m[:, None], x_m[None, :]))
    gap_m += rough_surface(spectrum, LENGTH_M, SURFACE_POINTS, seed)
    row, column = np.unravel_index(np.argmin(gap_m), gap_m.shape)
    half = points // 2
    gap_m = gap_m[row - half : row + half, column - half : column + half] - gap_m[row, column]
    press, found = Press(gap_m, points * STEP_M, ENOUGH), []
    for load_n in SPHERE_LOADS_N:
        low_m, _ = press.at((1.0 - LOAD_STEP) * load_n)
        high_m, touches = press.at((1.0 + LOAD_STEP) * load_n)
        found.append((0.5 * (low_m + high_m), 2.0 * LOAD_STEP * load_n / (high_m - low_m)))
    reaches_the_edge = touches[[0, -1]].any() or touches[:, [0, -1]].any()
    return press_sphere(seed, 2 * points) if reaches_the_edge else found


if __name__ == '__main__':
    sys.exit(main())
