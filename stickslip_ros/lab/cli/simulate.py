# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip simulate``, ``sweep`` and ``zero-amplitude``: runs without ROS."""

import argparse
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import RecordingError, StickSlipError, WrongKind
from stickslip_ros.files import RUN_ENDINGS, prepare_output
from stickslip_ros.lab.cli.chosen import asked_output, chosen_draws, chosen_for, chosen_parameters
from stickslip_ros.lab.cli.printing import Answer
from stickslip_ros.lab.measurements.run_result import SawtoothRun
from stickslip_ros.lab.measurements.sweep_table import (
    CSV,
    PARQUET,
    STEP_BACK,
    check_table_path,
    write_table,
)
from stickslip_ros.lab.runs.bands import BAND_DRAWS, LEVELS, band_of, bands_over
from stickslip_ros.lab.runs.courses import Course
from stickslip_ros.lab.runs.journal import Journal
from stickslip_ros.lab.runs.replay import read_drive_input
from stickslip_ros.lab.runs.sawtooth_run import drive_course, simulate
from stickslip_ros.lab.runs.sweep import (
    Sweep,
    parse_axis,
    parse_floats,
    parse_varied,
    run_sweep,
    stop_rule,
)
from stickslip_ros.lab.runs.sweep_parts import parts_for, run_parts
from stickslip_ros.lab.runs.zero_amplitude import zero_amplitude
from stickslip_ros.parameters import AMPLITUDE_SPEC, FREQUENCY_SPEC, Parameters, spec_of
from stickslip_ros.progress import shown_progress
from stickslip_ros.sections import Section, as_json, si_row
from stickslip_ros.units import NM, display_unit, unit_of

_SLOW_DRAWS = 20  # stands for a band of the 0-amplitude, with 60 runs each
_BANDS = 'force_mean_n', 'force_net_n', 'step_length_m'
"""Numbers of a run with bands."""


def simulate_verb(arguments: argparse.Namespace) -> Answer:
    """Run the stand; record it if asked."""
    parameters, waveform = chosen_parameters(arguments), arguments.waveform
    if arguments.both_ways and (waveform is not None or (arguments.frequency_hz or 0.0) < 0.0):
        wave, what = str(waveform or arguments.frequency_hz), 'a saw-tooth of a frequency above 0'
        raise WrongKind('wave of --both-ways', wave, what, 'change it, or leave --both-ways out')
    if waveform is not None:
        waveform = _cycle(waveform, parameters)
    if arguments.output:
        prepare_output(arguments.output, is_new=True, endings=RUN_ENDINGS)
    given = {**chosen_for(simulate, arguments), 'waveform': waveform}
    file = arguments.output or False
    run = simulate(parameters, **given, record=file, progress=not arguments.json)
    result = run.result
    bands = list[Section]()
    if draws := chosen_draws(arguments, BAND_DRAWS):
        if arguments.waveform is not None:
            what, hint = 'a saw-tooth, which --draws needs', 'give --amplitude or --voltage'
            raise WrongKind('--waveform', str(arguments.waveform), what, hint)
        bands.append(_bands(draws, arguments, result.voltage_v, result.frequency_hz))
    content = as_json(result)
    if arguments.both_ways:
        given['frequency_hz'] = -result.frequency_hz
        back_m = -simulate(parameters, **given, record=False).result.step_length_m
        content[STEP_BACK] = back_m
        rows = (('forwards', result.step_length_m), ('backwards', back_m))
        bands.append(Section('step length both ways', [si_row(*row, '.4f', 'nm') for row in rows]))
    held = 'the runner is fixed to the load cell, so its steps end; --no-load-cell frees it'
    note = [held] if parameters.load_cell.contact == 'attached' else []
    return Answer(content, [*result.sections(), *bands, *note])


def _cycle(path: Path, stand: Parameters) -> Array:
    """Return times, s, and voltages, V, of a table, which has no option that maps its columns."""
    try:
        cycle = read_drive_input(path, stand)
    except RecordingError as error:
        if '--map' not in str(error):
            raise
        hint = 'of stickslip import, and simulate its -o FILE'
        raise StickSlipError(f'{error} {hint}') from None
    return np.column_stack((cycle.time_s, cycle.voltage_v))


def _bands(
    draws: Sequence[Parameters], arguments: argparse.Namespace, voltage_v: float, hertz: float
) -> Section:
    """Return the bands of force and step length of the drive alone, under the same voltage."""

    def course(stand: Parameters) -> Course[dict[str, float]]:
        amplitude_m = voltage_v * stand.actuator.gain
        run = yield from drive_course(stand, amplitude_m, hertz, arguments.steps or 0)
        return {name: getattr(run, name) for name in _BANDS}

    with shown_progress('draws', quiet=arguments.json) as progress:
        found = bands_over(draws, course, progress=progress)
    rows = []
    for each in (each for each in fields(SawtoothRun) if each.name in _BANDS):
        factor, unit = display_unit(unit_of(each.name))
        cells = (f'{factor * value:.4f}' for value in found[each.name].values())
        rows.append((each.metadata['words'], *cells, unit))
    title = f'{len(draws)} draws of {arguments.draws}, the drive alone'
    return Section(title, rows, ('', *LEVELS, 'unit'))


def sweep_verb(arguments: argparse.Namespace) -> Answer:
    """Run the drive at every combination of values, and write the table."""
    axes = parse_varied(arguments.vary)
    if arguments.preload is not None:
        axes.append(parse_axis('stand.preload', arguments.preload, spec_of('stand.preload')))
    sweep = Sweep(
        parameters=chosen_parameters(arguments),
        varied=tuple(axes),
        frequencies_hz=parse_floats('frequency', arguments.frequency, FREQUENCY_SPEC),
        amplitudes_m=parse_floats('amplitude', arguments.amplitude, AMPLITUDE_SPEC),
        **chosen_for(Sweep, arguments),
    )
    path = asked_output(arguments)
    is_table = path.name.endswith((CSV, PARQUET))
    is_folder = not is_table and (path.is_dir() or not path.suffix)
    return _parts(sweep, arguments) if is_folder else _table(sweep, arguments)


def _table(sweep: Sweep, arguments: argparse.Namespace) -> Answer:
    """Make all runs of a sweep, as one table."""
    path = arguments.output
    check_table_path(path)
    if arguments.part:
        hint = 'write -o NAME without an ending'
        raise WrongKind('output of --part', str(path), 'a folder of tables', hint)
    journal_path = path.with_name(f'{path.name}.journal')
    with (
        Journal(journal_path, sweep.digest(), sweep.total, fresh=arguments.fresh) as journal,
        shown_progress('runs', quiet=arguments.json, resumes=True) as progress,
    ):
        resumed = len(journal.rows)
        given = chosen_for(run_sweep, arguments)
        rows = run_sweep(sweep, **given, journal=journal, progress=progress)
        if draws := chosen_draws(arguments, BAND_DRAWS):
            stands = (replace(sweep, parameters=each) for each in draws)
            over_draws = [run_sweep(each, workers=arguments.workers or 0) for each in stands]
            for case, row in enumerate(rows):
                for name in _BANDS:
                    band = band_of([each[case][name] for each in over_draws])
                    row |= {f'{name}_{level}': value for level, value in band.items()}
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
        [Section('sweep', counts), f'stop    {rule}', f'table   {path}'],
    )


def _parts(sweep: Sweep, arguments: argparse.Namespace) -> Answer:
    """Make one part of a sweep, or all, as tables in a folder."""
    folder = arguments.output
    if arguments.draws is not None:
        what, hint = 'without --draws for a folder of tables', 'write a table, -o NAME.parquet'
        raise WrongKind('sweep', str(arguments.draws), what, hint)
    parts, numbers = parts_for(sweep, folder, arguments.part, fresh=arguments.fresh)
    unit = 'parts' if arguments.scheduler else 'runs'
    with shown_progress(unit, quiet=arguments.json, resumes=True) as progress:
        workers = arguments.workers or 0
        kept = run_parts(parts, numbers, workers, arguments.scheduler, progress)
    rule, made = stop_rule(sweep.steps), len(numbers) - kept
    counts = [
        ('runs', sum(len(parts.cases_of(number)) for number in numbers)),
        ('parts', f'{len(numbers)} of {parts.count}'),
        ('of these taken from the folder', kept),
    ]
    files = [str(folder / parts.path(number).name) for number in numbers]
    return Answer(
        {'folder': str(folder), 'stop_rule': rule, 'files': files, 'made': made},
        [Section('sweep', counts), f'stop    {rule}', f'tables  {folder}'],
    )


def zero_amplitude_verb(arguments: argparse.Namespace) -> Answer:
    """Find the amplitude below which a free runner makes no steps."""
    stand, given = chosen_parameters(arguments), chosen_for(zero_amplitude, arguments)
    result = zero_amplitude(stand, **given, progress=not arguments.json)
    tables = result.sections()
    if draws := chosen_draws(arguments, _SLOW_DRAWS):
        found = [zero_amplitude(each, **given) for each in draws]
        band = band_of([each.zero_amplitude_m for each in found])
        row = ("0-amplitude, Edeler's", *(f'{NM * value:.3f}' for value in band.values()), 'nm')
        tables.append(
            Section(f'{len(draws)} draws of {arguments.draws}', [row], ('', *LEVELS, ''))
        )
    return Answer(result, tables)
