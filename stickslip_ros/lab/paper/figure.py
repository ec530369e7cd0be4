# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A figure of the paper: runs, table, drawing, caption, files."""

import csv
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.arrays import Array
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
class Table:
    """Rows with the same columns, whose names end with their units."""

    rows: Sequence[Row]

    @property
    def columns(self) -> tuple[str, ...]:
        return tuple(self.rows[0])

    def where(self, **values: object) -> 'Table':
        """Return the rows with these values."""
        return Table([row for row in self.rows if values.items() <= row.items()])

    def column(self, name: str) -> Array:
        """Return a column of numbers, shape (rows,)."""
        return np.array([row[name] for row in self.rows], dtype=float)

    def by_preload(self) -> Iterator[tuple[float, 'Table']]:
        """Return (preload, N; rows) pairs."""
        for preload_n in dict.fromkeys(self.column('preload_n').tolist()):
            yield preload_n, self.where(preload_n=preload_n)

    def write(self, path: Path) -> None:
        """Write CSV; NaN becomes an empty cell."""
        with path.open('w', newline='', encoding='utf-8') as file:
            writer = csv.writer(file, lineterminator='\n')
            writer.writerow(self.columns)
            for row in self.rows:
                values = row.values()
                writer.writerow('' if str(value) == 'nan' else value for value in values)


@dataclass(frozen=True)
class PaperFigure:
    """A figure, and how to make it."""

    name: str  # stem of its files
    title: str  # heading
    points: int  # default number of points along an axis
    # runs of each row, from parameters and number of points
    cases: Callable[[Parameters, int], Sequence[RowRuns]]
    draw: Callable[[Table, Figure], None]  # draws a table
    caption: Callable[[Parameters], str]  # content and assumptions
    inches: tuple[float, float]  # width and height


def write_figure(
    figure: PaperFigure,
    table: Table,
    parameters: Parameters,
    folder: Path,
    kinds: Sequence[str] = _KINDS,
) -> list[Path]:
    """Write a figure into a new or existing folder; return the files."""
    changed = [f'{name} = {value}' for name, value in parameters.changed().items()]
    caption = figure.caption(parameters) + (f' Changed: {", ".join(changed)}.' if changed else '')
    files = [folder / f'{figure.name}{kind}' for kind in kinds]
    title = figure.title  # marks a stand that is not the default
    if changed:
        is_short = len(changed) <= CHANGED_MAX
        title += f'\nchanged: {", ".join(changed) if is_short else f"{len(changed)} parameters"}'
    with styled():
        drawn = new_figure(*figure.inches, title)
        figure.draw(table, drawn)
    try:
        for path in files:
            if path.suffix == '.csv':
                table.write(path)
            elif path.suffix == '.md':
                page = f'# {figure.title}\n\n![{figure.title}]({figure.name}.png)\n\n{caption}\n'
                path.write_text(page, encoding='utf-8')
            else:
                save_figure(drawn, path)
    except OSError as error:
        problem = f'cannot be written ({error.strerror})'
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
