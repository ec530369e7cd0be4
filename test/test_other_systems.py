# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The Python part works in processes without the names that macOS and Windows lack."""

import os
import sys
from pathlib import Path

import pytest
from processes import run_process

SYSTEMS = Path(__file__).with_name('systems')
ROOT = SYSTEMS.parents[1]
MEASURED = """preload_n,amplitude_m,frequency_hz,force_n,force_sigma_n
0.1,30e-9,1000,0.0083,0.002
0.1,40e-9,1000,0.0211,0.002
0.1,70e-9,1000,0.0414,0.002
"""
VERBS = (
    ('simulate', '--amplitude', '60nm', '--steps', '5', '-o', 'run.mcap'),
    ('info', 'run.mcap'),
    ('export', 'run.mcap', '-o', 'run.csv'),
    ('compare', 'run.mcap', 'run.csv'),
    ('sweep', '--preload', '0.1:0.3:2', '--amplitude', '60nm', '-o', 'sweep.csv'),
    ('fit', 'measured.csv', '--free', 'contact.friction', '--starts', '1', '-o', 'fit.yaml'),
)
EACH = f"""
import sys
from stickslip_ros.lab.cli.start import stickslip
for words in {VERBS}:
    sys.argv = ['stickslip', *words]
    assert stickslip() == 0, words
"""
KEEPS = """
from stickslip_ros.kernels.cache import cache_folders
from stickslip_ros.kernels.kernel import entry_point

@entry_point
def twice(value):
    return 2.0 * value

twice(1.0)
print(cache_folders().write, twice.stats.cache_hits)
"""


@pytest.fixture(params=['macos', 'windows'])
def run_there(request, tmp_path):
    """Give a function that runs a process on such a system; its home holds the package."""
    here = {'MPLCONFIGDIR': str(tmp_path), 'XDG_CACHE_HOME': str(tmp_path / 'cache')}
    path = f'{SYSTEMS / request.param}{os.pathsep}{ROOT}'

    def run(*words, home=ROOT, **named):
        environment = os.environ | here | {'PYTHONPATH': path, 'HOME': str(home)} | named
        command = [sys.executable, *words]
        return run_process(command, cwd=tmp_path, env=environment, check=True).stdout

    return run


@pytest.mark.usefixtures('compiled_kernels')
def test_verbs_work_without_the_names_that_are_of_linux(run_there, tmp_path):
    (tmp_path / 'measured.csv').write_text(MEASURED, encoding='utf-8')
    run_there('-c', EACH)
    for words in VERBS:
        assert all((tmp_path / each).stat().st_size for each in words[-1:] if words[-2] == '-o')
    assert not [*tmp_path.glob('*.journal')]


def test_kernels_are_kept_in_a_folder_that_is_judged_by_its_path(run_there, tmp_path):
    (tmp_path / 'keeps.py').write_text(KEEPS, encoding='utf-8')
    for hits in ('Counter()', 'Counter({'):
        told = run_there('keeps.py', home=tmp_path, NUMBA_CACHE_DIR=str(tmp_path / 'asked'))
        assert told.startswith(f'{tmp_path}/asked/stickslip_ros-')
        assert hits in told


def test_a_folder_that_others_can_exchange_keeps_no_kernels(run_there, tmp_path):
    (tmp_path / 'open').mkdir()
    (tmp_path / 'open').chmod(0o777)
    (tmp_path / 'keeps.py').write_text(KEEPS, encoding='utf-8')
    told = run_there('keeps.py', home=tmp_path / 'home', NUMBA_CACHE_DIR=str(tmp_path / 'open'))
    assert not told.startswith(f'{tmp_path}/open')
