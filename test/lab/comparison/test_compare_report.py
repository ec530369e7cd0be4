# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The report of a comparison: self-contained, escaped, the same bytes, all numbers."""

import base64
import re
from dataclasses import replace
from html.parser import HTMLParser
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from stickslip_ros.errors import RecordingError
from stickslip_ros.lab.comparison.compare import CompareOptions, compare
from stickslip_ros.lab.comparison.figure import cycle_of, draw_comparison
from stickslip_ros.lab.figures.page import page_of
from stickslip_ros.lab.figures.plotting import svg_of
from stickslip_ros.parameters import Parameters

NASTY = '<script>alert("1")</script> & \'x\' {{ 7 * 7 }}'
SVG = 'data:image/svg+xml;base64,'
VOID = {'meta', 'img', 'br', 'link', 'hr', 'input'}


class Page(HTMLParser):
    """Collect tags, attributes and texts, and see that every element is closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self._open: list[str] = []
        self.feed(text)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)

    def attributes(self, tag: str, name: str) -> list[str]:
        return [attributes.get(name) or '' for each, attributes in self.tags if each == tag]


@pytest.fixture(scope='module')
def points(tmp_path_factory):
    """Give a comparison by amplitude of a file whose name and notes are nasty."""
    path = tmp_path_factory.mktemp('report') / '<b>&"nasty\'.csv'
    path.write_text(
        f'# {NASTY}\npreload_n,amplitude_m,force_n,force_sigma_n\n'
        '0.1,6e-8,0.03,1e-3\n0.1,1.6e-7,0.06,1e-3\n0.5,6e-8,0.01,1e-3\n0.5,1.6e-7,0.17,1e-3\n',
        encoding='utf-8',
    )
    return compare(path, Parameters(), options=CompareOptions(steps=20))


@pytest.fixture(scope='module')
def runs(recorded_run):
    path = str(recorded_run[1])
    return compare(path, path, options=CompareOptions(shift_s=1e-3))


@pytest.fixture(scope='module')
def pages(points, runs):
    """Give comparison and page of each: to draw its pictures takes long."""
    return {
        name: (each, page_of(each.sections(), NASTY))
        for name, each in (('points', points), ('runs', runs))
    }


@pytest.mark.parametrize('kind', ['points', 'runs'])
def test_a_page_needs_nothing_else_and_has_each_number_sentence_and_picture(pages, kind, tmp_path):
    comparison, text = pages[kind]
    shown = Page(text)
    tags = {tag for tag, _ in shown.tags}
    assert not tags & {'script', 'link', 'iframe', 'object', 'embed', 'base', 'form'}
    assert all(url.startswith(SVG) for url in shown.attributes('a', 'href'))
    without_data = re.sub(rf'{SVG}[\w+/=]+', '', text)
    assert not [word for word in ('http', 'url(', '@import') if word in without_data]
    urls = shown.attributes('img', 'src')
    assert len(urls) == len(comparison.quantities)
    assert all(shown.attributes('img', 'alt'))
    for url in urls:
        svg = ET.fromstring(base64.b64decode(url.removeprefix(SVG)))
        names = [(name, value) for each in svg.iter() for name, value in each.attrib.items()]
        assert all(value.startswith('#') for name, value in names if name.endswith('href'))
        assert sum(element.tag.endswith('path') for element in svg.iter()) > 20
    for section in comparison.sections():
        for cell in (cell for row in [section.header, *section.rows] for cell in row if cell):
            assert all(line in shown.texts for line in str(cell).split('\n'))
        assert set(section.notes) <= set(shown.texts)
    assert {*repr(comparison).split('\n'), NASTY} <= {*shown.texts}
    assert comparison.save(tmp_path / 'page.html', NASTY).read_bytes() == text.encode()
    assert len(text) < 2_000_000  # also of more than 4000 samples


def test_a_page_says_what_was_compared_and_escapes_what_comes_from_a_file(pages):
    texts = Page(pages['points'][1]).texts
    assert {'experiment by amplitude', 'not in the file', NASTY} <= {*texts}
    assert any('<b>&"nasty\'.csv' in each for each in texts)
    runs, text = pages['runs']
    texts = Page(text).texts
    assert texts.count('recording') == 2
    assert any('times of B were shifted by 0.001 s, as given' in each for each in texts)
    assert runs.differences == ()
    assert any(each.startswith('None. Parameters, seed, versions') for each in texts)


@pytest.mark.parametrize(
    ('origin', 'shown'),
    [
        ('runs/run.mcap', 'run.mcap'),
        ('a$b$.mcap', 'a$b$.mcap'),
        (f'{"x" * 40}_1.mcap', f'…{"x" * 32}_1.mcap'),
    ],
    ids=['folder', 'no formula', 'long'],
)
def test_the_legend_names_the_files(runs, origin, shown):
    named = replace(runs, a=replace(runs.a, origin=origin), quantities=runs.quantities[:1])
    words = re.findall('<!-- (.*?) -->', svg_of(named.plot()))
    assert {f'A: {shown}', 'B: run.mcap'} <= set(words)


def test_a_report_that_cannot_be_written_is_refused(points, tmp_path):
    (tmp_path / 'file').write_bytes(b'')
    with pytest.raises(RecordingError, match=r'cannot be made .*; choose another folder'):
        points.save(tmp_path / 'file/page.html', NASTY)


def test_sentences_say_when_all_is_equal(recorded_run):
    path = str(recorded_run[1])
    same = compare(path, path)
    told = repr(same).split('\n')
    assert len(told) == 4
    assert all(re.fullmatch(r'The .* of B equals that of A at all \d+ points\.', t) for t in told)


def test_a_cycle_is_enlarged_beside_the_course_of_a_run_but_not_in_a_narrow_figure(runs):
    quantity = runs.quantities[0]
    time_s = np.arange(0.0, 0.05, 2e-5)
    values = 1e-6 * (np.floor(500.0 * time_s) + 0.3 * (500.0 * time_s % 1.0))
    stepping = replace(quantity.parts[0], x=time_s, a=values, b=values, sigma=None)
    start_s, end_s = cycle_of(stepping)
    assert (start_s, end_s - start_s) == pytest.approx((0.025, 1.2 / 500.0), rel=1e-3)
    assert cycle_of(replace(stepping, a=time_s)) is None
    assert cycle_of(replace(stepping, a=np.sin(100.0 * time_s))) is None
    drawn = replace(runs, quantities=(replace(quantity, parts=(stepping,)),))
    assert [len(drawn.plot(width_mm=width).axes) for width in (None, 85.0)] == [4, 2]


def test_the_bands_stand_in_the_legend(runs):
    [quantity, *_] = runs.quantities
    [part] = quantity.parts
    ends = ('low_95', 'low_68', 'high_68', 'high_95')
    band = {name: part.b + k * 1e-9 for name, k in zip(ends, (-2, -1, 1, 2), strict=True)}
    banded = replace(quantity, parts=(replace(part, band=band),))
    figure = draw_comparison(runs, [banded])
    told = [text.get_text() for text in figure.legends[0].get_texts()]
    assert {'B, 95 % band', 'B, 68 % band'} <= {*told}
