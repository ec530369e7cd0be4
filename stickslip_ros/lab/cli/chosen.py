# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Parameters, draws and figure styles from a command line."""

import argparse
import sys
from collections.abc import Callable
from inspect import signature
from pathlib import Path
from typing import Any

from stickslip_ros.errors import OutOfRange, StickSlipError, printable, quoted
from stickslip_ros.files import prepare_output
from stickslip_ros.parameters import Parameters, load_ranges, load_values, parse_assignments
from stickslip_ros.parameters.typed import to_si_list


def to_numbers(name: str, text: str, unit: str = '') -> list[float]:
    """Return quantities separated by commas, in an SI unit."""
    return to_si_list(name, text.split(','), unit)


def chosen_parameters(arguments: argparse.Namespace) -> Parameters:
    """Return the parameters of a command line."""
    stand = Parameters()
    if getattr(arguments, 'draws', None):
        from stickslip_ros.lab.fitting.result import read_stand  # noqa: PLC0415 - takes long

        stand = read_stand(arguments.draws)
    ranges = load_ranges(*arguments.params)
    return stand.updated(chosen_values(arguments)).with_ranges(ranges, _typed(arguments))


def chosen_draws(arguments: argparse.Namespace, count: int) -> list[Parameters]:
    """Return draws of the fit of ``--draws``, none without it; refuse a value that they vary."""
    if arguments.draws is None:
        return []
    from stickslip_ros.lab.fitting.result import read_draws, read_note  # noqa: PLC0415 - takes long

    changes, drawn = chosen_values(arguments), read_draws(arguments.draws, count)
    if fixed := [name for name in changes if len({each.value(name) for each in drawn}) > 1]:
        why = f'{fixed[0]} is given, but varies in the draws of {quoted(arguments.draws)}'
        hint = 'which holds the fitted stand: leave out --params, --set or --draws'
        raise StickSlipError(f'{why}, {hint}')
    draws = [each.updated(changes) for each in drawn]
    if note := read_note(arguments.draws):
        print(printable(f'Note: {note}.'), file=sys.stderr)
    return draws


def chosen_values(arguments: argparse.Namespace) -> dict[str, object]:
    """Return the parameters given on a command line, defaults included."""
    values = {
        name: value for path in arguments.params for name, value in load_values(path).items()
    }
    return {**values, **_typed(arguments)}


def _typed(arguments: argparse.Namespace) -> dict[str, object]:
    """Return the parameters given by options other than files."""
    named = {
        name: value for name, value in vars(arguments).items() if '.' in name and value is not None
    }
    return {**parse_assignments(arguments.assignments), **named}


def chosen_for(owner: Callable[..., Any], arguments: argparse.Namespace) -> dict[str, Any]:
    """Return the arguments of a function, or fields of a record, given on a command line."""
    typed = {name: getattr(arguments, name, None) for name in signature(owner).parameters}
    return {name: value for name, value in typed.items() if value is not None}


def asked_output(arguments: argparse.Namespace) -> Path:
    """Return the file to write, which is missed after the checks of all other options."""
    if arguments.output is None:
        raise StickSlipError(f'-o FILE is missing; stickslip {arguments.verb.name} writes a file')
    return Path(arguments.output)


def chosen_look(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return style and width of the figures; refuse an unknown style or kind of picture."""
    width_m, figure = arguments.width, getattr(arguments, 'figure', None)
    if width_m is not None and width_m >= 1.0:
        hint = f'write {width_m:g}mm for millimetres'
        raise OutOfRange('--width', width_m, 'm', 'wider than a page', hint)
    look = {'style': arguments.style, 'width_mm': None if width_m is None else 1e3 * width_m}
    if any(each is not None for each in (width_m, figure)) or arguments.style:
        # a slow import
        from stickslip_ros.lab.figures.plotting import check_picture, style_of  # noqa: PLC0415

        style_of(**look)
        if figure is not None:
            check_picture(figure)
            prepare_output(figure)
    return look
