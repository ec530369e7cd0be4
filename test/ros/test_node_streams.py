# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Readings come block by block, without a hole, with the stamps that they should have."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from stickslip_ros.testing import deep_queues

QUEUES = deep_queues('position', 'force', 'trace')
#: A stamp in s as a double: half the last digit at 100 s.
STAMP_TOLERANCE_S = 1e-14 * 100.0
COLUMNS = 't[s],voltage[V],foot[m],position[m],force[N]'


@pytest.fixture
def stand(start_drive: Callable) -> Any:
    return start_drive(QUEUES)


def table(message: Any) -> np.ndarray:
    rows, columns = (dim.size for dim in message.layout.dim)
    return np.array(message.data).reshape(rows, columns)


def test_stamps_rise_by_the_block_without_a_hole(start_drive: Callable):
    block_s = 5e-3
    stand = start_drive({**QUEUES, 'sim.block': block_s})
    position, force = stand.operator.listen('position'), stand.operator.listen('force')
    stand.operator.spin_until(lambda: min(len(position), len(force)) >= 50, 'readings')
    for heard in (position, force):
        times = [stand.operator.simulated_ns(each) for each in heard]
        assert np.diff(times).tolist() == [round(block_s * 1e9)] * (len(times) - 1)
        assert times[0] % round(block_s * 1e9) == 0


def test_the_joint_has_position_and_force_of_the_same_moment(stand: Any):
    operator = stand.operator
    joint, force = operator.listen('joint_states'), operator.listen('force')

    def of_all() -> list[Any]:
        times = operator.positions.keys() & {operator.simulated_ns(each) for each in force}
        return [each for each in joint if operator.simulated_ns(each) in times]

    operator.spin_until(lambda: len(of_all()) >= 2, 'joint states with position and force')
    forces = {operator.simulated_ns(each): each.wrench.force.x for each in force}
    for each in of_all():
        time_ns = operator.simulated_ns(each)
        assert time_ns % 10_000_000 == 0
        assert (list(each.name), each.header.frame_id) == (['runner_joint'], 'stage_base')
        assert list(each.position) == [operator.positions[time_ns]]
        assert list(each.effort) == [forces[time_ns]]
        assert len(each.velocity) == 1


def test_frames_and_unused_components_are_as_declared(start_drive: Callable):
    stand = start_drive({'frame_id.stage': 'left/stage', 'frame_id.load_cell': 'left/cell'})
    position, force = stand.operator.listen('position'), stand.operator.listen('force')
    stand.operator.spin_until(lambda: bool(position and force), 'readings')
    assert position[0].header.frame_id == 'left/stage'
    assert force[0].header.frame_id == 'left/cell'
    assert (position[0].point.y, position[0].point.z) == (0.0, 0.0)
    torque = force[0].wrench.torque
    assert (torque.x, torque.y, torque.z) == (0.0, 0.0, 0.0)


def test_a_trace_names_its_columns_and_lacks_no_sample_within_and_between_blocks(stand: Any):
    heard = stand.operator.listen('trace')
    stand.operator.spin_until(lambda: len(heard) >= 20, 'traces')
    rows, columns = heard[0].layout.dim
    origin_ns = stand.operator.info['time_origin_ns']
    assert origin_ns > 0
    label = f'sample; time_origin_ns={origin_ns}'
    assert (rows.label, rows.size, rows.stride) == (label, 500, 2500)
    assert (columns.label, columns.size, columns.stride) == (COLUMNS, 5, 5)
    assert (heard[0].layout.data_offset, len(heard[0].data)) == (0, 2500)
    time_s = np.concatenate([table(each)[:, 0] for each in heard])
    sample = np.round(time_s * 50e3).astype(int)
    assert np.diff(sample).tolist() == [1] * (len(sample) - 1)
    assert time_s == pytest.approx(sample / 50e3, rel=0.0, abs=STAMP_TOLERANCE_S)
    assert sample[0] % 500 == 1


def test_a_sensor_that_is_enabled_has_a_topic_and_a_column_of_the_trace(start_drive: Callable):
    stand = start_drive({**QUEUES, 'capacitive_probe.enabled': True})
    foot, trace = stand.operator.listen('foot_position'), stand.operator.listen('trace')
    stand.operator.spin_until(
        lambda: len(foot) >= 100 and len(trace) >= 10, 'readings of the feet'
    )
    assert trace[-1].layout.dim[1].label == f'{COLUMNS},foot_position[m]'
    assert {each.header.frame_id for each in foot} == {'stage_base'}
    rows = {round(row[0] * 1e9): row[-1] for each in trace for row in table(each)}
    told = {stand.operator.simulated_ns(each): each.point.x for each in foot}
    both = rows.keys() & told.keys()
    assert len(both) >= 10
    assert [rows[each] for each in both] == [told[each] for each in both]
