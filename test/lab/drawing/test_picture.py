# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The drawing of the stand, whatever its parameters; as a program: docs/images/stand.svg.

    python test/lab/drawing/test_picture.py

"""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from stickslip_ros import Parameters, draw_stand, simulate
from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.lab.cli.main import main

PICTURE = Path(__file__).resolve().parents[3] / 'docs' / 'images' / 'stand.svg'
NUMBER = re.compile(r'-?\d+\.?\d*')
PIXELS = 0.5
"""Between two machines: the places of a curve are rounded to a tenth."""


def film() -> str:
    """Draw the first cycles of the default stand, in which the spring of its cell is pressed."""
    return draw_stand(simulate(Parameters(), amplitude_m=160e-9, steps=8))


def test_the_drawing_of_the_documentation_is_that_of_this_version():
    kept, now = PICTURE.read_text(encoding='utf-8'), film()
    assert NUMBER.split(kept) == NUMBER.split(now)
    numbers = ([float(each) for each in NUMBER.findall(text)] for text in (kept, now))
    assert next(numbers) == pytest.approx(next(numbers), abs=PIXELS)


@pytest.mark.parametrize(
    'values',
    [
        {'load_cell.contact': 'absent'},
        {'load_cell.contact': 'one_sided', 'load_cell.gap': 1e-3},
        {'load_cell.contact': 'one_sided', 'load_cell.gap': 1.0},
        {'contact.radius': 1e-6, 'stand.travel_max': 1.0},
        {'contact.radius': 1.0, 'runner.mass': 10.0},
        {'contact.profile': 'rough_line'},
        {'contact.law': 'lugre'},
    ],
)
def test_every_stand_is_drawn_within_the_picture(values: dict[str, object]):
    parameters = Parameters().updated(values)
    root = ET.fromstring(draw_stand(parameters))
    width, height = map(float, root.attrib['viewBox'].split()[2:])
    for each in root.iter('{http://www.w3.org/2000/svg}rect'):
        x, y = (abs(float(each.attrib.get(name, 0.0))) for name in 'xy')
        assert x + float(each.attrib['width']) <= width + 1.0
        assert y + float(each.attrib['height']) <= height + 1.0
    words = ''.join(root.itertext())
    assert ('no load cell' in words) == (parameters.load_cell.contact == 'absent')
    assert ('not of lugre' in words) == (parameters.contact.law == 'lugre')


def test_a_run_without_cycles_or_without_a_trace_is_refused():
    run = simulate(Parameters(), amplitude_m=100e-9, steps=8)
    with pytest.raises(RecordingError, match='no 2 cycles of a saw-tooth so far; draw its'):
        draw_stand(run, end_s=1.5e-3)
    with pytest.raises(OutOfRange, match='end of the cycles 9 s is after the end of the run'):
        draw_stand(run, end_s=9.0)
    del run.series['foot_m']  # as of a recording of another program
    with pytest.raises(RecordingError, match='has no trace; record'):
        draw_stand(run)


def test_the_verb_writes_drawing_film_and_description(tmp_path: Path):
    run, film, stand = (tmp_path / name for name in ('run.mcap', 'film.svg', 'stand.urdf'))
    simulate(Parameters(), amplitude_m=100e-9, steps=8, record=run)
    assert main(['draw', str(run), '-o', str(film)]) == 0
    assert film.read_text(encoding='utf-8').count('<animate') > 10
    assert main(['draw', '--set', 'runner.mass=6g', '-o', str(stand)]) == 0
    assert '<mass value="0.006"/>' in stand.read_text(encoding='utf-8')
    assert main(['draw', str(run), '--set', 'runner.mass=6g', '-o', str(film)]) == 2
    assert main(['draw', '-o', str(tmp_path / 'stand.png')]) == 2


if __name__ == '__main__':
    PICTURE.write_text(film(), encoding='utf-8')
