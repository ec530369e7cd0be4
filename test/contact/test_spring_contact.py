# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""One contact with the memory of its springs, as scripts have it."""

import pytest

from stickslip_ros import Parameters, SpringContact, presliding
from stickslip_ros.errors import OutOfRange, StickSlipError

NORMAL_N = 0.2
BANK_ERROR = 2.5e-3
"""128 springs against the continuum; of the largest force."""


def test_a_contact_that_is_pulled_follows_the_virgin_curve_and_slips_at_its_limit():
    known, contact = (
        presliding(Parameters(), normal_force_n=NORMAL_N),
        SpringContact(Parameters(), 0.4),
    )
    assert contact.move(0.0, NORMAL_N) == 0.0
    step_m = known.max_displacement_m / 20
    for number in range(1, 26):
        found_n = contact.move(step_m, NORMAL_N)
        wanted_n = float(known.tangential_force(number * step_m))
        assert found_n == pytest.approx(wanted_n, abs=BANK_ERROR * known.max_force_n)


def test_a_contact_that_is_lifted_forgets():
    contact = SpringContact(Parameters(), NORMAL_N)
    contact.move(0.0, NORMAL_N)
    assert contact.move(1e-8, NORMAL_N) > 0.0
    assert contact.move(0.0, 0.0) == contact.move(0.0, NORMAL_N) == 0.0


@pytest.mark.parametrize('largest_n', [0.0, -1.0, float('nan'), float('inf')])
def test_a_largest_normal_force_that_does_not_press_is_refused(largest_n):
    told = r'largest normal force .* give a positive number|normal_force_max_n .* finite number'
    with pytest.raises(StickSlipError, match=told):
        SpringContact(Parameters(), largest_n)


@pytest.mark.parametrize('normal_n', [-0.1, 0.3, float('nan')])
def test_a_normal_force_that_the_contact_was_not_made_for_is_refused(normal_n):
    with pytest.raises(OutOfRange, match=r'normal force .* N is not from 0 to 0\.2; give'):
        SpringContact(Parameters(), NORMAL_N).move(0.0, normal_n)
