"""
``stickslip sweep`` and ``stickslip zero-amplitude``: many runs, without ROS and sensors.

The one makes a table of every combination of values, the other looks for one stroke.

"""

import argparse
from collections.abc import Iterator

from stickslip_ros.cli.chosen import chosen_parameters
from stickslip_ros.cli.printing import Answer, number, table
from stickslip_ros.parameters import AMPLITUDE, FREQUENCY, spec_of
from stickslip_ros.progress import shown_progress
from stickslip_ros.runs.journal import Journal
from stickslip_ros.runs.sweep import (
    Sweep,
    parse_axis,
    parse_floats,
    parse_varied,
    run_sweep,
    stop_rule,
)
from stickslip_ros.runs.sweep_table import check_table_path, write_table
from stickslip_ros.runs.zero_amplitude import (
    ZeroAmplitude,
    zero_amplitude,
)
from stickslip_ros.units import NM


def sweep_verb(arguments: argparse.Namespace) -> Answer:
    """Sweep and write the table."""
    path = arguments.output
    check_table_path(path)
    sweep = chosen_sweep(arguments)
    journal_path = path.with_name(f'{path.name}.journal')
    with (
        Journal(journal_path, sweep.identity(), fresh=arguments.fresh) as journal,
        shown_progress('runs', quiet=arguments.json, resumes=True) as progress,
    ):
        resumed = len(journal.rows)
        rows = run_sweep(
            sweep,
            journal=journal,
            workers=arguments.workers,
            scheduler=arguments.scheduler,
            progress=progress,
        )
        write_table(rows, path, sweep.parameters)
        journal.remove()
    rule = stop_rule(sweep.steps)
    counts = [
        ('runs', len(rows)),
        ('of these taken from the journal', resumed),
        ('steady', sum(bool(row['steady']) for row in rows)),
        ('largest energy residual', f'{max(abs(float(r["energy_residual"])) for r in rows):.2e}'),
    ]
    return Answer(
        {'file': str(path), 'stop_rule': rule, 'rows': rows},
        [table('sweep', counts), f'stop    {rule}', f'table   {path}'],
    )


def chosen_sweep(arguments: argparse.Namespace) -> Sweep:
    """
    Return the sweep that a command line asks for.

    Raises
    ------
    StickSlipError
        If a name, a value or a combination is refused.

    """
    parameters = chosen_parameters(arguments)
    axes = parse_varied(arguments.vary)
    if arguments.preload is not None:
        axes.append(parse_axis('stand.preload', arguments.preload, spec_of('stand.preload')))
    return Sweep(
        parameters=parameters,
        varied=tuple(axes),
        frequencies_hz=parse_floats('frequency', arguments.frequency, FREQUENCY),
        amplitudes_m=parse_floats('amplitude', arguments.amplitude, AMPLITUDE),
        steps=arguments.steps,
    )


def zero_amplitude_verb(arguments: argparse.Namespace) -> Answer:
    """Find the 0-amplitude."""
    result = zero_amplitude(
        chosen_parameters(arguments),
        arguments.frequency,
        steps=arguments.steps,
        progress=not arguments.json,
    )
    title = f'preload {result.preload_n:g} N, {result.frequency_hz:g} Hz, {result.steps} steps'
    return Answer(result, [table(title, _zero_rows(result))])


def _zero_rows(result: ZeroAmplitude) -> Iterator[tuple[str, str, str]]:
    fitted = f'{result.fit_from_m * NM:.2f} to {result.fit_to_m * NM:.2f}'
    yield number("0-amplitude, Edeler's extrapolation", result.zero_amplitude_m, '.3f', 'nm')
    yield number('slope of step length', result.slope, '.4f')
    yield f'line fitted at {result.fit_points} amplitudes', fitted, 'nm'
    yield number('rms of what the line misses', result.fit_rms_m, '.4f', 'nm')
    yield number('0-amplitude, first net step', result.zero_amplitude_direct_m, '.3f', 'nm')
    yield number('u_max of a lower contact', result.max_presliding_lower_m, '.3f', 'nm')
