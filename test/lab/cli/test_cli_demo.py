# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""`stickslip demo`: two processes, topics between them, a recording and a picture."""

import json
import os
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from processes import run_process

from stickslip_ros.lab.cli.demo import DemoSummary, largest_lag_s
from stickslip_ros.lab.measurements.recorded import timed_messages
from stickslip_ros.lab.measurements.recorded_run import Run
from stickslip_ros.lab.runs.replay import replay
from stickslip_ros.recording.reader import Recording

PNG = b'\x89PNG\r\n\x1a\n'
SETTINGS = ('--set', 'stand.preload=0.25')
FREE_MS = 200
"""Steps and ramp of the free runner, and the pauses; position and force come every ms."""
CELL_NOISE_N = 1e-3
"""Far above the noise of the load cell, 0.06 mN, and far below any force that is generated."""
READ_S = 0.2e-3
"""Two samples of the trace."""
STICKSLIP = Path(sys.executable).with_name('stickslip')


@pytest.fixture(scope='module')
def demo(tmp_path_factory: pytest.TempPathFactory, compiled_kernels: None) -> tuple[Any, Path]:
    """Run the demo once; give the ended process and its folder."""
    folder = tmp_path_factory.mktemp('demo')
    environment = {
        **os.environ,
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
        'ROS_LOG_DIR': str(folder / 'log'),
    }
    for name in ('ROS_NAMESPACE', 'ROS_DOMAIN_ID'):
        environment.pop(name, None)
    return (
        run_process([STICKSLIP, 'demo', '--output', folder, '--json', *SETTINGS], env=environment),
        folder,
    )


def test_it_passes_and_leaves_nothing_on_stderr(demo: tuple[Any, Path]):
    process, _ = demo
    lines = [each for each in process.stderr.splitlines() if not BUSY.search(each)]
    assert lines == []
    assert process.returncode == 0


def test_its_summary_says_what_the_drive_did_and_that_nothing_was_dropped(demo: tuple[Any, Path]):
    told = json.loads(demo[0].stdout)
    assert told['steps'] == 258
    assert told['dropped'] == told['exit_status'] == 0
    assert 0.0 < told['free_step_m'] < 160e-9
    assert 0.0 < told['loaded_force_n'] < told['force_n']


BUSY = re.compile(r' s late|a lag of .* is made up|real-time factor')
"""Lines of a drive on a host that is too busy for real time."""
KEPT_UP = 'simulated time kept up with the clock'
FELL = 'this machine was too busy for real time: simulated time fell 1.2 s behind the clock'


@pytest.mark.parametrize(
    ('changes', 'verdict'),
    [
        ({'behind_s': 0.0}, f'{KEPT_UP}; its largest lag was 0 s'),
        ({'behind_s': 0.49}, f'{KEPT_UP}; its largest lag was 0.49 s'),
        ({'behind_s': 1.23}, f'{FELL}; no step is left out'),
        ({'dropped': 1}, 'the demo failed: check steps, dropped messages and status above'),
    ],
)
def test_a_verdict_says_whether_simulated_time_kept_up(demo, changes, verdict):
    told = DemoSummary(**json.loads(demo[0].stdout))
    assert replace(told, **changes).verdict == verdict


@pytest.mark.parametrize(
    ('report', 'lag_s'),
    [
        ({'lag_s': '1.5', 'lateness_max_us': '3.0', 'behind_s': '0.0'}, 1.5),
        ({'lag_s': '0.0', 'lateness_max_us': '1500000.0', 'behind_s': '0.0'}, 1.5),
        ({'lag_s': '0.0', 'lateness_max_us': 'nan', 'behind_s': '61.0'}, 61.0),
    ],
)
def test_a_lag_counts_whether_it_is_present_made_up_or_given_up(report, lag_s):
    assert largest_lag_s(report) == lag_s


def test_it_writes_a_recording_with_its_parameters(demo: tuple[Any, Path]):
    process, folder = demo
    told = json.loads(process.stdout)
    assert Path(told['recording']) == folder / 'demo.mcap'
    recording = Recording(folder / 'demo.mcap')
    counts = {channel.topic: channel.messages for channel in recording.channels}
    assert counts['/position'] > 700
    commands = '/command/waveform', '/command/sawtooth', '/command/load'
    assert [counts[topic] for topic in commands] == [1, 4, 2]
    assert 'preload: 0.25\n' in recording.attachments['parameters.yaml'][1].decode()
    assert 'preload: 0.25\n' in (folder / 'demo_parameters.yaml').read_text(encoding='utf-8')


def test_the_levels_of_its_ramp_lie_4_ms_apart_on_any_host(demo: tuple[Any, Path]):
    recording = Recording(demo[1] / 'demo.mcap')
    voltage = Run(recording.path).series['voltage_v']  # of the trace, at 10 kHz
    events = [json.loads(text) for _, text in timed_messages(recording, 'event')]
    free_ns = next(each['time_ns'] for each in events if each['command'] == 'sawtooth')
    begin = int(np.searchsorted(voltage.time_s, 1e-9 * free_ns + 0.01))
    levels_v = 7.5 * np.arange(1, 20)  # of 20, to half of 300 V
    rises = [begin + int(np.argmax(voltage.value[begin:] > each - 1.0)) for each in levels_v]
    assert np.diff(voltage.time_s[rises]) == pytest.approx(0.004, abs=READ_S)


def test_it_draws_a_picture(demo: tuple[Any, Path]):
    picture = demo[1] / 'demo.png'
    data = picture.read_bytes()
    assert data.startswith(PNG)
    assert len(data) > 10_000


def test_the_runner_walks_freely_before_it_pushes(demo: tuple[Any, Path]):
    recording = Recording(demo[1] / 'demo.mcap')
    position, force = recording.series('position'), recording.series('force')
    # The load cell stands nine strokes away, of 160 nm at 300 V; two are more than a step.
    walked = int(np.argmax(position.value > 7 * 160e-9))
    assert walked > FREE_MS
    assert abs(force.value[:walked]).max() < CELL_NOISE_N


def test_its_recording_is_replayed_to_the_byte(demo: tuple[Any, Path]):
    recording = demo[1] / 'demo.mcap'
    assert Recording(recording).series('position').time_s[0] > 0.0
    assert replay(recording, demo[1] / 'again.mcap').identical
