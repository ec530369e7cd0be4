"""``stickslip zero-amplitude``: the stroke below which a free runner does not get ahead."""

import argparse
from typing import Any

from stickslip_ros.cli.common import (
    add_json,
    add_parameters,
    chosen_parameters,
    print_json,
    print_table,
)
from stickslip_ros.cli.progress import shown_progress
from stickslip_ros.study.zero_amplitude import (
    FIT_POINTS,
    STEP_MIN_M,
    STEPS,
    ZeroAmplitude,
    zero_amplitude,
)

DEFAULT_FREQUENCY_HZ = 200.0


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'zero-amplitude',
        description="Find the 0-amplitude of a free runner in two ways. Edeler's: a straight "
        f'line through the step lengths at {FIT_POINTS} amplitudes, from half-way between the '
        'first that steps and the full stroke up to the full stroke, extrapolated to zero. '
        f'Directly: the smallest amplitude with a net step above {STEP_MIN_M:g} m. The load '
        'cell is taken away, whatever load_cell.contact says.',
    )
    parser.add_argument('--preload', type=float, metavar='N', help='sets stand.preload, N')
    parser.add_argument(
        '--frequency',
        type=float,
        default=DEFAULT_FREQUENCY_HZ,
        metavar='HZ',
        help='steps per second (default: %(default)g)',
    )
    parser.add_argument(
        '--smooth', action='store_true', help='bare spheres: sets contact.profile=smooth'
    )
    parser.add_argument(
        '--steps',
        type=int,
        default=STEPS,
        metavar='N',
        help='steps of each run (default: %(default)d)',
    )
    add_parameters(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Find and print."""
    values: dict[str, object] = {}
    if arguments.preload is not None:
        values['stand.preload'] = arguments.preload
    if arguments.smooth:
        values['contact.profile'] = 'smooth'
    parameters = chosen_parameters(arguments).updated(values)
    with shown_progress('runs', quiet=arguments.json) as progress:
        result = zero_amplitude(
            parameters, arguments.frequency, steps=arguments.steps, progress=progress
        )
    if arguments.json:
        print_json(result)
    else:
        _print(result)
    return 0


def _print(result: ZeroAmplitude) -> None:
    fitted = f'{result.fit_from_m * 1e9:.2f} to {result.fit_to_m * 1e9:.2f}'
    rows = [
        ("0-amplitude, Edeler's extrapolation", f'{result.zero_amplitude_m * 1e9:.3f}', 'nm'),
        ('slope of step length', f'{result.slope:.4f}', ''),
        (f'line fitted at {result.fit_points} amplitudes', fitted, 'nm'),
        ('rms of what the line misses', f'{result.fit_rms_m * 1e9:.4f}', 'nm'),
        ('0-amplitude, first net step', f'{result.zero_amplitude_direct_m * 1e9:.3f}', 'nm'),
        ('u_max of a lower contact', f'{result.max_presliding_lower_m * 1e9:.3f}', 'nm'),
    ]
    print_table(
        f'preload {result.preload_n:g} N, {result.frequency_hz:g} Hz, {result.steps} steps', rows
    )
