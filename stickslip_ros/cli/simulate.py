"""``stickslip simulate``: a saw-tooth run of the whole stand, without ROS."""

import argparse
from collections.abc import Iterator

import numpy as np
from rich.table import Table

from stickslip_ros.cli.chosen import chosen_parameters
from stickslip_ros.cli.printing import Answer, number, table
from stickslip_ros.errors import WrongKind
from stickslip_ros.files import make_room
from stickslip_ros.runs.replay import read_drive_input
from stickslip_ros.runs.sawtooth_run import SawtoothRun, simulate
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
        make_room(arguments.output, is_new=True)
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
    return Answer(run.result, [_table(run.result)])


def _table(result: SawtoothRun) -> Table:
    title = (
        f'preload {result.preload_n:g} N, stroke {result.amplitude_m * NM:.4g} nm '
        f'({result.voltage_v:.4g} V), {result.frequency_hz:g} Hz'
    )
    return table(title, _rows(result))


def _rows(result: SawtoothRun) -> Iterator[tuple[object, ...]]:
    yield number('generated force, mean of the last cycle', result.force_mean_n, '.4f', 'mN')
    yield number('the same without elastic following', result.force_net_n, '.4f', 'mN')
    yield number('generated force, start of the ramp', result.force_ramp_start_n, '.4f', 'mN')
    yield number('step length, last 10 cycles', result.step_length_m, '.4f', 'nm')
    yield 'steps', result.steps, 'steady' if result.steady else 'NOT steady'
    yield number('simulated time', result.simulated_s, '.4f', 's')
    yield number('wall time', result.wall_s, '.4f', 's')
    yield number('real-time factor', result.real_time_factor, '.1f')
    yield number('energy residual / work of the feet', result.energy_residual, '.2e')
    if result.recording:
        yield 'recording', result.recording
