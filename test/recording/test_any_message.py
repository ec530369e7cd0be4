# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Any message is read by its definition as others read it; what is none is refused in a line."""

import json
import struct
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_records import foreign
from mcap_ros2.decoder import DecoderFactory
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from stickslip_ros.errors import StickSlipError
from stickslip_ros.extras import MissingExtra
from stickslip_ros.interface import cdr
from stickslip_ros.message_types import FLOAT64, POINT_STAMPED
from stickslip_ros.recording.any_message import numbers_of
from stickslip_ros.recording.reader import Recording

TYPE = 'pkg/msg/T0'
LINE = '=' * 80
HEADED = f"""std_msgs/Header header
float64 Kp
{LINE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{LINE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
LITTLE = b'\0\1\0\0'
MS_NS = 1_000_000


def numbers_in(value: Any, path: str = '') -> Iterator[tuple[str, float]]:
    """Give paths and values of the numbers of a message that mcap_ros2 has read."""
    if isinstance(value, (list, tuple, bytes)):
        for at, each in enumerate(value):
            yield from numbers_in(each, f'{path}[{at}]')
    elif hasattr(value, '__slots__'):
        for name in value.__slots__:
            if not name.isupper():  # a constant
                yield from numbers_in(getattr(value, name), f'{path}.{name}' if path else name)
    elif not isinstance(value, str):
        yield path, float(value)


def recorded(path: Path, rows: list[bytes], text: str, name: str = TYPE) -> Recording:
    """Give a file with messages of a definition, one each ms from 1 ms on."""
    writer = foreign(path)
    schema = writer.register_schema(name, 'ros2msg', text.encode())
    number = writer.register_channel('/t', 'cdr', schema)
    for at, data in enumerate(rows, 1):
        writer.add_message(number, at * MS_NS, data, at * MS_NS)
    writer.finish()
    return Recording(path)


NESTED = f"""int32 X=5
bool flag
string name
int8[] few
Part part
Part[2] pair
Part[] parts
string[<=3] texts
uint64 last
{LINE}
MSG: pkg/Part
byte[3] bits
float32 x
string unit
float64[<=2] pair
"""


@pytest.mark.parametrize('is_little', [True, False])
def test_numbers_of_any_message_are_those_that_mcap_ros2_reads(is_little: bool, tmp_path: Path):
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(NESTED, TYPE))
    message, part = store.types[TYPE], store.types['pkg/msg/Part']

    def made(number: int) -> Any:
        parts = [
            part(np.arange(3, dtype=np.uint8), number + k, 'µm' * k, np.full(k % 3, 0.1 * number))
            for k in range(4)
        ]
        few, texts = np.arange(number, dtype=np.int8) - 1, ['a', '', 'bcd'][:number]
        return message(True, 'n' * number, few, parts[3], parts[:2], parts[1:], texts, 1 << 40)

    rows = [
        bytes(store.serialize_cdr(made(number), TYPE, little_endian=is_little))
        for number in (1, 2, 3)
    ]
    recording = recorded(tmp_path / 'run.mcap', rows, NESTED)
    with (tmp_path / 'run.mcap').open('rb') as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        expected = [dict(numbers_in(each[-1])) for each in reader.iter_decoded_messages()]
    in_all = set.intersection(*(set(each) for each in expected))
    assert {'few[0]', 'part.bits[2]', 'pair[1].x', 'parts[2].x', 'last'} <= in_all
    for field in in_all:
        times_ns, values, _ = numbers_of(recording.files, '/t', field)
        assert times_ns.tolist() == [MS_NS * at for at in range(1, 4)]
        np.testing.assert_array_equal(values, [each[field] for each in expected], field)
    with pytest.raises(StickSlipError, match='the array of a message has 1 elements'):
        numbers_of(recording.files, '/t', 'few[1]')


def headed(sec: int, nanosec: int, value: float) -> bytes:
    return struct.pack('<4siIIB3xd', LITTLE, sec, nanosec, 1, 0, value)


@pytest.mark.parametrize(
    ('text', 'field', 'data'),
    [
        ('float64 Kp', 'Kp', struct.pack('<d', 1.5)),
        ('float64 posX', 'posX', struct.pack('<d', 1.5)),
        ('float64 a__b_', 'a__b_', struct.pack('<d', 1.5)),
        ('MyType at\n===\nMSG: pkg/MyType\nfloat32 x', 'at.x', struct.pack('<f', 1.5)),
        ('x/T at\n===\nMSG: x/msg/T\nfloat32 x', 'at.x', struct.pack('<f', 1.5)),
        ('string S="a # b"\nint8 N =5\nfloat32 x', 'x', struct.pack('<f', 1.5)),
        ('string s "a=b" # c\nfloat32 x 0.5#d', 'x', struct.pack('<I4sf', 2, b'a', 1.5)),
        ('  \t\n# float32 x\n\tfloat32   x\t', 'x', struct.pack('<f', 1.5)),
        ('builtin_interfaces/Time t\nfloat32 x', 'x', struct.pack('<iIf', 0, 0, 1.5)),
        ('string<=9[<=2] s\nfloat64[<=3] x', 'x[1]', struct.pack('<IIdd', 0, 2, 0.5, 1.5)),
        ('float64 header\nfloat64 x', 'x', struct.pack('<dd', 0.5, 1.5)),
    ],
)
def test_any_name_constant_default_and_bound_is_read(text, field, data, tmp_path):
    recording = recorded(tmp_path / 'run.mcap', [LITTLE + data] * 2, text)
    times_ns, values, _ = numbers_of(recording.files, '/t', field)
    assert times_ns.tolist() == [MS_NS, 2 * MS_NS]
    assert values.tolist() == [1.5, 1.5]


def test_a_message_is_placed_at_its_stamp_and_one_without_at_the_time_of_the_file(tmp_path: Path):
    rows = [headed(5, 7, 1.5), headed(0, 0, 2.5), headed(3, 0, 3.5)]
    times_ns, values, _ = numbers_of(
        recorded(tmp_path / 'run.mcap', rows, HEADED).files, '/t', 'Kp'
    )
    assert times_ns.tolist() == [2 * MS_NS, 3_000_000_000, 5_000_000_007]
    assert values.tolist() == [2.5, 3.5, 1.5]


@pytest.mark.parametrize('row', [headed(-1, 0, 0.0), headed(0, 10**9, 0.0)])
def test_a_stamp_that_is_no_time_is_refused(row: bytes, tmp_path: Path):
    recording = recorded(tmp_path / 'run.mcap', [row], HEADED)
    with pytest.raises(StickSlipError, match=r'has the stamp .* on /t; write whole seconds'):
        numbers_of(recording.files, '/t', 'Kp')


@pytest.mark.parametrize(
    ('text', 'told'),
    [
        ('nothing', 'cannot be read'),
        ('float64 1x', 'cannot be read'),
        ('Other x', 'it lacks pkg/msg/Other'),
        ('wstring s\nfloat64 x', 'it lacks pkg/msg/wstring'),
        ('T0 x', 'recursion'),
        (f'string[{10**9}] y\nfloat64 x', 'array y of 1000000000 elements is above'),
        (f'float64[{10**30}] y\nfloat64 x', 'a message on /t is no pkg/msg/T0'),
        ('float64[0] x', 'its numbers are x at ...kHz, an array of samples'),
        ('float64 f', 'its numbers are f$'),
        ('uint8[99] f\nfloat32[] x', 'is no pkg/msg/T0'),
        ('\n'.join(f'uint8 f{k}' for k in range(25)), r'its numbers are f0, .*, f19, \.\.\.$'),
        ('uint8[8] x', r'its numbers are x\[0\], x at ...kHz, an array of samples$'),
    ],
    ids=lambda text: text[:12],
)
def test_a_definition_that_makes_no_sense_or_lacks_the_number_is_refused(text, told, tmp_path):
    recording = recorded(tmp_path / 'run.mcap', [LITTLE + bytes(25)], text)
    with pytest.raises(StickSlipError, match=told):
        numbers_of(recording.files, '/t', 'x')


@pytest.mark.parametrize(
    ('text', 'data', 'told'),
    [
        ('float64 x', b'', 'begins with "", not'),
        ('float64 x', LITTLE[:3], 'begins with'),
        ('float64 x', LITTLE + bytes(7), 'is no pkg/msg/T0'),
        ('float64 x', b'\0\7\0\0' + bytes(8), 'not as plain CDR'),
        ('string s\nfloat64 x', LITTLE + b'\xff' * 8, 'is no pkg/msg/T0'),
        ('string[] s\nfloat64 x', LITTLE + b'\xff\xff\0\0' + bytes(5000), 'is no pkg/msg/T0'),
    ],
)
def test_a_message_of_other_bytes_is_refused(text: str, data: bytes, told: str, tmp_path: Path):
    recording = recorded(tmp_path / 'run.mcap', [data], text)
    with pytest.raises(StickSlipError, match=told):
        numbers_of(recording.files, '/t', 'x')


@pytest.mark.parametrize('is_parsed', [True, False])
def test_a_definition_whose_names_are_code_is_refused_and_runs_nothing(
    is_parsed: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    made = tmp_path / 'made'
    code = f'pkg/msg/T0((open({str(made)!r}, "w")) or object)'
    if not is_parsed:  # as by a rosbags that takes any name
        types: dict[str, Any] = {code: ([], get_types_from_msg('float64 x', TYPE)[TYPE][1])}
        monkeypatch.setattr('rosbags.typesys.get_types_from_msg', lambda *_: types)
    with pytest.raises(StickSlipError, match=r'definition .* cannot be read'):
        numbers_of(recorded(tmp_path / 'a.mcap', [LITTLE], 'float64 x', code).files, '/t', 'x')
    assert not made.exists()


def test_without_rosbags_messages_that_we_record_too_are_read_and_others_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setitem(sys.modules, 'rosbags.typesys', None)
    ours = recorded(tmp_path / 'ours.mcap', [cdr.pack_float64(1.5)], '', FLOAT64)
    assert numbers_of(ours.files, '/t', 'data')[1].tolist() == [1.5]
    theirs = recorded(tmp_path / 'theirs.mcap', [cdr.pack_float64(1.5)], 'float64 data')
    with pytest.raises(MissingExtra, match="pkg/msg/T0 needs the package 'rosbags"):
        numbers_of(theirs.files, '/t', 'data')


@pytest.mark.parametrize('kind', [FLOAT64, POINT_STAMPED])
def test_messages_that_we_record_too_are_read_at_once_in_either_byte_order(kind, tmp_path):
    store = get_typestore(Stores.ROS2_JAZZY)
    rows = {FLOAT64: [cdr.pack_float64(0.5), cdr.pack_float64(1.5)]}
    rows[POINT_STAMPED] = [cdr.pack_stamped(7 + n, 'f' * n, (n - 0.5, 0, 0)) for n in (1, 2)]
    for at, is_little in enumerate((True, False)):
        data = [
            bytes(
                store.serialize_cdr(
                    store.deserialize_cdr(each, kind), kind, little_endian=is_little
                )
            )
            for each in rows[kind]
        ]
        files = recorded(tmp_path / f'{at}.mcap', data, '', kind).files
        times_ns, values, _ = numbers_of(files, '/t', 'data' if kind == FLOAT64 else 'point.x')
        assert values.tolist() == [0.5, 1.5]
        assert times_ns.tolist() == ([8, 9] if kind == POINT_STAMPED else [MS_NS, 2 * MS_NS])
    for short in (data[0][:3], rows[kind][0][:7], rows[kind][0][:-17]):
        files = recorded(tmp_path / f'{len(short)}.mcap', [short], '', kind).files
        with pytest.raises(StickSlipError, match='a message on /t is too short'):
            numbers_of(files, '/t', 'data' if kind == FLOAT64 else 'point.x')


def test_a_definition_that_is_no_text_or_of_another_language_is_refused(tmp_path: Path):
    writer = foreign(tmp_path / 'run.mcap')
    broken = writer.register_schema(TYPE, 'ros2msg', b'\xff')
    other = writer.register_schema(TYPE, 'ros2idl', b'')
    for name, encoding, schema in (('/a', 'cdr', broken), ('/b', 'cdr', other), ('/c', 'json', 0)):
        writer.add_message(writer.register_channel(name, encoding, schema), 0, b'', 0)
    writer.finish()
    recording = Recording(tmp_path / 'run.mcap')
    for name, told in {
        '/a': 'cannot be read',
        '/b': 'lacks pkg/msg/T',
        '/c': 'is not JSON',
    }.items():
        with pytest.raises(StickSlipError, match=told):
            numbers_of(recording.files, name, 'x')


IDL = """IDL: rig_msgs/msg/Sample
#include "rig_msgs/msg/Part.idl"
module rig_msgs { module msg {
  typedef double double__2[2];
  module Sample_Constants { const long MOST = 3; };
  @verbatim (language="comment", text="struct of (all); that" "is read")
  struct Sample {
    @default (value=TRUE)
    boolean is_on;
    string<8> name;
    double__2 pair;
    @unit (value="m")
    sequence<rig_msgs::msg::Part, 4> parts;
    unsigned long long last;
  };
}; };
================================================================================
IDL: rig_msgs/msg/Part
module rig_msgs { module msg { struct Part { float size; short turns; }; }; };
"""


def test_a_definition_in_idl_is_read(tmp_path: Path):
    writer = foreign(tmp_path / 'run.mcap')
    schema = writer.register_schema('rig_msgs/msg/Sample', 'ros2idl', IDL.encode())
    channel = writer.register_channel('/t', 'cdr', schema)
    body = struct.pack('<B3xI2sxx4xdd', 1, 2, b'a', 1.5, 2.5)
    body += struct.pack('<Ifhxxfhxx4xQ', 2, 0.5, -3, 0.25, 4, 77)
    writer.add_message(channel, 0, b'\0\1\0\0' + body, 0)
    writer.finish()
    files = Recording(tmp_path / 'run.mcap').files
    for path, value in {'is_on': 1, 'pair[1]': 2.5, 'parts[1].turns': 4, 'last': 77}.items():
        assert numbers_of(files, '/t', path)[1].tolist() == [value]


def in_json(path: Path, *messages: object) -> Path:
    """Write messages as Foxglove does: JSON, without a profile."""
    writer = foreign(path, '')
    schema = writer.register_schema('rig.Reading', 'jsonschema', b'{}')
    channel = writer.register_channel('/t', 'json', schema)
    for at_ns, each in enumerate(messages, 50):
        data = each if isinstance(each, bytes) else json.dumps(each).encode()
        writer.add_message(channel, at_ns, data, at_ns)
    writer.finish()
    return path


def test_numbers_in_json_are_read_at_their_stamps(tmp_path: Path):
    messages = [
        {'x': {'y': [1, 2.5]}, 'timestamp': {'sec': 1, 'nsec': 5}},
        {'x': {'y': [1, None]}, 'header': {'stamp': {'sec': 2, 'nanosec': 6}}},
        {'x': {'y': [1, True]}, 'timestamp': {'sec': 0, 'nsec': 0}},
        {'x': {'y': [1, -3]}, 'timestamp': '2026-11-26T00:00:00Z'},
    ]
    files = Recording(in_json(tmp_path / 'a.mcap', *messages)).files
    times_ns, values, _ = numbers_of(files, '/t', 'x.y[1]')
    assert times_ns.tolist() == [52, 53, 1_000_000_005, 2_000_000_006]
    np.testing.assert_array_equal(values, [1.0, -3.0, 2.5, np.nan])
    assert numbers_of(files, '/t', 'x.y[1]', by_stamp=False)[0].tolist() == [50, 51, 52, 53]


@pytest.mark.parametrize(
    ('message', 'told'),
    [
        ({'x': 'three', 'y': [{'z': 1}], 'n': 4}, r'its numbers are y\[0\].z, n'),
        ({}, 'its numbers are none'),
        ([3], r'its numbers are \[0\]'),
        (b'{"x": 1', 'has a message on /t that is not JSON; name another topic'),
        (b'[' * 100_000, 'that is not JSON'),
        ({'x': 1, 'timestamp': {'sec': 1.5, 'nsec': 0}}, 'has the stamp 1.5 s 0 ns on /t'),
        ({'x': 1, 'timestamp': {'sec': 1}}, 'has the stamp 1 s None ns'),
        ({'x': 1, 'timestamp': {'sec': 1, 'nsec': 1 << 70}}, 'has the stamp 1 s'),
        ({'x': 10**400}, 'is not JSON: a number is too large'),
    ],
)
def test_json_without_that_number_or_with_another_stamp_is_refused(message, told, tmp_path):
    with pytest.raises(StickSlipError, match=told):
        numbers_of([in_json(tmp_path / 'a.mcap', message)], '/t', 'x')


def test_two_types_on_one_topic_are_read_each_by_its_definition(tmp_path: Path):
    writer = foreign(tmp_path / 'run.mcap')
    for at, kind in enumerate(('float32', 'float64')):
        schema = writer.register_schema(f'pkg{"/msg" * at}/T{at}', 'ros2msg', f'{kind} x'.encode())
        channel = writer.register_channel('/t', 'cdr', schema)
        data = LITTLE + struct.pack('<f' if at == 0 else '<d', 1.5 + at)
        writer.add_message(channel, at, data, at)
    writer.finish()
    assert numbers_of([tmp_path / 'run.mcap'], '/t', 'x')[1].tolist() == [1.5, 2.5]
