# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Faults come and go while the drive runs; each shows in status and readings."""

import math

import numpy as np
import pytest
from bench_runs import MS, drive_bench, steps

from stickslip_ros.drive.records import FOOT, VOLTAGE
from stickslip_ros.errors import OutOfRange, UnknownName
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request, check_request
from stickslip_ros.instrument.reports import Result, Status
from stickslip_ros.parameters import Parameters

FREE = {'load_cell.contact': 'absent', 'runner.damping': 5.0}
CLEAR = Request('clear_faults')


def fault(**settings):
    return Request('fault', settings=tuple((f'fault.{k}', v) for k, v in settings.items()))


@pytest.fixture
def bench(stand):
    return Bench(stand.updated(FREE))


@pytest.mark.parametrize(
    'settings',
    [
        {'interferometer': 'freeze'},
        {'interferometer_offset': 1e-6},
        {'load_cell': 'dropout'},
        {'load_cell_offset': 0.1},
        {'amplifier_off': True},
        {'dead_foot': 3},
        {'runner_stuck': True},
        {'missed_steps': 0.5},
        {'command_delay': 0.01},
    ],
)
def test_every_fault_shows_in_the_status_at_once_and_ends_when_cleared(bench, settings):
    run = drive_bench(bench, 4 * MS, {MS: [fault(**settings)], 3 * MS: [CLEAR]})
    assert [bool(status & Status.FAULT) for status in run.status] == [False, True, True, False]
    assert [event.result for event in run.events] == [Result.DONE, Result.DONE]
    assert bench.faults.names == ()


def test_a_dropout_is_no_number_and_the_sensor_comes_back(bench):
    requests = {5 * MS: [fault(interferometer='dropout', load_cell='dropout')], 8 * MS: [CLEAR]}
    run = drive_bench(bench, 12 * MS, requests)
    assert np.isnan(run.trace[250:400, 3:]).all()
    assert np.isfinite(run.trace[400:, 3:]).all()
    assert not run.status[6] & Status.SENSOR_PRESENT
    assert run.status[-1] & Status.SENSOR_PRESENT
    assert math.isfinite(run.outputs[6].readings.truth_position_m)


def test_a_stuck_runner_does_not_move_under_the_feet(bench):
    requests = {0: [fault(runner_stuck=True), steps(10)], 15 * MS: [CLEAR, steps(10)]}
    run = drive_bench(bench, 30 * MS, requests)
    truth_m = [output.readings.truth_position_m for output in run.outputs]
    assert set(truth_m[:15]) == {0.0}
    assert np.ptp(run.trace[:750, FOOT]) > 150e-9
    assert truth_m[-1] > 10 * 50e-9


def test_a_dead_foot_holds_the_runner_back(stand):
    ends = {}
    for foot in (0, 1, 6):
        bench = Bench(stand.updated(FREE | {'fault.dead_foot': foot}))
        run = drive_bench(bench, 40 * MS, {0: [steps(30)]})
        ends[foot] = run.outputs[-1].readings.truth_position_m
    # An upper foot carries twice the load of a lower one.
    assert 0.0 < ends[1] < ends[6] < ends[0]


def test_missed_steps_are_missed_by_their_share_and_still_counted(bench):
    run = drive_bench(bench, 1100 * MS, {0: [fault(missed_steps=0.3), steps(1000)]})
    (done,) = [event for event in run.events if event.command == 'steps']
    assert done.steps == 1000
    heights_v = run.trace[:, VOLTAGE].reshape(-1, 50).max(axis=1)[:1000]
    missed = np.count_nonzero(heights_v < 10.0)
    # 5 sigma of a binomial count
    assert abs(missed - 300) < 5 * math.sqrt(1000 * 0.3 * 0.7)


def test_a_delayed_command_takes_effect_later_and_shows_until_then(bench):
    requests = {0: [fault(command_delay=5e-3)], 2 * MS: [Request('voltage', (100.0,))]}
    run = drive_bench(bench, 10 * MS, requests)
    volts = [output.readings.voltage_v for output in run.outputs]
    assert volts[6] == 0.0
    assert volts[7] == pytest.approx(100.0)
    delayed = [bool(status & Status.MOVE_DELAYED) for status in run.status]
    assert delayed == [False] * 2 + [True] * 5 + [False] * 3
    assert run.events[-1].time_ns == 8 * MS


def test_delayed_commands_keep_their_order_when_the_delay_shrinks(bench):
    requests = {
        0: [fault(command_delay=5e-3), Request('voltage', (100.0,))],
        MS: [fault(command_delay=1e-3), Request('voltage', (200.0,))],
        2 * MS: [Request('stop')],
    }
    run = drive_bench(bench, 8 * MS, requests)
    assert run.outputs[-1].readings.voltage_v == pytest.approx(100.0)  # the later arrival


def test_a_reset_keeps_the_faults(bench):
    run = drive_bench(
        bench, 20 * MS, {0: [fault(runner_stuck=True)], 2 * MS: [Request('reset'), steps(10)]}
    )
    assert run.outputs[-1].readings.truth_position_m == 0.0
    assert run.status[-1] & Status.FAULT


def test_faults_of_the_parameters_hold_from_the_start(stand):
    bench = Bench(stand.updated({'fault.interferometer': 'dropout'}))
    output = bench.update(MS)
    assert math.isnan(output.readings.position_m)
    assert output.status & Status.FAULT


@pytest.mark.parametrize(
    ('name', 'value', 'kind'),
    [
        ('fault.interferometer', 'melted', OutOfRange),
        ('fault.dead_foot', 7, OutOfRange),
        ('fault.missed_steps', 1.5, OutOfRange),
        ('fault.command_delay', -1.0, OutOfRange),
        ('fault.schedule', 'a.yaml', UnknownName),
        ('stand.preload', 1.0, UnknownName),
        ('fault.unheard', 1, UnknownName),
    ],
)
def test_a_bad_fault_is_refused(name, value, kind):
    with pytest.raises(kind):
        check_request(Request('fault', settings=((name, value),)), Parameters())


def test_a_fault_that_the_stand_cannot_have_is_refused_and_changes_nothing(stand):
    bench = Bench(stand.updated(FREE | {'contact.law': 'coulomb'}))
    run = drive_bench(bench, 3 * MS, {MS: [fault(dead_foot=1), steps(1)]})
    assert [(e.command, e.result) for e in run.events] == [
        ('fault', Result.INVALID_PARAMETER),
        ('steps', Result.DONE),
    ]
    assert "Coulomb's law" in run.events[0].message
    assert bench.faults.names == ()
    assert not run.status[-1] & Status.FAULT


def test_a_reset_ends_delayed_commands_with_an_event_each(bench):
    requests = {
        0: [fault(command_delay=5e-3), steps(5), Request('preload', (0.6,), stamp_ns=7)],
        2 * MS: [Request('reset')],
    }
    run = drive_bench(bench, 8 * MS, requests)
    assert [(e.number, e.result, e.message, e.sent_ns) for e in run.events[1:]] == [
        (2, Result.ABORTED, 'reset by command 4', 0),
        (3, Result.ABORTED, 'reset by command 4', 7),
        (4, Result.DONE, '', 0),
    ]
    assert not run.status[2] & Status.MOVE_DELAYED
