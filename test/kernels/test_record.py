# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Records in Python: fields are attributes, and large ones are zeros until they are touched."""

import copy

import pytest

from stickslip_ros.kernels.record import COUNT, FLOAT, LARGE, kind, record, records

INNER = kind(width_m=FLOAT, turns=(COUNT, (3,)))
OUTER = kind(force_n=FLOAT, whole=INNER, each=(INNER, (2,)))


def test_fields_are_attributes_of_the_array_that_a_record_lies_in():
    made = records(OUTER, force_n=2.0)
    one = made[0]
    one.whole.width_m = one.force_n
    one.each[1].turns[2] = 7
    assert made['whole']['width_m'].item() == 2.0
    assert made['each']['turns'][0].tolist() == [[0, 0, 0], [0, 0, 7]]
    other = copy.deepcopy(one)
    other.whole.width_m = 5.0
    assert one.whole.width_m == 2.0


def test_a_field_that_is_not_there_is_neither_read_nor_written():
    one = record(OUTER)
    assert not hasattr(one, 'width_m')
    with pytest.raises(ValueError, match='width_m'):
        one.width_m = 1.0


def test_a_large_record_is_all_zeros_and_its_own():
    large = kind(first=FLOAT, rest=(FLOAT, (LARGE // 8,)))
    one, other = records(large, first=1.0), records(large)
    one['rest'][0, -1] = 2.0
    assert other['first'] == 0.0
    assert not other['rest'].any()
