# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""One cycle of a wave: closed, with one rise and one fall, whatever its parameters."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator

from stickslip_ros.lab.design.shapes import SHAPES, spline
from stickslip_ros.lab.design.waves import KNOTS_MAX, KNOTS_MIN

KNOTS = [0.0, 0.2, 0.4, 0.6, 0.8, 0.9, 1.0]
HEIGHTS = [0.0, 0.1, 0.5, 1.0, 0.6, 0.2, 0.0]


def assert_closed_with_one_rise(rows):
    time, height = rows.T
    top = int(np.argmax(height))
    assert (tuple(rows[0]), tuple(rows[-1]), height[top]) == ((0.0, 0.0), (1.0, 0.0), 1.0)
    assert (np.diff(time) >= 0.0).all()
    assert (np.diff(height[: top + 1]) >= 0.0).all()
    assert (np.diff(height[top:]) <= 0.0).all()


@pytest.mark.parametrize('name', SHAPES)
@given(data=st.data())
def test_a_named_shape_is_closed_whatever_its_parameters(name, data):
    shape = SHAPES[name]
    values = {
        trait: data.draw(st.floats(bounds.low, bounds.high))
        for trait, bounds in shape.traits.items()
    }
    assert_closed_with_one_rise(shape.rows(**values))


@given(data=st.data())
def test_a_spline_is_closed_and_monotone_on_either_side_whatever_its_knots(data):
    count = data.draw(st.integers(KNOTS_MIN, KNOTS_MAX))
    positive = st.floats(1e-4, 1.0)
    steps = np.array(data.draw(st.lists(positive, min_size=count, max_size=count)))
    rise = data.draw(st.integers(1, count - 1))
    times = np.concatenate(([0.0], np.cumsum(steps)[:-1] / steps.sum(), [1.0]))
    up, down = np.cumsum(steps[:rise]), np.cumsum(steps[rise:])
    heights = [0.0, *(up[:-1] / up[-1]), 1.0, *(1.0 - down[:-1] / down[-1]), 0.0]
    rows = spline(times, heights)
    assert_closed_with_one_rise(rows)
    for part in (np.s_[: rise + 1], np.s_[rise:]):
        first_s, last_s = times[part][[0, -1]]
        of_part = rows[(rows[:, 0] >= first_s) & (rows[:, 0] < last_s)]
        joined = PchipInterpolator(times[part], heights[part])(of_part[:, 0])
        assert of_part[:, 1].tolist() == np.clip(joined, 0.0, 1.0).tolist()
    for knot in zip(times, heights, strict=True):
        assert np.abs(rows - knot).max(axis=1).min() < 1e-12  # every knot is a corner


def test_the_usual_parameters_are_the_published_forms():
    assert SHAPES['sawtooth'].rows().tolist() == [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0]]
    time, height = SHAPES['parabola'].rows()[:-1].T
    assert height[time < 1.0] == pytest.approx(time[time < 1.0] ** 2)
    time, height = SHAPES['cycloid'].rows().T
    assert height == pytest.approx(height[::-1])
    assert np.interp(0.25, time, height) < 0.25  # a cusp on top is steep beside it
    time, height = SHAPES['sine-compensated'].rows()[:-1].T
    assert height == pytest.approx(time - np.sin(2.0 * np.pi * time) / (2.0 * np.pi))
    kick = SHAPES['freeze-and-kick'].rows(rise=0.5, freeze=0.5)
    assert kick[1:4].tolist() == [[0.5, 1.0], [0.75, 1.0], [0.75, 0.0]]
    trapezoid = SHAPES['trapezoid'].rows(rise=0.25, fall=0.25, hold=0.5)
    assert trapezoid[:, 0].tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]


def test_more_rows_follow_the_same_curve():
    few, many = spline(KNOTS, HEIGHTS), spline(KNOTS, HEIGHTS, rows=192)
    assert len(many) > 3 * len(few)
    assert np.interp(few[:, 0], *many.T) == pytest.approx(few[:, 1], rel=0.0, abs=1e-3)
