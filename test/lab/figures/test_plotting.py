# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What figures share: files of the same bytes, and curves that lose no peak."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip_ros.errors import RecordingError, UnknownName
from stickslip_ros.lab.figures.plotting import (
    UNDATED,
    curve_style,
    decimated,
    new_figure,
    save_figure,
    styled,
    svg_of,
)


def _figure():
    figure = new_figure(2.0, 1.5, 'title')
    axes = figure.subplots()
    axes.plot([0.0, 1.0], [1.0, 0.0])
    axes.set(xlabel='x', ylabel='y')
    return figure


@pytest.mark.parametrize('kind', UNDATED)
def test_the_same_figure_gives_the_same_bytes_at_any_time(tmp_path, monkeypatch, kind):
    for name, epoch in (('first', '1000000000'), ('again', '2000000000')):
        monkeypatch.setenv('SOURCE_DATE_EPOCH', epoch)
        save_figure(_figure(), tmp_path / f'{name}{kind}')
    first, again = ((tmp_path / f'{name}{kind}').read_bytes() for name in ('first', 'again'))
    assert first == again


def test_curves_differ_in_colour_and_without_it():
    with styled():
        curves = [curve_style(number) for number in range(8)]
    for look in ('color', 'linestyle'):
        assert len({curve[look] for curve in curves[:7]}) == 7
    assert curves[7] == curves[0]


def test_a_figure_as_text_is_that_of_its_file(tmp_path):
    save_figure(_figure(), tmp_path / 'figure.SVG')
    assert svg_of(_figure()) == (tmp_path / 'figure.SVG').read_text(encoding='utf-8')


def test_a_picture_of_another_kind_or_below_a_file_is_refused(tmp_path):
    with pytest.raises(UnknownName, match=r"kind of picture '.gif' is not known; use .png, .svg"):
        save_figure(_figure(), tmp_path / 'figure.gif')
    (tmp_path / 'file').touch()
    with pytest.raises(RecordingError, match=r'cannot be written .*; choose another place'):
        save_figure(_figure(), tmp_path / 'file/figure.png')


@given(st.integers(1, 3000), st.integers(1, 50), st.integers(0, 2**32 - 1))
def test_decimation_keeps_every_peak_in_few_points(count, pixels, seed):
    y = np.random.default_rng(seed).normal(size=count)
    x = np.arange(count) * 1e-9
    thin_x, thin_y = decimated(x, y, pixels)
    assert len(thin_x) == len(thin_y) <= max(4 * pixels, min(count, 4 * pixels))
    assert (thin_y.min(), thin_y.max()) == (y.min(), y.max())
    assert (thin_x[0], thin_x[-1]) == (x[0], x[-1])
    assert np.all(np.diff(thin_x) > 0.0)
    assert set(thin_y) <= set(y)


def test_one_sample_in_a_million_stays():
    y = np.zeros(1_000_000)
    y[123_456] = 1.0
    _, thin = decimated(np.arange(1_000_000, dtype=float) * 1e-6, y, 800)
    assert thin.max() == 1.0
    assert len(thin) <= 3200


def test_a_gap_stays_a_gap():
    y = np.ones(10_000)
    y[5000:5100] = math.nan
    thin_x, thin = decimated(np.arange(10_000, dtype=float), y, 100)
    inside = (thin_x >= 5000) & (thin_x < 5100)
    assert np.isnan(thin[inside]).any()
