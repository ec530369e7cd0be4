# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The codec agrees with ROS's own serialiser and with rosbags, byte for byte."""

import struct
from contextlib import suppress

import numpy as np
import pytest
from geometry_msgs.msg import PointStamped, Vector3Stamped, WrenchStamped
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray, Int32, MultiArrayDimension, String, UInt32
from written_messages import written

from stickslip_ros.errors import RecordingError, UnknownName, WrongKind
from stickslip_ros.interface import cdr
from stickslip_ros.interface import messages as m
from stickslip_ros.message_types import (
    FLOAT64,
    FLOAT64_ARRAY,
    INT32,
    JOINT_STATE,
    POINT_STAMPED,
    STRING,
    UINT32,
    VECTOR3_STAMPED,
    WRENCH_STAMPED,
)

#: What reads ROS's definitions imports modules that Python has renamed since.
pytestmark = pytest.mark.filterwarnings('ignore:module .sre_:DeprecationWarning')

ROSBAGS = get_typestore(Stores.ROS2_JAZZY)
ROS_TYPES = {
    FLOAT64: Float64,
    INT32: Int32,
    UINT32: UInt32,
    STRING: String,
    FLOAT64_ARRAY: Float64MultiArray,
    POINT_STAMPED: PointStamped,
    VECTOR3_STAMPED: Vector3Stamped,
    WRENCH_STAMPED: WrenchStamped,
    JOINT_STATE: JointState,
}
TEXTS = st.text(st.characters(exclude_categories=['Cs'], exclude_characters='\0'), max_size=12)
STAMPS_NS = st.integers(-(2**31) * 10**9, 2**31 * 10**9 - 1)
VECTOR_TYPES = POINT_STAMPED, VECTOR3_STAMPED
VECTORS = st.tuples(st.floats(), st.floats(), st.floats())
ANY_FLOATS = st.floats(width=64)

Case = tuple[str, bytes, m.Message]
Vector = tuple[float, float, float]


def unpacked_array(data: bytes) -> m.ArrayMessage:
    message = cdr.unpack(FLOAT64_ARRAY, data)
    assert isinstance(message, m.ArrayMessage)
    return message


def array_case(values: np.ndarray, labels: list[str]) -> Case:
    message = m.ArrayMessage(tuple(labels), values.shape, values)
    return FLOAT64_ARRAY, cdr.pack_float64_array(values, labels), message


def point_case(type_name: str, stamp_ns: int, frame_id: str, xyz: Vector) -> Case:
    message = m.StampedMessage(stamp_ns, frame_id, xyz)
    return type_name, cdr.pack_stamped(stamp_ns, frame_id, xyz), message


def wrench_case(stamp_ns: int, frame_id: str, force: Vector, torque: Vector) -> Case:
    message = m.StampedMessage(stamp_ns, frame_id, force + torque)
    return WRENCH_STAMPED, cdr.pack_stamped(stamp_ns, frame_id, force + torque), message


def joint_case(
    stamp_ns: int, frame_id: str, names: tuple[str, ...], *numbers: tuple[float, ...]
) -> Case:
    message = m.JointMessage(stamp_ns, frame_id, names, *numbers)
    return JOINT_STATE, cdr.pack_joints(message), message


def joints(fewest: int) -> st.SearchStrategy[Case]:
    names = st.lists(TEXTS, max_size=3).map(tuple)
    numbers = st.lists(ANY_FLOATS, min_size=fewest, max_size=3).map(tuple)
    return st.builds(joint_case, STAMPS_NS, TEXTS, names, numbers, numbers, numbers)


def arrays(axes: int, shortest: int) -> st.SearchStrategy[Case]:
    values = hnp.arrays(
        np.float64,
        hnp.array_shapes(min_dims=axes, max_dims=axes, min_side=shortest, max_side=4),
        elements=ANY_FLOATS,
    )
    return st.builds(array_case, values, st.lists(TEXTS, min_size=axes, max_size=axes))


FULL_CASES = st.one_of(
    ANY_FLOATS.map(lambda x: (FLOAT64, cdr.pack_float64(x), x)),
    st.integers(-(2**31), 2**31 - 1).map(lambda x: (INT32, cdr.pack_int32(x), x)),
    st.integers(0, 2**32 - 1).map(lambda x: (UINT32, cdr.pack_uint32(x), x)),
    TEXTS.map(lambda x: (STRING, cdr.pack_string(x), x)),
    arrays(1, 1),
    arrays(2, 1),
    st.builds(
        point_case, st.sampled_from([POINT_STAMPED, VECTOR3_STAMPED]), STAMPS_NS, TEXTS, VECTORS
    ),
    st.builds(wrench_case, STAMPS_NS, TEXTS, VECTORS, VECTORS),
    joints(1),
)
CASES = st.one_of(FULL_CASES, arrays(1, 0), arrays(2, 0), joints(0))

deterministic = settings(derandomize=True, deadline=None, max_examples=200)


@deterministic
@given(CASES)
def test_what_is_packed_comes_back(case: Case):
    type_name, data, message = case
    assert written(cdr.unpack(type_name, data)) == written(message)


@deterministic
@given(FULL_CASES)
def test_bytes_are_those_of_ros_but_for_the_junk_in_its_padding(case: Case):
    type_name, data, _ = case
    theirs = bytes(serialize_message(deserialize_message(data, ROS_TYPES[type_name])))
    assert len(data) == len(theirs)
    assert all(ours in (0, ros) for ours, ros in zip(data, theirs, strict=True))


@deterministic
@given(CASES)
def test_bytes_are_those_of_rosbags(case: Case):
    type_name, data, _ = case
    message = ROSBAGS.deserialize_cdr(data, type_name)
    assert bytes(ROSBAGS.serialize_cdr(message, type_name)) == data


@deterministic
@given(CASES)
def test_what_ros_packs_is_read(case: Case):
    type_name, data, message = case
    theirs = bytes(serialize_message(deserialize_message(data, ROS_TYPES[type_name])))
    assert written(cdr.unpack(type_name, theirs)) == written(message)


@deterministic
@given(FULL_CASES, st.data())
def test_cut_bytes_are_refused_wherever_they_are_cut(case: Case, data: st.DataObject):
    type_name, whole, _ = case
    length = data.draw(st.integers(0, len(whole) - 1))
    with pytest.raises(RecordingError, match='check the type'):
        cdr.unpack(type_name, whole[:length])


@deterministic
@given(st.sampled_from(list(ROS_TYPES)), st.binary(max_size=60), st.booleans())
def test_foreign_bytes_are_read_or_refused_but_never_crash(type_name, data, headed):
    with suppress(RecordingError):
        cdr.unpack(type_name, b'\0\1\0\0' * headed + data)


@pytest.mark.parametrize(
    ('type_name', 'foreign'),
    [
        (FLOAT64, cdr.pack_int32(1)),
        (INT32, cdr.pack_float64(1.0)),
        (POINT_STAMPED, cdr.pack_stamped(0, 'runner', (0, 0, 0, 0, 0, 0))),
        (STRING, b'\0\1\0\0\4\0\0\0abcd'),
        (STRING, b'\0\1\0\0\2\0\0\0\xff\0'),
        (STRING, b'\0\1\0\0\4\0\0\0a\0b\0'),
        (FLOAT64, b'\0\0\0\0' + struct.pack('>d', 1.0)),
    ],
    ids=[
        'short',
        'long',
        'other type',
        'no closing zero',
        'no UTF-8',
        'zero inside',
        'big endian',
    ],
)
def test_bytes_of_another_kind_are_refused(type_name: str, foreign: bytes):
    with pytest.raises(RecordingError, match='not one little-endian CDR message'):
        cdr.unpack(type_name, foreign)


def test_a_last_word_that_is_filled_up_is_read():
    assert cdr.unpack(STRING, cdr.pack_string('') + bytes(3)) == ''


def test_an_empty_array_has_no_padding_but_is_read_with_the_padding_of_ros():
    data = cdr.pack_float64_array(np.empty(0), ['x'])
    theirs = bytes(serialize_message(deserialize_message(data, Float64MultiArray)))
    assert (theirs[:-4], len(theirs)) == (data, len(data) + 4)
    assert unpacked_array(theirs).data.size == 0


def test_strides_are_products_of_this_size_and_all_later_ones():
    data = cdr.pack_float64_array(np.zeros((2, 3, 4)), ['image', 'row', 'column'])
    dims = deserialize_message(data, Float64MultiArray).layout.dim
    assert [dim.stride for dim in dims] == [24, 12, 4]


def test_a_transposed_array_is_packed_as_it_is_indexed():
    values = np.arange(6, dtype=float).reshape(2, 3).T
    data = cdr.pack_float64_array(values, ['row', 'column'])
    np.testing.assert_array_equal(unpacked_array(data).data, values)


def test_an_array_whose_layout_does_not_fit_stays_flat():
    message = Float64MultiArray(data=[1.0, 2.0, 3.0])
    assert unpacked_array(bytes(serialize_message(message))).data.shape == (3,)
    message.layout.dim = [MultiArrayDimension(label='x', size=2, stride=2)]
    flat = unpacked_array(bytes(serialize_message(message)))
    assert (flat.sizes, flat.data.tolist()) == ((2,), [1.0, 2.0, 3.0])


def test_an_unpacked_array_is_ours_to_write_to():
    data = unpacked_array(cdr.pack_float64_array(np.ones(3), ['x'])).data
    data[0] = 2.0
    assert data.flags.aligned


def test_labels_must_match_the_axes():
    with pytest.raises(WrongKind, match='one label per axis'):
        cdr.pack_float64_array(np.zeros((2, 2)), ['row'])


def test_long_names_and_many_axes_are_refused_before_they_are_taken_apart():
    block = cdr.pack_float64_array(np.zeros((2, 2)), ('sample', 't[s]' + ',' * 10_000_000))
    with pytest.raises(RecordingError, match=r'10000004 characters of a label, .* limit of 10000'):
        cdr.unpack(FLOAT64_ARRAY, block)
    stamped = cdr.pack_stamped(0, 'x' * 20_000, (0.0, 0.0, 0.0))
    with pytest.raises(RecordingError, match='20000 characters of a label, a frame or'):
        cdr.unpack(POINT_STAMPED, stamped)
    axes = b'\0\1\0\0' + struct.pack('<I', 1_000_000) + bytes(12_000_000)
    with pytest.raises(RecordingError, match='1000000 axes or joints of a message'):
        cdr.unpack(FLOAT64_ARRAY, axes)


def test_a_zero_inside_a_text_is_refused():
    with pytest.raises(WrongKind, match='free of zero characters'):
        cdr.pack_string('cut\0off')


def test_a_type_that_is_not_recorded_is_refused():
    with pytest.raises(UnknownName, match='std_msgs/msg/Float64'):
        cdr.unpack('std_msgs/msg/Bool', b'\0\1\0\0\1')
