"""``stickslip simulate``: a saw-tooth run of the whole stand, without ROS."""

import argparse
from collections.abc import Callable, Iterator

import numpy as np
from rich.table import Table

from stickslip_ros.cli.chosen import chosen_parameters
from stickslip_ros.cli.printing import Answer, number, table
from stickslip_ros.files import make_room
from stickslip_ros.parameters import Parameters
from stickslip_ros.progress import shown_progress
from stickslip_ros.study.replay import read_drive_input
from stickslip_ros.study.sawtooth_run import (
    SAWTOOTH_HZ,
    SawtoothRun,
    run_sawtooth,
    run_waveform,
    voltage_for,
)
from stickslip_ros.units import NM

Task = Callable[..., SawtoothRun]
"""A run that lacks the number of its steps, its recording and its progress."""


def simulate_verb(arguments: argparse.Namespace) -> Answer:
    """Run the stand, record it if asked."""
    parameters = chosen_parameters(arguments)
    run = _sawtooth if arguments.waveform is None else _waveform
    task = run(arguments, parameters)
    if arguments.output:
        make_room(arguments.output, is_new=True)
    with shown_progress('steps', quiet=arguments.json) as progress:
        result = task(
            steps=arguments.steps,
            path=arguments.output,
            progress=lambda done, _: progress(done, arguments.steps),
        )
    return Answer(result, [_table(result)])


def _sawtooth(arguments: argparse.Namespace, parameters: Parameters) -> Task:
    voltage_v, frequency_hz = arguments.voltage, arguments.frequency
    if voltage_v is None:
        voltage_v = voltage_for(parameters, arguments.amplitude)
    if frequency_hz is None:
        frequency_hz = SAWTOOTH_HZ
    return lambda **how: run_sawtooth(parameters, voltage_v, frequency_hz, **how)


def _waveform(arguments: argparse.Namespace, parameters: Parameters) -> Task:
    given = read_drive_input(arguments.waveform, parameters)
    rows = np.column_stack((given.time_s, given.voltage_v))
    return lambda **how: run_waveform(parameters, rows, arguments.frequency, **how)


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
