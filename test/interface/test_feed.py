# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The joint of the runner and the trace: when their messages come, and what they say."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.interface import messages as m
from stickslip_ros.interface.cdr import unpack
from stickslip_ros.message_types import FLOAT64_ARRAY, JOINT_STATE
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.run import ReportingBench

MS_NS = 1_000_000
RAMP = Request('waveform', (0.0, 0.0, 0.1, 100.0))


def joints_of(values: Mapping[str, object], duration_ns: int) -> list[m.JointMessage]:
    """Return what a run says of its joint."""
    parameters = Parameters().updated(values)
    heard: list[m.JointMessage] = []

    def take(packed):
        if packed.key == 'joint_states':
            message = unpack(JOINT_STATE, packed.data)
            assert isinstance(message, m.JointMessage)
            assert message.stamp_ns == packed.time_ns
            heard.append(message)

    run = ReportingBench(parameters, take)
    run.accept(RAMP)
    for end_ns in range(parameters.block_ns, duration_ns + 1, parameters.block_ns):
        run.update(end_ns)
    return heard


@pytest.mark.parametrize(
    ('rate_hz', 'block_s', 'stamps_ms'),
    [
        (100.0, 1e-3, [10, 20, 30, 40]),
        (0.0, 1e-3, []),
        (1e4, 0.01, [10, 20, 30, 40]),
        (40.0, 0.02, [40]),
        (75.0, 0.01, [20, 30, 40]),
    ],
    ids=['default', 'off', 'each block', 'rounded up', 'not a whole number of blocks'],
)
def test_a_message_comes_with_the_block_in_which_a_period_ends(rate_hz, block_s, stamps_ms):
    values = {'sim.joint_states_rate': rate_hz, 'sim.block': block_s, 'trace.period': 0.04}
    stamps = [each.stamp_ns for each in joints_of(values, 40 * MS_NS)]
    assert stamps == [time_ms * MS_NS for time_ms in stamps_ms]


def test_it_says_where_the_readings_are_how_fast_they_change_and_the_force():
    values = {'sim.joint_name': 'stage_x', 'frame_id.stage': 'left/stage_base'}
    joints = joints_of(values, 100 * MS_NS)
    bench = Bench(Parameters().updated(values))
    bench.accept(RAMP)
    readings = {t: bench.update(t).readings for t in range(MS_NS, 100 * MS_NS + 1, MS_NS)}
    before_m = 0.0
    for each in joints:
        reading = readings[each.stamp_ns]
        assert (each.frame_id, each.names) == ('left/stage_base', ('stage_x',))
        assert (each.positions, each.efforts) == ((reading.position_m,), (reading.force_n,))
        [velocity_m_per_s] = each.velocities
        assert velocity_m_per_s == pytest.approx(
            (reading.position_m - before_m) / 10e-3, rel=1e-12
        )
        before_m = reading.position_m
    assert before_m > 10e-9  # the ramp does move the runner


def test_without_a_reading_neither_position_nor_velocity_is_a_number():
    [joint] = joints_of({'fault.interferometer': 'dropout'}, 10 * MS_NS)
    assert math.isnan(joint.positions[0])
    assert math.isnan(joint.velocities[0])
    assert not math.isnan(joint.efforts[0])


def test_a_run_that_goes_on_from_a_state_knows_the_velocity_since_the_last_message():
    parameters = Parameters()
    whole, first = ReportingBench(parameters), ReportingBench(parameters)
    later: dict[ReportingBench, list] = {}
    for run in (whole, first):
        run.accept(RAMP)
        for time_ms in range(1, 15):
            run.update(time_ms * MS_NS)
    second = ReportingBench(parameters, bench=Bench.restore(first.save()))
    for run in (whole, second):
        heard = later[run] = []
        run._publish = heard.append
        for time_ms in range(15, 21):
            run.update(time_ms * MS_NS)
    assert later[whole] == later[second]
    assert any(packed.key == 'joint_states' for packed in later[second])


@pytest.mark.parametrize(('rate_hz', 'period_s'), [(50e3, 0.01), (10e3, 0.02), (1e5, 0.02)])
def test_a_trace_has_the_rate_and_the_period_of_the_parameters(rate_hz: float, period_s: float):
    values = {'trace.sample_rate': rate_hz, 'trace.period': period_s}
    heard: list[np.ndarray] = []

    def take(packed):
        if packed.key == 'trace':
            message = unpack(FLOAT64_ARRAY, packed.data)
            assert isinstance(message, m.ArrayMessage)
            assert packed.time_ns == round(1e9 * period_s) * (len(heard) + 1)
            heard.append(message.data[:, 0])

    run = ReportingBench(Parameters().updated(values), take)
    for end_ns in range(MS_NS, 60 * MS_NS + 1, MS_NS):
        run.update(end_ns)
    assert [len(each) for each in heard] == [round(rate_hz * period_s)] * round(0.06 / period_s)
    samples = np.arange(1, round(0.06 * rate_hz) + 1)
    assert np.concatenate(heard) == pytest.approx(samples / rate_hz, rel=1e-12)


def test_messages_that_begin_to_be_heard_are_those_of_a_run_that_was_always_heard():
    always: list[Any] = []
    later: list[Any] = []
    keys = {'status'}
    whole = ReportingBench(Parameters(), always.append)
    part = ReportingBench(Parameters(), later.append, is_heard=keys.__contains__)
    for end_ns in range(MS_NS, 40 * MS_NS + 1, MS_NS):
        if end_ns == 16 * MS_NS:
            keys.update(('position', 'trace', 'joint_states', 'event'))
        volts = [Request('voltage', (100.0,))] if end_ns % (10 * MS_NS) == 0 else []
        for run in whole, part:
            run.update(end_ns, volts)
    at_first = [each for each in always if each.time_ns < 16 * MS_NS and each.key == 'status']
    heard = at_first + [each for each in always if each.time_ns > 15 * MS_NS and each.key in keys]
    assert later == heard
    assert {each.key for each in heard} == keys
