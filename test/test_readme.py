# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The commands of the pages are ones of the program; what the pages name exists."""

import json
import re
import runpy
import shlex
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from pages import blocks_of, commands_of

from stickslip_ros.interface.topics import TOPICS
from stickslip_ros.lab.cli.main import build_parser, main
from stickslip_ros.parameters.tree import specs

ROOT = Path(__file__).resolve().parents[1]
START = ROOT / 'docs' / 'start' / 'first_steps.md'
PAGES = [*ROOT.glob('*.md'), *(ROOT / 'docs').rglob('*.md'), ROOT / 'benchmarks' / 'README.md']
MADE = {'build', 'dist', 'install', 'log', 'runs'}
"""Folders that commands of the pages make."""
FOLDERS = {path.name for top in (ROOT, ROOT / 'stickslip_ros') for path in top.iterdir()} - MADE
WORDS = re.compile(r'(?<![\w<>{}~*./-])(?:\.?[\w-]+/)*[\w.-]*\w/?(?![\w<>{}*(])')
OF_A_USER = {'test_controller.py'}
"""Modules that a page asks its reader to write."""
MADE_BY_THE_SITE = {'parameters.md', 'verbs.md'}
"""Pages whose anchors docs/conf.py adds."""


def typed_in(page: Path) -> list[list[str]]:
    """Return the command lines of a page, word by word."""
    commands = [each for block in blocks_of(page, 'sh') for each in commands_of(block)]
    return [shlex.split(each, comments=True) for each in commands]


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_every_command_of_a_page_is_one_that_the_program_takes(page: Path):
    for words in typed_in(page):
        if words[:1] == ['stickslip']:
            build_parser(words[1:2]).parse_args(words[1:])


@pytest.mark.parametrize('page', [ROOT / 'README.md', START], ids=lambda page: page.name)
def test_the_line_that_makes_the_program_known_stands_before_its_first_command(page: Path):
    typed = typed_in(page)
    first = next(number for number, words in enumerate(typed) if words[:1] == ['stickslip'])
    assert ['source', '.venv/bin/activate'] in typed[:first]
    programs = {words[0] for words in typed if words}
    assert {'make', 'source', 'stickslip'} <= programs
    own = '.venv-python/bin/python'
    assert programs <= {'make', 'source', 'rosdep', 'ros2', 'stickslip', 'python3', own}


def test_the_energy_balances_as_closely_as_the_first_page_says(tmp_path, capsys):
    told = re.search(r'residual below (\S+) of the work', (ROOT / 'README.md').read_text('utf-8'))
    words = ['--preload', '0.1,0.5,1.0', '--amplitude', '0:160nm:33', '-o', f'{tmp_path}/f.csv']
    assert main(['sweep', *words]) == 0
    found = re.search(r'largest energy residual +(\S+)', capsys.readouterr().out)
    assert 0.0 < float(found[1]) < float(told[1])


def test_the_loop_of_the_control_engineer_reaches_its_target(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('MPLBACKEND', 'agg')
    page = ROOT / 'docs' / 'start' / 'control_engineer.md'
    [block] = blocks_of(page, 'python')
    names: dict[str, Any] = {}
    exec(compile(block.text, 'control_engineer.md', 'exec'), names)
    [curve] = plt.gca().get_lines()
    plt.close('all')
    told = re.search(r'rises to (\d+) nm within (\d+) ms', page.read_text(encoding='utf-8'))
    assert told is not None
    target_nm, within_ms = map(int, told.groups())
    shown_nm = np.asarray(curve.get_ydata())
    assert max(abs(each - target_nm) for each in shown_nm[within_ms:]) < 1.0
    assert min(abs(each - target_nm) for each in shown_nm[: within_ms // 2]) > 1.0
    assert (tmp_path / 'loop.png').exists()


def test_the_answers_of_the_teacher_are_right(capsys: pytest.CaptureFixture[str]):
    text = (ROOT / 'docs' / 'start' / 'teacher.md').read_text(encoding='utf-8')
    [base] = re.findall(r'^stickslip (simulate .*) --voltage 300V$', text, re.MULTILINE)
    rows = re.findall(r'\| (?:`(.*)` )?\| (-?\d+) nm \|', text)
    assert len(rows) == 7
    for option, answer_nm in rows:
        voltage = [] if '--voltage' in option else ['--voltage', '300V']
        assert main([*base.split(), *voltage, *option.split(), '--json']) == 0
        step_nm = 1e9 * json.loads(capsys.readouterr().out)['step_length_m']
        assert step_nm == pytest.approx(float(answer_nm), abs=0.6), option


def anchors_of(page: Path) -> set[str]:
    """Return what a link into a page may name: its headings, as GitHub and the site spell them."""
    text = re.sub(r'```.*?```', '', page.read_text(encoding='utf-8'), flags=re.DOTALL)
    headings = re.findall(r'^#+ (.*)$', text, re.MULTILINE)
    return {re.sub(r'[^\w -]', '', heading.lower()).replace(' ', '-') for heading in headings}


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_every_link_into_the_repository_leads_somewhere(page: Path):
    links = re.findall(r'\]\(([^)#]*)(?:#([^)]*))?\)', page.read_text(encoding='utf-8'))
    site, lost = ROOT / 'docs', []
    for path, anchor in ((path, anchor) for path, anchor in links if '://' not in path):
        target = (page.parent / path).resolve() if path else page
        leaves_the_site = site in page.parents and site not in target.parents
        found = target.exists() and not (leaves_the_site and target.suffix == '.md')
        if found and anchor and target.name not in MADE_BY_THE_SITE:
            found = anchor in anchors_of(target)
        lost += [f'{path}#{anchor}'] * (not found)
    assert lost == []


def named_in(page: Path) -> list[str]:
    """Return what stands in a page as code, in the text."""
    text = re.sub(r'```.*?```', '', page.read_text(encoding='utf-8'), flags=re.DOTALL)
    return re.findall(r'`([^`\n]+)`', text)


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_every_path_that_a_page_names_exists(page: Path):
    folders = [path for path in ROOT.iterdir() if path.is_dir() and path.name[0] != '.']
    modules = {path.name for top in folders for path in top.rglob('*.py')}
    modules |= {path.name for path in ROOT.glob('*.py')}
    missing = []
    for word in (word for code in named_in(page) for word in WORDS.findall(code)):
        first, slash, _ = word.partition('/')
        if slash and first in FOLDERS:
            places = (ROOT, ROOT / 'stickslip_ros', page.parent)
            missing += [word] * (not any((place / word).exists() for place in places))
        elif not slash and word.endswith('.py'):
            missing += [word] * (word not in modules | OF_A_USER)
    assert missing == []


def test_every_topic_that_is_played_or_recorded_on_the_page_of_recordings_exists():
    text = (ROOT / 'docs' / 'reference' / 'recordings.md').read_text(encoding='utf-8')
    commands = [shlex.split(line) for line in re.findall(r'ros2 bag (?:play|record) .*', text)]
    named = {word for words in commands for word in words if re.fullmatch(r'/[\w/]+', word)}
    assert len(named) >= 10
    assert named <= {topic.full_name() for topic in TOPICS}
    assert {topic.full_name() for topic in TOPICS if topic.is_command} >= {
        word for words in commands if words[2] == 'play' for word in words if word in named
    }


def test_every_parameter_has_an_anchor_on_the_site():
    site = runpy.run_path(str(ROOT / 'docs' / 'conf.py'))
    text = ['']
    site['add_parameters'](None, 'reference/parameters', text)
    anchors = re.findall(r'^\| `([\w.]+)`\{#([a-z-]+)\} \|', text[0], re.MULTILINE)
    assert [name for name, _ in anchors] == list(specs())
    assert dict(anchors)['contact.line_seed'] == 'contact-line-seed'
    assert len({anchor for _, anchor in anchors}) == len(anchors)


def test_the_words_of_the_search_are_entered_below_the_title_of_one_page_each():
    site = runpy.run_path(str(ROOT / 'docs' / 'conf.py'))
    words = [word.lower() for each in site['FOUND_FIRST'].values() for word in each]
    assert len(set(words)) == len(words) >= 30
    for page, own in site['FOUND_FIRST'].items():
        text = [(ROOT / 'docs' / f'{page}.md').read_text(encoding='utf-8')]
        site['add_words'](None, page, text)
        below = re.split(r'^# ', text[0], maxsplit=1, flags=re.MULTILINE)[1].splitlines()
        assert below[2].startswith('```{index} ! ')
        assert all(f' ! {word},' in f'{below[2]},' for word in own)


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_every_target_that_a_page_names_is_in_the_makefile(page: Path):
    makefile = (ROOT / 'Makefile').read_text(encoding='utf-8')
    targets = set(re.findall(r'^([a-z-]+):', makefile, re.MULTILINE))
    named = {words for code in named_in(page) for words in re.findall(r'\bmake ([a-z-]+)', code)}
    assert named - targets == set()
