# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A drive, a panel and a browser, each a process; as a program: the picture of the README.

    PYTHONPATH=test python test/lab/panel/browser.py docs/images/panel.png

"""

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, Locator, Page, ViewportSize, sync_playwright
from waiting import wait_until

from stickslip_ros.testing.stand import reserve_domain

BIN = Path(sys.executable).parent
NAMES = ('chromium', 'chromium-headless-shell', 'chromium-browser', 'google-chrome')
CHROMIUM = next(filter(None, map(shutil.which, NAMES)), None)
NET_MS = 240_000
"""Net under each condition that Playwright awaits: shorter than the time limit of pytest, so that
Playwright says what it waited for; a start of a drive, the longest wait, takes a hundredth."""
INK = """(canvas) => canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height)
    .data.filter((each, index) => index % 4 === 3 && each > 0).length"""
WIDE = ViewportSize(width=1440, height=900)


@contextmanager
def process(words: Sequence[object], domain: int, folder: Path) -> Iterator[subprocess.Popen[str]]:
    """Run an executable of the package; end it with the context."""
    environment = {**os.environ, 'ROS_DOMAIN_ID': str(domain)}
    command = [str(BIN / str(words[0])), *map(str, words[1:])]
    with subprocess.Popen(
        command, env=environment, cwd=folder, stdout=subprocess.PIPE, text=True
    ) as running:
        try:
            yield running
        finally:
            running.terminate()
            try:
                running.wait()
            finally:  # the time limit of pytest, or Ctrl-C
                running.kill()


def drive(domain: int, folder: Path, *parameters: str) -> Any:
    """Run a drive in a folder, which gets its recordings; parameters as ``name:=value``."""
    given = [word for each in parameters for word in ('-p', each)]
    return process(['drive', '--ros-args', '--log-level', 'error', *given], domain, folder)


@contextmanager
def panel(domain: int, folder: Path, *words: object) -> Iterator[str]:
    """Run a panel on a free port; give its address."""
    with process(['stickslip', 'panel', '--json', '--port', 0, *words], domain, folder) as running:
        assert running.stdout is not None
        yield json.loads(running.stdout.readline())['address']


@contextmanager
def browser() -> Iterator[Browser]:
    """Run Chromium without a window."""
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=CHROMIUM)
        yield running
        running.close()


def opened(running: Browser, address: str, **options: Any) -> Page:
    """Open a page and wait until it shows something."""
    page = running.new_page(**{'viewport': WIDE, **options})
    page.set_default_timeout(NET_MS)
    page.goto(address)
    page.wait_for_selector('body.fresh')
    return page


def note(page: Page, control: str) -> Locator:
    """Return the place of the note beside a control."""
    return page.locator(f'[data-note="{control}"]')


def lamp(page: Page, name: str) -> Locator:
    """Return the lamp of a status bit that is on; none if it is off."""
    return page.locator('#bits .on', has_text=re.compile(f'^{name}$'))


def ink(page: Page, place: str) -> int:
    """Count the pixels of a plot that are not empty."""
    return int(page.locator(f'{place} canvas').first.evaluate(INK))


def frames(page: Page) -> int:
    """Return how many pictures the page has shown."""
    return int(page.locator('body').get_attribute('data-frames') or 0)


def take_picture(picture: Path) -> None:
    """Draw the panel of a free runner that steps."""
    folder = picture.parent
    with (
        reserve_domain() as domain,
        drive(domain, folder, 'load_cell.contact:=absent', 'runner.damping:=2.0'),
        panel(domain, folder) as address,
        browser() as running,
    ):
        page = opened(running, address, viewport=ViewportSize(width=1440, height=930))
        page.locator('#sawtooth-frequency').fill('500')
        page.locator('#sawtooth-steps').fill('1000')
        page.get_by_label('Sawtooth backwards').click()
        page.locator('#events >> text=DONE').wait_for()
        page.locator('#time', has_text=re.compile(r'^(9|\d\d)\.')).wait_for()  # a full history
        page.locator('#sawtooth-steps').fill('0')  # on a busy machine it goes on, too
        page.get_by_label('Sawtooth forwards').click()
        page.locator('#velocity', has_text=re.compile(r'^\+4\d')).wait_for()
        first = frames(page)
        wait_until(lambda: frames(page) > first + 12, 'frames', progress=lambda: frames(page))
        page.locator('#drawing svg', has_text='are shown in').wait_for()
        page.wait_for_selector('body[data-condition=running]')
        page.screenshot(path=picture)


if __name__ == '__main__':
    take_picture(Path(sys.argv[1]).absolute())
