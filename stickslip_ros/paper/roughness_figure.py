"""A page of plots: random roughness, its spectra, and lines against their equivalent profile."""

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

from stickslip_ros.contact.hemisphere import elasticity_of, spectrum_of
from stickslip_ros.contact.indentation import indent
from stickslip_ros.contact.line_profile import line_places, line_profile
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.self_affine import (
    Spectrum,
    fit_hurst,
    line_spectrum,
    rough_line,
    rough_surface,
    surface_spectrum,
)
from stickslip_ros.paper.ensemble import Comparison, Ensemble, equivalent_profile, line_contact
from stickslip_ros.parameters import ContactParameters, Parameters
from stickslip_ros.study.plotting import new_figure, save_figure

SURFACE_POINTS = 512
"""Points along a side of the surface; they, not the line's cut-off, limit its shortest wave."""
WINDOW_WIDTHS = 4.0
"""Half the width of the close-up, in half widths of the contact under the largest load."""
PLOTTED_POINTS = 4096
"""A line of more points is thinned out for its plot."""
FIGURE_INCHES = (19.0, 9.0)
LINES, EQUIVALENT, THEORY = 'tab:blue', 'tab:red', 'black'


@dataclass(frozen=True)
class Samples:
    """
    One line and one surface of the same roughness, and what their spectra say.

    Attributes
    ----------
    contact : ContactParameters
        What they were made from; its profile is a rough line.
    line_m : array, shape (points,)
        Heights of the line, m, without the parabola.
    surface_m : array, shape (SURFACE_POINTS, SURFACE_POINTS)
        Heights of the surface, m.
    surface_kind : Spectrum
        Spectrum of the surface: that of the line, cut off where its grid ends.
    hurst_line, hurst_surface : float
        Hurst exponents fitted to the two.

    """

    contact: ContactParameters
    line_m: Array
    surface_m: Array
    surface_kind: Spectrum
    hurst_line: float
    hurst_surface: float


def sample_roughness(parameters: Parameters) -> Samples:
    """
    Make one line and one surface, both from contact.line_seed.

    Raises
    ------
    OutOfRange
        If a grid does not resolve the roughness.

    """
    contact = line_contact(parameters.contact)
    spectrum, length_m, seed = spectrum_of(contact), contact.line_length, contact.line_seed
    finest = math.pi * SURFACE_POINTS / length_m
    kind = dataclasses.replace(
        spectrum, upper_cutoff_per_m=min(spectrum.upper_cutoff_per_m, finest)
    )
    line_m = rough_line(spectrum, length_m, contact.line_points, seed)
    surface_m = rough_surface(kind, length_m, SURFACE_POINTS, seed)
    return Samples(
        contact,
        line_m,
        surface_m,
        kind,
        fit_hurst(*_inside(line_spectrum(line_m, length_m), spectrum), 1),
        fit_hurst(*_inside(surface_spectrum(surface_m, length_m), kind), 2),
    )


def draw_roughness(samples: Samples, ensemble: Ensemble, picture: Path) -> None:
    """
    Draw the page.

    Parameters
    ----------
    samples : Samples
        Line and surface to show.
    ensemble : Ensemble
        Lines against the equivalent profile.
    picture : Path
        PNG or SVG file to write; folders are made.

    """
    contact = samples.contact
    figure = new_figure(
        *FIGURE_INCHES,
        f'Self-affine roughness on a sphere: H = {contact.hurst:g}, '
        f'rms {contact.rms_height * 1e6:.4g} µm, R = {contact.radius * 1e3:g} mm; '
        f'{len(ensemble.normal_force_n.lines)} lines of {contact.line_points} springs',
    )
    axes = figure.subplots(2, 4)
    _draw_line(axes[0, 0], samples)
    _draw_contact(axes[0, 1], samples, float(ensemble.loads_n[-1]))
    _draw_surface(figure, axes[0, 2], samples)
    _draw_spectrum(axes[0, 3], samples, 1)
    _draw_spectrum(axes[1, 3], samples, 2)
    depths_nm, loads_n = ensemble.depths_m * 1e9, ensemble.loads_n
    depth_label, load_label = 'depth from first touch $d$ (nm)', 'normal force $F_n$ (N)'
    _compare(axes[1, 0], depths_nm, ensemble.normal_force_n, depth_label, load_label)
    label = 'maximal presliding $u_{max}$ (nm)'
    _compare(axes[1, 1], loads_n, ensemble.max_displacement_m, load_label, label, 1e9)
    label = 'full-stick stiffness (N/µm)'
    _compare(axes[1, 2], loads_n, ensemble.stiffness_n_per_m, load_label, label, 1e-6)
    for one in (*axes[:, 0], *axes[:, 1], axes[1, 2], *axes[:, 3]):
        one.grid(visible=True, alpha=0.3)
        one.legend(fontsize='small')
    save_figure(figure, picture)


def _inside(estimate: tuple[Array, Array], spectrum: Spectrum) -> tuple[Array, Array]:
    """Leave out the waves that the roughness has not, where an estimate is rounding noise."""
    wave, density = estimate
    kept = spectrum.density_2d(wave) > 0.0
    return wave[kept], density[kept]


def _draw_line(axes: Axes, samples: Samples) -> None:
    length_m, points = samples.contact.line_length, len(samples.line_m)
    step = max(points // PLOTTED_POINTS, 1)
    x_mm = line_places(length_m, points)[::step] * 1e3
    rms_um = float(np.sqrt(np.mean(samples.line_m**2))) * 1e6
    axes.plot(x_mm, samples.line_m[::step] * 1e6, LINES, linewidth=0.7, label='h(x)')
    for side in (-rms_um, rms_um):
        label = f'rms {rms_um:.4g} µm' if side > 0.0 else None
        axes.axhline(side, color=THEORY, linestyle='--', linewidth=0.8, label=label)
    axes.set_title('one rough line, without the parabola')
    axes.set_xlabel('place x (mm)')
    axes.set_ylabel('height (µm)')


def _draw_contact(axes: Axes, samples: Samples, load_n: float) -> None:
    """Show the line on its parabola around the lowest spring, as deep as it is pressed."""
    contact = samples.contact
    places_m = line_places(contact.line_length, contact.line_points)
    spacing_m = contact.line_length / contact.line_points
    line = line_profile(places_m**2 / contact.radius + samples.line_m, spacing_m)
    pressed = indent(line, elasticity_of(contact), load_n)
    lowest_m = places_m[np.argmin(line.heights_m)]
    near = np.abs(places_m - lowest_m) < WINDOW_WIDTHS * pressed.radius_m
    step = max(np.count_nonzero(near) // PLOTTED_POINTS, 1)
    x_m, heights_m = places_m[near][::step], line.heights_m[near][::step]
    from_lowest_m = x_m - lowest_m
    equivalent_m = equivalent_profile(contact).height(from_lowest_m)
    parabola_m = from_lowest_m**2 / contact.radius
    axes.plot(x_m * 1e6, parabola_m * 1e6, '0.5', linestyle='--', label='parabola x²/R')
    axes.plot(x_m * 1e6, heights_m * 1e6, LINES, linewidth=0.8, label='rough parabola (Eq. 14)')
    axes.plot(x_m * 1e6, equivalent_m * 1e6, EQUIVALENT, label='equivalent (Eq. 18)')
    label = f'd under {load_n:g} N: {pressed.depth_m * 1e9:.0f} nm'
    axes.axhline(pressed.depth_m * 1e6, color=THEORY, linewidth=0.8, label=label)
    axes.set_title('the line on its parabola, at the first touch')
    axes.set_xlabel('place x (µm)')
    axes.set_ylabel('height above the first touch (µm)')


def _draw_surface(figure: Figure, axes: Axes, samples: Samples) -> None:
    length_mm = samples.contact.line_length * 1e3
    image = axes.imshow(
        samples.surface_m.T * 1e6,
        origin='lower',
        extent=(0.0, length_mm, 0.0, length_mm),
        cmap='viridis',
    )
    figure.colorbar(image, ax=axes, label='height (µm)', shrink=0.85)
    axes.set_title('one rough surface of the same rms and H')
    axes.set_xlabel('x (mm)')
    axes.set_ylabel('y (mm)')


def _draw_spectrum(axes: Axes, samples: Samples, dimensions: int) -> None:
    contact, length_m = samples.contact, samples.contact.line_length
    if dimensions == 1:
        spectrum, fitted = spectrum_of(contact), samples.hurst_line
        wave, density = _inside(line_spectrum(samples.line_m, length_m), spectrum)
        theory, kind, unit = spectrum.density_1d(wave), 'line', 'm³'
    else:
        spectrum, fitted = samples.surface_kind, samples.hurst_surface
        wave, density = _inside(surface_spectrum(samples.surface_m, length_m), spectrum)
        theory, kind, unit = spectrum.density_2d(wave), 'surface', 'm⁴'
    axes.loglog(
        wave, density, LINES, marker='.', markersize=3, label=f'of the {kind}: sum is rms²'
    )
    label = f'theory, H = {contact.hurst:g}: integral is rms²'
    axes.loglog(wave, theory, THEORY, linestyle='--', label=label)
    axes.set_title(f'spectrum of the {kind}: fitted H = {fitted:.4f}')
    axes.set_xlabel('wave number q (rad/m)')
    axes.set_ylabel(f'$C_{{{dimensions}D}}$ ({unit})')


def _compare(
    axes: Axes, x: Array, comparison: Comparison, x_label: str, y_label: str, scale: float = 1.0
) -> None:
    mean, spread = comparison.mean * scale, comparison.spread * scale
    axes.fill_between(
        x, mean - spread, mean + spread, color=LINES, alpha=0.25, label='± one standard deviation'
    )
    axes.loglog(x, mean, LINES, marker='o', markersize=3, label='mean of the lines')
    axes.loglog(x, comparison.equivalent * scale, EQUIVALENT, label='equivalent profile (Eq. 18)')
    low, high = float(np.min(comparison.ratio)), float(np.max(comparison.ratio))
    axes.set_title(f'mean of the lines / equivalent: {low:.2f} to {high:.2f}')
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FormatStrFormatter('%g'))
        axis.set_minor_formatter(NullFormatter())
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
