"""``stickslip contact``: one hemisphere under a normal force, in closed form."""

import argparse
from typing import Any

import numpy as np

from stickslip_ros.cli.common import (
    add_json,
    add_parameters,
    chosen_parameters,
    print_json,
    print_table,
)
from stickslip_ros.contact.hemisphere import elasticity_of, profile_of
from stickslip_ros.contact.mdr import Presliding, presliding
from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.parameters import spec_of


def add_verb(add_parser: Any) -> None:
    """Add the verb to the parser."""
    parser = add_parser(
        'contact',
        description='Solve the contact of one hemisphere under a constant normal force.',
    )
    parser.add_argument(
        '--normal-force', type=float, required=True, metavar='N', help='normal force F_n, N'
    )
    parser.add_argument(
        '--profile', choices=spec_of('contact.profile').choices, help='sets contact.profile'
    )
    parser.add_argument(
        '--curve',
        metavar='FRACTIONS',
        help='tangential force at these fractions of the maximal presliding, as 0.1,0.5',
    )
    add_parameters(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Solve and print."""
    parameters = chosen_parameters(arguments)
    if arguments.profile:
        parameters = parameters.updated({'contact.profile': arguments.profile})
    contact = presliding(
        profile_of(parameters.contact),
        elasticity_of(parameters.contact),
        parameters.contact.friction,
        arguments.normal_force,
    )
    _check_size(contact, parameters.contact.radius)
    result = describe_contact(contact)
    if arguments.curve is not None:
        fractions = parse_fractions(arguments.curve)
        displacements_m = np.array(fractions) * contact.max_displacement_m
        result['tangential_force_n'] = contact.tangential_force(displacements_m).tolist()
    if arguments.json:
        print_json(result)
    else:
        _print(result, parameters.contact.profile, arguments)
    return 0


def _check_size(contact: Presliding, sphere_m: float) -> None:
    radius_m = contact.indentation.radius_m
    if radius_m > sphere_m:
        limit = f'beyond the radius of the sphere, {sphere_m:g} m'
        raise OutOfRange('contact radius', radius_m, 'm', limit, 'lower --normal-force')


def describe_contact(contact: Presliding) -> dict[str, Any]:
    """Return the figures of a contact, with units in the names."""
    return {
        'indentation_m': contact.indentation.depth_m,
        'contact_radius_m': contact.indentation.radius_m,
        'max_presliding_m': contact.max_displacement_m,
        'stick_stiffness_n_per_m': contact.stick_stiffness_n_per_m,
        'effective_modulus_pa': contact.elasticity.normal_pa,
        'effective_shear_modulus_pa': contact.elasticity.shear_pa,
    }


def parse_fractions(text: str) -> list[float]:
    """
    Return fractions from a text such as ``0.1,0.5``.

    Raises
    ------
    WrongKind
        If a part is not a number.
    OutOfRange
        If one is negative.

    """
    try:
        fractions = [float(part) for part in text.split(',')]
    except ValueError:
        mend = 'write fractions with commas, as 0.1,0.5'
        raise WrongKind('--curve', text, 'a list of numbers', mend) from None
    for fraction in fractions:
        if not 0.0 <= fraction < float('inf'):
            mend = '1 is the displacement of full slip'
            raise OutOfRange('--curve', fraction, '', 'not a fraction from 0 on', mend)
    return fractions


def _print(result: dict[str, Any], profile: str, arguments: argparse.Namespace) -> None:
    rows = [
        ('indentation d', f'{result["indentation_m"] * 1e9:.4f}', 'nm'),
        ('contact radius a', f'{result["contact_radius_m"] * 1e6:.5f}', 'um'),
        ('maximal presliding u_max', f'{result["max_presliding_m"] * 1e9:.4f}', 'nm'),
        ('stick stiffness 2 G* a', f'{result["stick_stiffness_n_per_m"] * 1e-6:.5f}', 'N/um'),
        ('effective modulus E*', f'{result["effective_modulus_pa"] * 1e-9:.4f}', 'GPa'),
        (
            'effective shear modulus G*',
            f'{result["effective_shear_modulus_pa"] * 1e-9:.4f}',
            'GPa',
        ),
    ]
    if 'tangential_force_n' in result:
        fractions = parse_fractions(arguments.curve)
        for fraction, force_n in zip(fractions, result['tangential_force_n'], strict=True):
            rows.append((f'tangential force at {fraction:g} u_max', f'{force_n * 1e3:.5f}', 'mN'))
    print_table(f'{profile} hemisphere under {arguments.normal_force:g} N', rows)
