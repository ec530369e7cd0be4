"""What a command line chooses: parameters, and lists of quantities."""

import argparse
from typing import TYPE_CHECKING

from stickslip_ros.errors import UnknownName
from stickslip_ros.parameters import Parameters, load_values, parse_assignments
from stickslip_ros.parameters.typed import to_si_list

if TYPE_CHECKING:
    from stickslip_ros.runs.plotting import Look


def to_numbers(name: str, text: str, unit: str = '') -> list[float]:
    """Return the quantities of a list with commas, in an SI unit; refuse what is none."""
    return to_si_list(name, text.split(','), unit)


def chosen_parameters(arguments: argparse.Namespace) -> Parameters:
    """Return the parameters that a command line asks for; refuse a name or a value."""
    return Parameters().updated(chosen_values(arguments))


def chosen_values(arguments: argparse.Namespace) -> dict[str, object]:
    """Return the parameters that a command line names, whether or not they are the defaults."""
    values = {
        name: value for path in arguments.params for name, value in load_values(path).items()
    }
    named = {
        name: value for name, value in vars(arguments).items() if '.' in name and value is not None
    }
    return {**values, **parse_assignments(arguments.assignments), **named}


def chosen_look(arguments: argparse.Namespace) -> 'Look':
    """Return how the figures look that a command line asks for; refuse what is no look."""
    from stickslip_ros.runs.plotting import WIDTH, look_of  # noqa: PLC0415 - takes long

    styles = {'': None, 'screen': None, 'paper': float(WIDTH.default)}
    if arguments.style not in styles:
        raise UnknownName('style', arguments.style, 'use screen or paper')
    width_m = arguments.width
    width_mm = styles[arguments.style] if width_m is None else 1e3 * width_m
    return look_of(width_mm, arguments.font_size)
