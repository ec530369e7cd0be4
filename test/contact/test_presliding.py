"""The virgin tangential curve: reference tables, Cattaneo and Mindlin, a 3-D solution."""

import math

import numpy as np
import pytest

from stickslip_ros.contact.elasticity import effective_elasticity
from stickslip_ros.contact.presliding import Presliding, presliding
from stickslip_ros.contact.profile import smooth_profile
from stickslip_ros.errors import OutOfRange

LAST_DIGIT = 0.5000001
"""Half a unit of the last printed digit, and a little for binary fractions."""
ROUNDING = 1e-11
"""A power of 3/2 close to full slip, after a Newton solution."""
DERIVATIVE = 1e-7
"""Central difference of step 1e-5 of u_max."""

QUARTERS = np.array([0.1, 0.25, 0.5, 0.75, 0.9])
FORCE_N = math.sqrt(2.0) / 4.0

# Profile, F_n (N), d (nm), a (um), u_max (nm), T/(mu F_n) at QUARTERS of u_max.
TABLE = [
    ('rough', 0.1, 81.5873, 3.11549, 29.7211, (0.20108, 0.46195, 0.78288, 0.95697, 0.99524)),
    ('rough', 1.0, 263.2160, 8.34539, 95.8858, (0.17623, 0.41426, 0.73314, 0.93695, 0.99214)),
    ('smooth', 0.1, 40.1840, 4.48241, 14.6385, (0.14619, 0.35048, 0.64645, 0.87500, 0.96838)),
    ('smooth', 1.0, 186.5176, 9.65706, 67.9457, (0.14619, 0.35048, 0.64645, 0.87500, 0.96838)),
]


def _agrees(value, printed, digits):
    return abs(value - printed) <= LAST_DIGIT * 10.0**-digits


@pytest.mark.parametrize(('profile', 'preload_n', 'd_nm', 'a_um', 'u_nm', 'ratios'), TABLE)
def test_the_reference_table_is_met_to_its_last_digit(
    profile, preload_n, d_nm, a_um, u_nm, ratios, hemisphere
):
    contact = hemisphere(profile, FORCE_N * preload_n)
    assert _agrees(contact.indentation.depth_m * 1e9, d_nm, 4)
    assert _agrees(contact.indentation.radius_m * 1e6, a_um, 5)
    assert _agrees(contact.max_displacement_m * 1e9, u_nm, 4)
    forces_n = contact.tangential_force(QUARTERS * contact.max_displacement_m)
    assert all(map(_agrees, forces_n / contact.max_force_n, ratios, [5] * len(ratios)))


@pytest.mark.parametrize(('preload_n', 'n_per_um'), [(0.1, 0.7554), (1.0, 2.0235)])
def test_the_full_stick_stiffness_of_the_rough_contact_is_known(preload_n, n_per_um, hemisphere):
    stiffness = hemisphere('rough', FORCE_N * preload_n).stick_stiffness_n_per_m
    assert _agrees(stiffness * 1e-6, n_per_um, 4)


@pytest.mark.parametrize(
    ('profile', 'preload_n', 'u_nm'),
    [
        ('rough', 0.1, 29.72),
        ('rough', 0.5, 66.17),
        ('rough', 1.0, 95.89),
        ('smooth', 0.1, 14.64),
        ('smooth', 0.5, 42.80),
        ('smooth', 1.0, 67.95),
    ],
)
def test_the_displacement_of_full_slip_of_a_lower_contact_is_known(
    profile, preload_n, u_nm, hemisphere
):
    contact = hemisphere(profile, FORCE_N * preload_n)
    assert _agrees(contact.max_displacement_m * 1e9, u_nm, 2)


def test_a_smooth_sphere_follows_cattaneo_and_mindlin(hemisphere):
    contact = hemisphere('smooth', FORCE_N)
    share = np.linspace(0.0, 1.2, 121)
    left = np.maximum(1.0 - share, 0.0)
    u_m = share * contact.max_displacement_m
    radius_m = contact.indentation.radius_m
    largest_m = 3.0 * contact.max_force_n / (4.0 * contact.elasticity.shear_pa * radius_m)
    assert contact.max_displacement_m == pytest.approx(largest_m, rel=ROUNDING, abs=0.0)
    np.testing.assert_allclose(
        contact.tangential_force(u_m) / contact.max_force_n, 1.0 - left**1.5, atol=ROUNDING
    )
    np.testing.assert_allclose(contact.stick_radius(u_m) / radius_m, left**0.5, atol=1e-7)


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
        presliding(smooth_profile(1e-3), steel_on_ruby, 0.3, 0.0)


def test_two_springs_per_length_give_johnsons_stiffness(hemisphere):
    """Johnson's 8 G* a, with his G* a quarter of ours, is the same stiffness."""
    contact = hemisphere('smooth', 1.0)
    compliance = sum((2.0 - 0.3) / (young_pa / 2.6) for young_pa in (210e9, 370e9))
    johnson = 8.0 * contact.indentation.radius_m / compliance
    assert contact.stick_stiffness_n_per_m == pytest.approx(johnson, rel=1e-13, abs=0.0)


@pytest.fixture(scope='module')
def rubber_sphere() -> Presliding:
    """Give the case 'cattaneo' of CONTACT (Vollebregt, Kalker): a sphere on a plane."""
    young_pa = 2.0 * 200e6 * 1.42
    elasticity = effective_elasticity(young_pa, 0.42, young_pa, 0.42)
    return presliding(smooth_profile(0.05), elasticity, 0.4, 9.1954)


SHIFT_SHARE = 0.75
"""u/u_max at T = 7/8 mu F_n: 1 - (1/8)^(2/3)."""
ELEMENTS_ERROR = 3e-3
"""CONTACT's 19 x 19 elements resolve the circle's area to about an element of its rim; its
results lie up to 0.22 % below the continuum."""
AREA_ERROR = 1.0 / 45.0
"""One of its 45 sticking elements."""


def test_the_closed_form_of_the_rubber_sphere_has_its_known_digits(rubber_sphere):
    shift_m = SHIFT_SHARE * rubber_sphere.max_displacement_m
    force_n = float(rubber_sphere.tangential_force(shift_m))
    core = float(rubber_sphere.stick_radius(shift_m)) / rubber_sphere.indentation.radius_m
    assert force_n == pytest.approx(7.0 / 8.0 * rubber_sphere.max_force_n, rel=ROUNDING, abs=0.0)
    assert _agrees(rubber_sphere.indentation.depth_m * 1e5, 2.0000, 4)
    assert _agrees(shift_m * 1e6, 8.1724, 4)
    assert core**2 == pytest.approx(0.25, rel=ROUNDING, abs=0.0)


def test_an_independent_3d_solution_agrees_within_its_elements(rubber_sphere):
    shift_m = SHIFT_SHARE * rubber_sphere.max_displacement_m
    core = float(rubber_sphere.stick_radius(shift_m)) / rubber_sphere.indentation.radius_m
    assert rubber_sphere.indentation.depth_m == pytest.approx(
        1.998e-5, rel=ELEMENTS_ERROR, abs=0.0
    )
    assert shift_m == pytest.approx(8.155e-6, rel=ELEMENTS_ERROR, abs=0.0)
    assert core**2 == pytest.approx(45.0 / 177.0, rel=AREA_ERROR, abs=0.0)
