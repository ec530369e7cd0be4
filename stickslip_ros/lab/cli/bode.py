# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip bode``: the frequency response of the stuck drive."""

import argparse

import numpy as np

from stickslip_ros.lab.cli.chosen import chosen_for, chosen_look, chosen_parameters
from stickslip_ros.lab.cli.printing import Answer
from stickslip_ros.lab.figures.plotting import save_figure
from stickslip_ros.lab.linear.bode import BAND
from stickslip_ros.lab.linear.linearise import linearise
from stickslip_ros.lab.linear.swept_sine import bode_rows, measure_response
from stickslip_ros.lab.measurements.sweep_table import check_table_path, write_table
from stickslip_ros.lab.runs.sweep import parse_floats
from stickslip_ros.parameters import FREQUENCY_SPEC

POINTS = 25  # frequencies by default


def bode_verb(arguments: argparse.Namespace) -> Answer:
    """Measure the frequency response; write its table and draw it if asked."""
    parameters = chosen_parameters(arguments)
    look = chosen_look(arguments)
    if arguments.output:
        check_table_path(arguments.output)
    if arguments.frequency is None:
        resonance_hz = linearise(parameters, arguments.at_voltage_v).resonance_hz
        frequencies = resonance_hz * np.geomspace(*BAND, POINTS)
    else:
        frequencies = np.array(parse_floats('--frequency', arguments.frequency, FREQUENCY_SPEC))
    given = {**chosen_for(measure_response, arguments), 'frequency_hz': frequencies}
    measured = measure_response(parameters, **given, progress=not arguments.json)
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
        'largest_deviation': measured.largest_deviation,
        'rows': rows,
    }
    files = {'table': arguments.output, 'figure': arguments.figure}
    written = (f'{name} {path}' for name, path in files.items() if path)
    return Answer(content, [*measured.sections(), *written])
