# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The figures of the paper, small: known answers, files, and that threads change nothing."""

import csv
import math
import re
import xml.etree.ElementTree as ET
from typing import Any

import pytest
from pandas import DataFrame

from stickslip_ros.errors import OutOfRange, RecordingError, UnknownName
from stickslip_ros.lab.figures.plotting import new_figure, styled
from stickslip_ros.lab.paper.curves import (
    max_presliding_m,
    quasi_static_zero_m,
    stand_at,
    zero_by_steps_m,
)
from stickslip_ros.lab.paper.figure import write_figure
from stickslip_ros.lab.paper.make import FIGURES, chosen_figures, make_tables
from stickslip_ros.lab.runs.courses import run_course
from stickslip_ros.lab.runs.sawtooth_run import run_drive
from stickslip_ros.lab.runs.zero_amplitude import force_onset_m
from stickslip_ros.parameters import Parameters
from stickslip_ros.units import MN

NO_REBOUND_ERROR = 0.05
"""Friction and damping let a strongly damped runner creep on for a few per cent."""
STIFF_ERROR = 0.1
"""The threshold moves the onset; without the give of the contacts it would be missed by half."""
ROUNDED_ERROR = 1e-3
"""Time step behind a low-pass; of the force at the full stroke."""
FULL_M, FORCE_HZ, STEP_HZ = 160e-9, 1000.0, 200.0
BANDWIDTHS_HZ = (0.0, 1e6, 300e3, 100e3, 30e3, 10e3)
LOW_PASS_STEP_S = 2e-6
"""Half of it changes no force behind a low-pass by 1e-3."""
PNG = b'\x89PNG\r\n\x1a\n'
POINTS = 2
CAPTION = 90
"""No axis label is so long, and every caption is longer."""


@pytest.fixture(scope='module')
def tables():
    return make_tables(list(FIGURES.values()), Parameters(), points=POINTS)


def test_figure_7_of_other_feet_is_refused_with_the_way_out():
    stand = Parameters().updated({'feet.count': [3], 'feet.share': [0.4]})
    with pytest.raises(
        OutOfRange, match=r'feet.count \[3\] is not of the two upper .* leave feet'
    ):
        max_presliding_m(stand)


@pytest.mark.parametrize('profile', ['rough', 'smooth'])
@pytest.mark.parametrize('preload_n', [0.1, 1.0])
def test_a_damped_runner_has_the_0_amplitude_of_the_closed_form_without_rebound(
    profile, preload_n
):
    stand = stand_at(
        Parameters(), preload_n, {'contact.profile': profile, 'runner.damping': 200.0}
    )
    found_m, _ = run_course(zero_by_steps_m(stand, STEP_HZ))
    assert found_m == pytest.approx(quasi_static_zero_m(stand), rel=NO_REBOUND_ERROR, abs=0.0)


@pytest.mark.parametrize('preload_n', [0.5, 1.0])
def test_on_a_stiff_load_cell_force_begins_at_the_same_amplitude(preload_n):
    changes = {'runner.damping': 80.0, 'load_cell.stiffness': 3e6}
    stand = stand_at(Parameters(), preload_n, changes)
    found_m = force_onset_m(stand, FORCE_HZ)
    assert found_m == pytest.approx(quasi_static_zero_m(stand), rel=STIFF_ERROR, abs=0.0)


def test_a_slow_fall_leaves_no_line_to_extrapolate():
    slow = stand_at(Parameters(), 1.0, {'amplifier.slew_rate': 5e6})
    zero_m, slope = run_course(zero_by_steps_m(slow, STEP_HZ))
    assert math.isnan(zero_m)
    assert slope < 0.5


def rounded_stand(parameters: Parameters, preload_n: float, bandwidth_hz: float) -> Parameters:
    """Return a stand behind a low-pass; 0 Hz is none."""
    changes = {'amplifier.bandwidth': bandwidth_hz}
    changes |= {'sim.dt': LOW_PASS_STEP_S} if bandwidth_hz else {}
    return stand_at(parameters, preload_n, changes)


@pytest.mark.parametrize(
    ('preload_n', 'bandwidth_hz', 'known_mn'),
    [
        (0.1, 1e4, 33.667),
        (0.5, 1e5, 157.614),
        (0.5, 3e4, 101.392),
        (1.0, 1e6, 219.376),
        (1.0, 3e5, 208.236),
        (1.0, 1e5, 171.271),
        (1.0, 3e4, 68.143),
    ],
)
def test_the_force_behind_a_low_pass_is_that_of_the_periodic_wave_in_closed_form(
    preload_n, bandwidth_hz, known_mn
):
    """Known: the steady wave b t + C exp(-t/tau) in 192 straight pieces; twice as many: 2e-4."""
    stand = rounded_stand(Parameters(), preload_n, bandwidth_hz)
    run = run_drive(stand, FULL_M, FORCE_HZ)
    assert run.force_mean_n * MN == pytest.approx(known_mn, rel=ROUNDED_ERROR, abs=0.0)


def test_the_less_a_saw_tooth_is_rounded_the_more_force_it_generates():
    stands = [rounded_stand(Parameters(), 0.5, bandwidth_hz) for bandwidth_hz in BANDWIDTHS_HZ]
    forces_n = [run_drive(stand, FULL_M, FORCE_HZ).force_mean_n for stand in stands]
    assert forces_n == sorted(forces_n, reverse=True)
    assert forces_n[0] == run_drive(stand_at(Parameters(), 0.5), FULL_M, FORCE_HZ).force_mean_n


def test_the_number_of_workers_does_not_change_the_tables():
    figures = chosen_figures(['fig6b', 'fig7'])
    single, pooled = (
        make_tables(figures, Parameters(), points=3, workers=workers) for workers in (1, 3)
    )
    assert repr(single) == repr(pooled)  # not a number is not itself


@pytest.mark.parametrize('name', FIGURES)
def test_a_figure_is_written_as_table_pictures_and_caption(name, tables, tmp_path):
    figure = FIGURES[name]
    files = write_figure(figure, tables[name], Parameters(), tmp_path)
    assert [path.name for path in files] == [
        f'{name}.{kind}' for kind in ('csv', 'md', 'png', 'svg')
    ]
    with files[0].open(encoding='utf-8') as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(tables[name]) > 0
    assert rows[0].keys() == tables[name][0].keys()
    page = files[1].read_text(encoding='utf-8')
    assert f'({name}.png)' in page
    assert 'damping c = ' in page
    assert files[2].read_bytes().startswith(PNG)
    assert ET.parse(files[3]).getroot().tag.endswith('svg')


def test_every_column_of_a_table_is_filled_and_named_with_its_unit(tables):
    without = {'profile', 'steady', 'steps', 'step_slope'}
    for name, table in tables.items():
        assert all(row.keys() == table[0].keys() for row in table), name
        units = {column.rpartition('_')[2] for column in table[0].keys() - without}
        assert units <= {'n', 'm', 'hz', 's'}, name


@pytest.mark.parametrize('name', FIGURES)
def test_without_colour_the_curves_of_a_panel_differ_and_no_caption_is_in_the_picture(
    name, tables, tmp_path
):
    figure, table = FIGURES[name], tables[name]
    with styled():
        drawn = new_figure(*figure.inches)
        figure.draw(DataFrame(table), drawn)
    for axes in drawn.axes:
        curves: list[Any] = [c for c in axes.lines if not str(c.get_label()).startswith('_')]
        looks = {(str(c._dash_pattern), c.get_marker(), c.get_linewidth()) for c in curves}
        assert len(looks) == len(curves)
    *_, picture = write_figure(figure, table, Parameters(), tmp_path)
    assert max(map(len, words_in(picture))) < CAPTION


def test_a_preload_has_one_colour_in_all_figures_and_no_two_figures_have_the_same_title(tables):
    seen: dict[str, set[tuple[object, str]]] = {}
    for name in ('fig2', 'fig6a', 'fig6b'):
        with styled():
            drawn = new_figure(*FIGURES[name].inches)
            FIGURES[name].draw(DataFrame(tables[name]), drawn)
        lines: list[Any] = [line for axes in drawn.axes for line in axes.lines]
        for line in lines:
            if label := re.search(r'[\d.]+ N$', str(line.get_label())):
                seen.setdefault(label[0], set()).add((line.get_color(), str(line._dash_pattern)))
    assert seen.keys() == {'0.1 N', '0.4 N', '0.5 N', '0.7 N', '1 N'}
    assert all(len(looks) == 1 for looks in seen.values())
    assert len(set.union(*seen.values())) == len(seen)
    titles = [figure.title for figure in FIGURES.values()]
    assert len(set(titles)) == len(titles)


def words_in(picture):
    """Return the texts of a picture in SVG."""
    return re.findall('<!-- (.*?) -->', picture.read_text(encoding='utf-8'), re.DOTALL)


def test_a_caption_and_a_heading_name_what_was_changed(tables, tmp_path):
    damped = Parameters().updated({'runner.damping': 80.0})
    _, page, _, picture = write_figure(FIGURES['fig2'], tables['fig2'], damped, tmp_path)
    text = page.read_text(encoding='utf-8')
    assert 'damping c = 80 N s/m' in text
    assert 'Changed: runner.damping = 80.0.' in text
    assert 'changed: runner.damping = 80.0' in words_in(picture)
    many = {'runner.damping': 80.0, 'runner.mass': 0.004, 'contact.friction': 0.2, 'sim.seed': 7}
    _, page, _, picture = write_figure(
        FIGURES['fig2'], tables['fig2'], Parameters().updated(many), tmp_path
    )
    assert 'changed: 4 parameters' in words_in(picture)
    assert 'contact.friction = 0.2' in page.read_text(encoding='utf-8')


def test_progress_is_told_up_to_the_last_row():
    told = []
    make_tables(
        chosen_figures(['fig2']),
        Parameters(),
        points=POINTS,
        workers=1,
        progress=lambda done, wanted: told.append((done, wanted)),
    )
    assert told[-1] == (8, 8)


def test_an_unknown_figure_a_single_point_and_a_folder_that_is_a_file_are_refused(
    tables, tmp_path
):
    with pytest.raises(UnknownName, match=r"figure 'fig9' is not known; use fig2, fig6a"):
        chosen_figures(['fig9'])
    with pytest.raises(OutOfRange, match=r'points 1 is below 2, .*; raise it'):
        make_tables(chosen_figures(['fig2']), Parameters(), points=1)
    taken = tmp_path / 'file'
    taken.touch()
    with pytest.raises(RecordingError, match='cannot be written'):
        write_figure(FIGURES['fig2'], tables['fig2'], Parameters(), taken)
