"""``stickslip roughness``: random rough lines against the equivalent profile."""

import argparse
from typing import Any

import numpy as np

from stickslip_ros.cli.common import (
    add_folder,
    add_json,
    add_parameters,
    chosen_parameters,
    print_json,
    print_table,
)
from stickslip_ros.cli.progress import shown_progress
from stickslip_ros.files import make_folder
from stickslip_ros.paper.ensemble import Ensemble, rough_line_ensemble
from stickslip_ros.paper.roughness_figure import Samples, draw_roughness, sample_roughness
from stickslip_ros.units import MICRO

DEFAULT_REALISATIONS = 100
PICTURE = 'roughness.png'


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'roughness',
        description='Make random self-affine lines and a surface, check their spectra, and '
        'compare the contact of the lines with that of the equivalent rough profile, which has '
        f'the same rms height and Hurst exponent. Writes DIR/{PICTURE}.',
    )
    add_folder(parser)
    parser.add_argument(
        '--realisations',
        type=int,
        default=DEFAULT_REALISATIONS,
        metavar='N',
        help='number of random lines (default: %(default)d)',
    )
    parser.add_argument('--seed', type=int, metavar='N', help='sets contact.line_seed')
    add_parameters(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Compare, draw and print."""
    parameters = chosen_parameters(arguments)
    if arguments.seed is not None:
        parameters = parameters.updated({'contact.line_seed': arguments.seed})
    make_folder(arguments.out)
    samples = sample_roughness(parameters)
    with shown_progress('lines', quiet=arguments.json) as progress:
        ensemble = rough_line_ensemble(parameters, arguments.realisations, progress=progress)
    picture = arguments.out / PICTURE
    draw_roughness(samples, ensemble, picture)
    if arguments.json:
        print_json(describe_roughness(samples, ensemble) | {'picture': str(picture)})
    else:
        _print(samples, ensemble)
        print(f'picture {picture}')
    return 0


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


def _print(samples: Samples, ensemble: Ensemble) -> None:
    rows = [
        (name, f'{each.rms_m / MICRO:.6f}', f'{each.hurst:.4f}')
        for name, each in (('line', samples.line), ('surface', samples.surface))
    ]
    print_table('roughness', rows, ('', 'rms (um)', 'fitted H'))
    columns = [
        [f'{mean:.3f} ± {spread:.3f}' for mean, spread in zip(*pair, strict=True)]
        for pair in ((c.ratio, c.ratio_spread) for c in ensemble.comparisons.values())
    ]
    springs = [f'{count:.0f}' for count in ensemble.springs_in_contact]
    loads = [f'{load_n:.4g}' for load_n in ensemble.loads_n]
    print_table(
        f'{len(ensemble.normal_force_n.lines)} rough lines over the equivalent profile, '
        'mean ± standard deviation',
        list(zip(loads, springs, *columns, strict=True)),
        ('F_n (N)', 'springs', 'F_n at equal depth', 'u_max', 'stiffness'),
    )
