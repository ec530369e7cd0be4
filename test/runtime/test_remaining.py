# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A drive runs before all of its kernels are compiled; a request that needs others waits."""

import json
import os
import shutil
import sys
from functools import cache
from typing import Any

import pytest
from processes import run_process

from stickslip_ros.kernels.cache import cache_folders

MISSING = '*.switch_all_to_springs-*-entry-*.nbc'
RUN = """
import hashlib, json, sys, time
from stickslip_ros.instrument.commands import Request
from stickslip_ros.kernels.kernel import compilation_reported
from stickslip_ros.parameters import Parameters
from stickslip_ros.runtime.orders import AT_ONCE, Grant
from stickslip_ros.runtime.session import Session
from stickslip_ros.runtime.worker import Callbacks

lockstep = sys.argv[1] == 'lockstep'
said, ended, compiled, digest = [], [], [], hashlib.sha256()
def publish(packed):
    digest.update(packed.data)
callbacks = Callbacks(say=said.append, on_end=lambda event: ended.append(event.command))
parameters = Parameters().updated({'sim.lockstep': lockstep, 'stand.preload_rate': 50.0})
with compilation_reported(compiled.append):
    session = Session(parameters, publish, callbacks)
    session.start()
    fault = None
    if not lockstep:
        fault = session.submit(Request('fault', settings=(('fault.dead_foot', 2),)), AT_ONCE)
        session.submit(Request('clear_faults'), AT_ONCE).result()
    for request in Request('preload', (0.4,)), Request('voltage', (30.0,)):
        session.receive(request)
    session.extend_grant(Grant(20_000_000, 2))
    state = session.state
    while 'preload' not in ended or session.bench.time_ns < 20_000_000:
        time.sleep(0.001)
    session.stop()
print(json.dumps({'said': said, 'ended': ended, 'compiled': len(compiled), 'state': state,
                  'withdrawn': fault and fault.cancelled(), 'dead': session.bench.faults.dead_foot,
                  'digest': digest.hexdigest()}))
"""


@pytest.fixture(scope='module')
def run(tmp_path_factory: pytest.TempPathFactory, compiled_kernels: None) -> Any:
    """Give a function that runs a drive, once, whose disk lacks an entry point, or lacks none."""
    folder = cache_folders().write
    assert folder is not None

    @cache
    def run(mode: str, *, lacks: bool) -> Any:
        disk = tmp_path_factory.mktemp('disk')
        shutil.copytree(folder, disk / folder.name)
        if lacks:
            files = [*(disk / folder.name).glob(MISSING)]
            assert files
            for file in files:  # also those of other Pythons
                file.unlink()
        environment = {**os.environ, 'NUMBA_CACHE_DIR': str(disk)}
        command = [sys.executable, '-c', RUN, mode]
        return json.loads(run_process(command, env=environment, check=True).stdout)

    return run


def test_a_request_that_needs_other_kernels_waits_while_the_drive_goes_on(run):
    found = run('paced', lacks=True)
    assert found['ended'] == ['clear_faults', 'voltage', 'preload']
    assert found['compiled'] == 0
    [line] = found['said']
    assert line.startswith('preload, friction, faults wait for kernels')
    assert run('paced', lacks=False)['said'] == []


def test_a_fault_that_waits_for_kernels_is_withdrawn_when_faults_are_cleared(run):
    found = run('paced', lacks=True)
    assert found['withdrawn']
    assert found['dead'] == 0
    assert not run('paced', lacks=False)['withdrawn']


def test_in_lockstep_simulated_time_waits_and_the_bytes_are_the_same(run):
    kept, lacking = run('lockstep', lacks=False), run('lockstep', lacks=True)
    assert lacking['state'].endswith('waits for kernels, which are compiled once')
    assert kept['said'] == []
    assert lacking['compiled'] == 0
    for same in ('ended', 'digest'):
        assert lacking[same] == kept[same]
