# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The bench carries out requests and reports their results."""

import json
import math
import re

import numpy as np
import pytest
from bench_runs import MS, PERFECT, drive_bench, load, sawtooth

from stickslip_ros.drive.advance import RAMP_END, RAMP_START
from stickslip_ros.drive.records import FOOT, FORCE, POSITION, TIME, VOLTAGE
from stickslip_ros.errors import OutOfRange
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.reports import Result, Status

READY = Status.SENSOR_PRESENT | Status.AMPLIFIER_ENABLED
"""Bits of a stand on which nothing happens."""


def _force_is_that_of_the_spring(trace):
    return np.allclose(trace[:, FORCE], 1e5 * trace[:, POSITION], rtol=1e-9, atol=0.0)


@pytest.fixture
def bench(stand) -> Bench:
    return Bench(stand)


@pytest.fixture
def true_bench(stand) -> Bench:
    return Bench(stand.updated(PERFECT))


def test_a_sawtooth_ends_with_an_event_that_counts_its_steps(bench):
    run = drive_bench(bench, 12 * MS, {0: [sawtooth(300.0, 1000.0, 10)]})
    (event,) = run.events
    assert (event.number, event.command, event.result) == (1, 'sawtooth', Result.DONE)
    assert event.steps == 10
    assert event.message == ''
    # The last fall is over two microseconds after the tenth ramp: seen at the end of that block.
    assert event.time_ns == 11 * MS
    assert len(run.ramps) == 10
    assert run.status == [READY | Status.MOVING] * 10 + [READY] * 2


@pytest.mark.parametrize('fault', [{}, {'fault.interferometer': 'dropout'}])
def test_an_event_has_the_readings_of_its_time(bench: Bench, fault: dict[str, str]):
    faults = Request('fault', settings=tuple(fault.items()))
    begun = [faults, sawtooth(300.0, 1000.0, 5), load(0.01)]
    run = drive_bench(bench, 20 * MS, {3 * MS: begun, 15 * MS: [Request('reset')]})
    read = {each.readings.time_ns: each.readings for each in run.outputs}
    moved = [event for event in run.events if event.command in {'sawtooth', 'load', 'reset'}]
    assert [event.time_ns // MS for event in moved] == [3, 9, 15]
    for event in moved:
        there = read[event.time_ns]
        is_lost = math.isnan(there.position_m)
        assert event.position_m == (None if is_lost else there.position_m)
        assert event.force_n == there.force_n
        assert is_lost == (bool(fault) and event.time_ns > 3 * MS)
    assert moved[-1].force_n


def test_a_bench_shows_where_it_is(bench):
    drive_bench(bench, 2 * MS, {0: [Request('voltage', (100.0,))]})
    place = r'runner at [\d.]+ nm, 100 V, SENSOR_PRESENT, AMPLIFIER_ENABLED'
    assert re.fullmatch(rf'Bench\(at 0\.002 s: {place}\)', repr(bench))


def test_the_reported_ramps_are_those_of_the_runner(true_bench):
    run = drive_bench(true_bench, 12 * MS, {0: [sawtooth(300.0, 500.0, 5)]})
    ends = run.trace[99::100, POSITION][:5]
    np.testing.assert_allclose(run.ramps[:, RAMP_END], ends, rtol=1e-9)


def test_a_fall_that_ends_with_a_sample_is_reported_like_any_other(stand):
    starts = []
    for slew_v_per_s in (7.47e6, 7.47e6 * (1.0 - 1e-7)):  # 300 V in two samples, and in a bit more
        bench = Bench(stand.updated({'amplifier.slew_rate': slew_v_per_s}))
        run = drive_bench(bench, 60 * MS, {0: [sawtooth(300.0, 100.0, 5)]})
        starts.append(run.ramps[:, RAMP_START])
    np.testing.assert_allclose(starts[0], starts[1], rtol=1e-4)


def test_many_ramps_in_one_block_are_all_told(stand):
    bench = Bench(stand.updated({'sim.block': 1e-2}))
    run = drive_bench(bench, 20 * MS, {0: [sawtooth(30.0, 20e3, 300)]}, 10 * MS)
    assert [len(output.ramps) for output in run.outputs] == [200, 100]
    assert len(np.unique(run.ramps[:, RAMP_END])) == 300
    assert run.events[0].steps == 300


def test_a_voltage_ends_when_the_amplifier_has_arrived(stand):
    bench = Bench(stand.updated({'amplifier.slew_rate': 1e5}))
    run = drive_bench(bench, 5 * MS, {0: [Request('voltage', (300.0,))]})
    (event,) = run.events
    assert (event.command, event.result, event.steps) == ('voltage', Result.DONE, 0)
    assert event.time_ns == 3 * MS
    assert run.outputs[-1].readings.voltage_v == 300.0


@pytest.mark.parametrize(
    ('second', 'reason'),
    [
        (sawtooth(100.0, -1000.0, 2), 'replaced by command 2'),
        (Request('voltage', (3.0,)), 'replaced by command 2'),
        (Request('stop'), 'stopped by command 2'),
        (Request('reset'), 'reset by command 2'),
    ],
)
def test_a_move_that_is_cut_short_is_told_as_aborted_with_its_steps(second, reason, bench):
    run = drive_bench(bench, 9 * MS, {0: [sawtooth(300.0, 1000.0)], 5 * MS: [second]})
    aborted, done = run.events
    assert (aborted.number, aborted.command, aborted.result) == (1, 'sawtooth', Result.ABORTED)
    assert (aborted.time_ns, aborted.steps, aborted.message) == (5 * MS, 5, reason)
    assert (done.number, done.command, done.result) == (2, second.name, Result.DONE)


def test_moves_at_the_same_time_end_in_their_order(bench):
    requests = [sawtooth(300.0, 1000.0), Request('fly'), load(0.1), Request('voltage', (1.0,))]
    run = drive_bench(bench, MS, {0: requests})
    results = [(event.number, event.result.name) for event in run.events]
    assert results == [(2, 'INVALID_PARAMETER'), (3, 'DONE'), (1, 'ABORTED'), (4, 'DONE')]


def test_a_stop_holds_the_voltage_at_which_it_comes(bench):
    run = drive_bench(bench, 10 * MS, {0: [sawtooth(300.0, 62.5)], 4 * MS: [Request('stop')]})
    voltages = run.trace[:, VOLTAGE]
    assert voltages[199] == pytest.approx(75.0, rel=1e-9, abs=0.0)
    assert set(voltages[200:]) == {voltages[199]}
    assert run.status[3:] == [READY | Status.MOVING] + [READY] * 6


def test_a_reset_brings_the_first_run_back_to_the_bit(bench):
    requests = {0: [sawtooth(300.0, 700.0)], 3 * MS: [load(0.05)], 6 * MS: [load(0.0)]}
    first = drive_bench(bench, 9 * MS, requests)
    requests[0].insert(0, Request('reset'))
    second = drive_bench(bench, 9 * MS, requests)
    np.testing.assert_array_equal(second.trace[:, VOLTAGE:], first.trace[:, VOLTAGE:])
    np.testing.assert_array_equal(second.ramps, first.ramps)
    # Time runs on.
    assert second.trace[0, TIME] > first.trace[-1, TIME]


def test_a_reset_takes_load_voltage_and_refusal_back(bench):
    drive_bench(bench, 3 * MS, {0: [Request('voltage', (300.0,)), load(0.5), Request('fly')]})
    run = drive_bench(bench, MS, {0: [Request('reset')]})
    assert run.status == [READY]
    assert bench.state.position_m == bench.state.voltage_v == 0.0
    assert bench.ledger.feet_work_j == bench.ledger.load_work_j == 0.0


def test_a_trace_holds_time_voltage_foot_position_and_force(true_bench):
    trace = drive_bench(true_bench, 3 * MS, {0: [sawtooth(300.0, 1000.0)]}).trace
    assert trace.shape == (150, 5)
    np.testing.assert_allclose(trace[:, TIME], 2e-5 * np.arange(1, 151), rtol=1e-12)
    np.testing.assert_allclose(trace[:, FOOT], 160e-9 / 300.0 * trace[:, VOLTAGE], rtol=1e-12)
    assert _force_is_that_of_the_spring(trace)
    assert trace[24, VOLTAGE] == pytest.approx(150.0, rel=1e-9, abs=0.0)


def test_the_readings_are_those_of_the_last_row_of_the_trace(bench):
    run = drive_bench(bench, 5 * MS, {0: [sawtooth(300.0, 1000.0)]})
    for number, output in enumerate(run.outputs, start=1):
        readings, last = output.readings, output.readings.trace[-1]
        assert readings.time_ns == number * MS
        assert last[TIME] == pytest.approx(readings.time_ns * 1e-9, rel=1e-12, abs=0.0)
        assert (readings.position_m, readings.force_n) == (last[POSITION], last[FORCE])
        assert readings.voltage_v == last[VOLTAGE]


@pytest.mark.parametrize('until_ns', [0, -20_000, 10_000, MS + 1, MS + 20_000, 2 * MS])
def test_a_time_that_is_no_sample_of_the_next_block_is_refused_and_changes_nothing(
    until_ns, bench
):
    with pytest.raises(OutOfRange) as caught:
        bench.update(until_ns, [sawtooth(300.0, 1000.0)])
    assert f'until_ns {until_ns} ns is not a whole number of samples (20000 ns)' in str(
        caught.value
    )
    assert 'at most one block (1000000 ns) after 0 ns; go block by block' in str(caught.value)
    assert bench.time_ns == 0
    assert bench.update(MS).status == READY


def test_an_event_is_told_as_json(bench):
    (event,) = drive_bench(bench, MS, {0: [Request('voltage', (500.0,))]}).events
    content = json.loads(event.to_json())
    assert next(iter(content)) == 'message'  # ros2 topic echo cuts a text off after 128 characters
    assert content == {
        'time_ns': 0,
        'stamp_ns': 0,
        'position_m': None,
        'force_n': None,
        'number': 1,
        'command': 'voltage',
        'result': 'INVALID_PARAMETER',
        'steps': 0,
        'message': "voltage 500 V is above the amplifier's 300 V; "
        'lower it or raise amplifier.voltage_max',
    }
