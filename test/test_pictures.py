# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The pictures of the pages, drawn anew, have the numbers that the text around them states."""

import io
import re
from pathlib import Path

import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stickslip_ros import Parameters, compare
from stickslip_ros.lab.figures.plotting import new_figure
from stickslip_ros.lab.paper.make import FIGURES, make_tables

DOCS = Path(__file__).resolve().parents[1] / 'docs'
FORCES = 'force at 160 nm (mN)'
ROWS = {
    'u_x,max, lower contact': '$u_{x,max}$ of a lower contact, $F_{n2}$',
    '0-amplitude from steps, 200 Hz': '0-amplitude, step length extrapolated',
    '0-amplitude from force, 200 Hz': '0-amplitude, onset of generated force',
    'without rebound, closed form': '0-amplitude without rebound, closed form',
}
"""Rows of the table below Fig. 7, and the curves of the picture."""
HALF_DIGIT_NM = 0.0501


def text_of(page: str) -> str:
    return (DOCS / page).read_text(encoding='utf-8')


def table_of(page: str, corner: str) -> pd.DataFrame:
    """Return the table of a page whose first cell is this; its cells are texts."""
    lines = text_of(page).splitlines()
    begin = next(k for k, line in enumerate(lines) if line.startswith(f'| {corner} |'))
    end = next(k for k in range(begin, len(lines)) if not lines[k].startswith('|'))
    head, _, *rows = (
        [cell.strip() for cell in each[1:-1].split('|')] for each in lines[begin:end]
    )
    return pd.DataFrame(rows, columns=head).set_index(corner)


@pytest.fixture(scope='module')
def drawn(compiled_kernels: None) -> dict[str, Figure]:
    """Give the figures of the paper by two points of each curve, the first and the last."""
    tables = make_tables(list(FIGURES.values()), Parameters(), points=2)
    figures = {name: new_figure(*each.inches) for name, each in FIGURES.items()}
    for name, figure in figures.items():
        FIGURES[name].draw(pd.DataFrame(tables[name]), figure)
    return figures


def legend_of(axes: Axes) -> list[str]:
    legend = axes.get_legend()
    assert legend is not None
    return [text.get_text() for text in legend.get_texts()]


@pytest.mark.parametrize(
    ('name', 'row'), [('fig2', 'rough'), ('fig6a', 'rough'), ('fig6b', 'smooth')]
)
def test_the_forces_beside_the_curves_are_those_of_the_page(drawn, name, row):
    [axes] = drawn[name].axes
    shown = dict(zip(legend_of(axes), (text.get_text() for text in axes.texts), strict=True))
    stated = table_of('evidence/paper_figures.md', FORCES).loc[f'{row}, c = 0']
    assert len(shown) in {3, 4}
    assert shown == {preload: f'{stated[preload]} mN' for preload in shown}


def test_the_friction_limits_of_the_captions_are_those_of_the_page():
    captions = ' '.join(FIGURES[name].caption(Parameters()) for name in ('fig2', 'fig6a'))
    stated = table_of('evidence/paper_figures.md', FORCES).loc['friction limit 2 sqrt2 mu F_p']
    told = re.findall(r'can hold ([\d, ]+) mN', captions)
    assert {number for each in told for number in each.split(', ')} == set(stated)


def test_the_curves_of_figure_7_go_through_the_numbers_of_the_page(drawn: dict[str, Figure]):
    stated = table_of('evidence/paper_figures.md', 'nm')
    for axes, begin in zip(drawn['fig7'].axes, (0, 3), strict=True):
        assert str(stated.columns[begin]) == f'{axes.get_title()} 0.1 N'
        curves = {line.get_label(): line.get_ydata() for line in axes.get_lines()}
        for row, label in ROWS.items():
            first, _, last = map(float, stated.loc[row].iloc[begin : begin + 3])
            assert curves[label] == pytest.approx([first, last], abs=HALF_DIGIT_NM), row


def test_the_comparison_has_the_preloads_forces_and_chi_squares_of_the_page():
    text = text_of('howto/compare.md')
    [block] = re.findall(r'^```csv\n(.*?)^```', text, re.DOTALL | re.MULTILINE)
    points = pd.read_csv(io.StringIO(block), comment='#')
    rough, smooth = (
        compare(points, Parameters().updated({'contact.profile': profile}))
        for profile in ('rough', 'smooth')
    )
    figure = rough.plot()
    [legend] = figure.legends
    shown = [each.get_text() for each in legend.get_texts()]
    preloads = [f'{each:g} N' for each in points['preload_n'].unique()]
    assert [each.rpartition(', ')[2] for each in shown] == 2 * preloads
    bars = [bar for each in figure.axes[0].containers for bar in each[2][0].get_segments()]
    noise_mn = float(re.findall(r'noise of (\S+) mN', text)[0])
    middles_mn = 1e3 * points['force_n']
    assert sorted(bar[:, 1].mean() for bar in bars) == pytest.approx(sorted(middles_mn))
    assert [bar[1, 1] - bar[0, 1] for bar in bars] == pytest.approx([2.0 * noise_mn] * len(bars))
    told = re.search(r'chi-square is (\S+) for (\d+) degrees of freedom, .* (\d+):', text)
    assert told is not None
    stated = f'Chi-square of the force is {told[1]} for {told[2]} degrees of freedom'
    assert stated in repr(rough)
    assert f'is {told[3]} for' in repr(smooth)
