"""A page of plots: random roughness, its spectra, and lines against their equivalent profile."""

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

from stickslip_ros.contact.hemisphere import elasticity_of, line_places, spectrum_of
from stickslip_ros.contact.mdr import indent
from stickslip_ros.contact.profile import Array, line_profile
from stickslip_ros.contact.roughness import (
    Spectrum,
    fit_hurst,
    line_spectrum,
    rough_line,
    rough_surface,
    surface_spectrum,
)
from stickslip_ros.paper.ensemble import Comparison, Ensemble, equivalent_profile, line_contact
from stickslip_ros.parameters import ContactParameters, Parameters
from stickslip_ros.study.plotting import (
    BLACK,
    BLUE,
    GREY,
    VERMILION,
    draw_legend,
    label_axes,
    new_figure,
    save_figure,
)
from stickslip_ros.units import MICRO, MILLI, NM

SURFACE_POINTS = 512
"""Points along a side of the surface; they, not the line's cut-off, limit its shortest wave."""
WINDOW_WIDTHS = 4.0
"""Half the width of the close-up, in half widths of the contact under the largest load."""
PLOTTED_POINTS = 4096
"""A line of more points is thinned out for its plot."""
UM, MM = 1.0 / MICRO, 1.0 / MILLI
LINES, EQUIVALENT, THEORY = BLUE, VERMILION, BLACK


@dataclass(frozen=True)
class Sample:
    """Random heights of a line or of a surface, m, its length, m, and its spectrum."""

    heights_m: Array
    length_m: float
    spectrum: Spectrum

    @property
    def rms_m(self) -> float:
        """Root mean square of the heights, m."""
        return float(np.sqrt(np.mean(self.heights_m**2)))

    @property
    def hurst(self) -> float:
        """Hurst exponent fitted to the spectrum of the heights."""
        wave, density, _ = self.densities()
        return fit_hurst(wave, density, self.heights_m.ndim)

    def densities(self) -> tuple[Array, Array, Array]:
        """
        Return wave numbers, rad/m, and densities there: of the heights, and of the theory.

        Waves that the roughness has not are left out: an estimate is rounding noise there.

        """
        if self.heights_m.ndim == 1:
            wave, density = line_spectrum(self.heights_m, self.length_m)
            theory = self.spectrum.density_1d(wave)
        else:
            wave, density = surface_spectrum(self.heights_m, self.length_m)
            theory = self.spectrum.density_2d(wave)
        kept = self.spectrum.density_2d(wave) > 0.0
        return wave[kept], density[kept], theory[kept]


class Samples(NamedTuple):
    """One line and one surface of the same roughness, and the contact that they are made from."""

    contact: ContactParameters
    line: Sample
    surface: Sample


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
    finest = min(spectrum.upper_cutoff_per_m, math.pi * SURFACE_POINTS / length_m)
    coarser = dataclasses.replace(spectrum, upper_cutoff_per_m=finest)
    line_m = rough_line(spectrum, length_m, contact.line_points, seed)
    surface_m = rough_surface(coarser, length_m, SURFACE_POINTS, seed)
    line, surface = Sample(line_m, length_m, spectrum), Sample(surface_m, length_m, coarser)
    return Samples(contact, line, surface)


def draw_roughness(samples: Samples, ensemble: Ensemble, picture: Path) -> None:
    """Draw line and surface, their spectra, and the lines against the equivalent profile."""
    contact = samples.contact
    title = (
        f'Self-affine roughness on a sphere: H = {contact.hurst:g}, '
        f'rms {contact.rms_height * UM:.4g} µm, R = {contact.radius * MM:g} mm; '
        f'{len(ensemble.normal_force_n.lines)} lines of {contact.line_points} springs'
    )
    figure = new_figure(16.0, 7.8, title)
    axes = figure.subplots(2, 4)
    _draw_line(axes[0, 0], samples.line)
    _draw_contact(axes[0, 1], samples, float(ensemble.loads_n[-1]))
    _draw_surface(figure, axes[0, 2], samples.surface)
    _draw_spectrum(axes[0, 3], samples.line, 'line', 'm³')
    _draw_spectrum(axes[1, 3], samples.surface, 'surface', 'm⁴')
    load = (ensemble.loads_n, 'normal force $F_n$ (N)')
    depth = (ensemble.depths_m * NM, 'depth from first touch $d$ (nm)')
    _compare(axes[1, 0], depth, ensemble.normal_force_n, load[1])
    _compare(
        axes[1, 1], load, ensemble.max_displacement_m, 'maximal presliding $u_{max}$ (nm)', NM
    )
    _compare(axes[1, 2], load, ensemble.stiffness_n_per_m, 'full-stick stiffness (N/µm)', MICRO)
    for one in axes.flat:
        if one is not axes[0, 2]:
            draw_legend(one)
    save_figure(figure, picture)


def _draw_line(axes: Axes, line: Sample) -> None:
    points = len(line.heights_m)
    step = max(points // PLOTTED_POINTS, 1)
    x_mm = line_places(line.length_m, points)[::step] * MM
    axes.plot(x_mm, line.heights_m[::step] * UM, LINES, linewidth=0.7, label='h(x)')
    rms_um = line.rms_m * UM
    for side, label in ((-rms_um, None), (rms_um, f'rms {rms_um:.4g} µm')):
        axes.axhline(side, color=THEORY, linestyle='--', linewidth=0.8, label=label)
    label_axes(axes, 'place x (mm)', 'height (µm)', 'one rough line, without the parabola')


def _draw_contact(axes: Axes, samples: Samples, load_n: float) -> None:
    """Show the line on its parabola around the lowest spring, as deep as it is pressed."""
    contact = samples.contact
    places_m = line_places(contact.line_length, contact.line_points)
    spacing_m = contact.line_length / contact.line_points
    line = line_profile(places_m**2 / contact.radius + samples.line.heights_m, spacing_m)
    pressed = indent(line, elasticity_of(contact), load_n)
    from_lowest_m = places_m - places_m[np.argmin(line.heights_m)]
    near = np.flatnonzero(np.abs(from_lowest_m) < WINDOW_WIDTHS * pressed.radius_m)
    near = near[:: max(len(near) // PLOTTED_POINTS, 1)]
    x_um, x_m = places_m[near] * UM, from_lowest_m[near]
    parabola_m, equivalent_m = x_m**2 / contact.radius, equivalent_profile(contact).height(x_m)
    axes.plot(x_um, parabola_m * UM, GREY, linestyle=':', label='parabola x²/R')
    heights_um = line.heights_m[near] * UM
    axes.plot(x_um, heights_um, LINES, linewidth=0.8, label='rough parabola (Eq. 14)')
    axes.plot(x_um, equivalent_m * UM, EQUIVALENT, linestyle='--', label='equivalent (Eq. 18)')
    label = f'd under {load_n:g} N: {pressed.depth_m * NM:.0f} nm'
    axes.axhline(pressed.depth_m * UM, color=THEORY, linewidth=0.8, label=label)
    title = 'the line on its parabola, at the first touch'
    label_axes(axes, 'place x (µm)', 'height above the first touch (µm)', title)


def _draw_surface(figure: Figure, axes: Axes, surface: Sample) -> None:
    extent = (0.0, surface.length_m * MM, 0.0, surface.length_m * MM)
    heights_um = surface.heights_m.T * UM
    image = axes.imshow(heights_um, origin='lower', extent=extent, cmap='viridis')
    figure.colorbar(image, ax=axes, label='height (µm)', shrink=0.85)
    axes.set_title('one rough surface of the same rms and H', fontsize='medium')
    axes.set_xlabel('x (mm)')
    axes.set_ylabel('y (mm)')


def _draw_spectrum(axes: Axes, sample: Sample, kind: str, unit: str) -> None:
    wave, density, theory = sample.densities()
    label = f'of the {kind}: sum is rms²'
    axes.loglog(wave, density, LINES, marker='.', markersize=3, label=label)
    label = f'theory, H = {sample.spectrum.hurst:g}: integral is rms²'
    axes.loglog(wave, theory, THEORY, linestyle='--', label=label)
    title = f'spectrum of the {kind}: fitted H = {sample.hurst:.4f}'
    y_label = f'$C_{{{sample.heights_m.ndim}D}}$ ({unit})'
    label_axes(axes, 'wave number q (rad/m)', y_label, title)


def _compare(
    axes: Axes,
    along: tuple[Array, str],
    comparison: Comparison,
    label: str,
    scale: float = 1.0,
) -> None:
    """Draw mean and spread of the lines beside the equivalent profile along x, with its label."""
    x, x_label = along
    mean, spread = comparison.mean * scale, comparison.spread * scale
    axes.fill_between(
        x, mean - spread, mean + spread, color=LINES, alpha=0.25, label='± one standard deviation'
    )
    axes.loglog(x, mean, LINES, marker='o', markersize=3, label='mean of the lines')
    label_18, equivalent = 'equivalent profile (Eq. 18)', comparison.equivalent * scale
    axes.loglog(x, equivalent, EQUIVALENT, linestyle='--', label=label_18)
    low, high = float(np.min(comparison.ratio)), float(np.max(comparison.ratio))
    title = f'mean of the lines / equivalent: {low:.2f} to {high:.2f}'
    label_axes(axes, x_label, label, title)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FormatStrFormatter('%g'))
        axis.set_minor_formatter(NullFormatter())
