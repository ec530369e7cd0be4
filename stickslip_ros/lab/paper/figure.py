# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A figure of the paper: runs, table, drawing, caption, files."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure
from pandas import DataFrame

from stickslip_ros.errors import RecordingError
from stickslip_ros.lab.figures.plotting import new_figure, save_figure, styled
from stickslip_ros.lab.measurements.sweep_table import Row
from stickslip_ros.lab.runs.courses import Course
from stickslip_ros.parameters import Parameters
from stickslip_ros.units import MICRO

_KINDS = ('.csv', '.md', '.png', '.svg')  # files: table (SI, all digits), caption, pictures
CHANGED_MAX = 3  # changed parameters named in a title; above, only their number

RowRuns = Callable[[], Course[Row]]  # the runs of one row


@dataclass(frozen=True)
class PaperFigure:
    """A figure, and how to make it."""

    name: str  # stem of its files
    title: str  # heading
    points: int  # default number of points along an axis
    # runs of each row, from parameters and number of points
    cases: Callable[[Parameters, int], Sequence[RowRuns]]
    draw: Callable[[DataFrame, Figure], None]  # draws the rows
    caption: Callable[[Parameters], str]  # content and assumptions
    inches: tuple[float, float]  # width and height


def write_figure(
    figure: PaperFigure, rows: Sequence[Row], parameters: Parameters, folder: Path
) -> list[Path]:
    """Write a figure into a new or existing folder; return the files."""
    changed = [f'{name} = {value}' for name, value in parameters.changed().items()]
    caption = figure.caption(parameters) + (f' Changed: {", ".join(changed)}.' if changed else '')
    files = [folder / f'{figure.name}{kind}' for kind in _KINDS]
    title = figure.title  # marks a stand that is not the default
    if changed:
        is_short = len(changed) <= CHANGED_MAX
        title += f'\nchanged: {", ".join(changed) if is_short else f"{len(changed)} parameters"}'
    table = DataFrame(rows)
    with styled():
        drawn = new_figure(*figure.inches, title)
        figure.draw(table, drawn)
    page = f'# {figure.title}\n\n![{figure.title}]({figure.name}.png)\n\n{caption}\n'
    numbers, text, *pictures = files
    try:
        table.to_csv(numbers, index=False)
        text.write_text(page, encoding='utf-8')
        for picture in pictures:
            save_figure(drawn, picture)
    except OSError as error:
        problem = f'cannot be written ({error.strerror or error})'
        raise RecordingError(folder, problem, 'choose another folder') from error
    return files


def assumed(parameters: Parameters) -> str:
    """Return a sentence with the assumptions of runs with a load cell."""
    cell, damping = parameters.load_cell.stiffness * 1e-3, parameters.runner.damping
    slew, step_us = parameters.amplifier.slew_rate * MICRO, parameters.sim.dt / MICRO
    return (
        f'Assumed, as the paper does not say: load cell k = {cell:g} kN/m, damping c = '
        f'{damping:g} N s/m, f = {parameters.step.frequency:g} Hz, steady state (at least 200 '
        f'steps, force within 0.02 % of its limit), time step {step_us:g} us. '
        f'Slew rate {slew:g} V/us.'
    )


def surface(parameters: Parameters, profile: str) -> str:
    """Return the contact profile in words."""
    contact = parameters.contact
    sphere = f'R = {contact.radius * 1e3:g} mm, mu = {contact.friction:g}'
    if profile == 'smooth':
        return f'smooth sphere ({sphere})'
    return f'rough sphere (H = {contact.hurst:g}, Q_1D = {contact.prefactor:g} m^(1-H), {sphere})'
