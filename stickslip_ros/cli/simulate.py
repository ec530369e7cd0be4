"""
``stickslip simulate``, ``sweep`` and ``zero-amplitude``: runs without ROS.

The first runs the whole stand once, the second makes a table of every combination of values, the
third looks for one stroke; the last two do without sensors.

"""

import argparse
from collections.abc import Iterator

import numpy as np

from stickslip_ros.cli.chosen import chosen_parameters
from stickslip_ros.cli.printing import Answer, number, table
from stickslip_ros.errors import WrongKind
from stickslip_ros.files import prepare_output
from stickslip_ros.parameters import AMPLITUDE, FREQUENCY, spec_of
from stickslip_ros.progress import shown_progress
from stickslip_ros.runs.journal import Journal
from stickslip_ros.runs.replay import read_drive_input
from stickslip_ros.runs.sawtooth_run import SawtoothRun, simulate
from stickslip_ros.runs.sweep import (
    Sweep,
    parse_axis,
    parse_floats,
    parse_varied,
    run_sweep,
    stop_rule,
)
from stickslip_ros.runs.sweep_table import check_table_path, write_table
from stickslip_ros.runs.zero_amplitude import zero_amplitude
from stickslip_ros.units import NM


def simulate_verb(arguments: argparse.Namespace) -> Answer:
    """Run the stand, record it if asked."""
    parameters, waveform = chosen_parameters(arguments), arguments.waveform
    if waveform is not None:
        given = read_drive_input(waveform, parameters)
        waveform = np.column_stack((given.time_s, given.voltage_v))
    if arguments.output:
        if arguments.output.suffix.lower() not in {'', '.mcap'}:
            hint = 'write .mcap, then make a table of it with stickslip export'
            raise WrongKind('--output', str(arguments.output), 'an .mcap file', hint)
        prepare_output(arguments.output, is_new=True)
    run = simulate(
        parameters,
        amplitude_m=arguments.amplitude,
        voltage_v=arguments.voltage,
        waveform=waveform,
        frequency_hz=arguments.frequency,
        steps=arguments.steps,
        path=arguments.output,
        is_recorded=arguments.output is not None,
        progress=not arguments.json,
    )
    result = run.result
    title = (
        f'preload {result.preload_n:g} N, stroke {result.amplitude_m * NM:.4g} nm '
        f'({result.voltage_v:.4g} V), {result.frequency_hz:g} Hz'
    )
    held = 'the runner is fixed to the load cell: its steps end; --no-load-cell lets it go'
    note = [held] if parameters.load_cell.contact == 'attached' else []
    return Answer(result, [table(title, _rows(result)), *note])


def _rows(result: SawtoothRun) -> Iterator[tuple[object, ...]]:
    yield number('generated force, mean of the last cycle', result.force_mean_n, '.4f', 'mN')
    yield number('the same without elastic following', result.force_net_n, '.4f', 'mN')
    yield number('generated force, start of the ramp', result.force_ramp_start_n, '.4f', 'mN')
    yield number('step length, last 10 cycles', result.step_length_m, '.4f', 'nm')
    yield number('standard deviation of a step', result.step_scatter_m, '.4f', 'nm')
    yield number('correlation length of steps', result.step_correlation_m, '.4f', 'nm')
    yield 'steps', result.steps, 'steady' if result.steady else 'NOT steady'
    yield number('simulated time', result.simulated_s, '.4f', 's')
    yield number('wall time', result.wall_s, '.4f', 's')
    yield number('real-time factor', result.real_time_factor, '.1f')
    yield number('energy residual / work of the feet', result.energy_residual, '.2e')
    if result.recording:
        yield 'recording', result.recording


def sweep_verb(arguments: argparse.Namespace) -> Answer:
    """Run the drive at every combination of values, and write the table."""
    path = arguments.output
    check_table_path(path)
    parameters = chosen_parameters(arguments)
    axes = parse_varied(arguments.vary)
    if arguments.preload is not None:
        axes.append(parse_axis('stand.preload', arguments.preload, spec_of('stand.preload')))
    sweep = Sweep(
        parameters=parameters,
        varied=tuple(axes),
        frequencies_hz=parse_floats('frequency', arguments.frequency, FREQUENCY),
        amplitudes_m=parse_floats('amplitude', arguments.amplitude, AMPLITUDE),
        steps=arguments.steps,
    )
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
        write_table(rows, path, parameters)
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


def zero_amplitude_verb(arguments: argparse.Namespace) -> Answer:
    """Find the amplitude below which a free runner makes no steps."""
    result = zero_amplitude(
        chosen_parameters(arguments),
        arguments.frequency,
        steps=arguments.steps,
        progress=not arguments.json,
    )
    title = f'preload {result.preload_n:g} N, {result.frequency_hz:g} Hz, {result.steps} steps'
    fitted = f'{result.fit_from_m * NM:.2f} to {result.fit_to_m * NM:.2f}'
    rows = [
        number("0-amplitude, Edeler's extrapolation", result.zero_amplitude_m, '.3f', 'nm'),
        number('slope of step length', result.slope, '.4f'),
        (f'line fitted at {result.fit_points} amplitudes', fitted, 'nm'),
        number('rms of what the line misses', result.fit_rms_m, '.4f', 'nm'),
        number('0-amplitude, first net step', result.zero_amplitude_direct_m, '.3f', 'nm'),
        number('u_max of a lower contact', result.max_presliding_lower_m, '.3f', 'nm'),
    ]
    return Answer(result, [table(title, rows)])
