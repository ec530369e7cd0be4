"""Effective moduli, Hess's factor and the Pohrt-Popov rule against numbers known by hand."""

import math

import pytest
from scipy.integrate import quad

from stickslip_ros.contact.elasticity import effective_elasticity, shear_modulus
from stickslip_ros.contact.hemisphere import prefactor_of, profile_of
from stickslip_ros.contact.profile import rough_profile, smooth_profile
from stickslip_ros.contact.roughness import hess_factor, rough_prefactor_1d, rough_prefactor_3d
from stickslip_ros.parameters import ContactParameters

ROUNDING = 1e-14
"""A few operations on doubles."""
LAST_DIGIT = 0.5000001
"""Half a unit of the last printed digit."""
QUADRATURE = 1e-9
"""What quad promises at an integrable singularity of the integrand."""


def test_the_moduli_of_table_1_have_their_known_values(steel_on_ruby):
    assert abs(steel_on_ruby.normal_pa * 1e-9 - 147.2149) < LAST_DIGIT * 1e-4
    assert abs(steel_on_ruby.shear_pa * 1e-9 - 121.2358) < LAST_DIGIT * 1e-4


def test_the_cattaneo_mindlin_ratio_of_two_bodies_with_a_poisson_ratio_of_0_3_is_17_14(
    steel_on_ruby,
):
    assert steel_on_ruby.cattaneo_mindlin == pytest.approx(17.0 / 14.0, rel=ROUNDING, abs=0.0)


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


@pytest.mark.parametrize(
    ('exponent', 'factor'),
    [(1.0, math.pi / 2.0), (2.0, 2.0), (3.0, 3.0 * math.pi / 4.0), (4.0, 8.0 / 3.0)],
)
def test_hess_factor_of_a_cone_a_sphere_and_higher_powers_is_known(exponent, factor):
    assert hess_factor(exponent) == pytest.approx(factor, rel=ROUNDING, abs=0.0)


def test_hess_factor_of_the_paper_has_its_known_value():
    assert abs(hess_factor(0.7) - 1.419818) < LAST_DIGIT * 1e-6


@pytest.mark.parametrize('exponent', [0.4, 0.7, 1.0, 1.6, 2.0])
def test_hess_factor_is_the_integral_of_hess_rule(exponent):
    # r = x sin(t) takes the singularity at r = x out of int_0^x f'(r) / sqrt(x^2 - r^2) dr.
    integral, _ = quad(
        lambda angle: exponent * math.sin(angle) ** (exponent - 1.0),
        0.0,
        math.pi / 2.0,
        epsabs=0.0,
        epsrel=QUADRATURE / 10.0,
        limit=500,
    )
    assert hess_factor(exponent) == pytest.approx(integral, rel=QUADRATURE, abs=0.0)


def test_the_roughness_of_the_paper_has_the_prefactor_of_the_paper():
    prefactor = rough_prefactor_1d(1.1221e-6, 0.7, 0.5e-3)
    assert abs(prefactor - 4.44782e-4) < LAST_DIGIT * 1e-9


def test_hess_factor_cancels_in_the_prefactor_of_the_line():
    hurst, height_m, length_m = 0.7, 1.1221e-6, 1e-3
    slope = (2.0 * (hurst + 1.0) / (1.9412 * length_m)) ** (hurst + 1.0)
    expected = slope * (hurst + 1.0) * length_m / (2.0 * hurst) * height_m
    assert rough_prefactor_1d(height_m, hurst, length_m / 2.0) == pytest.approx(
        expected, rel=ROUNDING, abs=0.0
    )
    stretched = hess_factor(hurst) * rough_prefactor_3d(height_m, hurst, length_m / 2.0)
    assert stretched == pytest.approx(expected, rel=ROUNDING, abs=0.0)


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
