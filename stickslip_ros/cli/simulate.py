"""``stickslip simulate``: a saw-tooth run of the whole stand, without ROS."""

import argparse
from collections.abc import Iterator

from rich.table import Table

from stickslip_ros.cli.options import (
    FREE,
    PARAMETERS,
    PRELOAD,
    chosen_parameters,
    either,
    option,
    to_path,
    verb,
)
from stickslip_ros.cli.printing import Answer, number, table
from stickslip_ros.files import make_room
from stickslip_ros.progress import shown_progress
from stickslip_ros.study.sawtooth_run import SawtoothRun, run_sawtooth, voltage_for
from stickslip_ros.units import NM


@verb(
    'Drive the virtual stand with a saw-tooth, without ROS. Generated force is k x, the force in '
    'the load-cell spring.',
    PRELOAD,
    either(
        option('--amplitude', 'stroke of the feet, m', float, 'M'),
        option('--voltage', 'saw-tooth voltage, V', float, 'V'),
        required=True,
    ),
    option(
        '--frequency', 'steps per second; negative ones go backwards', float, 'HZ', default=1000.0
    ),
    option(
        '--steps',
        'number of steps (default: until the force is steady, at most 5000)',
        int,
        default=0,
    ),
    FREE,
    option('-o --output', 'record the run as MCAP', to_path),
    *PARAMETERS,
)
def simulate_verb(arguments: argparse.Namespace) -> Answer:
    """Run the stand, record it if asked."""
    parameters = chosen_parameters(arguments)
    voltage_v = arguments.voltage
    if voltage_v is None:
        voltage_v = voltage_for(parameters, arguments.amplitude)
    if arguments.output:
        make_room(arguments.output, is_new=True)
    with shown_progress('steps', quiet=arguments.json) as progress:
        result = run_sawtooth(
            parameters,
            voltage_v,
            arguments.frequency,
            arguments.steps,
            path=arguments.output,
            progress=lambda done, _: progress(done, arguments.steps),
        )
    return Answer(result, [_table(result)])


def _table(result: SawtoothRun) -> Table:
    title = (
        f'preload {result.preload_n:g} N, stroke {result.amplitude_m * NM:.4g} nm '
        f'({result.voltage_v:.4g} V), {result.frequency_hz:g} Hz'
    )
    return table(title, _rows(result))


def _rows(result: SawtoothRun) -> Iterator[tuple[object, ...]]:
    yield number('generated force, mean of the last cycle', result.force_mean_n, '.4f', 'mN')
    yield number('generated force, start of the ramp', result.force_ramp_start_n, '.4f', 'mN')
    yield number('step length, last 10 cycles', result.step_length_m, '.4f', 'nm')
    yield 'steps', result.steps, 'steady' if result.steady else 'NOT steady'
    yield number('simulated time', result.simulated_s, '.4f', 's')
    yield number('wall time', result.wall_s, '.4f', 's')
    yield number('real-time factor', result.real_time_factor, '.1f')
    yield number('energy residual / work of the feet', result.energy_residual, '.2e')
    if result.recording:
        yield 'recording', result.recording
