# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Effective moduli of other pairs of bodies, and the rough sphere of parameters."""

import pytest

from stickslip_ros.contact.hemisphere import prefactor_of, profile_of
from stickslip_ros.contact.mdr import effective_elasticity, shear_modulus
from stickslip_ros.contact.profile import rough_profile, smooth_profile
from stickslip_ros.contact.roughness import rough_prefactor_1d
from stickslip_ros.parameters import ContactParameters

ROUNDING = 1e-14
"""A few operations on doubles."""


@pytest.mark.parametrize(('poisson', 'ratio'), [(0.0, 1.0), (0.2, 1.125), (0.5, 1.5)])
def test_bodies_of_equal_poisson_ratio_have_a_ratio_of_stiffnesses_that_depends_on_it_alone(
    poisson, ratio
):
    pair = effective_elasticity(1e6, poisson, 3e6, poisson)
    assert pair.cattaneo_mindlin == pytest.approx(ratio, rel=ROUNDING, abs=0.0)


def test_a_rigid_partner_leaves_the_moduli_of_the_soft_body():
    soft = effective_elasticity(1e6, 0.25, 1e30, 0.25)
    shear_pa = shear_modulus(1e6, 0.25)
    assert shear_pa == pytest.approx(0.4e6, rel=ROUNDING, abs=0.0)
    assert soft.normal_pa == pytest.approx(1e6 / (1.0 - 0.0625), rel=ROUNDING, abs=0.0)
    assert soft.shear_pa == pytest.approx(4.0 * shear_pa / 1.75, rel=ROUNDING, abs=0.0)


def test_the_two_bodies_may_change_places():
    one = effective_elasticity(210e9, 0.3, 370e9, 0.2)
    other = effective_elasticity(370e9, 0.2, 210e9, 0.3)
    assert one.normal_pa == pytest.approx(other.normal_pa, rel=ROUNDING, abs=0.0)
    assert one.shear_pa == pytest.approx(other.shear_pa, rel=ROUNDING, abs=0.0)


def test_the_prefactor_is_proportional_to_the_rms_height():
    one, two = (rough_prefactor_1d(height_m, 0.5, 1e-3) for height_m in (1e-6, 2e-6))
    assert two == pytest.approx(2.0 * one, rel=ROUNDING, abs=0.0)


def test_parameters_choose_prefactor_rms_height_or_the_bare_sphere():
    given = ContactParameters()
    derived = ContactParameters(prefactor=0.0, rms_height=2.0 * 1.1221e-6)
    assert prefactor_of(given) == 4.4478e-4
    assert prefactor_of(derived) == pytest.approx(
        2.0 * rough_prefactor_1d(1.1221e-6, 0.7, 0.5e-3), rel=ROUNDING, abs=0.0
    )
    assert profile_of(given) == rough_profile(0.5e-3, 4.4478e-4, 0.7)
    assert profile_of(ContactParameters(profile='smooth')) == smooth_profile(0.5e-3)


def test_a_rough_sphere_without_roughness_is_the_smooth_sphere():
    flat = ContactParameters(prefactor=0.0, rms_height=0.0)
    assert profile_of(flat) == smooth_profile(0.5e-3)
