# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The virgin tangential curve: its slope, its ends, and what is refused."""

import math

import numpy as np
import pytest

from stickslip_ros.contact.mdr import solve_presliding
from stickslip_ros.contact.profile import smooth_profile
from stickslip_ros.errors import OutOfRange

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
