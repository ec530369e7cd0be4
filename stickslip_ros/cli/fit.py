"""``stickslip fit``: parameters of the drive from measured forces, with error bars."""

import argparse
from collections.abc import Iterator, Sequence

import numpy as np
from rich.table import Table

from stickslip_ros.cli.chosen import chosen_look, chosen_parameters
from stickslip_ros.cli.experiment import said_of_tables
from stickslip_ros.cli.printing import Answer, table
from stickslip_ros.errors import OutOfRange
from stickslip_ros.files import prepare_output
from stickslip_ros.fitting.coverage import Coverage, coverage_of
from stickslip_ros.fitting.figure import draw_fit
from stickslip_ros.fitting.fit import Fit, fit
from stickslip_ros.fitting.report import as_object, check_output, warnings_of, write_fit
from stickslip_ros.parameters import parse_assignments
from stickslip_ros.progress import shown_progress
from stickslip_ros.runs.plotting import check_picture, looking, save_figure


def fit_verb(arguments: argparse.Namespace) -> Answer:
    """Fit the parameters, write the files and draw the figure."""
    for path in arguments.output:
        check_output(path)
    look = chosen_look(arguments)
    if arguments.figure:
        check_picture(arguments.figure)
        prepare_output(arguments.figure)
    if arguments.seed < 0:
        raise OutOfRange('seed', arguments.seed, '', 'below 0', 'raise it')
    names = [name.strip() for name in arguments.free.split(',') if name.strip()]
    seed, workers = arguments.seed, arguments.workers
    fitted = fit(
        arguments.files,
        names,
        **said_of_tables(arguments),
        parameters=chosen_parameters(arguments),
        start=parse_assignments(arguments.start),
        bounds=parse_assignments(arguments.bounds),
        frequency_hz=arguments.frequency,
        steps=arguments.steps,
        starts=arguments.starts,
        seed=seed,
        workers=workers,
        progress=not arguments.json,
    )
    coverage: tuple[Coverage, ...] = ()
    if arguments.coverage:
        with shown_progress('synthetic data sets', quiet=arguments.json) as progress:
            coverage = coverage_of(
                fitted, arguments.coverage, seed=seed, workers=workers, progress=progress
            )
    origin = ', '.join(path.name for path in arguments.files)
    content = as_object(fitted, coverage)
    for path in arguments.output:
        write_fit(path, fitted, content, origin)
    files = [*arguments.output]
    if arguments.figure:
        with shown_progress('drawing', quiet=arguments.json), looking(look):
            save_figure(draw_fit(fitted, workers), arguments.figure)
        files.append(arguments.figure)
    return Answer(content, [*_parts(fitted, coverage), *(f'file    {path}' for path in files)])


def _parts(fit: Fit, coverage: Sequence[Coverage]) -> Iterator[str | Table]:
    estimates = []
    for one in fit.estimates:
        doubt = ('-', '-', '-')
        if np.isfinite(one.standard_error):
            doubt = (f'{one.standard_error:.2g}', f'{one.low:.6g}', f'{one.high:.6g}')
        estimates.append((one.name, f'{one.value:.6g}', *doubt, one.unit))
    bounds = ('std error', '95 % low', '95 % high')
    yield table('fit', estimates, ('parameter', 'estimate', *bounds, 'unit'))
    yield table('quality', _quality(fit))
    if fit.noise_n is None:
        yield (
            'errors  from the standard errors of the points; intervals of the normal distribution'
        )
    else:
        yield (
            'errors  scaled by the residuals, as the points have no standard errors; intervals of '
            f'the t distribution with {fit.uncertainty.dof} degrees of freedom; no test of the '
            'model'
        )
    if len(fit.estimates) > 1:
        names = [one.name for one in fit.estimates]
        rows = [
            (name, *('-' if np.isnan(value) else f'{value:+.3f}' for value in row))
            for name, row in zip(names, fit.uncertainty.correlation, strict=True)
        ]
        yield table('correlation', rows, ('', *(name.partition('.')[2] for name in names)))
    if coverage:
        counted = [
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
        yield table('synthetic data', counted, header)
    yield from (f'note    {note}' for note in fit.notes)
    yield from (f'warning {warning}' for warning in warnings_of(fit))


def _quality(fit: Fit) -> Iterator[tuple[str, object]]:
    doubt = fit.uncertainty
    yield 'points', len(fit.problem.points)
    yield 'degrees of freedom', doubt.dof
    if fit.noise_n is None:
        reduced, p_value = fit.reduced_chi_square, fit.p_value
        yield 'chi-square', f'{fit.chi_square:.4g}'
        yield 'chi-square per degree', '-' if reduced is None else f'{reduced:.4g}'
        yield 'p-value', '-' if p_value is None else f'{p_value:.3g}'
    else:
        yield 'noise of a point, estimated', f'{fit.noise_n:.3g} N'
    yield 'condition number', f'{doubt.condition:.3g}'
    yield 'singular values', ' '.join(f'{value:.3g}' for value in doubt.singular_values)
    yield 'searches in this minimum', f'{fit.same} of {len(fit.searches)}'
    yield 'stands tried', fit.evaluations
    steps = 'steps until steady' if fit.problem.points.steps is None else 'steps per run'
    yield steps, f'{min(fit.problem.cycles)} to {max(fit.problem.cycles)}'
    yield 'time', f'{fit.wall_s:.1f} s'
