"""The progress bar of long work, on a terminal."""

import io
import re
import sys
import time

from stickslip_ros.cli.printing import shown_progress

PATIENCE_S = 60.0
DONE_BEFORE, TOTAL = 500, 100_000_000
RATE_AND_TIME_LEFT = re.compile(r'\d/s .*\d:\d\d:\d\d')


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_the_bar_counts_and_says_the_rate_and_the_time_left(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, 'stderr', terminal)
    monkeypatch.setenv('TERM', 'xterm')
    monkeypatch.setenv('COLUMNS', '120')
    give_up = time.monotonic() + PATIENCE_S
    with shown_progress('runs', quiet=False, resumes=True) as show:
        done = DONE_BEFORE
        while not RATE_AND_TIME_LEFT.search(terminal.getvalue()):
            assert time.monotonic() < give_up
            done += 1
            show(done, TOTAL)
    assert 'runs' in terminal.getvalue()
    assert f'/{TOTAL}' in terminal.getvalue()


def test_a_quiet_bar_is_not_shown(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, 'stderr', terminal)
    with shown_progress('runs', quiet=True) as show:
        show(1, 2)
    assert terminal.getvalue() == ''
