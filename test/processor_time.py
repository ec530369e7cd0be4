# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Processor seconds of tests, their child processes included: the dearest, and a sum by folder.

``--budget=SECONDS`` fails a run that took more. Wall time would fail it on a busy machine. The
seconds are those of a host that takes `HOST_S` for a loop; a slower host has more, by its loop.

"""

import resource
import time
from collections import defaultdict
from collections.abc import Generator
from functools import cache
from pathlib import PurePath
from statistics import median

import pytest

DEAREST = 10
"""Tests that are named."""
COLLECTING = 'collecting'
"""Imports and collection of all workers."""

HOST_S = 0.115
"""Processor time of the loop on the host of the budget."""


@cache
def slowness() -> float:
    """Return how many times as long as that host this one takes, at least 1."""

    def loop_s(_: int) -> float:
        begin_s, total = time.process_time(), 0
        for number in range(2_000_000):
            total += number * number % 7
        return time.process_time() - begin_s

    return max(1.0, median(map(loop_s, range(7))) / HOST_S)


def used_s() -> float:
    """Return the processor time of this process and of its children that have ended."""
    each = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(use.ru_utime + use.ru_stime for use in each)


def dearest(spent: dict[str, float]) -> list[tuple[str, float]]:
    """Return names and seconds, the most first."""
    return sorted(spent.items(), key=lambda each: -each[1])


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let the user ask for a limit."""
    parser.addoption('--budget', type=float, help='processor seconds above which a run fails')


def pytest_configure(config: pytest.Config) -> None:
    """Measure where tests run, and add up where their reports come together."""
    config.pluginmanager.register(ProcessorTime(config), 'processor time')


class ProcessorTime:
    """Processor seconds of each test."""

    def __init__(self, config: pytest.Config) -> None:
        self._config = config
        self._spent: defaultdict[str, float] = defaultdict(float)
        self._since_s = 0.0

    def pytest_collection_finish(self) -> None:
        self._since_s = used_s()
        getattr(self._config, 'workeroutput', {})[COLLECTING] = self._since_s
        self._spent[COLLECTING] += self._since_s

    @pytest.hookimpl(optionalhook=True)  # of xdist
    def pytest_testnodedown(self, node: object) -> None:
        self._spent[COLLECTING] += getattr(node, 'workeroutput', {}).get(COLLECTING, 0.0)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        report = yield
        now_s = used_s()
        vars(report)['processor_s'], self._since_s = now_s - self._since_s, now_s
        return report

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self._spent[report.nodeid] += getattr(report, 'processor_s', 0.0)

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        if session.exitstatus == 0 and self._above_budget():
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Show what the tests cost, the dearest first."""
        terminalreporter.write_sep('=', 'processor seconds')
        folders: defaultdict[str, float] = defaultdict(float)
        for test, seconds in self._spent.items():
            folders['/'.join(PurePath(test.partition('::')[0]).parts[:2])] += seconds
        tests = [each for each in dearest(self._spent) if each[0] != COLLECTING]
        for name, seconds in [*tests[:DEAREST], *dearest(folders)]:
            terminalreporter.write_line(f'{seconds:8.1f} {name}')
        told = f' of a budget of {self._budget_s:.0f}' if self._budget_s else ''
        terminalreporter.write_line(f'{sum(self._spent.values()):8.1f} in all{told}')
        if self._above_budget():
            terminalreporter.write_line('ABOVE BUDGET: make the dearest cheaper', red=True)

    @property
    def _budget_s(self) -> float:
        """Seconds of this host; 0 without a budget, and in a worker."""
        is_worker = hasattr(self._config, 'workerinput')
        asked_s = 0.0 if is_worker else self._config.getoption('--budget') or 0.0
        return asked_s and asked_s * slowness()

    def _above_budget(self) -> bool:
        return 0.0 < self._budget_s < sum(self._spent.values())
