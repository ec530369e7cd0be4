"""``stickslip bode``: the frequency response of the stuck drive."""

import argparse
from collections.abc import Iterator

import numpy as np

from stickslip_ros.files import prepare_output
from stickslip_ros.lab.cli.chosen import chosen_look, chosen_parameters
from stickslip_ros.lab.cli.printing import Answer, number, table
from stickslip_ros.lab.linear.bode import BAND
from stickslip_ros.lab.linear.linearise import linearise
from stickslip_ros.lab.linear.swept_sine import MeasuredResponse, bode_rows, measure_response
from stickslip_ros.lab.runs.plotting import check_picture, save_figure
from stickslip_ros.lab.runs.sweep import parse_floats
from stickslip_ros.lab.runs.sweep_table import check_table_path, write_table
from stickslip_ros.parameters import FREQUENCY_SPEC
from stickslip_ros.units import NM

POINTS = 25  # frequencies that are measured by default
BELOW = 0.9
"""Measurement and closed form are compared below this share of the resonance."""


def bode_verb(arguments: argparse.Namespace) -> Answer:
    """Measure the frequency response, write its table and draw it if asked."""
    parameters = chosen_parameters(arguments)
    look = chosen_look(arguments)
    if arguments.output:
        check_table_path(arguments.output)
    if arguments.figure:
        check_picture(arguments.figure)
        prepare_output(arguments.figure)
    if arguments.frequency is None:
        resonance_hz = linearise(parameters, arguments.at_voltage).resonance_hz
        frequencies = resonance_hz * np.geomspace(*BAND, POINTS)
    else:
        frequencies = np.array(parse_floats('--frequency', arguments.frequency, FREQUENCY_SPEC))
    measured = measure_response(
        parameters,
        frequencies,
        arguments.at_voltage,
        workers=arguments.workers,
        progress=not arguments.json,
    )
    rows = bode_rows(measured)
    if arguments.output:
        write_table(rows, arguments.output, parameters)
    if arguments.figure:
        save_figure(measured.plot(**look), arguments.figure)
    linear = measured.linear
    content = {
        'at_voltage_v': linear.at_voltage_v,
        'contact_n_per_m': linear.contact_n_per_m,
        'cell_n_per_m': linear.cell_n_per_m,
        'resonance_hz': linear.resonance_hz,
        'softening': measured.softening,
        'largest_deviation': largest_deviation(measured),
        'rows': rows,
    }
    title = f'stuck at {linear.at_voltage_v:g} V, preload {parameters.stand.preload:g} N'
    files = [str(path) for path in (arguments.output, arguments.figure) if path]
    return Answer(content, [table(title, _rows(measured)), *files])


def largest_deviation(measured: MeasuredResponse) -> float | None:
    """Return the largest relative deviation from the closed form below the resonance, if any."""
    below = measured.frequency_hz <= BELOW * measured.linear.resonance_hz
    found = np.abs(np.array(measured.deviation)[:, below])
    return float(found.max()) if found.size else None


def _rows(measured: MeasuredResponse) -> Iterator[tuple[str, ...]]:
    linear, frequencies = measured.linear, measured.frequency_hz
    per_v, per_n = (abs(column[0]) for column in linear.response(frequencies.min()))
    yield number('stiffness of the contacts', linear.contact_n_per_m, '.4f', 'N/um')
    yield number('stiffness of what the runner touches', linear.cell_n_per_m, '.4f', 'N/um')
    yield 'resonance of the runner', f'{linear.resonance_hz:.1f}', 'Hz'
    lowest = f'at {frequencies.min():.4g} Hz'
    yield f'position per voltage {lowest}', f'{per_v * NM:.5f}', 'nm/V'
    yield f'position per load {lowest}', f'{per_n * NM:.5f}', 'nm/N'
    yield number('stiffness lost by partial slip', measured.softening, '.2e')
    deviation = largest_deviation(measured)
    if deviation is not None:
        yield f'largest deviation up to {BELOW:g} of the resonance', f'{deviation:.2%}', ''
