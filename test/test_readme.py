# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The worked example of the start runs as it stands; what the pages name exists."""

import json
import re
import runpy
import shlex
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pytest

from stickslip_ros.interface.topics import TOPICS
from stickslip_ros.lab.cli.main import build_parser, main
from stickslip_ros.parameters.tree import specs

ROOT = Path(__file__).resolve().parents[1]
START = ROOT / 'docs' / 'start' / 'first_steps.md'
HEADING = '## From a recording to a report'
PAGES = [*ROOT.glob('*.md'), *(ROOT / 'docs').rglob('*.md'), ROOT / 'benchmarks' / 'README.md']
MADE = {'build', 'dist', 'install', 'log', 'runs'}
"""Folders that commands of the pages make."""
FOLDERS = {path.name for top in (ROOT, ROOT / 'stickslip_ros') for path in top.iterdir()} - MADE
WORDS = re.compile(r'(?<![\w<>{}~*./-])(?:\.?[\w-]+/)*[\w.-]*\w/?(?![\w<>{}*(])')
OF_A_USER = {'test_controller.py'}
"""Modules that a page asks its reader to write."""
MADE_BY_THE_SITE = {'parameters.md', 'verbs.md'}
"""Pages whose anchors docs/conf.py adds."""


def example() -> list[list[str]]:
    """Return the commands of the example, word by word."""
    section = START.read_text(encoding='utf-8').partition(HEADING)[2]
    block = re.search(r'```sh\n(.*?)```', section, re.DOTALL)
    assert block is not None
    return [shlex.split(line, comments=True) for line in block.group(1).splitlines() if line]


def typed_in(page: Path) -> list[list[str]]:
    """Return the command lines of a page, word by word, without synopses."""
    blocks = re.findall(r'```sh\n(.*?)```', page.read_text(encoding='utf-8'), re.DOTALL)
    lines = ''.join(blocks).replace('\\\n', ' ').splitlines()
    return [shlex.split(line, comments=True) for line in lines if '[--' not in line]


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


def test_the_example_runs_as_it_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    Path('runs').mkdir()  # make demo has made it
    commands = example()
    assert len(commands) >= 8
    for program, *words in commands:
        assert program == 'stickslip'
        assert main(words) == 0, words
    written = {path.name for path in (tmp_path / 'runs').iterdir()}
    assert written >= {'damped.mcap', 'damping.html', 'damped.png', 'roughness.html'}


def test_the_energy_balances_as_closely_as_the_first_page_says(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    told = re.search(r'residual below (\S+) of the work', (ROOT / 'README.md').read_text('utf-8'))
    words = ['--preload', '0.1,0.5,1.0', '--amplitude', '0:160nm:33', '-o', f'{tmp_path}/f.csv']
    assert main(['sweep', *words]) == 0
    found = re.search(r'largest energy residual +(\S+)', capsys.readouterr().out)
    assert 0.0 < float(found[1]) < float(told[1])


def test_the_loop_of_the_control_engineer_reaches_its_target(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('MPLBACKEND', 'agg')
    text = (ROOT / 'docs' / 'start' / 'control_engineer.md').read_text(encoding='utf-8')
    [block] = re.findall(r'^```python\n(.*?)^```', text, re.DOTALL | re.MULTILINE)
    names: dict[str, Any] = {}
    exec(compile(block, 'control_engineer.md', 'exec'), names)
    plt.close('all')
    assert max(abs(each - 20.0) for each in names['read_nm'][20:]) < 1.0
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


def test_twelve_questions_to_the_search_are_entered_below_the_title_of_their_page():
    site = runpy.run_path(str(ROOT / 'docs' / 'conf.py'))
    asked = {
        'install': 'start/first_steps',
        'backlash': 'start/control_engineer',
        'MATLAB': 'howto/bring_your_data',
        'units': 'howto/bring_your_data',
        'pandas': 'reference/python',
        'seed': 'reference/parameters',
        'notebook': 'start/scientist',
        'ROS': 'start/ros_developer',
        'fit': 'howto/fit',
        'namespace': 'howto/several_drives',
        'pytest': 'howto/test_a_controller',
        'friction': 'explanation/physics',
    }
    words = [word.lower() for each in site['FOUND_FIRST'].values() for word in each]
    assert len(set(words)) == len(words)
    for page in site['FOUND_FIRST']:
        text = [(ROOT / 'docs' / f'{page}.md').read_text(encoding='utf-8')]
        site['add_words'](None, page, text)
        below = re.split(r'^# ', text[0], maxsplit=1, flags=re.MULTILINE)[1].splitlines()
        assert below[2].startswith('```{index} ! ')
        for word, place in asked.items():
            assert (f' ! {word},' in f'{below[2]},') == (place == page), word


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_every_target_that_a_page_names_is_in_the_makefile(page: Path):
    makefile = (ROOT / 'Makefile').read_text(encoding='utf-8')
    targets = set(re.findall(r'^([a-z-]+):', makefile, re.MULTILINE))
    named = {words for code in named_in(page) for words in re.findall(r'\bmake ([a-z-]+)', code)}
    assert named - targets == set()
