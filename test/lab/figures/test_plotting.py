# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Figures as a journal takes them: width, letters, room, bytes, and curves that keep peaks."""

import itertools
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure
from matplotlib.text import Text

from stickslip_ros import CompareOptions, Parameters, StickSlipError, compare, linearise, open_run
from stickslip_ros.errors import RecordingError, UnknownName
from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.figures.plotting import (
    UNDATED,
    curve_style,
    decimated,
    new_figure,
    save_figure,
    styled,
    svg_of,
)
from stickslip_ros.lab.fitting.figure import draw_correlations
from stickslip_ros.lab.fitting.fit import FitOptions, fit
from stickslip_ros.lab.measurements.run_result import SawtoothRun


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


Run = tuple[SawtoothRun, Path]
COLUMN_MM = 85.0
POINTS = """preload_n,amplitude_m,force_n,force_sigma_n
0.1,4e-8,0.0211,0.002
0.1,1.5e-7,0.0613,0.002
0.5,7e-8,0.0188,0.002
0.5,1.5e-7,0.1597,0.002
"""


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / 'a_table_of_a_long_name_from_a_laboratory.csv'
    path.write_text(POINTS, encoding='utf-8')
    return path


def drawn(name: str, run: Path, table: Path) -> Any:
    """Return what draws itself: a result, by its name."""
    if name == 'linear drive':
        return linearise(Parameters())
    if name == 'fit':
        return fit(table, ['contact.friction'], options=FitOptions(steps=20, starts=1))
    if name == 'force curves':
        return compare(table, Parameters(), options=CompareOptions(steps=20))
    return (
        compare(run, run, options=CompareOptions(shift_s=1e-3))
        if name == 'two runs'
        else open_run(run)
    )


def check_words(figure: Figure) -> None:
    """See that no words lie over others or are cut."""
    figure.draw_without_rendering()
    texts = {text for text in figure.findobj(Text) if text.get_visible()}
    for axis in (axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)):
        ticks: Any = axis
        made = [*ticks.get_major_ticks(), *ticks.get_minor_ticks()]
        shown = ticks._update_ticks()  # the others are beyond its ends
        texts -= {
            each for tick in made if tick not in shown for each in (tick.label1, tick.label2)
        }
    boxes = [
        (text.get_text(), text.get_window_extent()) for text in texts if text.get_text().strip()
    ]
    assert len(boxes) > 10
    for one, other in itertools.combinations(boxes, 2):
        assert not one[1].overlaps(other[1]), (one[0], other[0])
    for words, box in boxes:
        assert figure.bbox.padded(1.0).contains(*box.min), words
        assert figure.bbox.padded(1.0).contains(*box.max), words


@pytest.mark.parametrize('name', ['run', 'two runs', 'force curves', 'fit', 'linear drive'])
def test_no_words_of_a_column_lie_over_others_or_are_cut(recorded_run, table, name):
    figure: Figure = drawn(name, recorded_run[1], table).plot(width_mm=COLUMN_MM)
    assert 25.4 * figure.get_figwidth() == pytest.approx(COLUMN_MM)
    assert 25.4 * figure.get_figheight() < 240.0  # of a page
    check_words(figure)


@pytest.mark.parametrize(
    ('start_s', 'frequency_hz'),
    [(12.345, 1e3), (5e-3, 170.0), (3600.0, 9.1e3)],  # the last has the longest labels
)
def test_no_words_of_a_run_with_an_enlarged_cycle_lie_over_others(start_s, frequency_hz):
    phase = np.arange(0.0, 25.0, 0.02)
    time_s = start_s + phase / frequency_hz
    run: Any = {'time_s': time_s, 'voltage_v': 300.0 * (phase % 1.0), 'position_m': 1e-7 * phase}
    figure = compare(run, run).plot()
    assert len(figure.axes) == 8
    check_words(figure)


def test_a_matrix_of_correlations_shows_its_values_apart_from_each_other():
    for count in (2, 5, 12):
        values: Any = np.linspace(-1.0, 1.0, count**2).reshape(count, count)
        values[0, 1] = np.nan
        figure = draw_correlations([f'contact.young_sphere_{k}' for k in range(count)], values)
        check_words(figure)
        shown = [each.get_text().replace('−', '-') for each in figure.axes[0].texts]
        assert shown.pop(1) == '–'
        expected = np.delete(values, 1)
        assert [float(each) for each in shown] == pytest.approx(expected.tolist(), abs=0.0051)
    assert figure.axes[0].images[0].get_clim() == (-1.0, 1.0)


def test_a_figure_has_its_size_and_letters_that_journals_take(recorded_run: Run, tmp_path: Path):
    style = tmp_path / 'letters.mplstyle'
    style.write_text('font.size: 7', encoding='utf-8')
    figure = open_run(recorded_run[1]).plot(style=str(style), width_mm=120.0)
    figure.savefig(tmp_path / 'a.pdf')
    save_figure(figure, tmp_path / 'b.pdf')
    for name in ('a.pdf', 'b.pdf'):
        content = (tmp_path / name).read_bytes()
        assert b'/Type3' not in content
        assert b'/FontFile2' in content  # TrueType
    sizes = {text.get_fontsize() for text in figure.axes[0].get_xticklabels()}
    sizes |= {figure.axes[0].yaxis.label.get_fontsize()}
    assert sizes == {7.0}
    assert figure.get_suptitle() == ''
    save_figure(figure, tmp_path / 'a.png')
    header = (tmp_path / 'a.png').read_bytes()[16:20]
    assert int.from_bytes(header, 'big') == pytest.approx(120.0 / 25.4 * 600, abs=1)


def test_a_style_is_typed_and_what_is_none_is_refused(recorded_run, table, tmp_path, capsys):
    picture = tmp_path / 'a.svg'
    widths_pt = list[float]()
    own = tmp_path / 'own.mplstyle'
    own.write_text('figure.figsize: 4, 3', encoding='utf-8')
    for words in (
        ['--style', 'paper'],
        ['--width', '85mm'],
        ['--width', '170mm'],
        ['--style', str(own)],
        [],
    ):
        model = ['compare', str(table), 'model', '--steps', '20', '--figure', str(picture)]
        assert main([*model, *words]) == 0
        widths_pt += map(float, re.findall(r'<svg [^>]*width="([\d.]+)pt"', picture.read_text()))
    expected = np.array([85.0, 85.0, 170.0, 4.0 * 25.4, 8.0 * 25.4]) * 72.0 / 25.4
    assert widths_pt == pytest.approx(expected.tolist(), abs=0.01)
    assert f'figure {picture}' in capsys.readouterr().out
    for words, told in (
        (['--style', 'poster'], "style 'poster' is not known; use screen, paper or a file"),
        (['--style', 'none.mplstyle'], 'none.mplstyle'),
        (['--width', '85'], '85 m is wider than a page; write 85mm for millimetres'),
    ):
        assert main(['plot', str(recorded_run[1]), *words]) == 2
        assert told in capsys.readouterr().err
    with pytest.raises(StickSlipError, match='below the minimum 40 mm'):
        linearise(Parameters()).plot(width_mm=0.085)


def test_results_say_in_a_line_what_they_are(table: Path):
    assert repr(linearise(Parameters())).startswith('LinearDrive: resonance ')
    fitted = fit(table, ['contact.friction'], options=FitOptions(steps=20, starts=1))
    assert repr(fitted).startswith('contact.friction: 0.2')
    assert 'The fit does not hold, so no errors are given' in repr(fitted)
    assert 'the numbers are missed by more than their errors' in fitted._repr_html_()
    compared = compare(table, Parameters(), options=CompareOptions(steps=20))
    assert repr(compared).startswith('Over 4 points the force of B')
    assert '<p>Chi-square of the force is ' in compared._repr_html_()
