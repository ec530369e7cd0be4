# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What ``make release`` writes, in a copy of the files that it changes."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from processes import run_process

from stickslip_ros import __version__

ROOT = Path(__file__).resolve().parents[1]
WRITTEN = 'setup.py', 'package.xml', 'CITATION.cff'
URL, MAIL = 'https://example.org/stickslip', 'someone@example.org'


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """Return a folder with what the script reads, as it is before the first release."""
    read = 'CHANGELOG.rst', 'scripts/release.py', 'stickslip_ros/__init__.py'
    setup = (ROOT / 'setup.py').read_text()
    stands_for = {
        re.findall("HOME = '(.*)'", setup)[0]: 'https://stickslip-ros.invalid',
        re.findall("maintainer_email='(.*)'", setup)[0]: 'noreply@stickslip-ros.invalid',
    }
    for name in (*WRITTEN, *read):
        text = (ROOT / name).read_text()
        for said in stands_for if name in WRITTEN else ():
            text = text.replace(said, stands_for[said])
        text = text.replace('Forthcoming\n---', f'{__version__} (2026-01-01)\n---')
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def release(folder: Path, *asked: str) -> 'subprocess.CompletedProcess[str]':
    command = [sys.executable, str(folder / 'scripts/release.py'), *asked]
    return run_process(command)


def test_a_release_has_the_addresses_that_were_said_and_no_word_that_there_are_none(copy):
    assert release(copy, URL, MAIL).returncode == 0
    for name in WRITTEN:
        text = (copy / name).read_text()
        assert URL in text
        for placeholder in ('.invalid', 'RFC 2606', 'no public host'):
            assert placeholder not in text, name
    assert f'<maintainer email="{MAIL}">' in (copy / 'package.xml').read_text()
    assert 'written before' in release(copy).stdout


@pytest.mark.parametrize(
    'asked',
    [
        ('http://example.org', MAIL),
        (f'{URL}/', MAIL),
        (URL, 'nobody'),
        *((f'{URL}{sign}b', MAIL) for sign in '&<\'"\\{#'),
        *((URL, f'{sign}{MAIL}') for sign in '&<\'"\\{#'),
    ],
)
def test_what_is_no_address_is_refused_before_anything_is_written(copy, asked):
    before = {name: (copy / name).read_text() for name in WRITTEN}
    assert 'give an address' in release(copy, *asked).stderr
    assert {name: (copy / name).read_text() for name in WRITTEN} == before


@pytest.mark.parametrize(
    ('name', 'broken'),
    [('setup.py', "it's"), ('package.xml', '<url>'), ('CITATION.cff', 'a: b: c')],
)
def test_a_file_that_would_be_broken_leaves_all_as_they_were(copy, name, broken):
    with (copy / name).open('a') as file:
        file.write(f'{broken}\n')
    before = {name: (copy / name).read_text() for name in WRITTEN}
    done = release(copy, URL, MAIL)
    assert done.returncode == 1
    assert done.stderr.startswith(f'{name} would be broken, and nothing was written: ')
    assert {name: (copy / name).read_text() for name in WRITTEN} == before
