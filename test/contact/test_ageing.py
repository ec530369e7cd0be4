# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Ageing friction: velocity steps, holds and energy against the rate-and-state law."""

import math

import numpy as np
import pytest

from stickslip_ros.contact.ageing import slide
from stickslip_ros.contact.reaction import (
    CONTACT_STATE,
    contact_lost,
    contact_stored,
    react,
    relax,
)
from stickslip_ros.drive.build import all_contacts
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.kernels.record import record
from stickslip_ros.parameters import Parameters

react = entry_point(react)
contact_lost = entry_point(contact_lost)
contact_stored = entry_point(contact_stored)
slide = entry_point(slide)

MU0, A, B = 0.3, 0.01, 0.015
DISTANCE_M, V0, CUTOFF = 1e-6, 1e-3, 1e-4
NORMAL_N = 2.0 * math.sqrt(2.0) * 0.5
STIFFNESS_N_PER_M = float(all_contacts(Parameters()).curve.cells[0, 1])
WAY_M = 4e-9
"""Way of a step of these tests: 4e-3 of the critical distance."""
STEADY = 2e-6
"""Of the coefficient: what six critical distances leave of a small start."""
STEPPED = 1e-4
"""Error of a coefficient by steps of that length, in which the age lags."""
HELD = 0.02
"""Part of the age that is lost by slip before the whole contact slips again: at most 2 % of b."""


class Slider:
    """A contact that is moved at given velocities."""

    def __init__(self, rate: float = A, ageing: float = B) -> None:
        values = {'contact.friction_rate': rate, 'contact.friction_ageing': ageing}
        self.model = all_contacts(Parameters().updated(values)).copy()
        self.state = relax(record(CONTACT_STATE), 0.5)
        self.state.on_springs, self.state.springs.ages_s[:] = True, 1.0

    def settle(self, speed_m_per_s: float) -> float:
        """Slide until all springs slip, from the age of steady sliding; return the coefficient."""
        self.state.springs.ages_s[:] = DISTANCE_M / speed_m_per_s
        return self.go(speed_m_per_s, 2.0 * DISTANCE_M)[-1]

    def go(self, speed_m_per_s: float, way_m: float, step_m: float = WAY_M) -> list[float]:
        """Slide a way; return the coefficient after each step."""
        found, start_m = [], self.state.memory.u_m
        for k in range(1, round(way_m / step_m) + 1):
            self.wait(
                step_m / abs(speed_m_per_s), start_m + math.copysign(k * step_m, speed_m_per_s)
            )
            found.append(self.state.memory.force_n / NORMAL_N)
        return found

    def wait(self, time_s: float, u_m: float | None = None) -> None:
        place_m = self.state.memory.u_m if u_m is None else u_m
        react(self.model, self.state, place_m, time_s, 0.0)


def steady(speed: float, rate: float = A, ageing: float = B) -> float:
    """Return the coefficient of steady sliding."""
    return MU0 + rate * math.log((speed + CUTOFF) / (V0 + CUTOFF)) + ageing * math.log(V0 / speed)


@pytest.mark.parametrize('speed', [2e-4, V0, 2e-2])
def test_steady_sliding_has_the_coefficient_of_its_velocity(speed):
    slider = Slider()
    slider.settle(speed)
    assert slider.go(speed, 6.0 * DISTANCE_M)[-1] == pytest.approx(steady(speed), abs=STEADY)


@pytest.mark.parametrize('ratio', [3.0, 10.0, 0.1])
def test_a_velocity_step_is_followed_over_the_critical_distance(ratio):
    slider = Slider()
    slider.state.springs.ages_s[:] = DISTANCE_M / V0
    before = slider.go(V0, 8.0 * DISTANCE_M)[-1]
    after = np.array(slider.go(ratio * V0, 6.0 * DISTANCE_M))
    # The springs slip by the way of the runner but for that by which they stretch.
    stretched_m = (after - before) * NORMAL_N / STIFFNESS_N_PER_M
    x_m = WAY_M * np.arange(1, len(after) + 1) - stretched_m
    faded = np.exp(-x_m / DISTANCE_M)
    direct = A * math.log((ratio * V0 + CUTOFF) / (V0 + CUTOFF))
    # theta v2/D_c goes from v2/v1 to 1 over D_c: the closed form of the ageing law.
    expected = before + direct + B * np.log((1.0 + (ratio - 1.0) * faded) / ratio)
    settled = x_m > 0.4 * DISTANCE_M
    assert np.abs(after - expected)[settled].max() < STEPPED
    assert after[-1] - before == pytest.approx(direct - B * math.log(ratio), rel=0.03)


def test_friction_grows_by_b_per_e_fold_of_the_hold():
    peaks = []
    for hold_s in (1.0, 10.0, 100.0, 1000.0):
        slider = Slider(rate=0.0)
        slider.settle(V0)
        slider.wait(hold_s)
        peaks.append(max(slider.go(V0, 0.06 * DISTANCE_M, 5e-10)))
    growth = np.diff(peaks) / math.log(10.0)
    assert growth == pytest.approx(B, rel=HELD)
    assert peaks[0] == pytest.approx(MU0 + B * math.log(V0 / DISTANCE_M), abs=HELD * B * 10)


def test_a_held_contact_relaxes_with_the_logarithm_of_time_by_its_rate_effect():
    slider = Slider(ageing=0.0)
    slider.settle(10.0 * V0)
    slider.model.ageing.cutoff_m_per_s = 1e-12
    for _ in range(40):
        slider.wait(1e-4)
    early = slider.state.memory.force_n / NORMAL_N
    for _ in range(360):
        slider.wait(1e-4)
    late = slider.state.memory.force_n / NORMAL_N
    assert early - late == pytest.approx(A * math.log(10.0), rel=1e-2)


@pytest.mark.parametrize('speed', [1e-3, 1e-4, 0.0, -CUTOFF, -1e-3])
@pytest.mark.parametrize('pulled', [-1.07, 0.0, 0.9, 1.15])
def test_a_step_of_a_spring_is_as_exact_as_a_thousand(speed, pulled):
    ageing = Slider(ageing=0.0).model.ageing
    limit_n, n_per_m, time_s = 0.01, 5e4, 2e-5

    def slid(steps):
        force_n, lost_j = pulled * limit_n, 0.0
        for _ in range(steps):
            way_m, dt_s = speed * time_s / steps, time_s / steps
            force_n, _, more_j = slide(ageing, 1.0, force_n, limit_n, n_per_m, way_m, dt_s)
            lost_j += more_j
        return force_n, lost_j

    (force_n, lost_j), (exact_n, exact_j) = slid(1), slid(1000)
    assert force_n == pytest.approx(exact_n, rel=1e-9)
    assert lost_j == pytest.approx(exact_j, rel=0.05, abs=1e-16)


def test_a_spring_slips_at_the_speed_that_its_force_says():
    ageing, limit_n, n_per_m, dt_s = Slider(ageing=0.0).model.ageing, 0.01, 5e4, 1e-10
    for speed in (1e-4, 1e-3, 0.05):
        coefficient = MU0 + A * math.log((speed + CUTOFF) / (V0 + CUTOFF))
        force_n = limit_n * coefficient / MU0
        later_n, _, _ = slide(ageing, 1.0, force_n, limit_n, n_per_m, 0.0, dt_s)
        assert (force_n - later_n) / (n_per_m * dt_s) == pytest.approx(speed, rel=0.01)


def test_the_edge_of_a_contact_is_renewed_while_its_middle_goes_on_ageing():
    slider, way_m = Slider(rate=0.0), 2e-8
    slider.go(V0, way_m, 5e-10)
    springs, last = slider.state.springs, slider.state.springs.last[0]
    slid_m = way_m - springs.forces_n[last] * slider.model.bank.per_shear_m_per_n[last]
    assert springs.ages_s[0] == pytest.approx(1.0 + way_m / V0, rel=1e-12)
    assert springs.ages_s[last] == pytest.approx(math.exp(-slid_m / DISTANCE_M), rel=1e-4)
    assert np.all(np.diff(springs.ages_s[: last + 1]) <= 0.0)


def test_friction_only_loses_energy_and_all_of_it_is_booked():
    slider, random = Slider(), np.random.default_rng(7)
    state, work_j, lost_j = slider.state, 0.0, 0.0
    for turn in random.uniform(-3e-7, 3e-7, 15):
        start_m, speed = state.memory.u_m, 10.0 ** random.uniform(-4.0, -1.0)
        for u_m in np.linspace(start_m, turn, 1 + int(abs(turn - start_m) / 4e-10))[1:]:
            before_n, way_m = state.memory.force_n, u_m - state.memory.u_m
            slider.wait(abs(way_m) / speed, float(u_m))
            work_j += 0.5 * (before_n + state.memory.force_n) * way_m
            assert contact_lost(slider.model, state) >= lost_j
            lost_j = contact_lost(slider.model, state)
    assert work_j == pytest.approx(lost_j + contact_stored(slider.model, state), rel=2e-4)


def test_a_contact_that_does_not_age_goes_back_to_its_turning_points():
    slider = Slider(rate=0.0, ageing=0.0)
    slider.go(V0, DISTANCE_M)
    assert not slider.state.on_springs
    assert np.all(slider.state.springs.ages_s == 1.0)
