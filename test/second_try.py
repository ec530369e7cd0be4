# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
``--second-try``: a test that failed is run once more, alone, at the end of the run.

If it passes then, it counts as passed and is named as FLAKY before the closing line of pytest. If
it fails again, both reports are shown. What was not a test is not tried again: an error of
collection, a worker that crashed, a run that was stopped.

"""

import re
import sys
from collections.abc import Generator
from typing import Any

import pytest
from processes import run_process

TRIED_MAX = 10
"""Failed tests up to which each is tried again; more have a common cause."""
OUTCOMES = ('failed', 'error')


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let the user ask for it."""
    parser.addoption(
        '--second-try',
        action='store_true',
        help='run a test that failed once more, alone, at the end',
    )


def pytest_configure(config: pytest.Config) -> None:
    """Look at the outcomes where they come together, not in a worker of xdist."""
    if config.getoption('--second-try') and not hasattr(config, 'workerinput'):
        config.pluginmanager.register(SecondTry(config), 'second try')


class SecondTry:
    """The tests that failed and then passed."""

    def __init__(self, config: pytest.Config) -> None:
        self._config = config
        self._flaky: dict[str, list[pytest.TestReport]] = {}

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> Generator[None, object, object]:
        """Try again after all tests, before pytest sets its exit status."""
        result = yield
        failed = self._failed()
        for test, reports in failed.items():
            done = run_process(
                [sys.executable, '-m', 'pytest', '-p', 'no:xdist', test], cwd=self._config.rootpath
            )
            if done.returncode == 0 and re.search(r'\b1 passed', done.stdout.splitlines()[-1]):
                self._excuse(test, reports)
                session.testsfailed -= len(reports)
            else:
                reports[-1].sections.append(('second try', f'{done.stdout}{done.stderr}'))
        return result

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_terminal_summary(
        self, terminalreporter: pytest.TerminalReporter
    ) -> Generator[None, None, None]:
        """Show how they failed, and name them when all else has been said."""
        for test, reports in self._flaky.items():
            terminalreporter.write_sep('_', f'{test} failed, then passed')
            for report in reports:
                report.toterminal(terminalreporter._tw)
        yield
        for test in self._flaky:
            terminalreporter.write_line(f'FLAKY: {test}')

    def _failed(self) -> dict[str, list[pytest.TestReport]]:
        """Return the reports of each test that failed, if these may be tried again."""
        failed: dict[str, list[pytest.TestReport]] = {}
        for report in self._reports():
            if getattr(report, 'when', None) not in ('setup', 'call', 'teardown'):
                return {}
            failed.setdefault(report.nodeid, []).append(report)
        return failed if len(failed) <= TRIED_MAX else {}

    def _reports(self) -> list[Any]:
        return [each for outcome in OUTCOMES for each in self._stats.get(outcome, [])]

    def _excuse(self, test: str, reports: list[pytest.TestReport]) -> None:
        """Count a test as passed, once."""
        for outcome in OUTCOMES:
            left = [each for each in self._stats.pop(outcome, []) if each not in reports]
            if left:
                self._stats[outcome] = left
        passed = self._stats.setdefault('passed', [])
        if not any(each.nodeid == test for each in passed):
            reports[-1].outcome = 'passed'
            passed.append(reports[-1])
        self._terminal._set_main_color()
        self._flaky[test] = reports

    @property
    def _terminal(self) -> Any:
        return self._config.pluginmanager.getplugin('terminalreporter')

    @property
    def _stats(self) -> dict[str, list[Any]]:
        stats: dict[str, list[Any]] = self._terminal.stats
        return stats
