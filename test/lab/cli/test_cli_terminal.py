# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What a terminal shows: an answer in its two forms, the bar of long work, and completion."""

import io
import json
import os
import re
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
from processes import run_process

from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.cli.printing import Answer
from stickslip_ros.lab.cli.verbs import VERBS
from stickslip_ros.lab.validation.references import read_references
from stickslip_ros.process.signals import REFUSED
from stickslip_ros.progress import shown_progress
from stickslip_ros.sections import Section, si_row

DONE_BEFORE, LEFT = 500, 20_000
RATE_AND_TIME_LEFT = re.compile(r'\d/s .*\d:\d\d:\d\d')


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_the_bar_counts_and_says_the_rate_and_the_time_left(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, 'stderr', terminal)
    monkeypatch.setenv('TERM', 'xterm')
    monkeypatch.setenv('COLUMNS', '80')
    with shown_progress('runs', quiet=False, resumes=True) as show:
        done = DONE_BEFORE
        while not RATE_AND_TIME_LEFT.search(terminal.getvalue()):
            done += 1
            show(done, LEFT + done, '3 of 5 searches ended')  # a fit finds its total on its way
    assert 'runs' in terminal.getvalue()
    assert re.search(r'\d/[2-9]\d{4}\b', terminal.getvalue())


def test_a_quiet_bar_is_not_shown(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, 'stderr', terminal)
    with shown_progress('runs', quiet=True) as show:
        show(1, 2)
    assert terminal.getvalue() == ''


@pytest.mark.parametrize(
    ('words', 'bars'),
    [
        (['validate'], ['families']),
        (['figures', '--only', 'fig2', '--points', '2'], ['runs', 'figures']),
        (['zero-amplitude', '--steps', '10'], ['runs']),
        (['bode', '--frequency', '1kHz'], ['sines']),
        (['sweep', '--amplitude', '1nm', '--steps', '1', '--output', 'a.csv'], ['runs']),
        (['simulate', '--voltage', '9V', '--steps', '1'], ['steps']),
    ],
    ids=lambda each: each[0],
)
def test_long_work_shows_how_far_it_is(words, bars, monkeypatch, tmp_path, ros_domain):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('ROS_DOMAIN_ID', str(ros_domain))
    one = read_references()[:1]
    monkeypatch.setattr('stickslip_ros.lab.validation.self_test.read_references', lambda: one)
    shown: list[str] = []

    @contextmanager
    def noted(what, *, quiet, resumes=False):
        shown.append(what)
        with shown_progress(what, quiet=quiet, resumes=resumes) as show:
            yield show

    modules = [f'lab.cli.{VERBS[words[0]].module}', 'lab.linear.swept_sine', 'progress']
    for module in modules:
        monkeypatch.setattr(f'stickslip_ros.{module}.shown_progress', noted, raising=False)
    assert main(words) != REFUSED
    assert shown == bars


def test_an_answer_is_a_table_for_people_or_json_in_si_units(capsys):
    rows = [si_row('stroke', 60e-9, '.1f', 'nm'), ('steps', 20)]
    answer = Answer({'stroke_m': 60e-9, 'steps': 20}, [Section('a run', rows), 'done'])
    answer.show(as_json=False)
    shown = capsys.readouterr().out
    assert re.search(r'^stroke   60\.0   nm\nsteps      20 *$', shown, re.MULTILINE)
    assert shown.endswith('done\n')
    answer.show(as_json=True)
    assert json.loads(capsys.readouterr().out) == {'stroke_m': 60e-9, 'steps': 20}


def test_a_table_is_as_wide_as_a_narrow_terminal_where_nobody_says_how_wide(capsys, monkeypatch):
    answer = Answer(None, [Section('a table', [('x' * 200,)])])
    for columns, width in ((None, 80), ('90', 90)):
        if columns:
            monkeypatch.setenv('COLUMNS', columns)
        answer.show(as_json=False)
        assert max(map(len, capsys.readouterr().out.splitlines())) == width


BIN = Path(sys.executable).parent
IMPORTED = """
import os, sys
left = os._exit
def leave(status):
    found = [each for each in SLOW if each in sys.modules]
    print('imported', found, file=sys.stderr, flush=True)
    left(status)
os._exit = leave
from stickslip_ros.lab.cli.start import stickslip
stickslip()
"""
ASK = """
eval "$(register-python-argcomplete stickslip)"
for line; do
    COMP_LINE="$line" COMP_POINT=${#line} COMP_TYPE=9 COMPREPLY=()
    _python_argcomplete stickslip
    printf '%s ' "${COMPREPLY[@]}"
    echo
done
"""
OFFERED = {
    'stickslip zero': {'zero-amplitude'},
    'stickslip zero-amplitude --f': {'--frequency'},
    'stickslip info ': {'run.mcap', 'there/'},
    'stickslip fit a.csv -o ': {'run.mcap', 'there/'},
    'stickslip simulate --amplitude ': set[str](),
    'stickslip simulate --stage r': {'rod'},
    'stickslip simulate --set stand.preload_r': {'stand.preload_rate='},
    'stickslip simulate --set contact.profile=s': {'smooth'},
    'stickslip fit a.csv --free runner.mass,runner.d': {'runner.mass,runner.damping'},
}
"""What bash shall offer for a line, beside options that may follow as well."""


def test_bash_completes_verbs_options_files_and_parameters(tmp_path: Path):
    (tmp_path / 'run.mcap').touch()
    (tmp_path / 'there').mkdir()
    told = run_process(
        ['bash', '-c', ASK, 'bash', *OFFERED],
        cwd=tmp_path,
        env={**os.environ, 'PATH': f'{BIN}:{os.environ["PATH"]}'},
        check=True,
    )
    page = (Path(__file__).parents[3] / 'docs/reference/verbs.md').read_text(encoding='utf-8')
    assert ASK.splitlines()[1] in page
    for (line, offered), words in zip(OFFERED.items(), told.stdout.splitlines(), strict=True):
        others = {word for word in words.split() if not word.startswith('--')}
        assert others | offered & set(words.split()) == offered, line


@pytest.mark.parametrize('line', ['stickslip s', 'stickslip fit --', 'stickslip drive --set st'])
def test_completion_imports_nothing_that_takes_long(line: str, tmp_path: Path):
    slow = ('numba', 'scipy', 'matplotlib', 'rich', 'numpy', 'rclpy')
    told = run_process(
        [sys.executable, '-c', f'SLOW = {slow}\n{IMPORTED}'],
        env={
            **os.environ,
            '_ARGCOMPLETE': '1',
            '_ARGCOMPLETE_STDOUT_FILENAME': str(tmp_path / 'told'),
            'COMP_LINE': line,
            'COMP_POINT': str(len(line)),
        },
        check=True,
    )
    assert told.stderr.endswith('imported []\n')
    assert (tmp_path / 'told').read_text()
