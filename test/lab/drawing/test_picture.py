# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The drawing of the stand, whatever its parameters, and the example that writes a film.

    python docs/examples/film.py    # and copy runs/film.svg to docs/images/stand.svg

"""

import re
import runpy
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import pytest

from stickslip_ros import Parameters, draw_stand, simulate
from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.drawing.film import FRAMES

DOCS = Path(__file__).resolve().parents[3] / 'docs'
PICTURE = DOCS / 'images' / 'stand.svg'
NUMBER = re.compile(r'-?\d+\.?\d*')
LAYOUTS: dict[str, dict[str, object]] = {
    'one': {'feet.count': [1], 'feet.share': [1.0]},
    'three': {'feet.count': [3], 'feet.share': [0.4]},
    'clamp': {'feet.count': [1, 1], 'feet.share': [1.0, 0.3], 'feet.gain': [1.0, 0.0]},
    'walker': {
        'feet.count': [1] * 6,
        'feet.share': 0.35355,
        'feet.delay': [k / 3000.0 for k in range(6)],
    },
    'twelve': {
        'feet.count': [2, 4, 3, 3],
        'feet.share': [0.3, 0.2, 0.1, 0.2],
        'feet.gain': [1.0, -1.0, 0.0, 1.0],
        'feet.radius': [0.0, 1e-3, 0.0, 2e-4],
        'feet.delay': [0.0, 0.0, 0.0, 1e-3],
    },
    'guided': {'feet.gain': [1.0, 0.0]},
}
WORDS = {
    'one': ['group 1: 500 mN', 'feet: 0 above, 1 below'],
    'three': ['group 1: 200 mN'] * 2,
    'clamp': ['group 2: 150 mN', 'guide', 'feet: 1 above, 1 below'],
    'walker': ['delay 0.333 ms', 'delay 1.67 ms', 'group 6: 176.77 mN'],
    'twelve': ['gain -1', 'guide', 'delay 1 ms', 'feet: 6 above, 6 below'],
    'guided': ['above: 353.55 mN', 'below: 176.78 mN', 'guide', 'feet: 2 above, 4 below'],
}
TAG = '{http://www.w3.org/2000/svg}'
PIXELS = 0.5
"""Between two machines: the places of a curve are rounded to a tenth."""


@pytest.fixture(scope='module')
def film() -> Callable[..., Path]:
    return runpy.run_path(str(DOCS / 'examples' / 'film.py'))['main']


def test_the_drawing_of_the_documentation_is_the_film_of_the_example(film, tmp_path):
    kept, now = PICTURE.read_text(encoding='utf-8'), film(film=tmp_path / 'film.svg').read_text()
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
        *LAYOUTS.values(),
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


@pytest.mark.parametrize('name', LAYOUTS)
def test_a_picture_shows_as_many_feet_as_there_are(name: str):
    parameters = Parameters().updated(LAYOUTS[name])
    feet, root = parameters.feet.total, ET.fromstring(draw_stand(parameters))
    assert f'feet ({feet})' in root.findtext(f'{TAG}title', '')
    contacts = [each for each in root.iter(f'{TAG}circle') if each.get('class') == 'stick']
    assert len(contacts) == feet
    assert len({(each.get('cx'), each.get('cy')) for each in contacts}) == feet
    texts = [each.text for each in root.iter(f'{TAG}text')]
    assert all(texts.count(each) >= WORDS[name].count(each) for each in WORDS[name])
    drawn = list(root.iter(f'{TAG}use'))
    names = {each.get('id') for each in root.iter(f'{TAG}g')}
    assert {each.attrib['href'][1:] for each in drawn} == {each for each in names if each}
    if name != 'guided':  # the two rear pairs of the paper's stand are hidden
        assert len(drawn) == feet
        assert {str(each) for each in range(1, feet + 1)} <= set(texts)


def test_in_a_film_a_guide_rests_and_a_foot_with_a_delay_moves_later():
    values = {
        'feet.count': [1] * 3,
        'feet.share': 0.5,
        'feet.gain': [1.0, 0.0, 1.0],
        'feet.delay': [0.0, 0.0, 3e-4],
    }
    run = simulate(Parameters().updated(values), amplitude_m=160e-9, steps=8)
    root = ET.fromstring(draw_stand(run))
    feet = {each.get('id'): each for each in root.iter(f'{TAG}g') if each.get('id')}
    assert list(feet) == ['foot_3', 'foot_2', 'foot']
    moved = {}
    for name, foot in feet.items():
        ways = [each.attrib['values'] for each in foot.iter(f'{TAG}animateTransform')]
        moved[name] = [float(each) for each in ways[1].split(';')]
    assert set(moved['foot_2']) == {0.0}
    assert 'frame' in feet['foot_2'].find(f'{TAG}g/{TAG}rect').attrib['class']
    lowest = [moved[name].index(min(moved[name])) for name in ('foot', 'foot_3')]
    assert lowest[1] - lowest[0] == pytest.approx(3e-4 / 2e-3 * FRAMES, abs=2)


def test_a_run_without_cycles_or_without_a_trace_is_refused():
    run = simulate(Parameters(), amplitude_m=100e-9, steps=8)
    with pytest.raises(RecordingError, match='no 2 cycles of a saw-tooth so far; draw its'):
        draw_stand(run, end_s=1.5e-3)
    with pytest.raises(OutOfRange, match='end of the cycles 9 s is after the end of the run'):
        draw_stand(run, end_s=9.0)
    del run.series['foot_m']  # as of a recording of another program
    with pytest.raises(RecordingError, match='has no trace; record'):
        draw_stand(run)


def test_the_example_draws_a_recording_up_to_a_time(film: Callable[..., Path], tmp_path: Path):
    run, path = tmp_path / 'run.mcap', tmp_path / 'new' / 'film.svg'
    simulate(Parameters(), amplitude_m=100e-9, steps=8, record=run)
    moving = [each for each in ET.parse(film(run, path)).iter() if 'animate' in each.tag]
    assert len(moving) > 10
    assert {len(each.attrib['values'].split(';')) for each in moving} == {2, FRAMES}
    assert path.read_text() != film(run, path, end_s=0.006).read_text()


def test_the_verb_writes_drawing_and_description(tmp_path: Path):
    drawn, stand = tmp_path / 'stand.svg', tmp_path / 'stand.urdf'
    assert main(['draw', '-o', str(drawn)]) == 0
    assert 'animate' not in drawn.read_text(encoding='utf-8')
    assert main(['draw', '--set', 'runner.mass=6g', '-o', str(stand)]) == 0
    assert '<mass value="0.006"/>' in stand.read_text(encoding='utf-8')
    assert main(['draw', '-o', str(tmp_path / 'stand.png')]) == 2
