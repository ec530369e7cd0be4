"""
``make foreign``: ask codes that others wrote; their answers are references of the evidence.

Writes stickslip_ros/validation/foreign.csv. tamaas and ContactMechanics press the smooth and the
rough body of references.py on a half-space without images, slippy pulls at them; tamaas presses
random rough spheres; SurfaceTopography fits exponents. Of the package only Hess's factor and the
random lines and surfaces are used. Minutes on one core.
"""

import csv
import sys
from collections.abc import Callable, Iterator
from importlib.metadata import version

import numpy as np
import tamaas
from ContactMechanics import FreeFFTElasticHalfSpace
from ContactMechanics.Systems import NonSmoothContactSystem
from numpy.typing import NDArray
from scipy.optimize import bisect
from slippy.core import (
    bccg,
    elastic_influence_matrix_spatial,
    plan_convolve,
    polonsky_and_keer,
)
from SurfaceTopography import Topography, UniformLineScan

from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.roughness import Spectrum, rough_surface
from stickslip_ros.validation.foreign import (
    ANSWERED,
    BODIES,
    PULLED_N,
    SPHERE_LOADS_N,
    SPHERES,
    STORED,
)
from stickslip_ros.validation.half_space import GAPS, smooth_gap
from stickslip_ros.validation.references import (
    E_STAR_PA,
    FRICTION,
    HURST,
    POISSON,
    RMS_HEIGHT_M,
    TERMS,
    YOUNG_PA,
    PowerContact,
    height,
)
from stickslip_ros.validation.roughness import HURSTS, LENGTH_M, line_and_surface

HEADER = ('code', 'version', 'body', 'given', 'at', 'quantity', 'value')
Row = tuple[str, str, str, float, str, float]
"""All but the version."""

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
    with STORED.open('w', encoding='utf-8', newline='') as file:
        writer = csv.writer(file, lineterminator='\n')
        writer.writerow(HEADER)
        for ask in (press_bodies, pull, fit_exponents, press_random_spheres):
            for code, body, given, at, quantity, value in ask():
                row = (code, version(code), body, given, f'{at:.9g}', quantity, f'{value:.9g}')
                writer.writerow(row)
            file.flush()
    return 0


def contact_of(body: str, load_n: float) -> PowerContact:
    """Return the contact of a load by the integral of Eq. 24: where to look."""
    contact = PowerContact(TERMS[body], 1e-4)
    radius_m = bisect(lambda a_m: float(contact.normal_force(a_m)) - load_n, 0.0, 1e-4)
    return PowerContact(TERMS[body], float(radius_m))


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


def press_bodies() -> Iterator[Row]:
    """Return depth and radius of loads by tamaas, forces of depths by ContactMechanics."""
    for body in BODIES:
        for load_n in LOADS_N:
            contact = contact_of(body, load_n)
            gap_m, length_m = shape(body, contact.radius_m, POINTS)
            depth_m, touches = Press(gap_m, length_m, EXACT).at(load_n)
            radius_m = length_m * float(np.sqrt(np.mean(touches) / np.pi))
            yield 'tamaas', body, 'force_n', load_n, 'depth_m', depth_m
            yield 'tamaas', body, 'force_n', load_n, 'radius_m', radius_m
            depth_m = float(height(contact.terms, contact.radius_m))
            substrate = FreeFFTElasticHalfSpace((POINTS, POINTS), E_STAR_PA, (length_m, length_m))
            surface = Topography(-gap_m, (length_m, length_m))
            system = NonSmoothContactSystem(substrate, surface)
            if not system.minimize_proxy(offset=depth_m, pentol=1e-6 * depth_m).success:
                raise SystemExit(f'ContactMechanics does not converge at {depth_m} m')
            force_n = float(system.compute_normal_force())
            yield 'ContactMechanics', body, 'depth_m', depth_m, 'force_n', force_n


def pull() -> Iterator[Row]:
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
            yield 'slippy', body, 'displacement_m', moved_m, 'tangential_force_n', force_n


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


def fit_exponents() -> Iterator[Row]:
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
            yield 'SurfaceTopography', body, 'hurst', hurst, 'fitted_hurst', exponent


def press_random_spheres() -> Iterator[Row]:
    """Return mean and scatter of the depth and stiffness of random rough spheres by tamaas."""
    found = np.array([press_sphere(seed, WINDOW_POINTS) for seed in range(SPHERES)])
    for k, load_n in enumerate(SPHERE_LOADS_N):
        for quantity, values in zip(ANSWERED, found[:, k].T, strict=True):
            yield 'tamaas', 'random', 'force_n', load_n, f'mean_{quantity}', float(np.mean(values))
            scatter = float(np.std(values, ddof=1))
            yield 'tamaas', 'random', 'force_n', load_n, f'scatter_{quantity}', scatter


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
