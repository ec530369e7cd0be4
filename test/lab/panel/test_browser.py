# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The panel in a real browser: what one sees there is what the drive does, and the other way."""

import json
import os
import re
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip('playwright', reason='no Playwright: pip install playwright')

import browser as tools
from geometry_msgs.msg import PointStamped
from playwright.sync_api import Page, ViewportSize, expect
from std_msgs.msg import Float64MultiArray, MultiArrayDimension, String

from stickslip_ros.lab.cli.panel import NICENESS
from stickslip_ros.lab.tables.experiment import parse_experiment
from stickslip_ros.process.signals import STOPPED
from stickslip_ros.testing import Operator, open_context

pytestmark = pytest.mark.skipif(
    tools.CHROMIUM is None, reason='no Chromium: apt-get install chromium'
)
expect.set_options(timeout=tools.TIMEOUT_MS)
RING_DOWN_S = 0.1
WATCHDOG_MS = 1500.0
"""Of jogging: a page on a busy machine renews it late."""
RUNS = re.compile('running|late|waiting')
"""Conditions of a drive that is active, on however busy a machine."""
SIGNED = re.compile(r'[+−][\d\u2009]+\.\d')
CONTROLS = 'button, input, select, textarea'
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

INK = """(canvas) => canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height)
    .data.filter((each, index) => index % 4 === 3 && each > 0).length"""


@pytest.fixture(scope='module')
def stage(ros_domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[SimpleNamespace]:
    """Give a drive, a panel and a browser, all of them until the last test."""
    folder = tmp_path_factory.mktemp('stage')
    with ExitStack() as stack:
        stage = SimpleNamespace(domain=ros_domain, folder=folder, requests=[], is_lost=False)
        watchdog = f'jog.timeout:={1e-3 * WATCHDOG_MS}'
        stage.start = lambda: stack.enter_context(tools.drive(ros_domain, folder, watchdog))
        stage.drive = stage.start()
        stage.address = stack.enter_context(tools.panel(ros_domain, folder))
        stage.browser = stack.enter_context(tools.browser())
        stage.page = tools.opened(stage.browser, stage.address)
        stage.page.on('request', lambda request: stage.requests.append(request.url))
        yield stage


@pytest.fixture
def operate(stage: SimpleNamespace) -> Iterator[Callable[[], Operator]]:
    """Give what makes an operator; one that nobody spins would have thousands of messages wait."""
    context = open_context(stage.domain)
    with ExitStack() as stack:
        stack.callback(context.try_shutdown)
        yield lambda: stack.enter_context(closing(Operator(context)))


@pytest.fixture
def page(stage: SimpleNamespace) -> Page:
    """Give the page, with a drive that is active, at rest and without faults."""
    page: Page = stage.page
    if stage.is_lost:
        pytest.fail('the drive of these tests had ended before')
    if page.url != stage.address:
        page.goto(stage.address)
    stage.is_lost = True
    expect(page.locator('#word')).to_have_text(RUNS)
    stage.is_lost = False
    page.keyboard.press('Escape')
    expect(page.locator('#bits .on', has_text='MOVING')).to_have_count(0)
    page.get_by_role('button', name='Clear faults').click()
    expect(page.locator('#bits .on', has_text='FAULT')).to_have_count(0)
    page.reload()
    expect(page.locator('#word')).to_have_text(RUNS)
    expect(page.locator('#voltage-voltage')).not_to_have_value('')
    expect(page.locator('#time')).not_to_have_text('–')  # the first picture moves what is below it
    return page


def note(page: Page, control: str) -> Any:
    return page.locator(f'[data-note="{control}"]')


ASKED = 'pressed'
"""Stands where the panel will note whether a command was sent."""


def send(page: Page, button: str, control: str) -> None:
    """Press a button; again, if the drive of a busy machine was silent just then."""
    for _ in range(20):
        note(page, control).evaluate(f'(each) => {{ each.textContent = "{ASKED}"; }}')
        page.get_by_label(button).click()
        expect(note(page, control)).not_to_have_text(ASKED)
        if 'not sent' not in note(page, control).inner_text():
            return
        expect(page.locator('#word')).to_have_text(RUNS)
    raise AssertionError(f'{button}: {note(page, control).inner_text()}')


def figure(page: Page, name: str) -> float:
    """Read one of the large figures."""
    locator = page.locator(f'#{name}')
    expect(locator).to_have_text(SIGNED)
    return float(locator.inner_text().replace('−', '-').replace('\u2009', ''))


def await_figure(page: Page, name: str, fits: Callable[[float], bool]) -> float:
    """Wait for a figure that fits."""
    for _ in range(int(tools.TIMEOUT_MS / 50)):
        if fits(figure(page, name)):
            return figure(page, name)
        page.wait_for_timeout(50)
    raise AssertionError(f'{name} is {figure(page, name)}')


def await_that(page: Page, condition: Callable[[], bool], what: str) -> None:
    """Wait until a condition holds."""
    for _ in range(int(tools.TIMEOUT_MS / 50)):
        if condition():
            return
        page.wait_for_timeout(50)
    raise AssertionError(f'{what} did not come')


def lamp(page: Page, name: str) -> Any:
    return page.locator('#bits .on', has_text=re.compile(f'^{name}$'))


def test_steps_move_the_runner_on_the_page_and_on_the_topic(
    page: Page, operate: Callable[[], Operator]
):
    before_nm = figure(page, 'position')
    page.locator('#steps-steps').fill('25')
    send(page, 'Steps forwards', 'steps')
    expect(note(page, 'steps')).to_have_text('DONE')
    operator = operate()
    operator.spin_for(RING_DOWN_S)
    moved_nm = 1e9 * operator.positions[operator.time_ns]
    assert moved_nm > before_nm + 100.0
    await_figure(page, 'position', lambda now: now == pytest.approx(moved_nm, abs=20.0))
    expect(page.locator('#events p').first).to_contain_text('DONE, 25 steps')


def test_the_scope_triggers_on_a_sawtooth_which_escape_stops(page: Page):
    page.locator('#sawtooth-frequency').fill('500')
    send(page, 'Sawtooth backwards', 'sawtooth')
    expect(page.locator('#trigger')).to_have_text(re.compile(r'^fall at [\d.]+ s, 500\.0 Hz$'))
    expect(lamp(page, 'MOVING')).to_be_visible()
    page.locator('#cycles').select_option('5')
    page.keyboard.press('Escape')
    expect(note(page, 'sawtooth')).to_contain_text('ABORTED')
    expect(lamp(page, 'MOVING')).to_have_count(0)


def test_a_refusal_appears_beside_its_control_with_its_reason(page: Page):
    page.locator('#sawtooth-amplitude').fill('400')
    send(page, 'Sawtooth forwards', 'sawtooth')
    expect(note(page, 'sawtooth')).to_have_text(re.compile("400 V is above the amplifier's 300 V"))
    expect(note(page, 'sawtooth')).to_have_class(re.compile('bad'))
    expect(lamp(page, 'REFUSED')).to_be_visible()
    expect(note(page, 'voltage')).not_to_have_class(re.compile('bad'))
    page.locator('#position-x').fill('far')
    send(page, 'Send position', 'position')
    expect(note(page, 'position')).to_contain_text('is not a list of numbers')
    page.reload()
    expect(page.locator('#events p').first).to_contain_text('INVALID_PARAMETER')
    expect(note(page, 'sawtooth')).to_have_text('')
    send(page, 'Steps forwards', 'steps')
    expect(note(page, 'steps')).to_have_text('DONE')


def test_a_twin_is_shown_beside_its_drive(page: Page, operate: Callable[[], Operator]):
    expect(page.locator('#twin')).to_be_hidden()
    operator = operate()
    kinds = {'position': PointStamped, 'residual': PointStamped}
    kinds |= {'steps': Float64MultiArray, 'parameters': Float64MultiArray}
    twin = {
        key: operator.node.create_publisher(kind, f'/twin/{key}', 1000)
        for key, kind in kinds.items()
    }
    operator.spin_until(
        lambda: all(each.get_subscription_count() for each in twin.values()), 'the panel'
    )

    def publish(key: str, labels: str, row: list[float]) -> None:
        message = Float64MultiArray(data=[float(each) for each in row])
        message.layout.dim = [
            MultiArrayDimension(label='row', size=1, stride=len(row)),
            MultiArrayDimension(label=labels, size=len(row), stride=len(row)),
        ]
        twin[key].publish(message)

    def is_heard() -> bool:
        """Return whether the panel hears the last of the publishers, and so the others too."""
        publish('parameters', fitted, [7.2, 0.3, 0.003])
        return '0.3 ± 0.003' in page.locator('#twin-fits').inner_text()

    fitted = 't[s],contact.friction,contact.friction_sigma'
    await_that(page, is_heard, 'a fit')
    for at_ms in range(0, 200, 10):
        for key, value_m in (('position', 1e-9 * at_ms), ('residual', 1e-10)):
            message = PointStamped()
            message.header.stamp.sec, message.header.stamp.nanosec = 7, at_ms * 1_000_000
            message.point.x = value_m
            twin[key].publish(message)
    last = 't[s],steps,rig[m],twin[m],residual_rms[m]'
    publish('steps', last, [7.2, 99, 9.8e-8, 9.7e-8, 1e-10])
    publish('parameters', fitted, [17.2, 0.24, 0.003])
    expect(page.locator('#twin-steps')).to_contain_text('99 steps: rig +98.00 nm, twin +97.00 nm')
    expect(page.locator('#twin-fits')).to_have_text(re.compile('contact.friction.*0.24 ± 0.003'))
    page.reload()  # which asks for it anew
    expect(page.locator('#twin-fits')).to_have_text(re.compile('contact.friction.*0.24 ± 0.003'))
    for canvas in ('#twin-window canvas', '#twin-history canvas'):
        expect(page.locator(canvas).first).to_be_visible()
        assert page.locator(canvas).first.evaluate(INK) > 0


def test_a_jog_lasts_as_long_as_its_button_is_held(page: Page):
    page.get_by_label('Jog forwards').hover()
    page.mouse.down()
    expect(lamp(page, 'MOVING')).to_be_visible()
    page.wait_for_timeout(1.3 * WATCHDOG_MS)
    expect(lamp(page, 'MOVING')).to_be_visible()
    page.mouse.up()
    expect(note(page, 'jog')).to_contain_text('DONE')
    page.get_by_label('Jog backwards').focus()
    page.keyboard.down(' ')
    expect(lamp(page, 'MOVING')).to_be_visible()
    page.keyboard.up(' ')
    expect(note(page, 'jog')).to_contain_text('DONE')
    assert len(re.findall(r'jog \d+ DONE, \d+ steps', page.locator('#events').inner_text())) >= 2


def test_a_jog_lasts_as_long_as_its_key_is_held_but_not_in_a_field(page: Page):
    before = page.locator('#events p', has_text='jog').count()
    page.locator('#jog-frequency').focus()
    page.keyboard.press('ArrowRight')
    send(page, 'Send load', 'load')  # its end comes after that of a jog, had there been one
    expect(note(page, 'load')).to_have_text('DONE')
    assert page.locator('#events p', has_text='jog').count() == before
    page.get_by_label('Steps forwards').focus()
    page.keyboard.down('ArrowRight')
    expect(lamp(page, 'MOVING')).to_be_visible()
    page.wait_for_timeout(1.3 * WATCHDOG_MS)
    expect(lamp(page, 'MOVING')).to_be_visible()
    page.keyboard.up('ArrowRight')
    expect(note(page, 'jog')).to_contain_text('DONE')
    # One, unless a page on a busy machine renewed it too late.
    assert page.locator('#events p', has_text='jog').count() > before


def test_the_voltage_control_stands_where_the_drive_is(
    page: Page, operate: Callable[[], Operator]
):
    operator = operate()
    operator.wait_for_drive()
    operator.command('voltage', 240.0)
    field, slider = page.locator('#voltage-voltage'), page.get_by_role('slider', name='Voltage')
    expect(field).to_have_value('240')
    expect(slider).to_have_value('240')
    slider.focus()
    page.keyboard.press('ArrowRight')
    expect(field).to_have_value('240.3')
    await_figure(page, 'voltage', lambda now: now == 240.3)
    page.locator('#load-force\\.x').focus()
    operator.command('voltage', 60.0)
    expect(field).to_have_value('60')


def test_a_step_is_relative_to_the_target_that_is_held(page: Page):
    target = page.locator('[data-target-of=position]')
    page.locator('#position-x').fill('500')
    send(page, 'Send position', 'position')
    expect(note(page, 'position')).to_have_text('DONE')
    expect(target).to_have_text('target +500.0')
    page.locator('#position-step').fill('40')
    for held in ('+460.0', '+420.0'):
        send(page, 'Step backwards', 'position')
        expect(target).to_have_text(f'target {held}')
    await_figure(page, 'position', lambda now: abs(now - 420.0) < 10.0)
    page.locator('#position-step').press('Enter')  # forwards, not to the field above
    expect(target).to_have_text('target +460.0')
    await_figure(page, 'position', lambda now: abs(now - 460.0) < 10.0)
    page.keyboard.press('Escape')
    expect(target).to_have_text('')


def test_steps_say_of_what_they_are(page: Page):
    expect(page.get_by_role('group', name='Steps')).to_contain_text('of 300 V, 1000 Hz')
    expect(page.get_by_role('group', name='Jog')).to_contain_text('of 300 V; keys ← →')


def test_the_velocity_is_the_slope_of_the_position(page: Page):
    page.locator('#sawtooth-frequency').fill('500')
    send(page, 'Sawtooth forwards', 'sawtooth')
    expect(page.locator('#trigger')).to_contain_text('500.0 Hz')
    page.keyboard.press('Escape')
    await_figure(page, 'velocity', lambda now: abs(now) < 0.2)


def test_the_reason_of_a_condition_and_a_long_path_are_not_cut_off(page: Page):
    long = 'real-time factor 0.5312 instead of 1; ' * 4 + 60 * '/folder'
    for width, place in product((1000, 1440), ('#why', '#told .note', '#parts dd')):
        page.set_viewport_size(ViewportSize(width=width, height=900))
        cut = page.evaluate(
            """([place, text]) => {
                const shown = document.querySelector(place), before = shown.textContent;
                shown.textContent = text;
                const { right, bottom } = shown.getBoundingClientRect();
                const outer = shown.closest('header, section').getBoundingClientRect();
                const beyond = Math.max(right - outer.right, bottom - outer.bottom);
                const cut = shown.scrollWidth - shown.clientWidth;
                shown.textContent = before;
                return Math.max(beyond, cut);
            }""",
            [place, long],
        )
        assert cut <= 0, (width, place)
    page.set_viewport_size(tools.WIDE)


def test_the_runner_is_freed_from_the_load_cell_between_two_states(page: Page):
    cell = page.locator('#load_cell\\.contact')
    expect(cell).to_have_value('attached')
    expect(cell).to_be_disabled()
    expect(cell).to_have_attribute('title', re.compile('needs Deactivate, then Activate'))
    for contact in ('absent', 'attached'):
        page.get_by_role('button', name='Deactivate').click()
        expect(cell).to_be_enabled()
        cell.select_option(contact)
        page.get_by_role('button', name='Activate', exact=True).click()
        expect(page.locator('#word')).to_have_text(RUNS)
        expect(cell).to_be_disabled()
        expect(cell).to_have_value(contact)
        send(page, 'Steps forwards', 'steps')
        expect(note(page, 'steps')).to_have_text('DONE')


def test_a_slider_a_load_a_preload_and_a_target_are_followed(page: Page):
    page.get_by_role('slider', name='Voltage').focus()
    page.keyboard.press('End')
    await_figure(page, 'voltage', lambda now: now == 300.0)
    page.keyboard.press('Home')
    await_figure(page, 'voltage', lambda now: now == 0.0)
    page.locator('#load-force\\.x').fill('50')
    send(page, 'Send load', 'load')
    expect(lamp(page, 'LOADED')).to_be_visible()
    page.locator('#load-force\\.x').fill('0')
    page.keyboard.press('Enter')
    expect(lamp(page, 'LOADED')).to_have_count(0)
    page.locator('#preload-preload').fill('400')
    send(page, 'Send preload', 'preload')
    expect(note(page, 'preload')).to_have_text('DONE')
    page.locator('#position-x').fill('500')
    send(page, 'Send position', 'position')
    expect(note(page, 'position')).to_have_text('DONE')
    await_figure(page, 'position', lambda now: abs(now - 500.0) < 10.0)


def ink(page: Page) -> int:
    """Count the pixels of the drawn waveform that are not empty."""
    return int(page.locator('.wave canvas').evaluate(INK))


def picture(page: Page) -> str:
    """Give the drawn waveform as it looks."""
    return str(page.locator('.wave canvas').evaluate('(each) => each.toDataURL()'))


def test_a_waveform_of_a_shape_is_drawn_and_repeats_until_it_has_made_its_cycles(page: Page):
    page.locator('#waveform-amplitude').fill('250')
    page.locator('#waveform-frequency').fill('113.76725643485543')
    page.locator('#waveform-cycles').fill('7')
    drawn = ''
    for shape in page.locator('#waveform-shape option').all_inner_texts()[:-1]:
        page.locator('#waveform-shape').select_option(shape)
        await_that(
            page,
            lambda: bool(ink(page)) and picture(page) != drawn,  # noqa: B023 - at once
            f'the drawing of a {shape}',
        )
        drawn = picture(page)
        for where in ('backwards', 'forwards'):
            send(page, f'Waveform {where}', 'waveform')
            expect(page.locator('#events p').first).to_contain_text('DONE, 7 steps')
            expect(note(page, 'waveform')).to_have_text('DONE')


def test_a_waveform_of_no_cycles_lasts_until_escape(page: Page):
    for name in ('Sawtooth', 'Waveform'):
        expect(page.get_by_role('group', name=name)).to_contain_text('0: until stopped')
    page.locator('#waveform-shape').select_option('cycloid')
    send(page, 'Waveform forwards', 'waveform')
    expect(lamp(page, 'STREAMING')).to_be_visible()
    page.keyboard.press('Escape')
    expect(note(page, 'waveform')).to_contain_text('ABORTED')


def test_a_waveform_comes_from_a_file_and_is_drawn_before_it_is_played(page: Page, tmp_path: Path):
    file = tmp_path / 'wave.csv'
    file.write_text('time (ms),voltage (V)\n0,0\n10,100\n20,70\n')
    page.locator('#waveform-file').set_input_files(file)
    expect(page.locator('#waveform-shape')).to_have_value('file')
    control = page.locator('fieldset', has_text='Waveform')
    expect(control).to_contain_text('wave.csv: 3 rows, 20 ms')
    expect(page.locator('#waveform-cycles')).to_have_value('1')
    send(page, 'Waveform forwards', 'waveform')
    expect(note(page, 'waveform')).to_have_text('DONE')
    await_figure(page, 'voltage', lambda now: now == 70.0)
    wrong = tmp_path / 'wrong.csv'
    wrong.write_text('time (ms),voltage (V)\n0,0\n1,lots\n2,3\n3,4\n')
    page.locator('#waveform-file').set_input_files(wrong)
    expect(control).to_contain_text('wrong.csv: line 3, column voltage (V)')
    expect(control).to_contain_text('wave.csv: 3 rows, 20 ms')


def test_a_script_goes_line_by_line_is_noted_saved_and_ends_at_a_refusal(
    page: Page, tmp_path: Path
):
    lines, told = page.get_by_label('Commands of the script'), note(page, 'script-line')

    def play(text: str, ending: str) -> list[str]:
        """Run a script to its end; return what the newest events say, the newest first."""
        lines.fill(text)
        page.get_by_role('button', name='Run', exact=True).click()
        expect(told).to_have_text(re.compile(ending))
        return [each.strip() for each in page.locator('#events p').all_inner_texts()]

    events = play('sawtooth 300V 250 20 # ahead\n\nwait 0.3\nsteps -15', '^done$')
    (back, *steps), (ahead, *sawtooth) = (
        re.fullmatch(r'([\d.]+) s ?(\w+) \d+ (DONE, .*)', each).groups() for each in events[:2]
    )
    assert (steps, sawtooth) == (['steps', 'DONE, 15 steps'], ['sawtooth', 'DONE, 20 steps'])
    assert float(back) - float(ahead) > 0.3

    play(
        'voltage 30\nvoltage 301V\nvoltage 60',
        '^ended at line 2: INVALID_PARAMETER: voltage 301 V is above',
    )
    play('steps few', '^ended at line 1: steps .few. is not a whole number')
    play('steps 3000000000', '^ended at line 1: steps 3e.09 is not a whole number')
    events = play('steps 3\nzero\ntare\nwait 0,1\nposition 0,5um\nstop\nreset', '^done$')
    names = ('reset', 'stop', 'position', 'tare_force', 'zero_position', 'steps')
    for each, name in zip(events, names, strict=False):
        assert re.fullmatch(rf'[\d.]+ s ?{name} \d+ DONE.*', each)
    play('wait long', '^ended at line 1: wait takes a time in s')
    lines.fill('sawtooth 100 250 0')
    page.get_by_role('button', name='Run', exact=True).click()
    expect(lamp(page, 'MOVING')).to_be_visible()
    page.keyboard.press('Escape')
    expect(told).to_have_text(re.compile('STOP|stopped'))
    expect(lamp(page, 'MOVING')).to_have_count(0)

    lines.fill('')
    page.get_by_role('button', name='Note', exact=True).click()
    page.locator('#steps-steps').fill('3')
    send(page, 'Steps forwards', 'steps')
    page.get_by_role('button', name='Store place').click()
    expect(lines).to_have_value(re.compile(r'^steps 3\nposition -?[\d.]+nm$'))
    with page.expect_download() as saved:
        page.get_by_role('button', name='Save', exact=True).click()
    saved.value.save_as(tmp_path / 'script.txt')
    text = (tmp_path / 'script.txt').read_text()
    page.reload()
    expect(lines).to_have_value(text)
    lines.fill('')
    with page.expect_file_chooser() as chooser:
        page.get_by_role('button', name='Open…').click()
    chooser.value.set_files(tmp_path / 'script.txt')
    expect(lines).to_have_value(text)


def test_faults_come_by_switch_and_go(page: Page):
    page.locator('#fault\\.interferometer').select_option('dropout')
    expect(lamp(page, 'FAULT')).to_be_visible()
    expect(page.locator('#position')).to_have_text('no reading')
    expect(page.locator('#parts')).to_contain_text('interferometer')
    page.locator('#fault\\.runner_stuck').check()
    expect(page.locator('#parts')).to_contain_text('runner_stuck')
    page.locator('#fault\\.dead_foot').fill('9')
    page.keyboard.press('Enter')
    expect(note(page, 'fault.dead_foot')).to_contain_text('above the maximum 6')
    page.get_by_role('button', name='Clear faults').click()
    expect(lamp(page, 'FAULT')).to_have_count(0)
    expect(page.locator('#fault\\.interferometer')).to_have_value('none')
    expect(page.locator('#fault\\.runner_stuck')).not_to_be_checked()


def test_time_is_held_and_advanced_by_single_blocks(page: Page):
    block = page.get_by_role('button', name='Single block')
    expect(block).to_have_attribute('title', re.compile('not now: it needs Pause'))
    page.get_by_role('button', name='Pause').click()
    expect(page.locator('#word')).to_have_text('paused')
    expect(note(page, 'set_paused')).to_contain_text('paused at')
    page.get_by_role('button', name='Single block').click()
    expect(note(page, 'step_simulation')).to_contain_text('advanced to')
    page.get_by_role('button', name='Pause').click()
    expect(page.locator('#word')).to_have_text(RUNS)


def test_the_amplifier_is_switched_off_and_on(page: Page):
    button = page.get_by_role('button', name='Amplifier')
    expect(button).to_have_attribute('aria-pressed', 'true')
    button.click()
    expect(button).to_have_attribute('aria-pressed', 'false')
    send(page, 'Steps forwards', 'steps')
    expect(note(page, 'steps')).to_contain_text('AMPLIFIER_DISABLED')
    button.click()
    expect(button).to_have_attribute('aria-pressed', 'true')
    for name, control in (('Zero position', 'zero_position'), ('Tare force', 'tare_force')):
        page.get_by_role('button', name=name).click()
        expect(note(page, control)).to_have_text('DONE')
    page.get_by_role('button', name='Reset').click()
    await_figure(page, 'position', lambda now: abs(now) < 2.0)


def test_an_inactive_node_takes_no_commands_and_says_so(page: Page):
    page.get_by_role('button', name='Deactivate').click()
    expect(page.locator('#word')).to_have_text('inactive')
    steps = page.get_by_label('Steps forwards')
    expect(steps).to_be_disabled()
    expect(steps).to_have_attribute('title', re.compile('not now: the node is inactive'))
    expect(page.get_by_role('button', name='STOP')).to_be_disabled()
    page.get_by_role('button', name='Activate', exact=True).click()
    expect(page.locator('#word')).to_have_text(RUNS)
    expect(steps).to_be_enabled()
    assert 'not now' not in str(steps.get_attribute('title'))


def test_what_comes_from_ros_is_shown_as_text(page: Page, operate: Callable[[], Operator]):
    markup = '<img src=x onerror="document.title=1"><b id=evil>'
    event = {'result': markup, 'command': 'steps', 'number': 1, 'steps': 0, 'time_ns': 0}
    operator = operate()
    publisher = operator.node.create_publisher(String, '/stickslip_drive/event', 10)
    operator.spin_until(lambda: publisher.get_subscription_count() > 1, 'the panel')
    for _ in range(50):
        publisher.publish(String(data=json.dumps({'message': markup, **event})))
        if '<b id=evil>' in note(page, 'steps').inner_text():
            break
        page.wait_for_timeout(100)
    expect(page.locator('#events p').first).to_contain_text('<b id=evil>')
    expect(page.locator('#evil, main img')).to_have_count(0)


def test_a_picture_is_read_zoomed_frozen_and_saved(page: Page, tmp_path: Path):
    page.locator('#sawtooth-frequency').fill('500')
    send(page, 'Sawtooth forwards', 'sawtooth')
    expect(page.locator('#trigger')).to_contain_text('500.0 Hz')
    page.locator('#cycles').select_option('3')
    over, voltage = page.locator('#scope .u-over').first, page.locator('#scope .u-legend').last
    page.evaluate('scrollTo(0, 0)')
    box = over.bounding_box()
    page.mouse.move(box['x'] + 0.5 * box['width'], box['y'] + 40)
    # The middle of three cycles of 2 ms: the page shows what was chosen
    middle = re.compile(r'at(2\.[89]|3\.[012])\d* ms')
    expect(page.locator('#scope .u-legend').first).to_contain_text(middle)
    expect(voltage).to_contain_text(re.compile(r'voltage \(V\)\d+\.\d'))
    freeze = page.locator('#scope-tools').get_by_role('button', name='Freeze')
    freeze.click()
    expect(freeze).to_have_attribute('aria-pressed', 'true')

    def saved(place: str, kind: str) -> bytes:
        with page.expect_download() as download:
            page.locator(f'#{place}-tools').get_by_role('button', name=kind).click()
        return Path(download.value.path()).read_bytes()

    table = parse_experiment(saved('scope', 'CSV'), 'scope.csv').columns
    assert {*table} == {'time_s', 'position_m', 'foot_m', 'voltage_v'}
    assert table['time_s'][[0, -1]] == pytest.approx([-0.3e-3, 6.3e-3], abs=0.1e-3)
    assert np.ptp(table['voltage_v']) == pytest.approx(300.0, abs=10.0)
    assert np.ptp(table['foot_m']) == pytest.approx(160e-9, rel=0.05)
    picture = saved('scope', 'PNG')
    assert picture[:4] == b'\x89PNG'
    assert saved('scope', 'PNG') == picture  # frozen
    page.mouse.move(box['x'] + 0.2 * box['width'], box['y'] + 40)
    page.mouse.down()
    page.mouse.move(box['x'] + 0.4 * box['width'], box['y'] + 40, steps=4)
    page.mouse.up()
    page.mouse.move(0, 0)
    zoomed = saved('scope', 'PNG')
    assert zoomed != picture
    over.dblclick()
    page.mouse.move(0, 0)
    assert saved('scope', 'PNG') == picture
    reference = page.locator('#scope-tools').get_by_role('button', name='Reference')
    reference.click()  # keeps the run of 300 V
    freeze.click()
    page.locator('#sawtooth-amplitude').fill('150')
    send(page, 'Sawtooth forwards', 'sawtooth')
    expect(page.locator('#events p').first).to_contain_text('ABORTED')
    await_figure(page, 'voltage', lambda now: now < 100.0)  # a mean over more than is shown
    freeze.click()
    behind = saved('scope', 'PNG')
    assert behind != picture
    reference.click()
    assert saved('scope', 'PNG') != behind  # frozen: only the reference is gone
    freeze.click()
    history = parse_experiment(saved('history', 'CSV'), 'history.csv').columns
    assert {'time_s', 'position_m', 'force_n'} <= {*history}
    page.keyboard.press('Escape')


def test_the_stand_is_shown_and_moves_when_the_drive_does(stage: SimpleNamespace, page: Page):
    drawing = page.locator('#drawing svg')
    expect(drawing).to_be_visible()
    expect(drawing).to_have_attribute('height', '350')
    page.locator('#sawtooth-frequency').fill('200')
    send(page, 'Sawtooth forwards', 'sawtooth')
    expect(drawing).to_have_attribute('height', '550')
    first = drawing.screenshot()
    await_that(page, lambda: drawing.screenshot() != first, 'a movement')
    page.keyboard.press('Escape')


def test_every_control_has_a_name_a_tooltip_and_the_focus(page: Page):
    assert page.evaluate(NO_CONTROL_WITHOUT_NAME) == []


@pytest.mark.parametrize('width', [768, 820, 1024, 1440, 2200])
def test_the_page_fits_every_width_and_does_not_jump(page: Page, width: int):
    page.set_viewport_size(ViewportSize(width=width, height=900))
    page.emulate_media(color_scheme='light')
    assert page.evaluate('document.documentElement.scrollWidth') <= width
    send(page, 'Sawtooth forwards', 'sawtooth')
    expect(lamp(page, 'MOVING')).to_be_visible()
    before = [pytest.approx(box, abs=1) for box in page.evaluate(BOXES)]
    page.emulate_media(color_scheme='dark')
    assert page.evaluate('document.documentElement.scrollWidth') <= width
    assert page.evaluate(BOXES) == before
    page.keyboard.press('Escape')
    expect(note(page, 'sawtooth')).to_contain_text('ABORTED')
    assert page.evaluate(BOXES) == before
    page.set_viewport_size(tools.WIDE)


def test_nothing_is_loaded_from_outside(stage: SimpleNamespace, page: Page):
    assert stage.requests
    own = (stage.address, stage.address.replace('http', 'ws'))
    assert [url for url in stage.requests if not url.startswith(own)] == []


def test_a_page_of_another_site_cannot_move_the_drive(stage: SimpleNamespace, page: Page):
    stranger = stage.browser.new_page()
    stranger.route('http://evil.example/', lambda route: route.fulfill(body='<title>evil</title>'))
    stranger.goto('http://evil.example/')
    socket = stage.address.replace('http', 'ws') + 'socket'
    ended = stranger.evaluate(
        """(address) => new Promise((done) => {
            const socket = new WebSocket(address);
            socket.onopen = () => done('open');
            socket.onclose = () => done('refused');
        })""",
        socket,
    )
    assert ended == 'refused'
    own = page.evaluate(
        """(address) => new Promise((done) => {
            const socket = new WebSocket(address);
            socket.onopen = () => { done('open'); socket.close(); };
            socket.onclose = () => done('refused');
        })""",
        socket,
    )
    assert own == 'open'
    stranger.close()


def test_a_recording_is_made_and_then_played_on_the_same_scope(stage: SimpleNamespace, page: Page):
    page.get_by_role('button', name='Record').click()
    expect(page.get_by_role('button', name='Record')).to_have_attribute('aria-pressed', 'true')
    page.locator('#steps-steps').fill('100')
    send(page, 'Steps forwards', 'steps')
    expect(note(page, 'steps')).to_have_text('DONE')
    expect(page.locator('#parts')).to_contain_text(re.compile(r'[\d.]+ s, [\d.]+ MB'))
    page.get_by_role('button', name='Record').click()
    expect(page.get_by_role('button', name='Record')).to_have_attribute('aria-pressed', 'false')
    [file] = (stage.folder / 'runs').glob('*.mcap')
    with tools.panel(stage.domain, stage.folder, file) as address:
        player = tools.opened(stage.browser, address)
        expect(player.locator('#controls')).to_be_hidden()
        player.locator('#seek').focus()
        player.keyboard.press('End')
        expect(player.locator('#events')).to_contain_text('steps')
        end_s = float(player.locator('#events time').first.inner_text().removesuffix(' s'))
        player.locator('#seek').fill(f'{end_s:.3f}')
        expect(player.locator('#trigger')).to_contain_text('1000 Hz')
        expect(lamp(player, 'AMPLIFIER_ENABLED')).to_be_visible()
        assert player.locator('#speed').input_value() not in {'1', ''}
        player.locator('#speed').select_option('0.01')
        player.get_by_role('button', name='Play').click()
        expect(player.locator('#play')).to_have_text('Pause')
        player.locator('#speed').select_option('10')
        expect(player.locator('#play')).to_have_text('Play')
        assert player.evaluate(NO_CONTROL_WITHOUT_NAME) == []
        player.close()


def test_a_drive_that_is_killed_is_missed_and_found_when_it_is_back(
    stage: SimpleNamespace, page: Page
):
    stage.drive.kill()
    stage.drive.wait()
    expect(page.locator('#word')).to_have_text(re.compile('silent|absent'))
    expect(page.get_by_label('Steps forwards')).to_be_disabled()
    stage.drive = stage.start()
    expect(page.locator('#word')).to_have_text(RUNS)
    send(page, 'Steps forwards', 'steps')
    expect(note(page, 'steps')).to_have_text('DONE')
    await_figure(page, 'position', lambda now: now > 20.0)


def test_a_panel_ends_at_the_first_signal_and_the_page_says_so(stage: SimpleNamespace):
    with tools.process(
        ['stickslip', 'panel', '--json', '--port', 0], stage.domain, stage.folder
    ) as running:
        address = json.loads(running.stdout.readline())['address']
        page = tools.opened(stage.browser, address)
        threads = (int(each.name) for each in Path(f'/proc/{running.pid}/task').iterdir())
        assert max(os.getpriority(os.PRIO_PROCESS, each) for each in threads) >= NICENESS
        running.send_signal(signal.SIGINT)
        assert running.wait(tools.END_TIMEOUT_S) == STOPPED
        expect(page.locator('#word')).to_have_text('offline')
        steps = page.get_by_label('Steps forwards')
        expect(steps).to_have_attribute('title', re.compile('not now: the panel does not answer'))
        page.close()
        assert isinstance(running, subprocess.Popen)


def test_the_axes_of_a_stage_stand_side_by_side_and_are_commanded_each(
    stage: SimpleNamespace, tmp_path: Path
):
    axes = 'xy'
    with ExitStack() as stack:
        for axis in axes:
            words = ['drive', '--ros-args', '--log-level', 'error', '-r', f'__ns:=/stage/{axis}']
            stack.enter_context(tools.process(words, stage.domain, tmp_path))
        words = ['--namespace', '/stage/x', '--beside', '/stage/y']
        address = stack.enter_context(tools.panel(stage.domain, tmp_path, *words))
        page = stack.enter_context(closing(stage.browser.new_page()))
        page.set_default_timeout(tools.TIMEOUT_MS)
        page.goto(address)
        frames = [page.frame_locator('iframe').nth(number) for number in range(len(axes))]
        for axis, frame in zip(axes, frames, strict=True):
            expect(frame.locator('#word')).to_have_text(RUNS)
            expect(frame.locator('#drives')).to_have_value(f'/stage/{axis}/stickslip_drive')
        context = open_context(stage.domain, '/stage/y')
        stack.callback(context.try_shutdown)
        operator = stack.enter_context(closing(Operator(context)))
        operator.wait_for_drive()
        operator.command('voltage', 30.0)
        expect(frames[1].locator('#voltage')).to_have_text(re.compile(r'^\+?30\.0'))
        expect(frames[0].locator('#voltage')).not_to_have_text(re.compile('30'))
