# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The plays of the piezo: opening and stroke of the loop, wiping out, congruent loops."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip_ros.drive.build import plant_of
from stickslip_ros.drive.piezo import hysteresis, rest_piezo
from stickslip_ros.drive.records import PIEZO_STATE
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.kernels.record import record
from stickslip_ros.parameters import Parameters

hysteresis = entry_point(hysteresis)

LOW_V, HIGH_V = -20.0, 130.0
RANGE_V = HIGH_V - LOW_V
GAIN = 0.5e-9
STROKE_M = GAIN * RANGE_V
ROUNDING = 1e-12
"""Sums of some ten terms, relative to the stroke."""


class Loop:
    """A piezo that is led along voltages, quasi-statically."""

    def __init__(self, opening: float, plays: int, start_v: float = LOW_V) -> None:
        self.plant = plant_of(
            Parameters().updated(
                {
                    'amplifier.voltage_min': LOW_V,
                    'amplifier.voltage_max': HIGH_V,
                    'amplifier.voltage_initial': start_v,
                    'actuator.gain': GAIN,
                    'actuator.hysteresis': opening,
                    'actuator.plays': plays,
                }
            )
        )[0]
        self.memory = record(PIEZO_STATE)
        rest_piezo(self.plant, self.memory)

    def to(self, *voltages_v: float) -> np.ndarray:
        return np.array([hysteresis(self.plant, self.memory, volt) for volt in voltages_v])


CASES = [(0.15, 8), (0.4, 64), (0.4, 1), (0.02, 2), (0.3, 3)]


@pytest.mark.parametrize(('opening', 'plays'), CASES)
def test_the_loop_of_the_whole_range_has_the_declared_opening_in_mid_stroke(opening, plays):
    loop, middle_v = Loop(opening, plays), 0.5 * (LOW_V + HIGH_V)
    up_m, _, down_m = loop.to(middle_v, HIGH_V, middle_v)
    assert down_m - up_m == pytest.approx(opening * STROKE_M, rel=0.0, abs=ROUNDING * STROKE_M)


@pytest.mark.parametrize(('opening', 'plays'), CASES)
def test_the_loop_of_the_whole_range_has_the_stroke_of_the_gain_from_the_first_turn_on(
    opening, plays
):
    found_m = Loop(opening, plays).to(HIGH_V, LOW_V, HIGH_V, LOW_V)
    expected_m = [STROKE_M, 0.0, STROKE_M, 0.0]
    np.testing.assert_allclose(found_m, expected_m, rtol=0.0, atol=ROUNDING * STROKE_M)


@pytest.mark.parametrize(('opening', 'plays'), CASES)
def test_the_displacement_lags_behind_the_voltage(opening, plays):
    loop = Loop(opening, plays)
    volts = np.linspace(LOW_V, HIGH_V, 301)
    up_m, down_m = loop.to(*volts), loop.to(*volts[::-1])[::-1]
    assert np.all(down_m[1:-1] > up_m[1:-1])
    assert (down_m - up_m)[150] == pytest.approx((down_m - up_m).max(), rel=0.01)
    assert np.all(np.diff(up_m) > 0.0)
    assert np.all(np.diff(down_m) > 0.0)


def test_without_hysteresis_the_displacement_is_proportional_to_the_voltage():
    loop = Loop(0.0, 8)
    assert loop.plant.piezo.plays == 0
    volts = np.array([LOW_V, 3.0, HIGH_V, -7.0])
    np.testing.assert_allclose(loop.to(*volts), GAIN * (volts - LOW_V), rtol=1e-15)


volts_inside = st.floats(LOW_V, HIGH_V)


@given(before=st.lists(volts_inside, max_size=6), inner=st.lists(volts_inside, max_size=6))
def test_what_happened_within_a_larger_swing_is_wiped_out(before, inner):
    loop, other = Loop(0.25, 8), Loop(0.25, 8)
    loop.to(*before, HIGH_V, LOW_V, 60.0)
    other.to(LOW_V, HIGH_V, LOW_V, *[min(volt, 60.0) for volt in inner], LOW_V, 60.0)
    probes_v = (61.0, 90.0, 30.0, 80.0)
    difference_m = loop.to(*probes_v) - other.to(*probes_v)
    assert np.max(np.abs(difference_m)) < ROUNDING * STROKE_M


@given(before=st.lists(volts_inside, max_size=6), other_before=st.lists(volts_inside, max_size=6))
def test_loops_between_the_same_voltages_are_congruent(before, other_before):
    shapes_m = []
    for voltages_v in (before, other_before):
        loop = Loop(0.25, 8)
        loop.to(*voltages_v, 40.0, 100.0, 40.0)
        shapes_m.append(np.diff(loop.to(40.0, 55.0, 80.0, 100.0, 70.0, 40.0)))
    np.testing.assert_allclose(shapes_m[0], shapes_m[1], rtol=0.0, atol=ROUNDING * STROKE_M)


@given(turns=st.lists(volts_inside, min_size=1, max_size=8), pieces=st.integers(1, 7))
def test_the_pieces_of_a_way_do_not_matter(turns, pieces):
    whole, cut, at_v = Loop(0.25, 8), Loop(0.25, 8), LOW_V
    for turn_v in turns:
        end_m = whole.to(turn_v)[-1]
        cut_m = cut.to(*np.linspace(at_v, turn_v, pieces + 1)[1:])[-1]
        assert cut_m == pytest.approx(end_m, rel=0.0, abs=ROUNDING * STROKE_M)
        at_v = turn_v
