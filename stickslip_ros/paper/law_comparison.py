"""Generated force of every profile and every friction law, over amplitude and preload."""

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip_ros.parameters import Parameters, spec_of
from stickslip_ros.study.plotting import new_figure, save_figure
from stickslip_ros.study.sawtooth_run import run_sawtooth, voltage_for

PRELOADS_N = (0.1, 0.5, 1.0)
AMPLITUDE_MAX_M = 160e-9
FREQUENCY_HZ = 1000.0
STYLES = {
    'rough': ('tab:blue', '-'),
    'smooth': ('tab:cyan', '-'),
    'rough_line': ('tab:green', '-'),
    'coulomb': ('0.3', '--'),
    'dahl': ('tab:orange', '--'),
    'lugre': ('tab:red', ':'),
    'epm': ('tab:purple', '-.'),
}


@dataclass(frozen=True)
class Variant:
    """A name for a figure, and the parameters that make it."""

    name: str
    values: dict[str, object]


@dataclass(frozen=True)
class Point:
    """One run: which variant, where, and the mean generated force."""

    variant: str
    preload_n: float
    amplitude_m: float
    force_mean_n: float
    steady: bool


def variants() -> list[Variant]:
    """Return every profile of the contact model, and every rival law."""
    profiles = [
        Variant(name, {'contact.profile': name}) for name in spec_of('contact.profile').choices
    ]
    laws = [name for name in spec_of('contact.law').choices if name != 'mdr']
    return profiles + [Variant(name, {'contact.law': name}) for name in laws]


def compare_laws(
    parameters: Parameters, amplitudes: int, progress: Callable[[int, int], None] | None = None
) -> list[Point]:
    """
    Run every variant at every preload and amplitude, until the force is steady.

    Parameters
    ----------
    parameters : Parameters
        The stand; profile, law and preload are replaced.
    amplitudes : int
        Number of amplitudes from 0 (left out) to 160 nm.
    progress : callable, optional
        Called with runs done and runs in all.

    Raises
    ------
    StickSlipError
        If a variant is refused.

    """
    amplitudes_m = np.linspace(0.0, AMPLITUDE_MAX_M, amplitudes + 1)[1:]
    cases = [(v, p, a) for v in variants() for p in PRELOADS_N for a in amplitudes_m]
    points = []
    for done, (variant, preload_n, amplitude_m) in enumerate(cases, start=1):
        there = parameters.updated({**variant.values, 'stand.preload': preload_n})
        voltage_v = voltage_for(there, float(amplitude_m))
        run = run_sawtooth(there, voltage_v, FREQUENCY_HZ)
        points.append(
            Point(variant.name, preload_n, float(amplitude_m), run.force_mean_n, run.steady)
        )
        if progress is not None:
            progress(done, len(cases))
    return points


def write_points(points: Sequence[Point], path: Path) -> None:
    """Write points as CSV, with units in the header."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open('w', newline='', encoding='utf-8') as file:
        writer = csv.writer(file)
        writer.writerow(('variant', 'preload_n', 'amplitude_m', 'force_mean_n', 'steady'))
        for p in points:
            row = (p.variant, p.preload_n, p.amplitude_m, p.force_mean_n, p.steady)
            writer.writerow(row)


def draw_points(points: Sequence[Point], picture: Path, note: str) -> None:
    """
    Draw force over amplitude, one panel per preload.

    Parameters
    ----------
    points : sequence of Point
        The runs.
    picture : Path
        PNG or SVG file; folders are made.
    note : str
        What was assumed, for the foot of the figure.

    """
    preloads_n = sorted({p.preload_n for p in points})
    figure = new_figure(5.0 * len(preloads_n), 4.6)
    for axes, preload_n in zip(
        np.atleast_1d(figure.subplots(1, len(preloads_n))), preloads_n, strict=True
    ):
        for name, (colour, line) in STYLES.items():
            some = [p for p in points if p.variant == name and p.preload_n == preload_n]
            if not some:
                continue
            axes.plot(
                [p.amplitude_m * 1e9 for p in some],
                [p.force_mean_n * 1e3 for p in some],
                color=colour,
                linestyle=line,
                label=name,
            )
        axes.set_title(f'preload {preload_n:g} N')
        axes.set_xlabel('amplitude of the feet (nm)')
        axes.grid(visible=True, alpha=0.3)
        axes.margins(x=0.0)
    figure.axes[0].set_ylabel('generated force, mean of the last cycle (mN)')
    figure.axes[0].legend(fontsize='small')
    figure.supxlabel(note, fontsize='small')
    save_figure(figure, picture)
