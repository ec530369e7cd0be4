"""The rival friction laws: closed forms and published benchmarks."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from stickslip_ros.contact.laws import DAHL, EPM, LUGRE, FrictionLaw, deflect

COULOMB_N = 1.0
# The benchmark of Canudas de Wit, Olsson, Astrom, Lischinsky (1995), for a unit mass.
SIGMA_0, SIGMA_1, SIGMA_2 = 1e5, math.sqrt(1e5), 0.4
STATIC_RATIO, STRIBECK_M_PER_S, BREAKAWAY = 1.5, 1e-3, 0.7
SPRING_N_PER_M, PULL_M_PER_S = 2.0, 0.1
SLIP_STARTS_S = (7.438, 13.800, 20.163)
PLATEAUS_M = (0.6363, 1.2726)
LARGEST_FORCE_N = 1.477
# The references are printed to three or four digits.
PRINTED_S, PRINTED = 1e-3, 1e-4
DT_S = 5e-5


def law(number):
    return FrictionLaw(
        number, SIGMA_0, SIGMA_1, SIGMA_2, STATIC_RATIO, STRIBECK_M_PER_S, BREAKAWAY
    )


@njit
def pulled_mass(law, spring_n_per_m, pull_m_per_s, static_n, wave_n, wave_hz, dt_s, steps):
    """Drag a unit mass by a spring, or by a force; return position, speed and friction."""
    out = np.zeros((steps, 3))
    x = v = z = friction = 0.0
    for i in range(steps):
        for half in range(2):
            t = (i + half) * dt_s
            rise = min(t * wave_hz, 1.0)
            drive = rise * static_n + wave_n * math.sin(2 * math.pi * wave_hz * t) * (rise >= 1)
            drive += spring_n_per_m * (pull_m_per_s * t - x)
            v += 0.5 * dt_s * (drive - friction)
            if half == 0:
                x_new = x + dt_s * v
                z, friction, _ = deflect(law, 1.0, z, x_new - x, dt_s)
                x = x_new
        out[i] = x, v, friction
    return out


@pytest.fixture(scope='module')
def stick_slip():
    steps = int(22.0 / DT_S)
    return pulled_mass(law(LUGRE), SPRING_N_PER_M, PULL_M_PER_S, 0.0, 0.0, 1.0, DT_S, steps)


def test_lugre_slips_at_the_published_times(stick_slip):
    sliding = stick_slip[:, 1] > STRIBECK_M_PER_S
    starts = np.flatnonzero(sliding[1:] & ~sliding[:-1]) * DT_S
    assert starts == pytest.approx(SLIP_STARTS_S, abs=PRINTED_S)


def test_lugre_sticks_at_the_published_places(stick_slip):
    just_before = [int((start - 0.05) / DT_S) for start in SLIP_STARTS_S[1:]]
    assert stick_slip[just_before, 0] == pytest.approx(PLATEAUS_M, abs=PRINTED)


def test_lugre_reaches_the_published_largest_force(stick_slip):
    assert stick_slip[:, 2].max() == pytest.approx(LARGEST_FORCE_N, rel=5e-4)


def drift_per_cycle(number):
    """Return the drift under a force from 0.2 to 0.8 N, below the static 1.5 N."""
    steps = int(21.0 / DT_S)
    x = pulled_mass(law(number), 0.0, 0.0, 0.5, 0.3, 1.0, DT_S, steps)[:, 0]
    cycle = int(1.0 / DT_S)
    return (x[20 * cycle] - x[10 * cycle]) / 10


def test_lugre_creeps_under_an_oscillating_force_as_its_equation_says():
    # The formula is quasi-static; at 1 Hz inertia and bristle damping add a little.
    quasi_static = 2e-3
    ratio = (STATIC_RATIO**2 - 0.2**2) / (STATIC_RATIO**2 - 0.8**2)
    expected_m = STATIC_RATIO / SIGMA_0 * math.log(ratio)
    assert drift_per_cycle(LUGRE) == pytest.approx(expected_m, rel=quasi_static)


def test_epm_does_not_drift_below_its_breakaway():
    deflection_m = STATIC_RATIO / SIGMA_0
    assert abs(drift_per_cycle(EPM)) < 1e-12 * deflection_m


def drag_along(number, displacements_m, dt_s=1e-3):
    z, force, lost_j, forces = 0.0, 0.0, 0.0, []
    plain = FrictionLaw(number, SIGMA_0, 0.0, 0.0, 1.0, STRIBECK_M_PER_S, BREAKAWAY)
    for du_m in np.diff(displacements_m, prepend=0.0):
        z, force, loss_j = deflect(plain, COULOMB_N, z, du_m, dt_s)
        lost_j += loss_j
        forces.append(force)
    return np.array(forces), lost_j


def test_dahl_follows_its_exponential_from_the_virgin_state():
    x_m = np.linspace(0.0, 6e-5, 50)
    forces_n, _ = drag_along(DAHL, x_m)
    # Exact for any step: the exponential is the solution.
    assert forces_n == pytest.approx(1.0 - np.exp(-SIGMA_0 * x_m), abs=1e-12)


def test_dahl_settles_into_the_loop_of_the_hyperbolic_tangent():
    amplitude_m = 1.3e-5
    turns = amplitude_m * np.tile([1.0, -1.0], 30)
    forces_n, _ = drag_along(DAHL, turns)
    assert forces_n[-2:] == pytest.approx(
        [math.tanh(SIGMA_0 * amplitude_m), -math.tanh(SIGMA_0 * amplitude_m)], rel=1e-9
    )


@given(
    st.sampled_from([DAHL, LUGRE, EPM]),
    st.lists(st.floats(-1e-4, 1e-4), min_size=1, max_size=30),
)
def test_bristles_never_exceed_the_limit_and_never_give_energy(number, places_m):
    forces_n, lost_j = drag_along(number, np.array(places_m))
    assert np.all(np.abs(forces_n) <= COULOMB_N * (1 + 1e-12))
    # Large steps of EPM use the plastic share of their middle: positive up to rounding.
    assert lost_j >= -1e-18


def test_a_stiff_law_stays_bounded_at_steps_far_beyond_its_time_constant():
    z, force, _ = deflect(law(LUGRE), COULOMB_N, 0.0, 1.0, 1.0)
    assert z == pytest.approx(COULOMB_N / SIGMA_0)
    assert abs(force) < 2.0 * COULOMB_N
