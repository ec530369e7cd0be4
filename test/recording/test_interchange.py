# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Other people's tools open what is recorded here, and their recordings open here."""

from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from written_messages import plain, written

from stickslip_ros.interface import cdr
from stickslip_ros.interface.channels import Channel
from stickslip_ros.interface.schemas import SCHEMAS

Run = list[tuple[str, int, bytes]]


@pytest.fixture
def said(run: Run, channels: list[Channel]) -> list[tuple[str, int, str]]:
    """Give what the run says, message by message."""
    types = {each.topic: each.type_name for each in channels}
    return [(topic, at, written(cdr.unpack(types[topic], data))) for topic, at, data in run]


def test_rosbags_reads_the_bare_file(recorded: Path, said: list):
    with AnyReader([recorded]) as reader:
        seen = [
            (each.topic, at, plain(each.msgtype, reader.deserialize(data, each.msgtype)))
            for each, at, data in reader.messages()
        ]
    assert sorted(seen) == sorted(said)


def test_mcap_ros2_reads_every_message(recorded: Path, said: list):
    with recorded.open('rb') as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        seen = [
            (channel.topic, message.log_time, plain(schema.name, decoded))
            for schema, channel, message, decoded in reader.iter_decoded_messages()
        ]
    assert seen == said


def test_the_head_is_what_rosbag2_asks_for(recorded: Path):
    with recorded.open('rb') as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert reader.get_header().profile == 'ros2'
    assert {each.message_encoding for each in summary.channels.values()} == {'cdr'}
    assert {each.encoding for each in summary.schemas.values()} == {'ros2msg'}
    assert {each.name: each.data.decode() for each in summary.schemas.values()} == SCHEMAS
    assert min(*summary.schemas, *summary.channels) > 0
