# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A recording whose process was killed holds all that was on the disk, and nothing else."""

import json
import sys
from pathlib import Path

import killed_runs
import pytest
from processes import run_process

from stickslip_ros.errors import RecordingError
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recover import recover


def rows_of(path: Path) -> list[tuple[str, int, str]]:
    messages = Recording(path).messages()
    return [(topic, at, repr(each)) for topic, at, each in messages if not topic.endswith('info')]


def test_what_was_on_the_disk_comes_back_as_an_undisturbed_run_has_it(tmp_path: Path):
    done = run_process([sys.executable, killed_runs.__file__, tmp_path], check=True)
    runs = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(runs) == killed_runs.RUNS
    for run in runs:
        assert run['killed']
        path = Path(run['path'])
        source = path if path.exists() else path.with_suffix('')
        with pytest.raises(RecordingError, match='stickslip recover'):
            Recording(source)
        _, written = recover(source)
        rows = rows_of(source if written.name == 'metadata.yaml' else written)
        assert len(rows) + 1 >= run['secured'] > 0  # info
        parameters = killed_runs.parameters_of(run['number']).updated(
            {'record.format': 'file', 'record.split_duration': 0.0}
        )
        whole = tmp_path / f'whole{run["number"]}.mcap'
        ticks = round(rows[-1][1] * 1e-6) + 1
        killed_runs.record(whole, parameters, 'fast', ticks, lambda _: None)
        assert rows == rows_of(whole)[: len(rows)]
