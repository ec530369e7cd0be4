# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What all tests share: how hypothesis searches, and the stand of the paper."""

import os

# Threads of OpenBLAS spin while they wait, which on busy cores doubles the time of a fit. It reads
# this when numpy is loaded, as by the imports below.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

import fcntl
import gc
import re
import runpy
import signal
import sys
from collections.abc import Generator, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import matplotlib.font_manager  # noqa: F401 - a process that finds no font cache says so on stderr
import pytest
import setuptools
from held_disk import HeldDisk
from hypothesis import HealthCheck, settings
from processes import end_with_parent

from stickslip_ros.lab.measurements.run_result import SawtoothRun
from stickslip_ros.lab.runs.sawtooth_run import simulate
from stickslip_ros.parameters import Parameters

# The same examples in every run and on every machine, however slow it is: a failure found once
# is found again, and a first call that compiles a kernel fails no deadline. A run that holds slow
# tests, as of `make test-all`, searches twice as long.
settings.register_profile(
    'deterministic',
    max_examples=50,
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
settings.register_profile('thorough', settings.get_profile('deterministic'), max_examples=100)
settings.load_profile('deterministic')

pytest_plugins = ['stickslip_ros.testing.pytest_plugin', 'second_try', 'processor_time']
LONGEST = (
    'test_benchmarks.py',
    'test_browser.py',
    'test_cli_compile.py',
    'test_fit_of_traces.py',
    'test_studies.py',
)
DOORS = 'test_docs_doors.py', 'test_docs_doors_guard.py', 'test_example_learn.py'
"""Tests of examples that need the packages of requirements/doors.txt."""
WINDOW = ('COLUMNS', 'LINES', 'FORCE_COLOR', 'NO_COLOR', 'TTY_COMPATIBLE')


def pytest_configure(config: pytest.Config) -> None:
    """Let processes take SIGHUP, under nohup too, and choose the search."""
    if hasattr(config, 'workerinput'):
        end_with_parent()
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    if 'not slow' not in config.option.markexpr:
        settings.load_profile('thorough')


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out doors of `make test`, and what needs other readers, which only `test` installs."""
    if collection_path.name in DOORS and 'not slow' in config.option.markexpr:
        return True
    if collection_path.suffix != '.py' or find_spec('mcap_ros2') is not None:
        return None
    needs_it = re.search(
        '^from rosbags', collection_path.read_text(encoding='utf-8'), re.MULTILINE
    )
    return True if needs_it else None


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Let one worker compile a module of a fresh checkout, and the others load what it wrote."""
    if not isinstance(collector, pytest.Module):
        return (yield)
    with collector.path.open() as module:
        fcntl.flock(module, fcntl.LOCK_EX)
        return (yield)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the files that take longest, so that no worker is left alone with one."""
    items.sort(key=lambda item: item.path.name not in LONGEST)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Keep what is imported out of garbage collections, which would go through it each time."""
    gc.disable()
    result = yield
    gc.collect()
    gc.freeze()
    gc.enable()
    return result


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say where doors are tested, and how many tests ran in a browser."""
    if 'not slow' in terminalreporter.config.option.markexpr:
        terminalreporter.write_line(f'make test-all also runs {" and ".join(DOORS)}')
    stats = terminalreporter.stats
    counts = {
        outcome: sum('test_browser.py' in each.nodeid for each in stats.get(outcome, ()))
        for outcome in ('passed', 'failed', 'skipped')
    }
    if any(counts.values()):
        words = ', '.join(f'{count} {outcome}' for outcome, count in counts.items())
        terminalreporter.write_line(f'browser tests: {words}')


@pytest.fixture(scope='session', autouse=True)
def _plain_terminal() -> Iterator[None]:
    """Print tables as wide and as plain as into a file, whatever window the tests run in."""
    with pytest.MonkeyPatch.context() as patch:
        for name in WINDOW:
            patch.delenv(name, raising=False)
        yield


@pytest.fixture(scope='session')
def quiet_ros(tmp_path_factory: pytest.TempPathFactory, compiled_kernels: None) -> Iterator[None]:
    """Keep logs out of the home folder, and what the machine has set up for ROS out of a test."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv('ROS_LOG_DIR', str(tmp_path_factory.mktemp('log')))
        patch.delenv('ROS_DOMAIN_ID', raising=False)
        patch.delenv('ROS_NAMESPACE', raising=False)
        yield


@pytest.fixture(scope='session')
def stand() -> Parameters:
    """Give the test stand of the paper: every parameter at its default."""
    return Parameters()


@pytest.fixture(params=['install', 'bdist_wheel'])
def keywords(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Give what setup.py hands to setuptools, under colcon and under pip."""
    handed: dict[str, Any] = {}
    monkeypatch.setattr(setuptools, 'setup', lambda **given: handed.update(given))
    monkeypatch.setattr('sys.argv', ['setup.py', request.param])
    monkeypatch.chdir(Path(__file__).parents[1])
    runpy.run_path('setup.py')
    return handed


@pytest.fixture(scope='session')
def recorded_run(tmp_path_factory: pytest.TempPathFactory) -> tuple[SawtoothRun, Path]:
    """Give result and recording of twenty full steps at 1 kHz, with the default stand."""
    path = tmp_path_factory.mktemp('run') / 'run.mcap'
    return simulate(Parameters(), voltage_v=300.0, steps=20, record=path).result, path


@pytest.fixture
def unshared() -> Iterator[None]:
    """Keep the interpreter with this thread until it waits: no other one runs meanwhile."""
    interval_s = sys.getswitchinterval()
    sys.setswitchinterval(1000.0)
    yield
    sys.setswitchinterval(interval_s)


@pytest.fixture
def held_disk(monkeypatch: pytest.MonkeyPatch) -> Iterator[HeldDisk]:
    """Give a disk that a test holds; it goes on at the end."""
    disk = HeldDisk(monkeypatch)
    yield disk
    disk.release()
