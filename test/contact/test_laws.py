# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Properties of all rival friction laws; the evidence has closed forms and benchmarks."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip_ros.contact.laws import DAHL, EPM, LUGRE, deflect
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.lab.validation.laws import COULOMB_N, SIGMA_0, benchmark_law, plain_law, trace

deflect = entry_point(deflect)


LONGEST_M = 4.0 * COULOMB_N / SIGMA_0
"""Steps of four times the deflection of steady sliding: the drive takes a small share of it."""


@given(
    st.sampled_from([DAHL, LUGRE, EPM]),
    st.lists(st.floats(-LONGEST_M, LONGEST_M), min_size=1, max_size=30),
)
def test_bristles_never_exceed_the_limit_and_never_give_energy(number, steps_m):
    forces_n, lost_j = trace(plain_law(number), np.cumsum(steps_m))
    assert np.all(np.abs(forces_n) <= COULOMB_N * (1 + 1e-12))
    assert lost_j[-1] >= -1e-18


def test_a_stiff_law_stays_bounded_at_steps_far_beyond_its_time_constant():
    z, force, _ = deflect(benchmark_law(LUGRE), COULOMB_N, 0.0, 1.0, 1.0)
    assert z == pytest.approx(COULOMB_N / SIGMA_0)
    assert abs(force) < 2.0 * COULOMB_N
