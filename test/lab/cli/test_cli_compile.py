# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""`stickslip compile`, and a demo that finds no kernels: what is compiled is compiled once."""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from processes import finish, run_process, start_process

from stickslip_ros.instrument.compilation import KERNELS, RUNS_KERNELS
from stickslip_ros.kernels import cache as kernel_cache
from stickslip_ros.kernels.cache import Folders
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.lab.cli import compile as compilation
from stickslip_ros.lab.cli.main import main
from stickslip_ros.testing import reserve_domain

BIN = Path(sys.executable).parent
REALISTIC = str(Path(__file__).parents[3] / 'config/realistic.yaml')
LINE = 'compiling kernels, once: ({done}) of at most {kernels}'
OF_ALL = LINE.format(done=r'\d+', kernels=KERNELS + RUNS_KERNELS)
OF_NODE = LINE.format(done=r'\d+', kernels=KERNELS)
STARTING = 'starting the drive in a separate process'


@pytest.fixture(scope='module')
def environment(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """Give an environment whose kernel cache is empty at first."""
    folder = tmp_path_factory.mktemp('cold')
    with reserve_domain() as domain:
        yield {
            **os.environ,
            'NUMBA_CACHE_DIR': str(folder / 'cache'),
            'ROS_DOMAIN_ID': str(domain),
            'ROS_LOG_DIR': str(folder / 'log'),
        }


@pytest.fixture(scope='module')
def run(environment: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Callable:
    folder = tmp_path_factory.mktemp('work')

    def run(*words: str) -> Any:
        return run_process([BIN / 'stickslip', *words], cwd=folder, env=environment)

    return run


@pytest.fixture(scope='module')
def cold_demo(run: Callable) -> Any:
    """Run the demo with an empty cache, as the first command of a machine would."""
    return run('demo')


@pytest.fixture(scope='module')
def all_kept(run: Callable, cold_demo: Any, files: Callable[[], list[Path]]) -> None:
    """Compile what the drive of the demo does not need, and nothing twice."""
    before = len(files())
    done = run('compile')
    assert done.returncode == 0
    assert len(files()) == KERNELS + RUNS_KERNELS
    assert done.stdout.startswith(f'{KERNELS + RUNS_KERNELS - before} kernels compiled in ')


@pytest.fixture(scope='module')
def files(environment: dict[str, str]) -> Callable[[], list[Path]]:
    return lambda: sorted(Path(environment['NUMBA_CACHE_DIR']).rglob('*.nbc'))


@pytest.mark.slow
def test_a_demo_that_finds_no_kernels_compiles_those_of_its_stand_and_says_so(cold_demo, files):
    assert cold_demo.returncode == 0, cold_demo.stderr
    told = [int(done) for done in re.findall(OF_NODE, cold_demo.stderr)]
    assert told[0] == 0
    assert told == sorted(set(told))
    assert told[-1] < len(files()) < KERNELS / 2
    lines = cold_demo.stderr.splitlines()  # nothing is compiled while it is commanded
    assert not re.search(OF_NODE, ''.join(lines[lines.index(STARTING) :]))


@pytest.mark.slow
@pytest.mark.parametrize(
    'words',
    [
        ('compile',),
        ('simulate', '--voltage', '100', '--steps', '2', '--json', '--params', REALISTIC),
        ('sweep', '--amplitude', '0:90nm:10', '--steps', '3', '--workers', '1', '-o', 'sweep.csv'),
    ],
    ids=['compile', 'realistic', 'sweep'],
)
def test_after_that_nothing_is_compiled(words, run, files, all_kept):
    before = files()
    done = run(*words)
    assert done.returncode == 0
    assert done.stderr == ''
    assert files() == before
    assert bool(done.stdout) == (words != ('compile',))


@pytest.mark.slow
def test_what_is_missing_is_compiled_and_counted(run, environment, files, all_kept):
    before = files()
    [lost] = [file for file in before if '.sensing.fill_times-' in file.name]
    lost.unlink()
    done = run('compile')
    assert done.returncode == 0
    assert re.fullmatch(OF_ALL + r'\n', done.stderr)
    assert re.fullmatch(r'1 kernels compiled in .* s, .* s of a processor\n', done.stdout)
    assert files() == before
    assert '"kernels": 0' in run('compile', '--json').stdout


@pytest.mark.slow
def test_a_drive_that_compiles_ends_at_a_signal(environment, tmp_path):
    cold = {**environment, 'NUMBA_CACHE_DIR': str(tmp_path / 'cache')}
    with start_process([BIN / 'drive'], env=cold, stderr=subprocess.PIPE) as drive:
        told = next(line for line in drive.stderr if re.search(OF_NODE, line))
        drive.send_signal(signal.SIGTERM)
        _, rest = finish(drive)
        assert drive.returncode == 0
    assert f'0 of at most {KERNELS}' in told
    assert 'Traceback' not in rest
    assert 'active' not in rest
    assert len(list((tmp_path / 'cache').rglob('*.nbc'))) < KERNELS


def test_where_nothing_can_be_kept_the_verb_says_so_and_fails(monkeypatch, capsys):
    monkeypatch.setattr(kernel_cache, 'cache_folders', lambda: Folders((), None))
    monkeypatch.setattr(compilation, 'cache_folders', lambda: Folders((), None))
    monkeypatch.setattr(
        compilation, 'compile_kernels', lambda: entry_point(lambda value: 2.0 * value)(1.5)
    )
    monkeypatch.setattr(compilation, 'compile_for_runs', lambda: None)
    assert main(['compile']) == 1
    why, progress = capsys.readouterr().err.splitlines()
    assert why.endswith('set NUMBA_CACHE_DIR')
    assert re.fullmatch(OF_ALL, progress)
