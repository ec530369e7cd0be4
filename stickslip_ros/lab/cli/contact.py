# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip contact``: a hemisphere under a normal force, in closed form."""

import argparse
from collections.abc import Iterator
from typing import Any

import numpy as np

from stickslip_ros.contact.hemisphere import presliding
from stickslip_ros.errors import OutOfRange
from stickslip_ros.lab.cli.chosen import chosen_parameters, to_numbers
from stickslip_ros.lab.cli.printing import Answer
from stickslip_ros.sections import Section, si_row


def contact_verb(arguments: argparse.Namespace) -> Answer:
    """Solve the contact of a hemisphere, and its tangential force if a curve is asked for."""
    parameters, normal_force_n = chosen_parameters(arguments), arguments.normal_force
    contact, material = presliding(parameters, normal_force_n=normal_force_n), parameters.contact
    radius_m = contact.indentation.radius_m
    if radius_m > material.radius:
        limit = f'beyond the radius of the sphere, {material.radius:g} m'
        raise OutOfRange('contact radius', radius_m, 'm', limit, 'lower --normal-force')
    result: dict[str, Any] = {
        'indentation_m': contact.indentation.depth_m,
        'contact_radius_m': radius_m,
        'max_presliding_m': contact.max_displacement_m,
        'stick_stiffness_n_per_m': contact.stick_stiffness_n_per_m,
        'effective_modulus_pa': contact.elasticity.normal_pa,
        'effective_shear_modulus_pa': contact.elasticity.shear_pa,
    }
    fractions = [] if arguments.curve is None else to_numbers('--curve', arguments.curve)
    if fractions:
        if min(fractions) < 0.0:
            hint = '1 is the displacement of full slip'
            raise OutOfRange('--curve', min(fractions), '', 'below 0', hint)
        displacements_m = np.array(fractions) * contact.max_displacement_m
        result['tangential_force_n'] = contact.tangential_force(displacements_m).tolist()
    title = f'{material.profile} hemisphere under {normal_force_n:g} N'
    return Answer(result, [Section(title, [*_rows(result, fractions)])])


def _rows(result: dict[str, Any], fractions: list[float]) -> Iterator[tuple[str, str, str]]:
    yield si_row('indentation d', result['indentation_m'], '.4f', 'nm')
    yield si_row('contact radius a', result['contact_radius_m'], '.5f', 'um')
    yield si_row('maximal presliding u_max', result['max_presliding_m'], '.4f', 'nm')
    yield si_row('stick stiffness 2 G* a', result['stick_stiffness_n_per_m'], '.5f', 'N/um')
    yield si_row('effective modulus E*', result['effective_modulus_pa'], '.4f', 'GPa')
    yield si_row('effective shear modulus G*', result['effective_shear_modulus_pa'], '.4f', 'GPa')
    for fraction, force_n in zip(fractions, result.get('tangential_force_n', ()), strict=True):
        yield si_row(f'tangential force at {fraction:g} u_max', force_n, '.5f', 'mN')
