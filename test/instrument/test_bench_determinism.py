# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The same parameters and the same requests at the same times give the same bits."""

import numpy as np
import pytest
from bench_runs import MS, drive_bench, load, sawtooth

from stickslip_ros.drive.records import FORCE, POSITION
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.reports import Result
from stickslip_ros.interface.feed import Packed
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.run import ReportingBench

RUN_NS = 20 * MS
REQUESTS = {
    0: [sawtooth(300.0, 333.0, 4)],
    10 * MS: [load(-0.05), Request('voltage', (123.0,))],
    15 * MS: [sawtooth(80.0, -1700.0), load(0.0)],
}
REFUSED = [
    Request('voltage', (301.0,)),
    Request('voltage', (float('nan'),)),
    Request('sawtooth', (300.0, 1e9, 1.0)),
    Request('sawtooth', ()),
    Request('load', (1e9, 0.0, 0.0, 0.0, 0.0, 0.0)),
    Request('stop', (1.0,)),
    Request('fly'),
]


def _run(parameters, step_ns=MS, requests=None):
    bench = Bench(parameters)
    return bench, drive_bench(bench, RUN_NS, requests or REQUESTS, step_ns)


@pytest.fixture(scope='module')
def reference():
    return _run(Parameters())


def assert_same(found, expected):
    np.testing.assert_array_equal(found[1].trace, expected[1].trace)
    np.testing.assert_array_equal(found[1].ramps, expected[1].ramps)
    assert found[0].state == expected[0].state


def test_two_benches_tell_the_same(reference):
    bench, run = _run(Parameters())
    assert_same((bench, run), reference)
    assert run.events == reference[1].events
    assert run.status == reference[1].status
    assert bench.ledger == reference[0].ledger


def test_another_seed_changes_the_noise_and_nothing_else(reference):
    bench, run = _run(Parameters().updated({'sim.seed': 2}))
    for column in (POSITION, FORCE):
        changed = run.trace[:, column] != reference[1].trace[:, column]
        assert np.mean(changed) > 0.5
    np.testing.assert_array_equal(run.trace[:, :POSITION], reference[1].trace[:, :POSITION])
    np.testing.assert_array_equal(run.ramps, reference[1].ramps)
    assert bench.state == reference[0].state


@pytest.mark.parametrize('step_ns', [20_000, 500_000])
def test_updates_of_another_length_tell_the_same_to_the_bit(step_ns, reference):
    assert_same(_run(Parameters(), step_ns), reference)


@pytest.mark.parametrize('block_s', [1e-4, 5e-3])
def test_another_block_tells_the_same_to_the_bit(block_s, reference):
    values = {'sim.block': block_s}
    assert_same(_run(Parameters().updated(values), round(block_s * 1e9)), reference)


def test_refused_requests_change_neither_motion_nor_noise(reference):
    requests = {time_ns: [*REFUSED, *due] for time_ns, due in REQUESTS.items()}
    requests[5 * MS] = REFUSED
    bench, run = _run(Parameters(), requests=requests)
    assert_same((bench, run), reference)
    refusals = [event for event in run.events if event.result is Result.INVALID_PARAMETER]
    assert len(refusals) == bench.refused == 4 * len(REFUSED)
    assert all(event.message for event in refusals)


@pytest.mark.parametrize(
    ('stand', 'most'),
    [
        ({}, 10),
        ({'sim.publish_truth': True}, 1),
        ({'load_cell.range': 0.3, 'load_cell.noise_density': 0.01}, 1),
        ({'amplifier.bandwidth': 1e4}, 10),
    ],
)
def test_blocks_that_are_advanced_at_once_give_the_same_messages_and_state(stand, most):
    parameters = Parameters().updated(stand)
    told: tuple[list[Packed], list[Packed]] = [], []
    each, at_once = (ReportingBench(parameters, list_of.append) for list_of in told)
    longest = 0
    for requests in ([sawtooth(300.0, 730.0, 20)], [load(0.1)], [Request('voltage', (99.0,))]):
        for run in each, at_once:
            for request in requests:
                run.accept(request)
        for _ in range(20):
            each.report(each.bench.update(each.bench.time_ns + MS))
        while at_once.bench.time_ns < each.bench.time_ns:
            before_ns = at_once.bench.time_ns
            for output in at_once.bench.update_blocks((each.bench.time_ns - before_ns) // MS):
                longest = max(longest, len(output.readings.trace) // 50)
                at_once.report(output)
    assert told[0] == told[1]
    assert each.save() == at_once.save()
    assert longest == most
