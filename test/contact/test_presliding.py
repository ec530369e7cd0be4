# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The virgin tangential curve, effective moduli, and the rough sphere of parameters."""

import math

import numpy as np
import pytest

from stickslip_ros.contact.hemisphere import prefactor_of, profile_of
from stickslip_ros.contact.mdr import effective_elasticity, shear_modulus, solve_presliding
from stickslip_ros.contact.profile import rough_profile, smooth_profile
from stickslip_ros.contact.roughness import rough_prefactor_1d
from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters import ContactParameters

ROUNDING = 1e-11
"""A power of 3/2 close to full slip, after a Newton solution."""
DERIVATIVE = 1e-7
"""Central difference of step 1e-5 of u_max."""

QUARTERS = np.array([0.1, 0.25, 0.5, 0.75, 0.9])
FORCE_N = math.sqrt(2.0) / 4.0


@pytest.mark.parametrize('profile', ['rough', 'smooth'])
def test_the_slope_of_the_force_is_the_stiffness_of_the_sticking_core(profile, hemisphere):
    contact = hemisphere(profile, FORCE_N)
    u_m = QUARTERS * contact.max_displacement_m
    step_m = 1e-5 * contact.max_displacement_m
    rise_n = contact.tangential_force(u_m + step_m) - contact.tangential_force(u_m - step_m)
    np.testing.assert_allclose(
        rise_n / (2.0 * step_m), contact.tangential_stiffness(u_m), rtol=DERIVATIVE
    )


@pytest.mark.parametrize('profile', ['rough', 'smooth'])
def test_a_contact_begins_in_full_stick_and_ends_in_full_slip(profile, hemisphere):
    contact = hemisphere(profile, FORCE_N)
    assert float(contact.tangential_force(0.0)) == pytest.approx(0.0, abs=1e-15)
    assert float(contact.tangential_stiffness(0.0)) == pytest.approx(
        contact.stick_stiffness_n_per_m, rel=ROUNDING, abs=0.0
    )
    beyond_m = 2.0 * contact.max_displacement_m
    assert float(contact.tangential_force(beyond_m)) == contact.max_force_n
    assert float(contact.stick_radius(beyond_m)) == 0.0


def test_a_contact_without_load_is_refused(steel_on_ruby):
    with pytest.raises(OutOfRange, match=r'normal force 0 N is not above 0 N; press'):
        solve_presliding(smooth_profile(1e-3), steel_on_ruby, 0.3, 0.0)


def test_two_springs_per_length_give_johnsons_stiffness(hemisphere):
    """Johnson's 8 G* a, with his G* a quarter of ours, is the same stiffness."""
    contact = hemisphere('smooth', 1.0)
    compliance = sum((2.0 - 0.3) / (young_pa / 2.6) for young_pa in (210e9, 370e9))
    johnson = 8.0 * contact.indentation.radius_m / compliance
    assert contact.stick_stiffness_n_per_m == pytest.approx(johnson, rel=1e-13, abs=0.0)


DOUBLES = 1e-14
"""A few operations on doubles."""


@pytest.mark.parametrize(('poisson', 'ratio'), [(0.0, 1.0), (0.2, 1.125), (0.5, 1.5)])
def test_bodies_of_equal_poisson_ratio_have_a_ratio_of_stiffnesses_that_depends_on_it_alone(
    poisson, ratio
):
    pair = effective_elasticity(1e6, poisson, 3e6, poisson)
    assert pair.cattaneo_mindlin == pytest.approx(ratio, rel=DOUBLES, abs=0.0)


def test_a_rigid_partner_leaves_the_moduli_of_the_soft_body():
    soft = effective_elasticity(1e6, 0.25, 1e30, 0.25)
    shear_pa = shear_modulus(1e6, 0.25)
    assert shear_pa == pytest.approx(0.4e6, rel=DOUBLES, abs=0.0)
    assert soft.normal_pa == pytest.approx(1e6 / (1.0 - 0.0625), rel=DOUBLES, abs=0.0)
    assert soft.shear_pa == pytest.approx(4.0 * shear_pa / 1.75, rel=DOUBLES, abs=0.0)


def test_parameters_choose_prefactor_rms_height_or_the_bare_sphere():
    given = ContactParameters()
    derived = ContactParameters(prefactor=0.0, rms_height=2.0 * 1.1221e-6)
    assert prefactor_of(given) == 4.4478e-4
    assert prefactor_of(derived) == pytest.approx(
        2.0 * rough_prefactor_1d(1.1221e-6, 0.7, 0.5e-3), rel=DOUBLES, abs=0.0
    )
    assert profile_of(given) == rough_profile(0.5e-3, 4.4478e-4, 0.7)
    assert profile_of(ContactParameters(profile='smooth')) == smooth_profile(0.5e-3)


def test_a_rough_sphere_without_roughness_is_the_smooth_sphere():
    flat = ContactParameters(prefactor=0.0, rms_height=0.0)
    assert profile_of(flat) == smooth_profile(0.5e-3)
