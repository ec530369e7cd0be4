"""`stickslip demo`: two processes, topics between them, a recording and a picture."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stickslip_ros.cli.demo import DemoSummary
from stickslip_ros.recording.reader import Recording
from stickslip_ros.runs.replay import replay

TIMEOUT_S = 180.0
PNG = b'\x89PNG\r\n\x1a\n'
# At a quarter of the pace: four times as long may an operator be held up by other processes
# before DDS, which keeps ten thousand positions for it, has to drop one.
SETTINGS = ('--set', 'stand.preload=0.25', '--set', 'sim.real_time_factor=0.25')
FREE_MS = 200
"""Steps and ramp of the free runner, and the pauses; position and force come every ms."""
CELL_NOISE_N = 1e-3
"""Far above the noise of the load cell, 0.06 mN, and far below any force that is generated."""
STICKSLIP = Path(sys.executable).with_name('stickslip')


@pytest.fixture(scope='module')
def demo(
    tmp_path_factory: pytest.TempPathFactory, ros_domain: int, compiled_kernels: None
) -> tuple[Any, Path]:
    """Run the demo once; give the ended process and its folder."""
    folder = tmp_path_factory.mktemp('demo')
    environment = {
        **os.environ,
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
        'ROS_DOMAIN_ID': str(60 + ros_domain),
        'ROS_LOG_DIR': str(folder / 'log'),
    }
    environment.pop('ROS_NAMESPACE', None)
    return (
        subprocess.run(
            [STICKSLIP, 'demo', '--output', folder, '--json', *SETTINGS],
            env=environment,
            capture_output=True,
            text=True,
            timeout=TIMEOUT_S,
            check=False,
        ),
        folder,
    )


def test_it_passes_and_leaves_nothing_on_stderr(demo: tuple[Any, Path]):
    process, _ = demo
    assert process.stderr == ''
    assert process.returncode == 0


def test_its_summary_says_that_nothing_was_lost_or_altered(demo: tuple[Any, Path]):
    told = json.loads(demo[0].stdout)
    assert told['steps'] == 258
    assert told['dropped'] == told['unheard'] == 0
    assert told['positions_altered'] == 0
    assert told['positions_equal'] == told['positions_recorded']
    assert told['positions_recorded'] > 700
    assert told['exit_status'] == 0
    assert told['published']['voltage'] == told['received']['voltage'] == 20
    assert told['published']['sawtooth'] == 4
    assert told['published']['load'] == 2
    assert 0.0 < told['free_step_m'] < 160e-9
    assert 0.0 < told['loaded_force_n'] < told['force_n']


KEPT = 'simulated time kept up with the clock'
BUSY = 'this machine was too busy for real time: simulated time fell 1.2 s behind the clock'


@pytest.mark.parametrize(
    ('changes', 'verdict'),
    [
        ({}, f'{KEPT}; nothing was lost'),
        ({'behind_s': 1.23}, f'{BUSY}; nothing was lost'),
        (
            {'behind_s': 1.23, 'unheard': 9},
            f'{BUSY}; 9 readings did not reach the operator, but are recorded',
        ),
        (
            {'overruns': 7, 'overruns_processor_ms': 9.0},
            f'{KEPT}; 7 ticks began late, mostly waiting for a processor; nothing was lost',
        ),
        (
            {'dropped': 1},
            'NOT as it should be: look at steps, dropped, differing and status above',
        ),
    ],
)
def test_a_verdict_says_that_nothing_was_lost_only_where_nothing_was(
    demo: tuple[Any, Path], changes: dict[str, Any], verdict: str
):
    told = DemoSummary(**json.loads(demo[0].stdout))
    parts_ms = dict.fromkeys(
        ('overruns_work_ms', 'overruns_processor_ms', 'overruns_rest_ms'), 1.0
    )
    quiet: dict[str, Any] = {'behind_s': 0.0, 'overruns': 0, 'unheard': 0, **parts_ms}
    assert replace(told, **(quiet | changes)).verdict == verdict


def test_it_writes_a_recording_with_its_parameters(demo: tuple[Any, Path]):
    process, folder = demo
    told = json.loads(process.stdout)
    assert Path(told['recording']) == folder / 'demo.mcap'
    recording = Recording(folder / 'demo.mcap')
    counts = {channel.topic: channel.messages for channel in recording.channels}
    assert counts['/position'] == told['published']['position']
    assert 'preload: 0.25\n' in recording.attachments['parameters.yaml'][1].decode()
    assert 'preload: 0.25\n' in (folder / 'demo_parameters.yaml').read_text(encoding='utf-8')


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
