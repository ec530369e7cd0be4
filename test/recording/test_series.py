# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A quantity over time keeps its promises, and so do the columns of a trace."""

import numpy as np
import pytest

from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.interface.messages import ArrayMessage
from stickslip_ros.recording.series import Series, TraceColumns, split_columns


def ramp(*times_s: float) -> Series:
    return Series(np.array(times_s), 2.0 * np.array(times_s), 'V', 'a test')


def block(labels: tuple[str, ...], shape: tuple[int, ...]) -> ArrayMessage:
    return ArrayMessage(labels, shape, np.zeros(shape))


def test_whole_numbers_become_floats():
    series = Series(np.array([0, 1]), np.array([2, 3]), '', 'a test')
    assert series.time_s.dtype == series.value.dtype == np.float64
    assert len(series) == 2


def test_a_jump_is_two_samples_at_one_time():
    assert len(ramp(0.0, 1.0, 1.0, 2.0)) == 4


def test_an_empty_series_is_a_series():
    assert len(ramp().window(0.0, 1.0)) == 0


@pytest.mark.parametrize(
    ('time_s', 'value'),
    [([0.0, 1.0], [0.0]), ([[0.0]], [[0.0]]), (0.0, 0.0)],
    ids=['lengths', 'axes', 'scalar'],
)
def test_arrays_that_do_not_match_are_refused(time_s: object, value: object):
    with pytest.raises(WrongKind, match='a value for each time'):
        Series(np.array(time_s), np.array(value), 'm', 'a test')


def test_time_that_falls_is_refused_with_its_place():
    with pytest.raises(OutOfRange, match=r'time of sample 2 of a test 0\.5 s is before'):
        ramp(0.0, 1.0, 0.5)


@pytest.mark.parametrize('time_s', [np.nan, np.inf])
def test_time_that_is_not_finite_is_refused(time_s: float):
    with pytest.raises(OutOfRange, match='not finite'):
        ramp(0.0, time_s)


def test_a_window_includes_both_its_ends():
    series = ramp(0.0, 1.0, 1.0, 2.0, 3.0).window(1.0, 2.0)
    assert series.time_s.tolist() == [1.0, 1.0, 2.0]
    assert series.value.tolist() == [2.0, 2.0, 4.0]
    assert (series.unit, series.origin) == ('V', 'a test')


@pytest.mark.parametrize('end_s', [0.5, np.nan])
def test_a_window_that_ends_before_it_starts_is_refused(end_s: float):
    with pytest.raises(OutOfRange, match='before its start 1 s'):
        ramp(0.0, 1.0).window(1.0, end_s)


def test_a_column_without_brackets_is_a_pure_number():
    columns = split_columns([block(('sample', 't[s],slip'), (3, 2))], 'a test')
    assert [(name, each.unit) for name, each in columns.items()] == [('slip', '')]


@pytest.mark.parametrize(
    ('labels', 'shape'),
    [
        (('sample',), (3,)),
        (('sample', 'voltage[V],force[N]'), (3, 2)),
        (('sample', 't[ms],force[N]'), (3, 2)),
        (('sample', 't[s],force[N]'), (3, 3)),
        (('sample', 't[s],force[N],force[N]'), (3, 3)),
        (('sample', 't[s],force[N'), (3, 2)),
        (('sample', 't[s],force[N]'), (6,)),
    ],
    ids=['one axis', 'no time', 'other unit', 'too wide', 'twice', 'open bracket', 'flat'],
)
def test_a_block_that_is_no_trace_is_refused(labels: tuple[str, ...], shape: tuple[int, ...]):
    with pytest.raises(WrongKind, match='carries a trace'):
        split_columns([block(labels, shape)], 'a test')


def test_blocks_with_other_columns_are_refused():
    blocks = [block(('sample', f't[s],{name}[V]'), (1, 2)) for name in ('high', 'low')]
    with pytest.raises(WrongKind, match='low'):
        split_columns(blocks, 'a test')


@pytest.mark.parametrize('room', [0, 1, 5, 100])
def test_blocks_are_joined_whatever_the_room_for_them(room: int):
    table = np.arange(14, dtype=np.float64).reshape(7, 2)
    columns = TraceColumns('a test', room)
    for origin_ns, part in enumerate((table[:3], table[3:4], table[4:4], table[4:])):
        labels = f'sample; time_origin_ns={origin_ns}', 't[s],force[N]'
        columns.add(ArrayMessage(labels, part.shape, part))
    force = columns.series()['force']
    assert force.time_s.tolist() == table[:, 0].tolist()
    assert force.value.tolist() == table[:, 1].tolist()
