"""``stickslip simulate``: a saw-tooth run of the whole stand, without ROS."""

import argparse
from typing import Any

from stickslip_ros.cli.common import (
    add_json,
    add_parameters,
    chosen_parameters,
    print_json,
    print_table,
    to_path,
)
from stickslip_ros.cli.progress import shown_progress
from stickslip_ros.files import make_room
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.sawtooth_run import SawtoothRun, run_sawtooth, voltage_for

DEFAULT_FREQUENCY_HZ = 1000.0


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'simulate',
        description='Drive the virtual stand with a saw-tooth, without ROS. Generated force is '
        'k x, the force in the load-cell spring.',
    )
    parser.add_argument('--preload', type=float, metavar='N', help='sets stand.preload, N')
    stroke = parser.add_mutually_exclusive_group(required=True)
    stroke.add_argument('--amplitude', type=float, metavar='M', help='stroke of the feet, m')
    stroke.add_argument('--voltage', type=float, metavar='V', help='saw-tooth voltage, V')
    parser.add_argument(
        '--frequency',
        type=float,
        default=DEFAULT_FREQUENCY_HZ,
        metavar='HZ',
        help='steps per second; negative ones go backwards (default: %(default)g)',
    )
    parser.add_argument(
        '--steps',
        type=int,
        default=0,
        metavar='N',
        help='number of steps (default: until the force is steady, at most 5000)',
    )
    parser.add_argument(
        '--free', action='store_true', help='no load cell: sets load_cell.contact=absent'
    )
    parser.add_argument(
        '-o', '--output', type=to_path, metavar='FILE', help='record the run as MCAP'
    )
    add_parameters(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Simulate and print."""
    parameters = _with_shortcuts(chosen_parameters(arguments), arguments)
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
    if arguments.json:
        print_json(result)
    else:
        _print(result)
    return 0


def _with_shortcuts(parameters: Parameters, arguments: argparse.Namespace) -> Parameters:
    values: dict[str, object] = {}
    if arguments.preload is not None:
        values['stand.preload'] = arguments.preload
    if arguments.free:
        values['load_cell.contact'] = 'absent'
    return parameters.updated(values)


def _print(result: SawtoothRun) -> None:
    state = 'steady' if result.steady else 'NOT steady'
    rows = [
        ('generated force, mean of the last cycle', f'{result.force_mean_n * 1e3:.4f}', 'mN'),
        ('generated force, start of the ramp', f'{result.force_ramp_start_n * 1e3:.4f}', 'mN'),
        ('step length, last 10 cycles', f'{result.step_length_m * 1e9:.4f}', 'nm'),
        ('steps', str(result.steps), state),
        ('simulated time', f'{result.simulated_s:.4f}', 's'),
        ('wall time', f'{result.wall_s:.4f}', 's'),
        ('real-time factor', f'{result.real_time_factor:.1f}', ''),
        ('energy residual / work of the feet', f'{result.energy_residual:.2e}', ''),
    ]
    if result.recording:
        rows.append(('recording', result.recording, ''))
    print_table(
        f'preload {result.preload_n:g} N, stroke {result.amplitude_m * 1e9:.4g} nm '
        f'({result.voltage_v:.4g} V), {result.frequency_hz:g} Hz',
        rows,
    )
