# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The page in a real browser, without a drive: a test tells it all, and reads its wishes."""

import io
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import numpy as np
import pytest

pytest.importorskip('axe_playwright_python', reason='no axe: pip install axe-playwright-python')

import browser as tools
from axe_playwright_python.sync_playwright import Axe
from browser import ink, lamp, note
from matplotlib.image import imread
from playwright.sync_api import Browser, Locator, Page, ViewportSize, expect
from serving import served
from test_curves import sawtooth_samples
from waiting import GIVE_UP_S, wait_until

from stickslip_ros.arrays import Array
from stickslip_ros.instrument.reports import Status
from stickslip_ros.lab.measurements.run_result import SawtoothRun
from stickslip_ros.lab.measurements.tables import parse_experiment
from stickslip_ros.lab.panel import player
from stickslip_ros.lab.panel.controls import lamps, sheet
from stickslip_ros.lab.panel.curves import SAMPLE_COLUMNS
from stickslip_ros.lab.panel.model import ACTIVE, Model
from stickslip_ros.parameters import specs

pytestmark = pytest.mark.skipif(
    tools.CHROMIUM is None, reason='no Chromium: apt-get install chromium'
)
expect.set_options(timeout=tools.NET_MS)
JOG_TIMEOUT_S, RENEWALS = 0.2, 10
"""Watchdog of jogging, and how often a page renews a jog before it ends."""
AT_REST = {'t': 0.0, 'voltage': 30.0, 'foot': 15e-9, 'position': 1e-6, 'force': 0.01}
SHADE = 0.03
"""Of a pixel at the edge of a line, which is another each time it is drawn; of 1."""
CONTROLS = 'button, input, select, textarea'
TARGET_PX = 24
"""Least width and height of what a finger presses (WCAG 2.2, 2.5.8)."""
SMALL = f"""() => [...document.querySelectorAll('{CONTROLS}, summary, a')]
    .filter((each) => each.checkVisibility({{ contentVisibilityAuto: true }}))
    .map((each) => [each.outerHTML, each.getBoundingClientRect()])
    .filter(([, box]) => Math.min(box.width, box.height) < {TARGET_PX})
    .map(([text]) => text)"""
CUT = """() => [...document.querySelectorAll('#figures dl')]
    .filter((each) => each.scrollWidth > each.clientWidth
        || each.getBoundingClientRect().right > innerWidth)
    .map((each) => each.textContent)"""
SOFT = 'velocity, soft min, soft max'
"""Words of the fold of a position."""
UNFOLD = "() => { for (const each of document.querySelectorAll('details')) each.open = true; }"
FOCUSED = """() => document.activeElement.id || document.activeElement.getAttribute('aria-label')
    || document.activeElement.textContent"""
NO_CONTROL_WITHOUT_NAME = f"""() => [...document.querySelectorAll('{CONTROLS}')]
    .filter((each) => each.offsetParent)
    .filter((each) => !each.title && !each.closest('[title]')
        || !(each.getAttribute('aria-label') || each.textContent || (each.labels || []).length)
        || each.tabIndex < 0)
    .map((each) => each.outerHTML)"""

BOXES = """() => [...document.querySelectorAll('canvas, fieldset, #figures dl, #bits li')]
    .filter((each) => each.offsetParent)
    .map((each) => each.getBoundingClientRect())
    .map(({x, y, width, height}) => [x, y + scrollY, width, height].map(Math.round))"""


class Told(Model):
    """A drive that is as the test says; it keeps the wishes of its page."""

    def __init__(self) -> None:
        super().__init__('/stickslip_drive')
        self._wishes: SimpleQueue[Mapping[str, Any]] = SimpleQueue()
        self._time_s = 0.0
        self.lifecycle, self.is_there = ACTIVE, True
        defaults = {name: spec.default for name, spec in specs().items()}
        self.take_parameters(defaults | {'jog.timeout': JOG_TIMEOUT_S})
        self.take_status(Status.AMPLIFIER_ENABLED)

    def do(self, wish: Mapping[str, Any]) -> None:
        if wish['do'] == 'view':
            self.choose(wish)
        else:
            self._wishes.put(wish)

    def wish(self) -> Mapping[str, Any]:
        """Return the next wish, as soon as it comes."""
        return self._wishes.get(timeout=GIVE_UP_S)

    def has_wishes(self) -> bool:
        return not self._wishes.empty()

    def rest(self, **readings: float) -> None:
        """Give 0.3 s of samples that do not change."""
        time_s = self._time_s + np.arange(1, 301) / 1e3
        columns = AT_REST | {'t': time_s} | readings
        self.take_trace(np.column_stack(np.broadcast_arrays(*columns.values())), list(columns))
        self._time_s = float(time_s[-1])

    def step(self, frequency_hz: float, voltage_v: float = 300.0) -> None:
        """Give 0.2 s of samples of a saw-tooth."""
        samples = sawtooth_samples(0.2, frequency_hz, self._time_s + 1e-4)
        samples[:, SAMPLE_COLUMNS.index('voltage')] *= voltage_v / 300.0
        self.take_trace(samples, SAMPLE_COLUMNS)
        self._time_s = float(samples[-1, 0])

    def end(self, command: str, number: int, **fields: Any) -> None:
        """Say that a command has ended."""
        event = {'command': command, 'number': number, 'time_ns': number, 'steps': 5}
        self.take_event({**event, 'result': 'DONE', 'message': '', **fields})

    def close(self) -> None:
        pass


def command(name: str, *values: Any) -> dict[str, Any]:
    """Return the wish that sends a command."""
    numbers = [each if isinstance(each, str) else pytest.approx(each) for each in values]
    return {'do': 'command', 'name': name, 'values': numbers}


def service(name: str, wanted: bool | None = True) -> dict[str, Any]:
    """Return the wish that calls a service."""
    return {'do': 'service', 'name': name} | ({} if wanted is None else {'wanted': wanted})


def line(text: str) -> dict[str, Any]:
    """Return the wish that sends a line of a script."""
    return {'do': 'line', 'name': 'script', 'text': text}


@pytest.fixture
def drive() -> Told:
    return Told()


@pytest.fixture(scope='module')
def running() -> Iterator[Browser]:
    """Give a browser until the last test."""
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


def barriers(page: Page) -> str:
    """Unfold all; return what is a barrier by axe-core in light and in dark, nothing if none."""
    page.evaluate(UNFOLD)
    found = []
    for scheme in ('light', 'dark'):
        page.emulate_media(color_scheme=scheme)
        page.evaluate(SETTLED)
        results = Axe().run(page)
        assert results.response['passes']  # rules that had something to check
        found += [results.generate_report()] * bool(results.violations_count)
    return '\n'.join(found)


def press(page: Page, name: str) -> None:
    """Press a button."""
    page.get_by_role('button', name=name, exact=True).click()


HOLD_BACK = """() => {
    const later = window.setTimeout, held = [];
    window.setTimeout = (act) => held.push(act);
    window.goOn = () => { window.setTimeout = later; for (const each of held) each(); };
}"""
DRAWN_LONG_AGO = '() => { const end = performance.now() + 600; while (performance.now() < end); }'
NOTE_REPEATS = """() => {
    const repeat = window.setInterval;
    window.repeats = [];
    window.setInterval = (act, ms) => { window.repeats.push(ms); return repeat(act, ms); };
}"""


def test_a_jog_is_sent_while_it_is_held_and_a_voltage_that_was_drawn(drive: Told, page: Page):
    ways: list[tuple[int, Callable[[], None], Callable[[], None]]] = [
        (1, page.mouse.down, page.mouse.up),
        (-1, lambda: page.keyboard.down(' '), lambda: page.keyboard.up(' ')),
        (1, lambda: page.keyboard.down('ArrowRight'), lambda: page.keyboard.up('ArrowRight')),
        (-1, lambda: page.keyboard.down('ArrowLeft'), lambda: page.keyboard.up('ArrowLeft')),
    ]
    page.evaluate(NOTE_REPEATS)
    page.get_by_label('Jog forwards').hover()
    for hold, (sign, begin, end) in enumerate(ways):
        jog = command('jog', 200.0 * sign)
        begin()
        assert [drive.wish() for _ in range(2 * RENEWALS)] == [jog] * 2 * RENEWALS
        end()
        wish: Mapping[str, Any] = jog
        while wish == jog:
            wish = drive.wish()
        assert wish == command('jog', 0)
        press(page, 'Send load')  # which comes next: the jog is over
        assert drive.wish() == command('load', 0)
        page.get_by_label('Steps forwards' if hold else 'Jog backwards').focus()
    assert page.evaluate('repeats') == [1e3 * JOG_TIMEOUT_S / RENEWALS] * len(ways)
    page.locator('#jog-frequency').focus()
    page.keyboard.press('ArrowRight')
    press(page, 'Send load')
    assert drive.wish() == command('load', 0)

    slider, field = page.get_by_role('slider', name='Voltage'), page.locator('#voltage-voltage')
    drive.rest(voltage=240.0)
    expect(page.locator('#voltage')).to_have_text('+240.0')
    expect(field).to_have_value('240')
    expect(slider).to_have_value('240')
    slider.focus()
    for key, voltage_v in (('ArrowRight', 240.3), ('End', 300.0), ('Home', 0.0)):
        page.keyboard.press(key)
        assert drive.wish() == command('voltage', voltage_v)
        expect(field).to_have_value(f'{voltage_v:g}')

    def follows() -> bool:
        drive.rest(voltage=60.0)
        return field.input_value() == '60'

    page.locator('#load-force\\.x').focus()
    wait_until(follows, 'voltage of the drive in its field')

    slider.focus()
    page.evaluate(HOLD_BACK)
    page.keyboard.press('End')
    expect(field).to_have_value('300')
    page.evaluate(DRAWN_LONG_AGO)
    drive.rest(voltage=20.0)
    expect(page.locator('#voltage')).to_have_text('+20.0')
    assert not drive.has_wishes()
    page.evaluate('goOn()')
    assert drive.wish() == command('voltage', 300.0)


def test_numbers_are_sent_in_si_units_and_what_becomes_of_them_stands_beside_them(
    drive: Told, page: Page
):
    steps = page.get_by_role('group', name='Steps')
    expect(steps).to_contain_text('of 300 V, 1000 Hz')
    expect(page.get_by_role('group', name='Jog')).to_contain_text('of 300 V; keys ← →')
    for name in ('Sawtooth', 'Waveform'):
        expect(page.get_by_role('group', name=name)).to_contain_text('0: until stopped')
    press(page, 'Steps backwards')
    assert drive.wish() == command('steps', -10)
    page.locator('#sawtooth-frequency').fill('500')
    press(page, 'Sawtooth backwards')
    assert drive.wish() == command('sawtooth', 300, -500, 0)
    page.locator('#load-force\\.x').fill('0,5')
    page.keyboard.press('Enter')
    assert drive.wish() == command('load', '0,5')  # for the server to read
    page.locator('#position-x').fill('far')
    press(page, 'Send position')
    assert drive.wish() == command('position', 'far')
    expect(page.locator('#position-x')).to_have_attribute('aria-invalid', 'true')
    page.locator('#waveform-amplitude').fill('abc')
    press(page, 'Waveform forwards')
    expect(page.get_by_role('group', name='Waveform')).to_contain_text(
        "amplitude 'abc' is not a number; give a number in V, such as 120.5"
    )
    page.keyboard.press('Escape')
    assert drive.wish() == service('stop', wanted=None)

    target = page.locator('[data-target-of=position]')
    page.locator('#position-step').fill('40')
    drive.rest()
    expect(page.locator('#position')).to_have_text('+1\u2009000.0')
    press(page, 'Step forwards')  # from the reading
    assert drive.wish() == command('position', 1.04e-6)
    drive.take_status(Status.CLOSED_LOOP)
    drive.take_sent('position', 5e-7)
    expect(target).to_have_text('target +500.0')
    press(page, 'Step backwards')
    assert drive.wish() == command('position', 4.6e-7)
    page.locator('#position-step').press('Enter')  # forwards, not to the field above
    assert drive.wish() == command('position', 5.4e-7)
    drive.take_status(0)
    expect(target).to_have_text('')

    refused = {'result': 'INVALID_PARAMETER', 'message': '400 V is too much'}
    drive.end('sawtooth', 1, **refused)
    expect(note(page, 'sawtooth')).to_have_text('INVALID_PARAMETER: 400 V is too much')
    expect(note(page, 'sawtooth')).to_have_class(re.compile('bad'))
    expect(note(page, 'voltage')).not_to_have_class(re.compile('bad'))
    page.reload()
    expect(page.locator('#events p').first).to_contain_text('INVALID_PARAMETER')
    expect(note(page, 'sawtooth')).to_have_text('')
    drive.end('steps', 2)
    expect(page.locator('#events p').first).to_contain_text('DONE, 5 steps')
    expect(note(page, 'steps')).to_have_text('DONE')


def test_of_parameters_those_with_the_word_in_their_name_come_first(page: Page):
    page.locator('#parameters summary').click()
    page.get_by_label('Search parameters').fill('friction')
    names = page.locator('.parameters label:visible').all_inner_texts()
    named = ['friction' in each for each in names]
    assert named == sorted(named, reverse=True)
    assert not all(named)


def test_services_and_states_are_switched_and_greyed_with_a_reason(drive: Told, page: Page):
    def wishes(button: Locator) -> Mapping[str, Any]:
        button.click()
        return drive.wish()

    def named(name: str) -> Locator:
        return page.get_by_role('button', name=name, exact=True)

    for name, key in (('Zero position', 'zero_position'), ('Tare force', 'tare_force')):
        assert wishes(named(name)) == service(key)
    assert wishes(named('Reset')) == service('reset')
    amplifier, record, pause = (  # named with a mark while they are pressed
        page.get_by_role('button', name=name) for name in ('Amplifier', 'Record', 'Pause')
    )
    expect(amplifier).to_have_attribute('aria-pressed', 'true')
    assert wishes(amplifier) == service('enable_amplifier', wanted=False)
    drive.take_status(0)
    expect(amplifier).to_have_attribute('aria-pressed', 'false')
    assert wishes(amplifier) == service('enable_amplifier')

    assert wishes(record) == service('set_recording')
    file = {'file': '/runs/a.mcap', 'length_s': '12.34', 'size_bytes': '2340000'}
    drive.take_part('recorder', 0, 'recording', file)
    expect(record).to_have_attribute('aria-pressed', 'true')
    expect(page.locator('#parts')).to_contain_text('a.mcap')
    expect(page.locator('#parts')).to_contain_text('12.3 s, 2.34 MB')
    assert wishes(record) == service('set_recording', wanted=False)

    block = named('Single block')
    expect(block).to_be_disabled()
    expect(block).to_have_attribute('title', re.compile('not now: it needs Pause'))
    assert wishes(pause) == service('set_paused')
    drive.take_part('time', 0, '', {'paused': 'true'})
    drive.note('set_paused', 'paused at 3 s')
    expect(page.locator('#word')).to_have_text('paused')
    expect(note(page, 'set_paused')).to_have_text('paused at 3 s')
    expect(pause).to_have_attribute('aria-pressed', 'true')
    assert wishes(block) == service('step_simulation')
    assert wishes(pause) == service('set_paused', wanted=False)
    drive.take_pause(is_paused=False)
    expect(block).to_be_disabled()

    steps = page.get_by_label('Steps forwards')
    assert wishes(named('Deactivate'))['transition'] == 'deactivate'
    drive.lifecycle = 'inactive'
    expect(page.locator('#word')).to_have_text('inactive')
    expect(steps).to_be_disabled()
    expect(steps).to_have_attribute('title', re.compile('not now: the node is inactive'))
    expect(page.get_by_role('button', name='STOP')).to_be_disabled()
    expect(named('Deactivate')).to_be_disabled()
    assert wishes(named('Activate'))['transition'] == 'activate'
    drive.lifecycle = ACTIVE
    expect(steps).to_be_enabled()
    assert 'not now' not in str(steps.get_attribute('title'))


def test_faults_come_by_switch_and_go(drive: Told, page: Page):
    sensor, stuck = page.locator('#fault\\.interferometer'), page.locator('#fault\\.runner_stuck')
    expect(sensor).to_be_hidden()
    page.locator('details', has=sensor).locator('summary').click()
    sensor.select_option('dropout')
    assert drive.wish() == {'do': 'set', 'name': 'fault.interferometer', 'value': 'dropout'}
    stuck.check()
    assert drive.wish() == {'do': 'set', 'name': 'fault.runner_stuck', 'value': 'true'}
    present = {'fault.interferometer': 'dropout', 'fault.runner_stuck': True}
    drive.take_part('faults', 1, 'interferometer, runner_stuck', {})
    drive.take_parameters(present)
    drive.take_status(Status.FAULT)
    drive.rest(position=np.nan)
    expect(page.locator('#parts .bad')).to_have_text('interferometer, runner_stuck')
    expect(page.locator('summary', has_text='now: interferometer, runner_stuck')).to_be_visible()
    expect(lamp(page, 'FAULT')).to_be_visible()
    expect(page.locator('#position')).to_have_text('no reading')
    foot = page.locator('#fault\\.dead_foot')
    expect(foot).to_have_attribute('title', re.compile('; 0 to 6$'))
    drive.take_parameters({'feet.count': [2, 1], 'feet.share': [0.5, 0.5]})
    expect(foot).to_have_attribute('title', re.compile('; 0 to 3$'))
    foot.fill('9')
    page.keyboard.press('Enter')
    assert drive.wish() == {'do': 'set', 'name': 'fault.dead_foot', 'value': '9'}
    drive.note('fault.dead_foot', '9 is above the number of feet, 3', bad=True)
    expect(note(page, 'fault.dead_foot')).to_have_text('9 is above the number of feet, 3')
    press(page, 'Clear faults')
    assert drive.wish() == service('clear_faults')
    drive.take_part('faults', 0, 'none', {})
    drive.take_parameters({name: spec.default for name, spec in specs().items()})
    drive.take_status(0)
    expect(lamp(page, 'FAULT')).to_have_count(0)
    expect(sensor).to_have_value('none')
    expect(stuck).not_to_be_checked()


def test_a_script_is_noted_saved_opened_and_sent_line_by_line(
    drive: Told, page: Page, tmp_path: Path
):
    lines, told = page.get_by_label('Commands of the script'), note(page, 'script-line')
    drive.rest()
    expect(page.locator('#position')).to_have_text('+1\u2009000.0')
    press(page, 'Note')
    page.locator('#steps-steps').fill('3')
    press(page, 'Steps forwards')
    assert drive.wish() == command('steps', 3)
    press(page, 'Store place')
    text = 'steps 3\nposition 1000.0nm'
    expect(lines).to_have_value(text)
    with page.expect_download() as saved:
        press(page, 'Save')
    saved.value.save_as(tmp_path / 'script.txt')
    assert (tmp_path / 'script.txt').read_text() == text
    page.reload()
    expect(lines).to_have_value(text)
    lines.fill('')
    with page.expect_file_chooser() as chooser:
        press(page, 'Open…')
    chooser.value.set_files(tmp_path / 'script.txt')
    expect(lines).to_have_value(text)

    lines.fill('sawtooth 300V 250 20 # ahead\n\nwait 0,2\nsteps -15')
    press(page, 'Run')
    assert drive.wish() == line('sawtooth 300V 250 20')
    expect(page.get_by_role('button', name='Run', exact=True)).to_be_disabled()
    drive.end('sawtooth', 1)
    expect(told).to_have_text('line 3: wait 0,2')
    assert not drive.has_wishes()
    drive.rest()
    assert drive.wish() == line('steps -15')
    drive.end('steps', 2)
    expect(told).to_have_text('done')
    for text, why in (('long', 'is not a number; give a number in s'), ('1,000', 'is not clear')):
        lines.fill(f'wait {text}')
        press(page, 'Run')
        expect(told).to_have_text(re.compile(f"ended at line 1: .*'{text}' {why}"))
    lines.fill('steps 5\nsteps 6')
    press(page, 'Run')
    assert drive.wish() == line('steps 5')
    page.keyboard.press('Escape')
    assert drive.wish() == service('stop', wanted=None)
    expect(told).to_have_text('ended by STOP')
    drive.end('steps', 3)
    expect(page.locator('#events p')).to_have_count(3)
    lines.fill('steps 7')
    press(page, 'Run')
    assert drive.wish() == line('steps 7')


def test_a_script_waits_for_a_silent_drive_and_ends_where_its_drive_is_not_active_or_anew(
    drive: Told, page: Page
):
    lines, told = page.get_by_label('Commands of the script'), note(page, 'script-line')

    def run(text: str) -> None:
        lines.fill(text)
        press(page, 'Run')
        assert drive.wish() == line(text.partition('\n')[0])

    run('steps 5\nsteps 6\nsteps 7')
    drive.lifecycle = ''
    drive.end('steps', 1)
    expect(page.locator('#word')).to_have_text('silent')
    expect(page.locator('#events')).to_contain_text('DONE')
    expect(told).to_have_text('line 1: steps 5')
    assert not drive.has_wishes()
    drive.lifecycle = ACTIVE
    assert drive.wish() == line('steps 6')
    drive.lifecycle = ''
    expect(page.locator('#word')).to_have_text('silent')
    press(page, 'End')
    expect(told).to_have_text('ended')
    drive.lifecycle = ACTIVE

    run('steps few')
    drive.note('script', 'few is not a number', bad=True)
    expect(told).to_have_text('ended at line 1: few is not a number')

    for lifecycle, is_there, why in (
        ('inactive', True, 'the node is inactive'),
        ('', False, 'no drive /stickslip_drive'),
    ):
        run('steps 5\nsteps 6')
        drive.lifecycle, drive.is_there = lifecycle, is_there
        expect(told).to_have_text(re.compile(f'^ended at line 1: {why}'))
        expect(page.get_by_role('button', name='Run', exact=True)).to_be_disabled()
        drive.lifecycle, drive.is_there = ACTIVE, True

    drive.take_trace(np.array([[5.0]]), ['t'])
    expect(page.locator('#time')).to_have_text('5.000')
    lines.fill('wait 2')
    press(page, 'Run')
    expect(told).to_have_text('line 1: wait 2')
    drive.take_trace(np.array([[1.0]]), ['t'])
    expect(told).to_have_text('ended at line 1: the drive has begun anew')
    assert not drive.has_wishes()


def test_a_picture_is_read_zoomed_frozen_compared_and_saved(drive: Told, page: Page):
    page.locator('#cycles').select_option('5')
    wait_until(lambda: drive.view.cycles == 5, 'the choice')
    drive.step(500.0)
    expect(page.locator('#trigger')).to_have_text(re.compile(r'^fall at 0\.\d+ s, 500\.0 Hz$'))
    over, voltage = page.locator('#scope .u-over').first, page.locator('#scope .u-legend').last
    page.evaluate('scrollTo(0, 0)')
    box = over.bounding_box()
    page.mouse.move(box['x'] + 0.5 * box['width'], box['y'] + 40)
    middle = re.compile(r'at(4\.[89]|5\.[012])\d* ms')  # of five cycles of 2 ms
    expect(page.locator('#scope .u-legend').first).to_contain_text(middle)
    expect(voltage).to_contain_text(re.compile(r'voltage \(V\)\d+\.\d'))
    page.mouse.click(box['x'] + 0.5 * box['width'], box['y'] + 40)
    page.mouse.move(box['x'] + 0.55 * box['width'], box['y'] + 40)
    change = r'[−\d]+\.\d \(Δ [−\d]+\.\d\)'
    both = re.compile(rf'\(Δ 0\.5\d\d ms\)runner \(nm\){change}foot \(nm\){change}')
    expect(page.locator('#scope .u-legend').first).to_have_text(both)
    expect(voltage).to_have_text(re.compile(rf'voltage \(V\){change}'))
    over.dblclick()
    expect(voltage).not_to_contain_text('Δ')
    freeze = page.locator('#scope-tools').get_by_role('button', name='Freeze')
    freeze.click()
    expect(freeze).to_have_attribute('aria-pressed', 'true')

    def saved(place: str, kind: str) -> bytes:
        with page.expect_download() as download:
            page.locator(f'#{place}-tools').get_by_role('button', name=kind).click()
        return Path(download.value.path()).read_bytes()

    table = parse_experiment(saved('scope', 'CSV'), 'scope.csv').columns
    assert {*table} == {'time_s', 'position_m', 'foot_m', 'voltage_v'}
    assert table['time_s'][[0, -1]] == pytest.approx([-0.3e-3, 10.3e-3], abs=0.1e-3)
    assert np.ptp(table['voltage_v']) == pytest.approx(297.0, abs=0.1)  # the last of 100 samples
    assert np.ptp(table['foot_m']) == pytest.approx(148.5e-9, rel=1e-3)

    def picture() -> Array:
        """Return the colours of the saved picture."""
        return imread(io.BytesIO(saved('scope', 'PNG')))

    def is_same(one: Array, other: Array) -> bool:
        return bool(np.allclose(one, other, atol=SHADE))

    frozen = picture()
    drive.step(400.0)
    expect(page.locator('#trigger')).to_contain_text('400.0 Hz')
    assert is_same(picture(), frozen)
    page.mouse.move(box['x'] + 0.2 * box['width'], box['y'] + 40)
    page.mouse.down()
    page.mouse.move(box['x'] + 0.4 * box['width'], box['y'] + 40, steps=4)
    page.mouse.up()
    page.mouse.move(0, 0)
    assert not is_same(picture(), frozen)
    over.dblclick()
    page.mouse.move(0, 0)
    assert is_same(picture(), frozen)
    reference = page.locator('#scope-tools').get_by_role('button', name='Reference')
    reference.click()  # keeps the curves of 300 V
    freeze.click()
    drive.step(500.0, 150.0)
    expect(page.locator('#trigger')).to_have_text(re.compile(r'^fall at 0\.\d+ s, 500\.0 Hz$'))
    freeze.click()
    behind = picture()
    assert not is_same(behind, frozen)
    reference.click()
    assert not is_same(picture(), behind)  # frozen: only the reference is gone
    history = parse_experiment(saved('history', 'CSV'), 'history.csv').columns
    assert {'time_s', 'position_m', 'force_n'} <= {*history}


def test_the_scope_of_foreign_data_names_the_next_step(drive: Told, page: Page):
    trigger = page.locator('#trigger')
    drive.rest()
    expect(trigger).to_have_text('no falls: runs freely; send Sawtooth, Freeze holds it')
    drive.is_there, drive.lifecycle = False, ''
    drive.rest(voltage=np.nan)
    expect(page.locator('#word')).to_have_text('foreign')
    expect(page.locator('body')).to_have_class('fresh')
    expect(trigger).to_have_text('no voltage: runs freely; Freeze holds it')
    freeze = page.locator('#scope-tools').get_by_role('button', name='Freeze')
    freeze.click()
    axis = page.locator('#scope').screenshot()
    drive.rest(voltage=np.nan, position=2e-6)
    expect(page.locator('#position')).to_have_text('+2\u2009000.0')
    assert page.locator('#scope').screenshot() == axis


def test_numbers_are_shown_with_five_digits_and_kept_whole(drive: Told, page: Page):
    drive.take_parameters({'runner.mass': 0.0006067006686656132, 'step.amplitude': 98.7654321})
    expect(page.get_by_role('group', name='Steps')).to_contain_text('of 98.765 V, 1000 Hz')
    page.locator('#parameters summary').click()
    mass = page.locator('#parameter-runner\\.mass')
    expect(mass).to_have_value('0.0006067')
    mass.fill('1')
    expect(page.locator('#parameters .waits')).to_contain_text('to apply; now 0.0006067;')
    mass.fill('0.0006067')
    expect(page.locator('#parameters .waits')).to_have_count(0)
    assert drive.state()['changed']['runner.mass'] == '0.000606700668665613'


def test_the_stand_moves_as_the_drive_does_and_a_twin_is_shown_below(drive: Told, page: Page):
    drawing, summary = page.locator('#drawing svg'), page.locator('#stand summary')
    expect(drawing).to_be_visible()
    expect(drawing).to_have_attribute('height', '350')
    drive.step(200.0)
    expect(page.locator('#trigger')).to_contain_text('200.0 Hz')
    summary.click()
    expect(drawing).to_be_hidden()
    summary.click()  # which draws it anew, as some seconds do
    expect(drawing).to_have_attribute('height', '550')
    first = drawing.screenshot()
    wait_until(lambda: drawing.screenshot() != first, 'movement')

    expect(page.locator('#twin')).to_be_hidden()
    for at_ms in range(0, 200, 10):
        drive.take_twin_reading('position', 7_000_000_000 + at_ms * 1_000_000, 1e-9 * at_ms)
        drive.take_twin_reading('residual', 7_000_000_000 + at_ms * 1_000_000, 1e-10)
    window = ['t[s]', 'steps', 'rig[m]', 'twin[m]', 'residual_rms[m]']
    drive.take_twin_row('steps', window, [7.2, 99, 9.8e-8, 9.7e-8, 1e-10])
    for time_s, friction in ((7.2, 0.3), (17.2, 0.24)):
        fit = ['t[s]', 'contact.friction', 'contact.friction_sigma']
        drive.take_twin_row('parameters', fit, [time_s, friction, 0.003])
    expect(page.locator('#twin-steps')).to_contain_text('99 steps: rig +98.00 nm, twin +97.00 nm')
    expect(page.locator('#twin-fits')).to_have_text(re.compile('contact.friction.*0.24 ± 0.003'))
    page.reload()  # which asks for it anew
    expect(page.locator('#twin-fits')).to_have_text(re.compile('contact.friction.*0.24 ± 0.003'))
    for place in ('#twin-window', '#twin-history'):
        expect(page.locator(f'{place} canvas').first).to_be_visible()
        assert ink(page, place) > 0
    drive.end('steps', 1, result='REFUSED', message='above the range')
    expect(note(page, 'steps')).to_contain_text('above the range')
    page.locator('#parameters summary').click()
    page.locator('#parameters label', has_text='contact.friction').first.wait_for()
    assert barriers(page) == ''


JOG = ('Jog backwards', 'Jog forwards')
TABS = 4
"""Presses from the jump link to the first number of the first command."""
SETTLED = """() => new Promise((done) => {
    requestAnimationFrame(() => requestAnimationFrame(done));
})"""
CUT_OFF = """([place, text]) => {
    const shown = document.querySelector(place), before = shown.textContent;
    shown.textContent = text;
    const { right, bottom } = shown.getBoundingClientRect();
    const outer = shown.closest('header, section').getBoundingClientRect();
    const beyond = Math.max(right - outer.right, bottom - outer.bottom);
    const cut = shown.scrollWidth - shown.clientWidth;
    shown.textContent = before;
    return Math.max(beyond, cut);
}"""
CONDITIONS = (
    'simulated time runs',
    'no data for 12 s: the drive waits for grants, or is held up',
    '/stickslip_drive does not answer: no data for 12 s, its process may be gone; waiting for it',
    'real-time factor 0.8123 instead of 1; a preload on its way steps every spring',
)


def test_the_page_fits_every_width_does_not_jump_and_names_its_controls(
    drive: Told, page: Page, monkeypatch: pytest.MonkeyPatch
):
    def say(why: str) -> None:
        monkeypatch.setattr(drive, 'condition', lambda: ('late', why))
        expect(page.locator('#why')).to_have_text(why)

    say(CONDITIONS[0])
    drive.step(500.0)
    drive.take_part('time', 0, '', {'paused': 'false'})
    expect(page.locator('#trigger')).to_contain_text('500.0 Hz')
    expect(page.locator('#parts dd').first).to_be_visible()
    expect(page.locator('#drawing svg')).to_be_visible()
    assert page.evaluate(NO_CONTROL_WITHOUT_NAME) == []
    for name in ('STOP (Esc)', 'jump', 'jog-frequency', *JOG, 'position-x', 'Send position'):
        page.keyboard.press('Tab')
        assert page.evaluate(FOCUSED) == name
    for name in ('position-step', 'Step backwards', 'Step forwards', SOFT, 'cycles'):
        page.keyboard.press('Tab')
        assert page.evaluate(FOCUSED) == name
    page.locator('#jump').press('Enter')
    for _ in range(TABS):
        page.keyboard.press('Tab')
    assert page.evaluate(FOCUSED) == 'steps-steps'
    drive.rest(force=0.170679, position=-4.9e-3)
    expect(page.locator('#force')).to_have_text('+170.679')
    for number, width in enumerate((390, 768, 820, 1024, 1440, 2200)):
        page.set_viewport_size(ViewportSize(width=width, height=900))
        page.emulate_media(color_scheme='light')
        page.evaluate(SETTLED)
        assert page.evaluate('document.documentElement.scrollWidth') <= width
        assert page.evaluate(CUT) == []
        assert page.evaluate(SMALL) == []
        drive.take_status(Status.MOVING)
        expect(lamp(page, 'MOVING')).to_be_visible()
        before = [pytest.approx(box, abs=1) for box in page.evaluate(BOXES)]
        page.emulate_media(color_scheme='dark')
        page.evaluate(SETTLED)
        assert page.evaluate('document.documentElement.scrollWidth') <= width
        assert page.evaluate(BOXES) == before
        drive.take_status(0)
        drive.end('sawtooth', number, result='ABORTED', message=f'by command {number}')
        expect(note(page, 'sawtooth')).to_contain_text(f'ABORTED: by command {number}')
        expect(lamp(page, 'MOVING')).to_have_count(0)
        assert page.evaluate(BOXES) == before
        if width < tools.WIDE['width']:
            heights = set()
            for why in CONDITIONS:
                say(why)
                heights.add(page.locator('#hands').bounding_box()['y'])
            assert len(heights) == 1
            say(CONDITIONS[0])
    long = 'real-time factor 0.5312 instead of 1; ' * 4 + 60 * '/folder'
    for width in (1000, 1440):
        page.set_viewport_size(ViewportSize(width=width, height=900))
        for place in ('#why', '#told .note', '#parts dd'):
            assert page.evaluate(CUT_OFF, [place, long]) <= 0, (width, place)


OPENED = """(address) => new Promise((done) => {
    const socket = new WebSocket(address);
    socket.onopen = () => { done('open'); socket.close(); };
    socket.onclose = () => done('refused');
})"""


def test_the_page_loads_from_here_only_shows_text_as_text_and_admits_no_other_site(
    drive: Told, page: Page, running: Browser
):
    requests: list[str] = []
    page.on('request', lambda request: requests.append(request.url))
    page.on('websocket', lambda socket: requests.append(socket.url))
    markup = '<img src=x onerror="document.title=1"><b id=evil>'
    drive.end('steps', 1, result=markup, message=markup)
    page.reload()
    expect(page.locator('#events p').first).to_contain_text('<b id=evil>')
    drive.end('steps', 2, result=markup, message=markup)
    expect(note(page, 'steps')).to_contain_text('<b id=evil>')
    expect(page.locator('#evil, main img')).to_have_count(0)
    expect(page.locator('#drawing svg')).to_be_visible()
    own = (page.url, page.url.replace('http', 'ws'))
    assert len(requests) > 8
    assert [url for url in requests if not url.startswith(own)] == []

    socket = page.url.replace('http', 'ws') + 'socket'
    with closing(running.new_page()) as stranger:
        blank = '<title>evil</title>'
        stranger.route('http://evil.example/', lambda route: route.fulfill(body=blank))
        stranger.goto('http://evil.example/')
        assert stranger.evaluate(OPENED, socket) == 'refused'
    assert page.evaluate(OPENED, socket) == 'open'


def test_a_recording_is_played_on_the_same_scope(
    running: Browser, recorded_run: tuple[SawtoothRun, Path], monkeypatch: pytest.MonkeyPatch
):
    clock_s = [100.0]
    monkeypatch.setattr(player, 'monotonic', lambda: clock_s[0])
    source = player.Player(recorded_run[1])
    frame = source.frame
    monkeypatch.setattr(source, 'frame', lambda: None)  # late, as of a busy page
    told = {'kind': 'recording', **lamps(), 'run': source.overview()}
    with served(source, told) as address, closing(tools.opened(running, address)) as page:
        expect(page.locator('#controls')).to_be_hidden()
        page.locator('#seek').focus()
        page.keyboard.press('End')
        monkeypatch.setattr(source, 'frame', frame)
        expect(page.locator('#events')).to_contain_text('sawtooth')
        end_s = float(page.locator('#events time').first.inner_text().removesuffix(' s'))
        page.locator('#seek').fill(f'{end_s}')
        expect(page.locator('#trigger')).to_contain_text('1000 Hz')
        page.locator('#seek').fill('0.0001')
        expect(page.locator('#trigger')).to_contain_text('go to a saw-tooth on the time line')
        page.locator('#seek').fill(f'{end_s}')
        expect(lamp(page, 'AMPLIFIER_ENABLED')).to_be_visible()
        assert page.locator('#speed').input_value() not in {'1', ''}
        page.locator('#seek').fill('0')
        expect(page.locator('#events p')).to_have_count(0)
        page.locator('#speed').select_option('0.01')
        page.get_by_role('button', name='Play').click()
        expect(page.locator('#play')).to_have_text('Pause')
        clock_s[0] += 100.0 * end_s - 0.1
        expect(page.locator('#place')).to_contain_text(f'{end_s - 0.001:.4f} s of')
        clock_s[0] += 1e3
        expect(page.locator('#play')).to_have_text('Play')
        expect(page.locator('#events')).to_contain_text('sawtooth')
        assert page.evaluate(NO_CONTROL_WITHOUT_NAME) == []
        assert barriers(page) == ''
