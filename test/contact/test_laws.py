"""What every rival friction law keeps to; the evidence has its closed forms and benchmarks."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.laws import DAHL, EPM, LUGRE, deflect
from stickslip_ros.validation.laws import (
    COULOMB_N,
    SIGMA_0,
    benchmark_law,
    plain_law,
    trace,
)

deflect = entry_point(deflect)


@given(
    st.sampled_from([DAHL, LUGRE, EPM]), st.lists(st.floats(-1e-4, 1e-4), min_size=1, max_size=30)
)
def test_bristles_never_exceed_the_limit_and_never_give_energy(number, places_m):
    forces_n, lost_j = trace(plain_law(number), np.array(places_m))
    assert np.all(np.abs(forces_n) <= COULOMB_N * (1 + 1e-12))
    # Large steps of EPM use the plastic share of their middle: positive up to rounding.
    assert lost_j[-1] >= -1e-18


def test_a_stiff_law_stays_bounded_at_steps_far_beyond_its_time_constant():
    z, force, _ = deflect(benchmark_law(LUGRE), COULOMB_N, 0.0, 1.0, 1.0)
    assert z == pytest.approx(COULOMB_N / SIGMA_0)
    assert abs(force) < 2.0 * COULOMB_N
