# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The writer of MCAP files, beside that of the library."""

import io
import random

import pytest
from mcap.writer import CompressionType, Writer

from stickslip_ros.interface.schemas import SCHEMAS, TYPE_HASHES
from stickslip_ros.interface.topics import recorded_channels
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.integrity import PROFILE
from stickslip_ros.recording.layout import FileForm
from stickslip_ros.recording.writer import McapWriter, Stored

CHUNK_BYTES = 4_000
CHANNELS = tuple(recorded_channels(Parameters()).values())
FILES = ('parameters.yaml', 'application/yaml', b'a: 1'), ('state', 'text/plain', b'')


def messages(count: int) -> list[tuple[int, int, bytes, int]]:
    """Return channel, time, bytes and number of messages; some of one time, one above a chunk."""
    given = random.Random(1)
    sizes = [CHUNK_BYTES + 1 if i == 7 else i % 90 for i in range(count)]
    numbers = range(1, len(CHANNELS) + 1)
    return [
        (given.choice(numbers), 7 * (i // 2), given.randbytes(size), i)
        for i, size in enumerate(sizes)
    ]


def by_the_library(compression: str, count: int) -> bytes:
    stream = io.BytesIO()
    kind = CompressionType[compression.upper()]
    writer = Writer(stream, CHUNK_BYTES, kind, enable_data_crcs=True)
    writer.start(PROFILE)
    writer.add_attachment(0, 0, *FILES[0])
    writer.add_metadata('run', {'seed': '1', 'note': 'µ'})
    types = list(dict.fromkeys(each.type_name for each in CHANNELS))
    for name in types:
        writer.register_schema(name, 'ros2msg', SCHEMAS[name].encode())
    for each in CHANNELS:
        said = {'offered_qos_profiles': each.qos.to_yaml()}
        said['topic_type_hash'] = TYPE_HASHES[each.type_name]
        writer.register_channel(each.topic, 'cdr', types.index(each.type_name) + 1, said)
    for channel_id, time_ns, data, sequence in messages(count):
        writer.add_message(channel_id, time_ns, data, time_ns, sequence)
        if sequence in (0, 500):
            writer.flush()
    writer.add_attachment(0, 0, *FILES[1])
    writer.finish()
    return stream.getvalue()


# The library packs zstd by another level.
@pytest.mark.parametrize('compression', ['lz4', 'none'])
@pytest.mark.parametrize('count', [0, 1, 999])
def test_a_file_has_the_bytes_of_the_library(compression: str, count: int):
    stream = io.BytesIO()
    writer = McapWriter(stream, CHANNELS, FileForm(compression, CHUNK_BYTES))
    writer.attach({FILES[0][0]: FILES[0][1:]})
    writer.describe({'run': {'seed': '1', 'note': 'µ'}})
    for message in messages(count):
        writer.write(Stored(*message))
        if message[-1] == 500:
            writer.end_chunk()
    writer.attach({FILES[1][0]: FILES[1][1:]})
    writer.end()
    assert stream.getvalue() == by_the_library(compression, count)
