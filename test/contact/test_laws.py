"""The rival friction laws: closed forms and published benchmarks."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.laws import DAHL, EPM, LUGRE, deflect
from stickslip_ros.validation.law_drivers import (
    COULOMB_N,
    DT_S,
    FRICTION,
    POSITION,
    SIGMA_0,
    STATIC_RATIO,
    benchmark_law,
    drift_per_cycle,
    lugre_drift_m,
    oscillation,
    plain_law,
    slip_starts,
    stick_slip,
    trace,
)

deflect = entry_point(deflect)

# The references are printed to three or four digits.
SLIP_STARTS_S = (7.438, 13.800, 20.163)
PLATEAUS_M = (0.6363, 1.2726)
LARGEST_FORCE_N = 1.477
PRINTED_S, PRINTED = 0.5e-3, 0.5e-4
BEFORE_SLIP = round(0.05 / DT_S)


@pytest.fixture(scope='module')
def record():
    return stick_slip()


def test_lugre_slips_at_the_published_times(record):
    assert slip_starts(record) == pytest.approx(SLIP_STARTS_S, abs=PRINTED_S)


def test_lugre_sticks_at_the_published_places(record):
    just_before = np.rint(slip_starts(record)[1:] / DT_S).astype(int) - BEFORE_SLIP
    assert record[just_before, POSITION] == pytest.approx(PLATEAUS_M, abs=PRINTED)


def test_lugre_reaches_the_published_largest_force(record):
    assert record[:, FRICTION].max() == pytest.approx(LARGEST_FORCE_N, abs=10 * PRINTED)


def test_lugre_creeps_under_an_oscillating_force_as_its_equation_says():
    # The formula is quasi-static; at 1 Hz inertia and bristle damping add a little.
    quasi_static = 2e-3
    expected_m = 1.5e-5 * math.log((1.5**2 - 0.2**2) / (1.5**2 - 0.8**2))
    assert drift_per_cycle(oscillation(LUGRE)) == pytest.approx(expected_m, rel=quasi_static)
    assert lugre_drift_m() == pytest.approx(expected_m, rel=1e-12)


def test_epm_does_not_drift_below_its_breakaway():
    deflection_m = STATIC_RATIO / SIGMA_0
    assert abs(drift_per_cycle(oscillation(EPM))) < 1e-12 * deflection_m


def test_dahl_follows_its_exponential_from_the_virgin_state():
    x_m = np.linspace(0.0, 6e-5, 50)
    forces_n, _ = trace(plain_law(DAHL), x_m)
    # Exact for any step: the exponential is the solution.
    assert forces_n == pytest.approx(1.0 - np.exp(-SIGMA_0 * x_m), abs=1e-12)


def test_dahl_settles_into_the_loop_of_the_hyperbolic_tangent():
    amplitude_m = 1.3e-5
    turns = amplitude_m * np.tile([1.0, -1.0], 30)
    forces_n, _ = trace(plain_law(DAHL), turns)
    assert forces_n[-2:] == pytest.approx(
        [math.tanh(SIGMA_0 * amplitude_m), -math.tanh(SIGMA_0 * amplitude_m)], rel=1e-9
    )


@given(
    st.sampled_from([DAHL, LUGRE, EPM]),
    st.lists(st.floats(-1e-4, 1e-4), min_size=1, max_size=30),
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
