# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Other people's tools open what is recorded here, and their recordings open here."""

from pathlib import Path

import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.interfaces import (
    ConnectionExtRosbag2,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
)
from written_messages import plain, written

from stickslip_ros.interface import cdr
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.interface.schemas import SCHEMAS, TYPE_HASHES

Run = list[tuple[str, int, bytes]]

#: What rmw calls infinite: the largest signed number of nanoseconds.
FOREVER = {'sec': 9223372036, 'nsec': 854775807}


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


def test_rosbags_finds_types_and_counts(recorded: Path, channels: list[Channel], run: Run):
    with AnyReader([recorded]) as reader:
        seen = {each.topic: each.msgtype for each in reader.connections}
        assert reader.message_count == len(run)
    assert seen == {each.topic: each.type_name for each in channels}


def test_rosbags_finds_the_quality_of_service(recorded: Path):
    with AnyReader([recorded]) as reader:
        offered = {
            each.topic: each.ext.offered_qos_profiles
            for each in reader.connections
            if isinstance(each.ext, ConnectionExtRosbag2)
        }
    [status] = offered['/stand/drive/status']
    [force] = offered['/stand/force']
    assert (status.history, status.depth) == (QosHistory.KEEP_LAST, 1)
    assert status.reliability == QosReliability.RELIABLE
    assert status.durability == QosDurability.TRANSIENT_LOCAL
    assert status.liveliness == QosLiveliness.AUTOMATIC
    assert force.reliability == QosReliability.BEST_EFFORT
    assert (force.durability, force.depth) == (QosDurability.VOLATILE, 100)


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


def test_every_channel_carries_its_quality_of_service_and_hash(
    recorded: Path, channels: list[Channel]
):
    with recorded.open('rb') as stream:
        summary = make_reader(stream).get_summary()
    assert {each.topic: each.metadata for each in summary.channels.values()} == {
        each.topic: {
            'offered_qos_profiles': each.qos.to_yaml(),
            'topic_type_hash': TYPE_HASHES[each.type_name],
        }
        for each in channels
    }


def test_a_profile_is_a_sequence_of_one_complete_entry_in_numbers():
    assert yaml.safe_load(Qos(5, reliable=False, latched=True).to_yaml()) == [
        {
            'history': 1,
            'depth': 5,
            'reliability': 2,
            'durability': 1,
            'deadline': FOREVER,
            'lifespan': FOREVER,
            'liveliness': 1,
            'liveliness_lease_duration': FOREVER,
            'avoid_ros_namespace_conventions': False,
        }
    ]
