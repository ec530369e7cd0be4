# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The page in a real browser, without a drive: what one says, and when, is up to the test."""

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from typing import Any

import numpy as np
import pytest

pytest.importorskip('playwright', reason='no Playwright: pip install playwright')

import browser as tools
from playwright.sync_api import Browser, Page, ViewportSize, expect
from serving import served

from stickslip_ros.lab.panel.controls import sheet, shown_parameters
from stickslip_ros.lab.panel.model import ACTIVE, Model

pytestmark = pytest.mark.skipif(
    tools.CHROMIUM is None, reason='no Chromium: apt-get install chromium'
)
expect.set_options(timeout=tools.TIMEOUT_MS)


class Told(Model):
    """A drive that is as the test says; it keeps what is wished."""

    def __init__(self) -> None:
        super().__init__('/stickslip_drive')
        self.lines: list[str] = []
        self.values: list[Any] = []
        self.lifecycle, self.is_there = ACTIVE, True

    def do(self, wish: Mapping[str, Any]) -> None:
        if wish['do'] == 'line':
            self.lines.append(wish['text'])
        if wish['do'] == 'command':
            self.values.append(wish['values'])

    def end_steps(self, number: int) -> None:
        """Say that steps have ended."""
        event = {'command': 'steps', 'number': number, 'time_ns': number, 'steps': 5}
        self.take_event({**event, 'result': 'DONE', 'message': ''})

    def close(self) -> None:
        pass


@pytest.fixture
def drive() -> Told:
    return Told()


@pytest.fixture(scope='module')
def running() -> Iterator[Browser]:
    """Give a browser, until the last test."""
    with tools.browser() as running:
        yield running


@pytest.fixture
def page(drive: Told, running: Browser) -> Iterator[Page]:
    """Give the page of the drive."""
    with (
        served(drive, sheet()) as address,
        closing(tools.opened(running, address)) as page,
    ):
        yield page


def run(page: Page, lines: str) -> Any:
    """Begin a script; return where the page tells how far it is."""
    page.get_by_label('Commands of the script').fill(lines)
    page.get_by_role('button', name='Run', exact=True).click()
    return page.locator('[data-note="script-line"]')


def test_a_script_waits_while_the_drive_does_not_answer_and_can_be_ended(drive: Told, page: Page):
    end = page.get_by_role('button', name='End', exact=True)
    told = run(page, 'steps 5\nsteps 6\nsteps 7')
    expect(told).to_have_text('line 1: steps 5')
    drive.lifecycle = ''
    drive.end_steps(1)
    expect(page.locator('#word')).to_have_text('silent')
    expect(page.locator('#events')).to_contain_text('DONE')
    expect(told).to_have_text('line 1: steps 5')
    drive.lifecycle = ACTIVE
    expect(told).to_have_text('line 2: steps 6')
    drive.lifecycle = ''
    expect(page.locator('#word')).to_have_text('silent')
    end.click()
    expect(told).to_have_text('ended')
    assert drive.lines == ['steps 5', 'steps 6']


def test_a_line_that_a_silent_drive_was_not_sent_is_sent_again(
    drive: Told, page: Page, eventually: Callable[[Callable[[], object], str], None]
):
    told = run(page, 'steps 5')
    eventually(lambda: drive.lines, 'the line')
    drive.note('script', 'not sent: the drive does not answer', bad=True, unsent=True)
    eventually(lambda: len(drive.lines) > 1, 'the line again')
    drive.end_steps(1)
    expect(told).to_have_text('done')
    assert drive.lines == ['steps 5', 'steps 5']
    told = run(page, 'steps few')
    eventually(lambda: 'steps few' in drive.lines, 'the line')
    drive.note('script', 'few is not a number', bad=True)
    expect(told).to_have_text('ended at line 1: few is not a number')


HOLD_BACK = """() => {
    const later = window.setTimeout, held = [];
    window.setTimeout = (act) => held.push(act);
    window.goOn = () => { window.setTimeout = later; for (const each of held) each(); };
}"""
DRAWN_LONG_AGO = '() => { const end = performance.now() + 600; while (performance.now() < end); }'


def test_a_page_that_is_held_up_sends_where_its_slider_was_drawn_to(
    drive: Told, page: Page, eventually: Callable[[Callable[[], object], str], None]
):
    columns = ['t', 'voltage', 'foot', 'position', 'force']
    slider, field = page.get_by_role('slider', name='Voltage'), page.locator('#voltage-voltage')
    drive.take_parameters(
        {'amplifier.voltage_min': 0.0, 'amplifier.voltage_max': 300.0}, shown_parameters()
    )
    expect(slider).to_have_attribute('max', '300')
    slider.focus()
    page.evaluate(HOLD_BACK)
    page.keyboard.press('End')
    expect(field).to_have_value('300')
    page.evaluate(DRAWN_LONG_AGO)
    drive.take_trace(np.array([[7.0, 20.0, 0.0, 0.0, 0.0]]), columns)
    expect(page.locator('#voltage')).to_have_text('+20.0')
    page.evaluate('goOn()')
    eventually(lambda: drive.values, 'a command')
    assert drive.values == [[300.0]]


@pytest.mark.parametrize(
    ('lifecycle', 'is_there', 'why'),
    [('inactive', True, 'the node is inactive'), ('', False, 'no drive /stickslip_drive')],
)
def test_a_script_ends_where_its_drive_is_not_active_or_has_gone(
    drive: Told, page: Page, lifecycle: str, is_there: bool, why: str
):
    told = run(page, 'steps 5\nsteps 6')
    expect(told).to_have_text('line 1: steps 5')
    drive.lifecycle, drive.is_there = lifecycle, is_there
    expect(told).to_have_text(re.compile(f'^ended at line 1: {why}'))
    expect(page.get_by_role('button', name='Run', exact=True)).to_be_disabled()


@pytest.mark.parametrize('width', [768, 820, 1024, 1440])
def test_no_condition_that_comes_by_itself_moves_what_is_below(
    drive: Told, page: Page, monkeypatch: pytest.MonkeyPatch, width: int
):
    page.set_viewport_size(ViewportSize(width=width, height=900))
    heights = set()
    for why in (
        'simulated time runs',
        'no trace for 12 s: waits for grants, or is held up',
        '/stickslip_drive does not answer; waiting for it',
        'real-time factor 0.8123 instead of 1; a preload on its way steps every spring',
    ):
        monkeypatch.setattr(drive, 'condition', lambda why=why: ('late', why))
        expect(page.locator('#why')).to_have_text(why)
        heights.add(page.locator('header').bounding_box()['height'])
    assert len(heights) == 1


def test_a_script_ends_where_its_drive_begins_anew(drive: Told, page: Page):
    drive.take_trace(np.array([[5.0]]), ['t'])
    expect(page.locator('#time')).to_have_text('5.000')
    told = run(page, 'wait 2')
    expect(told).to_have_text('line 1: wait 2')
    drive.take_trace(np.array([[1.0]]), ['t'])
    expect(told).to_have_text('ended at line 1: the drive has begun anew')
