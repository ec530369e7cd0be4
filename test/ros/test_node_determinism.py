"""The same parameters, seed and commands give the same messages, with ROS and without."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from mcap.records import Metadata
from mcap.stream_reader import StreamReader
from mcap_records import rows_of

from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.interface.messages import ArrayMessage, StampedMessage
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.run import ReportingBench, RunWriter
from stickslip_ros.recording.run_file import RUN_RECORD
from stickslip_ros.runtime.orders import Order, Orders
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


def run_on_the_bench(path: Path, values: dict[str, Any]) -> None:
    """Record the plan without ROS and without threads of the node."""
    parameters = Parameters().updated({**FAST, **values})
    run = ReportingBench(parameters)
    start_ns, end_ns = RECORDING_NS
    with RunWriter(path, parameters, wait=True) as writer:
        while (now_ns := run.bench.time_ns) < end_ns:
            if now_ns == start_ns:
                run.record(writer)
            requests = [request for due_ns, request in PLAN if due_ns == now_ns]
            run.update(now_ns + parameters.block_ns, requests)


def metadata_of(path: Path) -> list[Metadata]:
    with path.open('rb') as stream:
        return [each for each in StreamReader(stream).records if isinstance(each, Metadata)]


def test_two_runs_of_the_node_give_the_same_bytes_but_for_the_wall_clock(
    start_drive: Callable, tmp_path: Path
):
    """Each message has the same bytes; which of them share a chunk is a matter of the clock."""
    first, second = tmp_path / '0.mcap', tmp_path / '1.mcap'
    for path in (first, second):
        run_on_the_node(start_drive, path, {})
    assert rows_of(first) == rows_of(second)
    different = [
        {key for key in ours.metadata if ours.metadata[key] != theirs.metadata[key]}
        for ours, theirs in zip(metadata_of(first), metadata_of(second), strict=True)
        if ours != theirs
    ]
    assert different == [{'wall_start'}]
    assert Recording(first).attachments == Recording(second).attachments


@pytest.mark.parametrize('block_s', [1e-3, 5e-3])
def test_the_node_and_the_bench_alone_record_the_same_messages(
    start_drive: Callable, tmp_path: Path, block_s: float
):
    values = {'sim.block': block_s, 'trace.period': 0.02, 'record.directory': str(tmp_path)}
    node, bench = tmp_path / 'node.mcap', tmp_path / 'bench.mcap'
    run_on_the_node(start_drive, node, values)
    run_on_the_bench(bench, {**values, 'autostart': False})
    seen = rows_of(node)
    assert len(seen) > 2 * 125e-3 / block_s
    assert seen == rows_of(bench)


def test_the_pace_does_not_change_what_happens(start_drive: Callable, tmp_path: Path):
    fast, real = tmp_path / 'fast.mcap', tmp_path / 'real.mcap'
    run_on_the_node(start_drive, fast, {})
    run_on_the_node(start_drive, real, {'sim.real_time_factor': 2.0})
    info = '/stickslip_drive/info'  # it tells the pace
    assert [m for m in rows_of(fast) if m[0] != info] == [m for m in rows_of(real) if m[0] != info]


def requests_of(path: Path) -> list[tuple[int, Request]]:
    """Read what a drive was asked, and when it took effect, from a recording."""
    found: list[tuple[int, Request]] = []
    for topic, time_ns, message in Recording(path).messages():
        name = topic.removeprefix('/command/')
        if topic == '/stickslip_drive/request':
            note = json.loads(str(message))
            settings = tuple(note['settings'].items())
            found.append((time_ns, Request(note['name'], tuple(note['values']), settings)))
        elif name == topic:
            continue
        elif isinstance(message, StampedMessage):
            found.append((time_ns, Request(name, message.values)))
        elif isinstance(message, ArrayMessage):
            found.append((time_ns, Request(name, tuple(message.data))))
        else:
            assert isinstance(message, int | float)
            found.append((time_ns, Request(name, (float(message),))))
    return found


def test_a_recorded_session_is_replayed_to_the_bit(start_drive: Callable, tmp_path: Path):
    path = tmp_path / 'live.mcap'
    stand = start_drive({'record.on_start': True, 'record.name': path.name})
    operator = stand.operator
    operator.command('sawtooth', (300.0, 1000.0, 0.0))
    operator.command('load', 0.1)
    operator.wait_for_event('load', 0)
    operator.set_parameter('fault.interferometer_offset', 1e-9)
    operator.switch('set_paused', wanted=True)
    operator.command('voltage', 20.0)
    operator.trigger('zero_position')
    operator.trigger('step_simulation')
    operator.switch('set_paused', wanted=False)
    operator.spin_for(0.01)
    for name in ('stop', 'clear_faults', 'reset'):
        operator.trigger(name)
    operator.spin_for(0.01)
    parameters = stand.drive.session.parameters
    stand.close()
    asked = requests_of(path)
    assert len(asked) == 8
    bench = Bench(parameters)
    replayed = {}
    for topic, time_ns, message in Recording(path).messages(['/position', '/force']):
        if time_ns not in replayed:
            now = [request for at_ns, request in asked if at_ns == bench.time_ns]
            replayed[time_ns] = bench.update(time_ns, now).readings
        assert isinstance(message, StampedMessage)
        seen = message.values[0]
        again = replayed[time_ns]
        assert seen == (again.position_m if topic == '/position' else again.force_n)
    assert len(replayed) > 20


def test_another_seed_gives_other_readings(start_drive: Callable, tmp_path: Path):
    one, other = tmp_path / 'one.mcap', tmp_path / 'other.mcap'
    run_on_the_node(start_drive, one, {})
    run_on_the_node(start_drive, other, {'sim.seed': 2})
    assert [m for m in rows_of(one) if m[0] == '/position'] != [
        m for m in rows_of(other) if m[0] == '/position'
    ]
    assert RUN_RECORD in {each.name for each in metadata_of(one)}


def test_orders_of_one_tick_are_carried_out_in_the_order_in_which_they_came():
    orders = Orders(by_topic=False)
    requests = [Request('voltage', (float(n),)) for n in range(20)]
    for number, request in enumerate(requests):
        orders.put(Order((number % 2) * 5 * MS_NS, request=request))
    taken = [order.request for order in orders.take(0)]
    taken += [order.request for order in orders.take(5 * MS_NS)]
    assert taken == requests[::2] + requests[1::2]
