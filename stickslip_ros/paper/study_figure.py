"""What a figure of the study is, and what figures share."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from matplotlib.figure import Figure

from stickslip_ros.paper.readings import FORCE_FREQUENCY_HZ
from stickslip_ros.paper.table import Table
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.journal import Row

Case = Callable[[], Row]
"""Runs that give one row of the table."""
PRELOAD_COLOURS = ('tab:blue', 'tab:orange', 'tab:green', 'tab:red')


@dataclass(frozen=True)
class StudyFigure:
    """
    A figure: which runs, how drawn, with which caption.

    Attributes
    ----------
    name : str
        Stem of its files.
    title : str
        Heading.
    columns : tuple of str
        Columns of its table.
    points : int
        Points along an axis, unless asked otherwise.
    cases : callable
        Gives the runs for parameters and a number of points.
    draw : callable
        Draws a table.
    caption : callable
        Says what is shown and what is assumed.
    inches : tuple of float
        Width and height.

    """

    name: str
    title: str
    columns: tuple[str, ...]
    points: int
    cases: Callable[[Parameters, int], Sequence[Case]]
    draw: Callable[[Table, Figure], None]
    caption: Callable[[Parameters], str]
    inches: tuple[float, float] = (8.5, 6.5)


def assumed(parameters: Parameters) -> str:
    """Return the assumptions that runs with a load cell share, as a sentence."""
    cell, damping = parameters.load_cell.stiffness * 1e-3, parameters.runner.damping
    slew, step_us = parameters.amplifier.slew_rate * 1e-6, parameters.sim.dt * 1e6
    return (
        f'Assumed, as the paper does not say: load cell k = {cell:g} kN/m, damping c = '
        f'{damping:g} N s/m, f = {FORCE_FREQUENCY_HZ:g} Hz, steady state (at least 200 steps, '
        f'force changes by less than 0.1 % in 20), time step {step_us:g} us. '
        f'Slew rate {slew:g} V/us.'
    )


def surface(parameters: Parameters, profile: str) -> str:
    """Return the profile of the contacts in words."""
    contact = parameters.contact
    if profile == 'smooth':
        return f'smooth sphere (R = {contact.radius * 1e3:g} mm, mu = {contact.friction:g})'
    return (
        f'rough sphere (H = {contact.hurst:g}, Q_1D = {contact.prefactor:g} m^(1-H), '
        f'R = {contact.radius * 1e3:g} mm, mu = {contact.friction:g})'
    )
