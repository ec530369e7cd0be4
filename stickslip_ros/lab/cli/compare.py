# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip compare``: compare sweeps, runs and experiments with each other or the model."""

import argparse
import shlex

from stickslip_ros.errors import OutOfRange
from stickslip_ros.files import PAGE_ENDINGS, prepare_output
from stickslip_ros.lab.cli.chosen import chosen_draws, chosen_for, chosen_look, chosen_parameters
from stickslip_ros.lab.cli.experiment import shown_tables
from stickslip_ros.lab.cli.printing import Answer
from stickslip_ros.lab.comparison.by_amplitude import MODEL
from stickslip_ros.lab.comparison.compare import CompareOptions, compare
from stickslip_ros.lab.runs.bands import BAND_DRAWS

SECONDS_MAX = 1e12


def compare_verb(arguments: argparse.Namespace) -> Answer:
    """Compare A with B; write report and figure if asked."""
    files, b = arguments.files[:1], None
    if len(arguments.files) > 1:
        *files, b = arguments.files
    _check(arguments, b)
    look = chosen_look(arguments)
    comparison = compare(
        files,
        chosen_parameters(arguments) if b == MODEL else b,
        options=CompareOptions(**chosen_for(CompareOptions, arguments)),
        draws=chosen_draws(arguments, BAND_DRAWS),
        report=shown_tables(arguments),
        progress=not arguments.json,
    )
    if arguments.output is not None:
        comparison.save(arguments.output, shlex.join(['stickslip', *arguments.words]))
    if arguments.figure is not None:
        from stickslip_ros.lab.figures.plotting import save_figure  # noqa: PLC0415 - takes long

        save_figure(comparison.plot(**look), arguments.figure)
    files = {'report': arguments.output, 'figure': arguments.figure}
    written = (f'{name} {path}' for name, path in files.items() if path is not None)
    return Answer(comparison.to_json(), [*comparison.sections(), *written])


def _check(arguments: argparse.Namespace, b: str | None) -> None:
    """Refuse options without effect, and outputs that would fail after the work."""
    report, shift_s = arguments.output, arguments.shift_s
    if MODEL in map(str, arguments.files[:-1]):
        hint = f'write it last: stickslip compare A {MODEL}'
        raise OutOfRange('A', MODEL, '', 'allowed as B only', hint)
    if report is not None:
        prepare_output(report, endings=PAGE_ENDINGS)
    if shift_s is not None and not abs(shift_s) <= SECONDS_MAX:
        limit = f'not within {SECONDS_MAX:g} s'
        raise OutOfRange('shift', shift_s, 's', limit, 'give the lag of B in seconds')
    given = {
        '--set': ' '.join(arguments.assignments),
        '--params': ' '.join(map(str, arguments.params)),
        '--frequency': arguments.frequency_hz,
        '--steps': arguments.steps,
        '--draws': arguments.draws,
    }
    for name, value in given.items():
        if value and b != MODEL:
            hint = f'write the word {MODEL} for B, or leave it out'
            raise OutOfRange(name, str(value), '', 'without effect on files', hint)
    if report is not None:
        prepare_output(report)
