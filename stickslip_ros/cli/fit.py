"""``stickslip fit``: parameters of the drive from measured forces, with error bars."""

import argparse
from collections.abc import Sequence
from typing import Any

import numpy as np

from stickslip_ros.cli.common import (
    add_json,
    add_parameters,
    add_workers,
    chosen_parameters,
    print_json,
    print_table,
    to_path,
)
from stickslip_ros.cli.progress import shown_progress
from stickslip_ros.errors import OutOfRange
from stickslip_ros.files import make_room
from stickslip_ros.parameters import Parameters, parse_assignments
from stickslip_ros.study.fitting.coverage import Coverage, coverage_of
from stickslip_ros.study.fitting.figure import draw_fit
from stickslip_ros.study.fitting.fit import STARTS, Fit, fit_drive
from stickslip_ros.study.fitting.free import FITTED_GROUPS, Free, choose_free
from stickslip_ros.study.fitting.problem import DEFAULT_FREQUENCY_HZ, EXAMPLE, Points, read_points
from stickslip_ros.study.fitting.report import as_object, check_output, warnings_of, write_fit
from stickslip_ros.study.fitting.statistics import Estimate
from stickslip_ros.study.plotting import check_picture


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'fit',
        description='Fit parameters of the drive to measured mean forces by weighted least '
        f'squares. The points stand in a CSV file; {EXAMPLE}. Without standard errors the noise '
        'is estimated from the residuals. The search runs from the present values and from a '
        'Latin hypercube in the bounds; the best minimum counts. Quantities of '
        f'{", ".join(FITTED_GROUPS)} may be freed. Freeing contact.rms_height sets '
        'contact.prefactor to 0, which would hide it.',
    )
    parser.add_argument('points', type=to_path, metavar='FILE', help='CSV file of measured forces')
    parser.add_argument(
        '--free',
        required=True,
        metavar='NAMES',
        help='parameters to fit, as contact.friction,runner.damping',
    )
    parser.add_argument(
        '--start',
        action='append',
        default=[],
        metavar='NAME=VALUE',
        help='start of a free parameter (default: its present value); may be repeated',
    )
    parser.add_argument(
        '--bounds',
        action='append',
        default=[],
        metavar='NAME=LOW:HIGH',
        help='bounds of a free parameter (default: a decade below and above its start); may be '
        'repeated',
    )
    parser.add_argument(
        '--frequency',
        type=float,
        default=DEFAULT_FREQUENCY_HZ,
        metavar='HZ',
        help='frequency of points that have none (default: %(default)g)',
    )
    _add_work(parser)
    add_parameters(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def _add_work(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        '--starts', type=int, default=STARTS, metavar='N', help='searches (default: %(default)s)'
    )
    parser.add_argument(
        '--seed', type=int, default=1, help='seed of starts and noise (default: %(default)s)'
    )
    parser.add_argument(
        '--coverage',
        type=int,
        default=0,
        metavar='N',
        help='fit N synthetic data sets too, and count the intervals that contain the truth',
    )
    add_workers(parser)
    parser.add_argument(
        '-o',
        '--output',
        type=to_path,
        action='append',
        default=[],
        metavar='FILE',
        help='.json: everything; .yaml: the fitted stand for --params; may be repeated',
    )
    parser.add_argument(
        '--figure', type=to_path, metavar='FILE', help='.png, .svg or .pdf of points and model'
    )


def run(arguments: argparse.Namespace) -> int:
    """Fit, write and print."""
    for path in arguments.output:
        check_output(path)
    if arguments.figure:
        check_picture(arguments.figure)
        make_room(arguments.figure)
    if arguments.seed < 0:
        raise OutOfRange('seed', arguments.seed, '', 'below 0', 'raise it')
    points = read_points(arguments.points, arguments.frequency)
    names = [name.strip() for name in arguments.free.split(',') if name.strip()]
    starts, bounds = parse_assignments(arguments.start), parse_assignments(arguments.bounds)
    stand, free, notes = choose_free(chosen_parameters(arguments), names, starts, bounds)
    fit, coverage = _fit(stand, free, points, arguments)
    content = as_object(fit, notes, coverage)
    _write(fit, content, arguments)
    if arguments.json:
        print_json(content)
    else:
        _print(fit, notes, coverage)
        for path in (*arguments.output, *([arguments.figure] if arguments.figure else [])):
            print(f'file    {path}')
    return 0


def _fit(
    stand: Parameters, free: tuple[Free, ...], points: Points, arguments: argparse.Namespace
) -> tuple[Fit, tuple[Coverage, ...]]:
    seed, workers = arguments.seed, arguments.workers
    with shown_progress('searches', quiet=arguments.json) as progress:
        fit = fit_drive(
            stand,
            free,
            points,
            starts=arguments.starts,
            seed=seed,
            workers=workers,
            progress=progress,
        )
    if not arguments.coverage:
        return fit, ()
    with shown_progress('synthetic data sets', quiet=arguments.json) as progress:
        return fit, coverage_of(
            fit, arguments.coverage, seed=seed, workers=workers, progress=progress
        )


def _write(fit: Fit, content: dict[str, Any], arguments: argparse.Namespace) -> None:
    for path in arguments.output:
        write_fit(path, fit, content, arguments.points.name)
    if arguments.figure:
        draw_fit(fit, arguments.figure, arguments.points.name, arguments.workers)


def _print(fit: Fit, notes: Sequence[str], coverage: Sequence[Coverage]) -> None:
    _print_estimates(fit)
    _print_quality(fit)
    if len(fit.estimates) > 1:
        _print_correlation(fit)
    if coverage:
        _print_coverage(coverage)
    for note in notes:
        print(f'note    {note}')
    for warning in warnings_of(fit):
        print(f'warning {warning}')


def _print_estimates(fit: Fit) -> None:
    header = ('parameter', 'estimate', 'std error', '95 % low', '95 % high', 'unit')
    print_table('fit', [_row(one) for one in fit.estimates], header)


def _row(one: Estimate) -> tuple[str, ...]:
    doubt = ('-', '-', '-')
    if np.isfinite(one.standard_error):
        doubt = (f'{one.standard_error:.2g}', f'{one.low:.6g}', f'{one.high:.6g}')
    return (one.name, f'{one.value:.6g}', *doubt, one.unit)


def _print_quality(fit: Fit) -> None:
    doubt = fit.uncertainty
    rows = [
        ('points', f'{len(fit.problem.points)}'),
        ('degrees of freedom', f'{doubt.dof}'),
        ('condition number', f'{doubt.condition:.3g}'),
        ('singular values', ' '.join(f'{value:.3g}' for value in doubt.singular_values)),
        ('searches in this minimum', f'{fit.same} of {len(fit.searches)}'),
        ('stands tried', f'{fit.evaluations}'),
        ('steps per run', f'{min(fit.problem.cycles)} to {max(fit.problem.cycles)}'),
        ('time', f'{fit.wall_s:.1f} s'),
    ]
    if fit.noise_n is None:
        reduced, p_value = fit.reduced_chi_square, fit.p_value
        rows[2:2] = [
            ('chi-square', f'{fit.chi_square:.4g}'),
            ('chi-square per degree', '-' if reduced is None else f'{reduced:.4g}'),
            ('p-value', '-' if p_value is None else f'{p_value:.3g}'),
        ]
    else:
        rows.insert(2, ('noise of a point, estimated', f'{fit.noise_n:.3g} N'))
    print_table('quality', rows)
    print(f'errors  {_error_basis(fit)}')


def _error_basis(fit: Fit) -> str:
    if fit.noise_n is None:
        return 'from the standard errors of the points; intervals of the normal distribution'
    return (
        'scaled by the residuals, as the points have no standard errors; intervals of the t '
        f'distribution with {fit.uncertainty.dof} degrees of freedom; no test of the model'
    )


def _print_correlation(fit: Fit) -> None:
    names = [one.name for one in fit.estimates]
    rows = [
        (name, *('-' if np.isnan(value) else f'{value:+.3f}' for value in row))
        for name, row in zip(names, fit.uncertainty.correlation, strict=True)
    ]
    print_table('correlation', rows, ('', *(name.partition('.')[2] for name in names)))


def _print_coverage(coverage: Sequence[Coverage]) -> None:
    rows = [
        (
            one.name,
            f'{one.inside} of {one.sets}',
            f'{one.share_low:.3f} to {one.share_high:.3f}',
            f'{one.bias:+.3f}',
            f'{one.spread_ratio:.3f}',
        )
        for one in coverage
    ]
    header = ('parameter', 'inside', 'coverage', 'bias', 'spread')
    print_table('synthetic data', rows, header)
