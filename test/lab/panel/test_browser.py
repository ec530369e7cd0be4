# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The panel in a real browser, with a drive: each does what the other says."""

import json
import os
import re
import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip('playwright', reason='no Playwright: pip install playwright')

import browser as tools
from browser import ink, lamp, note
from playwright.sync_api import Locator, Page, expect
from waiting import wait_until

from stickslip_ros.lab.cli.panel import NICENESS
from stickslip_ros.lab.measurements.tables import parse_experiment
from stickslip_ros.parameters import load_yaml
from stickslip_ros.process.signals import STOPPED
from stickslip_ros.testing import Operator, open_context

pytestmark = pytest.mark.skipif(
    tools.CHROMIUM is None, reason='no Chromium: apt-get install chromium'
)
expect.set_options(timeout=tools.NET_MS)
RUNS = re.compile('running|late|waiting')
"""Conditions of a drive that is active, on however busy a machine."""
SIGNED = re.compile(r'[+−][\d\u2009]+\.\d')
PRESS = """(each) => {
    const isFree = !each.matches(':disabled');
    if (isFree) each.click();
    return isFree;
}"""
NOTE_WORDS = """() => {
    const word = document.querySelector('#word');
    window.words = [word.textContent];
    new MutationObserver(() => window.words.push(word.textContent))
        .observe(word, { childList: true });
}"""
SHOWS_TIME = '(time_s) => Number(document.querySelector("#time").textContent) > time_s'
HELD_UP_S = 4.0
"""Longer than the silences after which a page reports its drive."""
ASKED = 'pressed'
"""Stands where the panel will note whether a command was sent."""


@pytest.fixture(scope='module')
def stage(ros_domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[SimpleNamespace]:
    """Give a drive, a panel and a browser until the last test."""
    folder = tmp_path_factory.mktemp('stage')
    with ExitStack() as stack:
        stage = SimpleNamespace(domain=ros_domain)
        stage.start = lambda: stack.enter_context(
            tools.drive(ros_domain, folder, 'sim.block:=0.01')
        )
        stage.drive = stage.start()
        words = ['stickslip', 'panel', '--json', '--port', 0]
        stage.panel = stack.enter_context(tools.process(words, ros_domain, folder))
        stage.address = json.loads(stage.panel.stdout.readline())['address']
        stage.browser = stack.enter_context(tools.browser())
        yield stage


@pytest.fixture
def page(stage: SimpleNamespace) -> Iterator[Page]:
    """Give a new page of the drive, which is active and at rest."""
    assert stage.drive.poll() is None
    with closing(tools.opened(stage.browser, stage.address)) as page:
        expect(page.locator('#word')).to_have_text(RUNS)
        page.keyboard.press('Escape')
        expect(lamp(page, 'MOVING')).to_have_count(0)
        expect(page.locator('#voltage-voltage')).not_to_have_value('')
        yield page


@pytest.fixture
def operate(stage: SimpleNamespace) -> Iterator[Callable[[], Operator]]:
    """Give a function that makes an operator; call it late: thousands of messages wait for it."""
    context = open_context(stage.domain)
    with ExitStack() as stack:
        stack.callback(context.try_shutdown)
        yield lambda: stack.enter_context(closing(Operator(context)))


def press(button: Locator) -> None:
    """Press a button while it is not grey: the drive of a busy machine may be silent."""
    wait_until(lambda: button.evaluate(PRESS), 'a button that can be pressed')


def send(page: Page, button: str, control: str) -> None:
    """Press a button until the command is sent."""
    while True:
        note(page, control).evaluate(f'(each) => {{ each.textContent = "{ASKED}"; }}')
        press(page.get_by_label(button))
        expect(note(page, control)).not_to_have_text(ASKED)
        if 'not sent' not in note(page, control).inner_text():
            return


def figure(page: Page, name: str) -> float:
    """Return a large figure."""
    locator = page.locator(f'#{name}')
    expect(locator).to_have_text(SIGNED)
    return float(locator.inner_text().replace('−', '-').replace('\u2009', ''))


def await_figure(page: Page, name: str, fits: Callable[[float], object]) -> None:
    """Wait for a large figure that fits."""
    wait_until(lambda: fits(figure(page, name)), name, progress=lambda: figure(page, name))


def test_the_drive_does_what_the_page_commands_and_the_page_shows_it(
    page: Page, operate: Callable[[], Operator]
):
    before_nm = figure(page, 'position')
    page.locator('#steps-steps').fill('25')
    send(page, 'Steps forwards', 'steps')
    expect(note(page, 'steps')).to_have_text('DONE')
    expect(page.locator('#events p').first).to_contain_text('DONE, 25 steps')
    await_figure(page, 'position', lambda now: now > before_nm + 100.0)

    page.locator('#sawtooth-frequency').fill('500')
    send(page, 'Sawtooth backwards', 'sawtooth')
    expect(page.locator('#trigger')).to_have_text(re.compile(r'^fall at [\d.]+ s, 500\.0 Hz$'))
    expect(lamp(page, 'MOVING')).to_be_visible()
    with page.expect_download() as saved:
        page.locator('#scope-tools').get_by_role('button', name='CSV').click()
    table = parse_experiment(Path(saved.value.path()).read_bytes(), 'scope.csv').columns
    assert np.ptp(table['voltage_v']) > 200.0
    page.keyboard.press('Escape')
    expect(note(page, 'sawtooth')).to_contain_text('ABORTED')
    expect(lamp(page, 'MOVING')).to_have_count(0)
    await_figure(page, 'velocity', lambda now: abs(now) < 0.2)

    page.locator('#load-force\\.x').fill('50')
    send(page, 'Send load', 'load')
    expect(lamp(page, 'LOADED')).to_be_visible()
    page.locator('#load-force\\.x').fill('0')
    send(page, 'Send load', 'load')
    expect(lamp(page, 'LOADED')).to_have_count(0)
    page.locator('#preload-preload').fill('400')
    send(page, 'Send preload', 'preload')
    expect(note(page, 'preload')).to_have_text('DONE')
    expect(page.locator('#drawing svg')).to_contain_text('= 400 mN')
    page.locator('#position-x').fill('500')
    send(page, 'Send position', 'position')
    expect(note(page, 'position')).to_have_text('DONE')
    target = page.locator('[data-target-of=position]')
    expect(target).to_have_text('target +500.0')
    page.locator('#position-x').fill('9 mm')
    send(page, 'Send position', 'position')
    expect(note(page, 'position')).to_contain_text('position x 9000000 nm is outside the travel')
    expect(target).to_have_text('target +500.0')
    send(page, 'Step backwards', 'position')
    expect(target).to_have_text('target +400.0')
    await_figure(page, 'position', lambda now: abs(now - 400.0) < 10.0)
    page.keyboard.press('Escape')
    expect(target).to_have_text('')

    page.locator('#sawtooth-amplitude').fill('400')
    send(page, 'Sawtooth forwards', 'sawtooth')
    expect(note(page, 'sawtooth')).to_have_text(re.compile("400 V is above the amplifier's 300 V"))
    expect(lamp(page, 'REFUSED')).to_be_visible()
    page.locator('#position-x').fill('far')
    send(page, 'Send position', 'position')
    expect(note(page, 'position')).to_contain_text("'far' is not a number; give a number in nm")

    operator = operate()
    operator.wait_for_drive()
    operator.command('voltage', 240.0)
    expect(page.locator('#voltage-voltage')).to_have_value('240')

    def agrees() -> bool:
        """Return whether page and topic give the same position."""
        operator.spin_for(0.01)
        there_nm = 1e9 * operator.positions[operator.time_ns]
        return figure(page, 'position') == pytest.approx(there_nm, abs=20.0)

    wait_until(agrees, 'position on the page that is that of the topic')


def test_parameters_are_found_changed_refused_applied_and_saved(page: Page, tmp_path: Path):
    card, told = page.locator('#parameters'), note(page, 'settings')
    card.locator('summary').click()
    page.get_by_label('Search parameters').fill('friction coefficient')
    friction = page.locator('#parameter-contact\\.friction')
    expect(card.locator('.parameters > div:visible', has=friction)).to_have_count(1)
    expect(page.locator('#parameter-runner\\.mass')).to_be_hidden()
    apply = card.get_by_role('button', name='Apply')
    expect(apply).to_be_disabled()
    friction.fill('-3')
    expect(card).to_contain_text('1 to apply: all live, the drive goes on')
    press(apply)
    expect(told).to_have_text('contact.friction -3 is below the minimum 0.001; raise it')
    expect(friction).to_have_value('-3')
    friction.fill('0,25')
    press(apply)
    expect(told).to_have_text('applied')
    expect(friction).to_have_value('0.25')
    expect(apply).to_be_disabled()

    page.reload()
    card.locator('summary').click()
    first = card.locator('.parameters > div', has=friction)
    expect(first).to_contain_text('default: 0.3, Table 1; 0.001 to 10')
    expect(first.locator('input')).to_have_value('0.25')
    with page.expect_download() as saved:
        card.get_by_role('link', name='Save').click()
    saved.value.save_as(tmp_path / 'saved.yaml')
    assert load_yaml(tmp_path / 'saved.yaml').changed()['contact.friction'] == 0.25

    card.get_by_label('Stage', exact=True).select_option('walker')
    expect(page.locator('#parameter-actuator\\.gain')).not_to_have_value('5.333e-10')
    expect(card).to_contain_text('to apply: an active drive is deactivated')
    press(apply)
    expect(told).to_have_text('applied; the drive began anew')
    expect(card.locator('.parameters > div', has=friction)).to_contain_text('default: Table 1')
    expect(page.locator('#preload-preload + .unit')).to_have_text('0 to 12\u2009000 mN')
    lines = 'contact: {friction: three}'
    file = tmp_path / 'wrong.yaml'
    file.write_text(f'/**:\n  ros__parameters:\n    {lines}\n')
    card.locator('input[type=file]').set_input_files(file)
    expect(card).to_contain_text("wrong.yaml: contact.friction 'three' is not a finite number")
    file = tmp_path / 'paper.yaml'
    file.write_text('/**:\n  ros__parameters:\n    sim: {block: 0.01}\n')
    card.locator('input[type=file]').set_input_files(file)
    press(apply)
    expect(page.locator('#preload-preload + .unit')).to_have_text('0 to 2\u2009000 mN')


def test_fields_take_units_and_live_parameters_change_beside_their_commands(page: Page):
    page.locator('#position-x').fill('2 um')
    page.locator('#position-x').blur()
    expect(page.locator('#position-x')).to_have_value('2000')
    page.locator('#waveform-amplitude').fill('0,3 kV')
    page.locator('#waveform-cycles').fill('1')
    send(page, 'Waveform forwards', 'waveform')
    expect(note(page, 'waveform')).to_have_text('DONE')
    page.locator('details', has=page.locator('#step\\.amplitude')).locator('summary').click()
    page.locator('#step\\.amplitude').fill('0.2 kV')
    page.keyboard.press('Enter')
    expect(page.locator('legend', has_text='Steps')).to_contain_text('of 200 V')
    page.locator('#step\\.amplitude').fill('300')
    page.keyboard.press('Enter')
    expect(page.locator('legend', has_text='Steps')).to_contain_text('of 300 V')


def picture(page: Page) -> str:
    """Return the drawn waveform as it looks."""
    return str(page.locator('.wave canvas').evaluate('(each) => each.toDataURL()'))


def test_waveforms_and_scripts_are_played_to_their_end_or_to_a_refusal(page: Page, tmp_path: Path):
    page.locator('#waveform-amplitude').fill('250')
    page.locator('#waveform-frequency').fill('113.76725643485543')
    page.locator('#waveform-cycles').fill('7')
    drawn = ''
    for shape in page.locator('#waveform-shape option').all_inner_texts()[:-1]:
        page.locator('#waveform-shape').select_option(shape)
        wait_until(
            lambda: ink(page, '.wave') and picture(page) != drawn,  # noqa: B023 - at once
            f'drawing of a {shape}',
        )
        drawn = picture(page)
        for where in ('backwards', 'forwards'):
            send(page, f'Waveform {where}', 'waveform')
            expect(page.locator('#events p').first).to_contain_text('DONE, 7 steps')
            expect(note(page, 'waveform')).to_have_text('DONE')

    page.locator('#waveform-cycles').fill('0')
    send(page, 'Waveform forwards', 'waveform')
    expect(lamp(page, 'STREAMING')).to_be_visible()
    page.keyboard.press('Escape')
    expect(note(page, 'waveform')).to_contain_text('ABORTED')

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

    lines, told = page.get_by_label('Commands of the script'), note(page, 'script-line')

    def play(text: str, ending: str) -> list[str]:
        """Run a script to its end; return the newest events, the newest first."""
        lines.fill(text)
        press(page.get_by_role('button', name='Run', exact=True))
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
    play('steps 3000000000', '^ended at line 1: steps 3e.09 is not a whole number')
    events = play('steps 3\nzero\ntare\nwait 0,1\nposition 0,5um\nstop\nreset', '^done$')
    names = ('reset', 'stop', 'position', 'tare_force', 'zero_position', 'steps')
    for each, name in zip(events, names, strict=False):
        assert re.fullmatch(rf'[\d.]+ s ?{name} \d+ DONE.*', each)
    lines.fill('sawtooth 100 250 0')
    press(page.get_by_role('button', name='Run', exact=True))
    expect(lamp(page, 'MOVING')).to_be_visible()
    page.keyboard.press('Escape')
    expect(told).to_have_text(re.compile('STOP|stopped'))
    expect(lamp(page, 'MOVING')).to_have_count(0)


def test_a_panel_that_was_held_up_does_not_take_its_drive_for_silent(
    stage: SimpleNamespace, page: Page, operate: Callable[[], Operator]
):
    expect(page.locator('#word')).to_have_text('running')
    operator = operate()
    operator.wait_for_drive()
    page.evaluate(NOTE_WORDS)
    stage.panel.send_signal(signal.SIGSTOP)
    try:
        operator.spin_for(HELD_UP_S)
    finally:
        stage.panel.send_signal(signal.SIGCONT)
    page.wait_for_function(SHOWS_TIME, arg=1e-9 * operator.time_ns)
    assert {*page.evaluate('words')} <= {'running', 'late'}


def test_a_drive_that_is_killed_is_missed_until_it_is_back_and_a_panel_that_ends_too(
    stage: SimpleNamespace, page: Page
):
    steps: Any = page.get_by_label('Steps forwards')
    stage.drive.kill()
    stage.drive.wait()
    expect(page.locator('#word')).to_have_text(re.compile('silent|absent'))
    expect(page.locator('#why')).to_contain_text('its process may be gone')
    expect(steps).to_be_disabled()
    stage.drive = stage.start()
    expect(page.locator('#word')).to_have_text(RUNS)
    send(page, 'Steps forwards', 'steps')
    expect(note(page, 'steps')).to_have_text('DONE')
    await_figure(page, 'position', lambda now: now > 20.0)

    threads = (int(each.name) for each in Path(f'/proc/{stage.panel.pid}/task').iterdir())
    assert max(os.getpriority(os.PRIO_PROCESS, each) for each in threads) >= NICENESS
    stage.panel.send_signal(signal.SIGINT)
    assert stage.panel.wait() == STOPPED
    expect(page.locator('#word')).to_have_text('offline')
    expect(steps).to_have_attribute('title', re.compile('not now: the panel does not answer'))
