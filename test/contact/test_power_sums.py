# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Roots of sums of powers: many at once are those that are found one by one."""

import numpy as np
import pytest

from stickslip_ros.contact.power_sums import power_sum, solve_power_sum

ROUNDING = 1e-13
"""Logarithms of about 20 lose a digit, the power 1/0.3 of a sum half of one."""
SMOOTH, ROUGH = ((2e3,), (2.0,)), ((2e3, 4.4478e-4), (2.0, 0.7))
FLAT, FLATTEST = ((2e3, 1e-6), (2.0, 0.3)), ((2e3, 1e-6), (2.0, 0.1))
"""Of the flattest one no polynomials are made: they would take longer than the roots."""


@pytest.mark.parametrize('terms', [SMOOTH, ROUGH, FLAT, FLATTEST])
@pytest.mark.parametrize(
    'totals',
    [
        3.1e-7 - np.linspace(0.0, 3.1e-7, 4097),
        2.0 ** np.arange(-24.0, -20.0, 1.0 / 1024.0),  # with borders of octaves and pieces
        np.geomspace(1e-16, 1e-6, 9000).reshape(3, -1)[:, ::-1],  # over more than a table covers
    ],
    ids=['even', 'octaves', 'wide'],
)
def test_many_roots_at_once_are_those_found_one_by_one(terms, totals):
    roots = solve_power_sum(totals, *terms)
    some = (..., slice(None, None, 7))
    one_by_one = [float(solve_power_sum(total, *terms)) for total in totals[some].flat]
    np.testing.assert_allclose(roots[some].flat, one_by_one, rtol=ROUNDING, atol=0.0)
    assert (np.diff(roots.ravel()[np.argsort(totals, axis=None)]) > 0.0).all()


def test_among_many_totals_those_not_above_zero_have_the_root_zero():
    totals = np.linspace(-1e-7, 1e-7, 20_001, dtype=np.float64)
    roots = solve_power_sum(totals, *ROUGH)
    assert (roots[:10_001] == 0.0).all()
    np.testing.assert_allclose(power_sum(roots, *ROUGH)[10_001:], totals[10_001:], rtol=ROUNDING)


@pytest.mark.parametrize('strange', [np.nan, np.inf])
def test_a_total_that_is_no_number_does_not_spoil_others(strange):
    totals = np.linspace(1e-9, 1e-7, 5000, dtype=np.float64)
    totals[17] = strange
    roots = solve_power_sum(totals, *ROUGH)
    assert float(roots[18]) == pytest.approx(
        float(solve_power_sum(totals[18], *ROUGH)), rel=ROUNDING
    )
