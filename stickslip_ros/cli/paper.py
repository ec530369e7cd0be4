"""``stickslip roughness``, ``laws`` and ``figures``: what the paper says, and leaves open."""

import argparse
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from rich.table import Table as Shown

from stickslip_ros.cli.chosen import chosen_parameters
from stickslip_ros.cli.printing import Answer, table
from stickslip_ros.errors import OutOfRange
from stickslip_ros.files import make_folder
from stickslip_ros.paper.ensemble import Ensemble, rough_line_ensemble
from stickslip_ros.paper.figure import Table, write_figure
from stickslip_ros.paper.laws import LAWS
from stickslip_ros.paper.make import chosen_figures, make_tables
from stickslip_ros.paper.readings import AMPLITUDE_MAX_M, PRELOADS_N
from stickslip_ros.paper.roughness_figure import Samples, draw_roughness, sample_roughness
from stickslip_ros.progress import shown_progress
from stickslip_ros.units import MICRO, MN

ROUGHNESS_PICTURE = 'roughness.png'


def roughness_verb(arguments: argparse.Namespace) -> Answer:
    """Compare lines and profile, draw."""
    parameters = chosen_parameters(arguments)
    make_folder(arguments.output)
    samples = sample_roughness(parameters)
    with shown_progress('lines', quiet=arguments.json) as progress:
        ensemble = rough_line_ensemble(parameters, arguments.realisations, progress=progress)
    picture = arguments.output / ROUGHNESS_PICTURE
    with shown_progress('drawing', quiet=arguments.json):
        draw_roughness(samples, ensemble, picture)
    content = describe_roughness(samples, ensemble) | {'picture': str(picture)}
    return Answer(content, [*_roughness_tables(samples, ensemble), f'picture {picture}'])


def describe_roughness(samples: Samples, ensemble: Ensemble) -> dict[str, Any]:
    """
    Return the figures of samples and ensemble, with units in the names.

    Ratios are lines over equivalent profile: ``_ratio_mean`` and ``_ratio_spread`` have one value
    per load, ``_ratio`` is the mean over all loads, which are evenly spaced in their logarithm.

    """
    contact = samples.contact
    result: dict[str, Any] = {
        'realisations': len(ensemble.normal_force_n.lines),
        'seed': contact.line_seed,
        'springs': contact.line_points,
        'spacing_m': contact.line_length / contact.line_points,
        'rms_line_m': samples.line.rms_m,
        'rms_surface_m': samples.surface.rms_m,
        'hurst_line': samples.line.hurst,
        'hurst_surface': samples.surface.hurst,
        'loads_n': ensemble.loads_n.tolist(),
        'depths_m': ensemble.depths_m.tolist(),
        'springs_in_contact': ensemble.springs_in_contact.tolist(),
    }
    for name, comparison in ensemble.comparisons.items():
        result[f'{name}_ratio'] = float(np.mean(comparison.ratio))
        result[f'{name}_ratio_mean'] = comparison.ratio.tolist()
        result[f'{name}_ratio_spread'] = comparison.ratio_spread.tolist()
    return result


def _roughness_tables(samples: Samples, ensemble: Ensemble) -> Iterator[Shown]:
    rows = [
        (name, f'{each.rms_m / MICRO:.6f}', f'{each.hurst:.4f}')
        for name, each in (('line', samples.line), ('surface', samples.surface))
    ]
    yield table('roughness', rows, ('', 'rms (um)', 'fitted H'))
    columns = [
        [f'{mean:.3f} ± {spread:.3f}' for mean, spread in zip(*pair, strict=True)]
        for pair in ((c.ratio, c.ratio_spread) for c in ensemble.comparisons.values())
    ]
    springs = [f'{count:.0f}' for count in ensemble.springs_in_contact]
    loads = [f'{load_n:.4g}' for load_n in ensemble.loads_n]
    yield table(
        f'{len(ensemble.normal_force_n.lines)} rough lines over the equivalent profile, '
        'mean ± standard deviation',
        zip(loads, springs, *columns, strict=True),
        ('F_n (N)', 'springs', 'F_n at equal depth', 'u_max', 'stiffness'),
    )


def laws_verb(arguments: argparse.Namespace) -> Answer:
    """Run all, write the table, draw the figure."""
    parameters = chosen_parameters(arguments)
    if arguments.points < 1:
        hint = 'give the number of amplitudes up to 160 nm'
        raise OutOfRange('--points', arguments.points, '', 'below 1', hint)
    make_folder(arguments.output)
    with shown_progress('runs', quiet=arguments.json) as progress:
        tables = make_tables([LAWS], parameters, points=arguments.points, progress=progress)
    runs = tables[LAWS.name]
    with shown_progress('drawing', quiet=arguments.json):
        files = write_figure(LAWS, runs, parameters, arguments.output, ('.csv', '.md', '.png'))
    paths = f'table   {files[0]}\nfigure  {files[2]}'
    return Answer({'points': runs.rows}, [_laws_table(runs), paths])


def _laws_table(runs: Table) -> Shown:
    forces: dict[str, list[str]] = {}
    for row in runs.where(amplitude_m=AMPLITUDE_MAX_M).rows:
        forces.setdefault(str(row['variant']), []).append(f'{float(row["force_mean_n"]) * MN:.1f}')
    rows = [(name, *texts) for name, texts in forces.items()]
    header = ('profile or law', *(f'{n:g} N' for n in PRELOADS_N))
    return table('generated force at 160 nm (mN)', rows, header)


def figures_verb(arguments: argparse.Namespace) -> Answer:
    """Run the drive, write the files."""
    parameters = chosen_parameters(arguments)
    figures = chosen_figures(None if arguments.only is None else arguments.only.split(','))
    make_folder(arguments.output)
    with shown_progress('runs', quiet=arguments.json) as progress:
        tables = make_tables(
            figures,
            parameters,
            points=arguments.points,
            workers=arguments.workers,
            progress=progress,
        )
    content: dict[str, Any] = {}
    with shown_progress('figures', quiet=arguments.json) as progress:
        for figure in figures:
            progress(len(content), len(figures))
            runs = tables[figure.name]
            files = write_figure(figure, runs, parameters, arguments.output)
            content[figure.name] = {'files': [str(path) for path in files], 'rows': _known(runs)}
    rows = [(figure.name, figure.title, len(tables[figure.name].rows)) for figure in figures]
    shown = table('figures', rows, ('name', 'shows', 'rows'))
    return Answer(content, [shown, f'folder {arguments.output}'])


def _known(runs: Table) -> list[dict[str, Any]]:
    """Return rows; JSON knows neither infinity nor what is not a number."""
    return [
        {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in row.items()
        }
        for row in runs.rows
    ]
