# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A recording whose process was killed holds all that was put before the flush period."""

import json
import subprocess
import sys
from pathlib import Path

import killed_runs
import pytest
from processes import finish, start_process

from stickslip_ros.errors import RecordingError
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recover import recover
from stickslip_ros.units import NS_PER_S

PROCESSES, RUNS_EACH = 2, 6
"""Together a run of every form at every pace."""
#: What a process that has a processor may need to write, beyond the flush period.
BUSY_S = 0.6


@pytest.fixture(scope='module')
def killed(tmp_path_factory: pytest.TempPathFactory) -> list[dict]:
    """Give what became of each run, as its process had said until it was killed."""
    folder = tmp_path_factory.mktemp('killed')
    command = [sys.executable, killed_runs.__file__, str(folder)]
    processes = [
        start_process([*command, seed, RUNS_EACH], stdout=subprocess.PIPE)
        for seed in range(PROCESSES)
    ]
    outputs = [finish(each)[0] for each in processes]
    assert [each.returncode for each in processes] == [0] * PROCESSES
    return [json.loads(line) for output in outputs for line in output.splitlines()]


def rows_of(path: Path) -> list[tuple[str, int, str]]:
    return [(topic, at, repr(each)) for topic, at, each in Recording(path).messages()]


@pytest.fixture(scope='module')
def recovered(killed: list[dict]) -> list[tuple[dict, list]]:
    """Give each run and the messages that came back."""
    rows = []
    for run in killed:
        path = Path(run['path'])
        source = path if path.exists() else path.with_suffix('')
        with pytest.raises(RecordingError, match='stickslip recover'):
            Recording(source)
        _, written = recover(source)
        rows.append((run, rows_of(source if written.name == 'metadata.yaml' else written)))
    return rows


def test_every_process_was_killed_while_it_recorded(killed: list[dict]):
    assert len(killed) == PROCESSES * RUNS_EACH
    assert all(run['killed'] for run in killed)
    assert all(run['rows'] for run in killed)


def test_what_was_said_to_be_on_the_disk_is_in_the_recording(recovered: list):
    secured = 0
    for run, rows in recovered:
        assert len(rows) >= max(row[2] for row in run['rows'])
        secured += max(row[2] for row in run['rows'])
    assert secured > 0


def test_what_was_put_longer_ago_than_the_flush_period_is_in_the_recording(recovered: list):
    bound_ns = round((killed_runs.FLUSH_PERIOD_S + BUSY_S) * NS_PER_S)
    messages = 0
    for run, rows in recovered:
        # What has no processor cannot write: that time does not count.
        old = [
            put
            for at, put, _, waited in run['rows']
            if run['killed_ns'] - at - (run['waited_ns'] - waited) > bound_ns
        ]
        assert len(rows) >= max(old, default=0)
        messages += max(old, default=0)
    assert messages > 0


def test_what_comes_back_is_what_was_put(recovered: list, tmp_path: Path):
    """An undisturbed run of the same stand gives the same messages in the same order."""
    for run, rows in recovered:
        number = run['number']
        path = tmp_path / f'{number}.mcap'
        parameters = killed_runs.parameters_of(number).updated(
            {'record.format': 'file', 'record.split_duration': 0.0}
        )
        ticks = round(rows[-1][1] * 1e-6) + 1 if rows else 1
        killed_runs.record(path, parameters, 'fast', ticks, lambda *_: None)
        whole = [row for row in rows_of(path) if not row[0].endswith('info')]
        back = [row for row in rows if not row[0].endswith('info')]
        assert back == whole[: len(back)]
