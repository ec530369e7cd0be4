# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The same parameters, seed and commands give the same messages at any pace."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from mcap.records import Metadata
from mcap.stream_reader import StreamReader
from mcap_records import rows_of

from stickslip_ros.instrument.commands import Request
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.run import RunWriter
from stickslip_ros.runtime.session import Session

MS_NS = 1_000_000
#: What is asked for, and the time at which it takes effect, ns: ticks of 1 ms and of 5 ms.
PLAN = (
    (10 * MS_NS, Request('sawtooth', (300.0, 1000.0, 30.0))),
    (25 * MS_NS, Request('load', (0.1, 0.0, 0.0, 0.0, 0.0, 0.0))),
    (25 * MS_NS, Request('voltage', (500.0,))),
    (60 * MS_NS, Request('voltage', (120.0,))),
    (65 * MS_NS, Request('sawtooth', (200.0, -400.0, 0.0))),
    (75 * MS_NS, Request('fault', settings=(('fault.interferometer_offset', 1e-9),))),
    (90 * MS_NS, Request('stop')),
    (90 * MS_NS, Request('zero_position')),
    (95 * MS_NS, Request('load', (0.0, 0.0, 0.0, 0.0, 0.0, 0.0))),
    (105 * MS_NS, Request('clear_faults')),
    (110 * MS_NS, Request('reset')),
    (110 * MS_NS, Request('voltage', (300.0,))),
)
RECORDING_NS = (5 * MS_NS, 130 * MS_NS)
FAST = {'sim.real_time_factor': 0.0, 'record.chunk_size': 20_000}


def plan_into(session: Session, path: Path) -> Any:
    """Order everything in advance; give what tells when the recording has ended."""
    start_ns, end_ns = RECORDING_NS
    writer = RunWriter(path, session.parameters, wait=True)
    session.exchange_recording(writer, start_ns)
    for due_ns, request in PLAN:
        session.submit(request, due_ns)
    return session.exchange_recording(None, end_ns)


def run_on_the_node(start_drive: Callable, path: Path, values: dict[str, Any]) -> None:
    """Record the plan with a node."""
    stand = start_drive({'autostart': False, **FAST, **values}, wait=False)
    assert stand.operator.change_state('configure')
    ended = plan_into(stand.drive._session, path)
    assert stand.operator.change_state('activate')
    stand.operator.spin_until(ended.done, 'the end of the plan')
    ended.result().close()
    stand.close()


def metadata_of(path: Path) -> list[Metadata]:
    with path.open('rb') as stream:
        return [each for each in StreamReader(stream).records if isinstance(each, Metadata)]


def test_runs_of_the_node_at_any_pace_give_the_same_bytes_but_for_the_wall_clock(
    start_drive: Callable, tmp_path: Path
):
    """Each message has the same bytes; which of them share a chunk is a matter of the clock."""
    first, second, real = (tmp_path / f'{name}.mcap' for name in ('first', 'second', 'real'))
    for path in (first, second):
        run_on_the_node(start_drive, path, {})
    run_on_the_node(start_drive, real, {'sim.real_time_factor': 2.0})
    assert rows_of(first) == rows_of(second)
    info = '/stickslip_drive/info'  # it tells the pace
    told = [[row for row in rows_of(path) if row[0] != info] for path in (first, real)]
    assert told[0] == told[1]
    different = [
        {key for key in ours.metadata if ours.metadata[key] != theirs.metadata[key]}
        for ours, theirs in zip(metadata_of(first), metadata_of(second), strict=True)
        if ours != theirs
    ]
    assert different == [{'wall_start'}]
    assert Recording(first).attachments == Recording(second).attachments
