# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Recording of 100 kS/s and four channels: what it costs, and what is lost."""

import tempfile
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.node.lateness import summary
from benchmarks.node.programs import Drive, run_in_turn
from benchmarks.outcome import Outcome, Row, spread
from benchmarks.sizes import Sizes
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.storage import CLOSING_RECORD

RATE_HZ = 100e3
BLOCK_S = 1e-3
NODE, RECORDS = 'the node', 'the node, recording'


def run(sizes: Sizes) -> Outcome:
    """Compare with and without recording."""
    with tempfile.TemporaryDirectory() as folder:
        trace: dict[str, object] = {'trace.sample_rate': RATE_HZ}
        record = {'record.on_start': 'true', 'record.directory': folder}
        makers = partial(Drive, NODE, trace), partial(Drive, RECORDS, {**trace, **record})
        turns = run_in_turn(makers, sizes)
        files = sorted(Path(folder).glob('run_*.mcap'))
        rate = float(np.median([rate_of(path) for path in files]))
        lost = sum(map(lost_in, files))
    ours = np.array([turn.cpu for turn in turns[RECORDS]])
    rows: list[Row] = []
    for name, its in turns.items():
        late = summary([window for turn in its for window in turn.windows])
        rows.append(
            {
                'program': name,
                'cpu_percent': 100.0 * float(np.median([turn.cpu for turn in its])),
                **spread('recording_over_this', ours / [turn.cpu for turn in its]),
                'p99_late_us': late['p99_us'],
                'overruns': late['overruns'],
                'sent_MB_per_s': float(np.median([t.heard['bytes_per_s'] for t in its])) * 1e-6,
                'file_MB_per_s': rate * 1e-6 if name == RECORDS else np.nan,
            }
        )
    told = [turn.heard['diagnostics'].get('recorder', []) for turn in turns[RECORDS]]
    peak = max((int(part['queue_peak']) for parts in told for part in parts), default=0)
    return Outcome(
        'Recording of 100 kS/s, four channels and their time, 1 kHz readings; zstd',
        rows,
        [
            (
                f'{sizes.node_rounds} turns of {sizes.turn_s:g} s; the node writes on a thread of '
                f'its own; its queue held at most {peak} messages of the 20000 that it may hold'
            ),
            f'{lost} messages are missing in its recordings',
        ],
    )


def rate_of(path: Path) -> float:
    """Return the bytes of a recording per second; the readings are its most frequent topics."""
    blocks = max(channel.messages for channel in Recording(path).channels)
    return path.stat().st_size / (blocks * BLOCK_S)


def lost_in(path: Path) -> int:
    """Return how many messages a recording lacks, by its sequence numbers and its own count."""
    recording = Recording(path)
    gaps = sum(channel.gaps or 0 for channel in recording.channels)
    account = recording.metadata[CLOSING_RECORD]
    dropped = sum(int(n) for what, n in account.items() if what.startswith('dropped'))
    return max(gaps, dropped)
