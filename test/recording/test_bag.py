# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A bag directory as rosbag2 makes it: others open ours, theirs open here, or say why not."""

import json
import re
import shlex
import shutil
import struct
import sys
from pathlib import Path

import pytest
import yaml
import zstandard
from mcap_records import foreign, foreign_numbers
from processes import run_process
from rosbags.interfaces import (
    ConnectionExtRosbag2,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.interfaces import Qos as RosQos
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from stickslip_ros.budget import NAMES_MOST
from stickslip_ros.errors import RecordingError
from stickslip_ros.interface import cdr
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.interface.schemas import TYPE_HASHES
from stickslip_ros.lab.cli.main import main
from stickslip_ros.message_types import FLOAT64, POINT_STAMPED, UINT32
from stickslip_ros.recording.bag import METADATA_FILE
from stickslip_ros.recording.layout import FileForm
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.recover import recover

Run = list[tuple[str, int, bytes]]
BAG = FileForm(bag=True, flush_period_s=0.005)
PART_NS = 5_000_000
PARTS = 4
FORCE = '/stand/force'
STORE = get_typestore(Stores.ROS2_JAZZY)
FOREVER = QosTime(9223372036, 854775807)
LATCHED = RosQos(
    QosHistory.KEEP_LAST,
    1,
    QosReliability.RELIABLE,
    QosDurability.TRANSIENT_LOCAL,
    FOREVER,
    FOREVER,
    QosLiveliness.AUTOMATIC,
    FOREVER,
    False,
)

BOMB = 'rosbag2_bagfile_information: {a: &a [x, x, x], b: &b [*a, *a, *a], storage_identifier: *b}'
"""Each further letter makes it three times as long, where somebody writes it out."""


@pytest.fixture(scope='module')
def bag(tmp_path_factory, channels, run, record_in_parts) -> Path:
    """Give the run of 20 ms as a bag of four parts."""
    path = tmp_path_factory.mktemp('bag') / 'run'
    return record_in_parts(path, channels, run, PART_NS, form=BAG).path


@pytest.fixture(scope='module')
def described(bag: Path) -> dict:
    return bag_information(bag)


def bag_information(bag: Path) -> dict:
    """Return what the metadata.yaml of a bag says."""
    return yaml.safe_load((bag / METADATA_FILE).read_text())['rosbag2_bagfile_information']


def foreign_bag(path: Path, mode: CompressionMode | None = None, **options) -> Path:
    """Write a bag as `ros2 bag record` does, with a topic of ours and one of another kind."""
    writer = Writer(path, **{'version': 9, 'storage_plugin': StoragePlugin.MCAP, **options})
    if mode is not None:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        point = writer.add_connection(
            '/position', POINT_STAMPED, typestore=STORE, offered_qos_profiles=[LATCHED]
        )
        flag = writer.add_connection('/flag', 'std_msgs/msg/Bool', typestore=STORE)
        for tick in range(3):
            writer.write(point, tick, cdr.pack_stamped(tick, 'runner', (tick, 0, 0)))
            writer.write(flag, tick, b'\0\1\0\0\1')
    return path


def test_the_description_has_every_entry_that_rosbag2_asks_for(described: dict, tmp_path: Path):
    theirs = bag_information(foreign_bag(tmp_path / 'theirs'))
    assert described.keys() == theirs.keys()
    assert (described['version'], described['storage_identifier']) == (9, 'mcap')
    assert described['starting_time'] == {'nanoseconds_since_epoch': 0}
    assert described['duration'] == {'nanoseconds': 19_000_000}
    assert described['relative_file_paths'] == [each['path'] for each in described['files']]
    assert described['message_count'] == sum(each['message_count'] for each in described['files'])


def test_a_file_that_stands_alone_tells_rosbag2_its_distribution(tmp_path, monkeypatch, described):
    """The whole description, as rosbag2 writes it: one with entries missing would not open."""
    monkeypatch.setenv('ROS_DISTRO', 'jazzy')
    voltage = Channel('/voltage', FLOAT64, Qos(10))
    Recorder(tmp_path / 'run.mcap', [voltage]).close()
    record = Recording(tmp_path / 'run.mcap').metadata['rosbag2']
    told = yaml.safe_load(record['serialized_metadata'])
    assert told.keys() == described.keys()
    assert (told['version'], told['ros_distro']) == (9, 'jazzy')
    monkeypatch.delenv('ROS_DISTRO')
    Recorder(tmp_path / 'unknown.mcap', [voltage]).close()
    assert 'rosbag2' not in Recording(tmp_path / 'unknown.mcap').metadata


def test_the_description_tells_types_and_quality_of_service(described: dict):
    topics = {
        each['topic_metadata']['name']: each['topic_metadata']
        for each in described['topics_with_message_count']
    }
    status = topics['/stand/drive/status']
    assert (status['type'], status['serialization_format']) == (UINT32, 'cdr')
    assert status['type_description_hash'] == TYPE_HASHES[UINT32]
    [profile], [other] = (topics[each]['offered_qos_profiles'] for each in (status['name'], FORCE))
    words = ('history', 'durability', 'liveliness')
    assert [profile[word] for word in words] == ['keep_last', 'transient_local', 'automatic']
    assert (profile['reliability'], other['reliability']) == ('reliable', 'best_effort')


def test_every_file_is_described(bag: Path, described: dict):
    for entry in described['files']:
        times = [at for _, at, _ in Recording(bag / entry['path']).messages()]
        assert entry['starting_time'] == {'nanoseconds_since_epoch': times[0]}
        assert entry['duration'] == {'nanoseconds': times[-1] - times[0]}
        assert entry['message_count'] == len(times)


def test_rosbags_opens_the_directory(bag: Path, run: Run, channels: list[Channel]):
    with Reader(bag) as reader:
        assert (reader.start_time, reader.end_time) == (0, 19_000_001)
        seen = {each.topic: each.msgtype for each in reader.connections}
        [status] = [each.ext for each in reader.connections if each.topic.endswith('status')]
        messages = [(each.topic, at, bytes(data)) for each, at, data in reader.messages()]
    assert seen == {each.topic: each.type_name for each in channels}
    assert isinstance(status, ConnectionExtRosbag2)
    assert status.offered_qos_profiles == [LATCHED]
    [latched] = [each for each in run if each[0] == '/stand/drive/status']
    repeated = [(latched[0], part * PART_NS, latched[2]) for part in range(1, PARTS)]
    assert sorted(messages) == sorted(run + repeated)


def test_a_bag_opens_here_as_one_run(bag: Path, recorded: Path):
    assert list(map(str, Recording(bag).messages())) == list(
        map(str, Recording(recorded).messages())
    )
    assert Recording(bag).channels == Recording(recorded).channels


def test_a_bag_without_messages_opens(tmp_path: Path):
    Recorder(tmp_path / 'run', [Channel('/u', FLOAT64, Qos(1))], form=BAG).close()
    assert list(Recording(tmp_path / 'run').messages()) == []
    with Reader(tmp_path / 'run') as reader:
        assert reader.message_count == 0


def test_of_messages_without_numbers_none_is_called_lost(tmp_path: Path, capsys):
    rows = [(1000 * at, 0, 0.5) for at in range(30) if at % 10]  # as rosbag2 writes
    path = foreign_numbers(tmp_path / 'lossy.mcap', rows)
    assert [each.gaps for each in Recording(path).channels] == [None]
    assert main(['info', str(path)]) == 0
    assert re.search(r'/u +Float64 +27 +\S+ +-\n', capsys.readouterr().out)
    assert main(['info', str(path), '--json']) == 0
    assert json.loads(capsys.readouterr().out)['topics'][0]['gaps'] is None
    counted = foreign_numbers(tmp_path / 'b.mcap', [(at, at + 7, 0.5) for at in (0, 1, 4)])
    assert [each.gaps for each in Recording(counted).channels] == [2]


def test_a_refused_recovery_leaves_nothing_behind(tmp_path: Path):
    bag = foreign_bag(tmp_path / 'bag')
    [first] = bag.glob('*.mcap')
    first = first.rename(bag / 'bag_0.mcap')
    shutil.copyfile(first, bag / 'bag_1.mcap')
    first.write_bytes(first.read_bytes()[:-9])
    writer = foreign(bag / 'bag_2.mcap', use_chunking=False)
    for number in range(NAMES_MOST.most + 1):
        writer.register_channel(f'/t{number}', 'json', 0)
    writer.finish()
    (bag / 'bag_2.mcap').write_bytes((bag / 'bag_2.mcap').read_bytes()[:-9])
    there = sorted(tmp_path.rglob('*'))
    with pytest.raises(RecordingError, match=r'bag_2\.mcap: it asks for 4097 topics'):
        recover(bag)
    assert sorted(tmp_path.rglob('*')) == there


@pytest.mark.parametrize('version', [8, 9])
def test_a_bag_of_another_recorder_opens_here(tmp_path: Path, version: int):
    bag = foreign_bag(tmp_path / 'bag', version=version)
    for recording in (Recording(bag), Recording(next(bag.glob('*.mcap')))):
        assert recording.series('position').value.tolist() == [0.0, 1.0, 2.0]
        assert {topic for topic, _, _ in recording.messages()} == {'/position'}
        assert [(each.messages, each.gaps) for each in recording.channels] == [
            (3, None),
            (3, None),
        ]
        assert recording.attachments == {}


def test_chunks_that_another_recorder_compressed_open_here(tmp_path: Path):
    recording = Recording(foreign_bag(tmp_path / 'bag', CompressionMode.STORAGE))
    assert recording.series('position').value.tolist() == [0.0, 1.0, 2.0]


@pytest.mark.parametrize('storage', [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_messages_that_rosbag2_compressed_one_by_one_are_read(tmp_path, storage):
    bag = foreign_bag(tmp_path / 'bag', CompressionMode.MESSAGE, storage_plugin=storage)
    assert Recording(bag).series('position').value.tolist() == [0.0, 1.0, 2.0]
    (bag / METADATA_FILE).unlink()
    assert recover(bag)[1] == bag / METADATA_FILE
    told = bag_information(bag)
    assert (told['compression_format'], told['compression_mode']) == ('zstd', 'MESSAGE')
    assert Recording(bag).series('position').value.tolist() == [0.0, 1.0, 2.0]


def test_a_compressed_file_is_refused_with_the_command_that_unpacks_it(tmp_path: Path):
    bag = foreign_bag(tmp_path / 'bag', CompressionMode.FILE)
    (bag / METADATA_FILE).unlink()
    [file] = bag.iterdir()
    for read in (Recording, recover):
        for path in (bag, file):
            with pytest.raises(RecordingError, match='it is compressed by zstd') as refused:
                read(path)
            assert f'"zstd -d {file}", and name {file.stem}' in str(refused.value)
    file.with_suffix('').write_bytes(unpacked(file))
    assert Recording(file.with_suffix('')).series('position').value.tolist() == [0.0, 1.0, 2.0]


def unpacked(file: Path) -> bytes:
    """Return what zstd -d makes of a file."""
    return zstandard.ZstdDecompressor().decompressobj().decompress(file.read_bytes())


def test_the_storage_that_a_description_leaves_open_is_that_of_the_files(tmp_path: Path):
    bag = foreign_bag(tmp_path / 'bag')
    text = (bag / METADATA_FILE).read_text()
    (bag / METADATA_FILE).write_text(
        text.replace('storage_identifier: mcap', 'storage_identifier: ""')
    )
    assert bag_information(bag)['storage_identifier'] == ''
    assert Recording(bag).series('position').value.tolist() == [0.0, 1.0, 2.0]


def test_a_bag_that_rosbag2_compressed_as_a_whole_is_refused(tmp_path: Path):
    bag = foreign_bag(tmp_path / 'bag', CompressionMode.FILE)
    with pytest.raises(RecordingError, match='it is compressed by file') as refused:
        Recording(bag)
    assert Recording(converted(refused.value)).series('position').value.tolist() == [0.0, 1.0, 2.0]


def converted(refusal: RecordingError) -> Path:
    """Carry out the command that a refusal names."""
    command = shlex.split(str(refusal).split('"')[3])
    run_process([Path(sys.executable).with_name(command[0]), *command[1:]], check=True)
    return Path(command[-1])


def test_a_bag_of_ros_1_is_refused_with_the_command_that_converts_it(tmp_path: Path):
    path, store = tmp_path / 'an old.bag', get_typestore(Stores.ROS1_NOETIC)
    with Ros1Writer(path) as writer:
        number = writer.add_connection('/u', FLOAT64, typestore=store)
        writer.write(number, 1000, struct.pack('<d', 1.5))
    with pytest.raises(RecordingError, match='it is a bag of ROS 1') as refused:
        Recording(path)
    assert Recording(converted(refused.value)).series('u').value.tolist() == [1.5]


@pytest.mark.parametrize(
    ('content', 'refusal'),
    [
        ('', 'metadata.yaml cannot be read'),
        ('{', 'metadata.yaml: is not YAML'),
        ('[' * 5000, '65 levels of YAML, above the limit of 64'),
        (BOMB, r'line 1: has the alias \*a; write out what it stands for'),
        ('rosbag2_bagfile_information: 3', 'metadata.yaml cannot be read'),
        ('rosbag2_bagfile_information: {}', 'metadata.yaml cannot be read'),
        (
            'rosbag2_bagfile_information: {storage_identifier: mcap, relative_file_paths: []}',
            'its list of files is missing',
        ),
        (
            'rosbag2_bagfile_information: {storage_identifier: mcap, relative_file_paths: [a]}',
            'a is missing; put it back',
        ),
        (
            'rosbag2_bagfile_information: {storage_identifier: x, relative_file_paths: []}',
            "a bag of storage 'x'; record it with storage mcap or sqlite3",
        ),
    ],
    ids=['empty', 'broken', 'deep', 'bomb', 'number', 'bare', 'no files', 'lost file', 'storage'],
)
def test_a_description_that_makes_no_sense_is_refused(tmp_path: Path, content: str, refusal: str):
    bag = foreign_bag(tmp_path / 'bag')
    (bag / METADATA_FILE).write_text(content)
    with pytest.raises(RecordingError, match=refusal):
        Recording(bag)


def test_a_description_cannot_name_files_elsewhere(tmp_path: Path, recorded: Path):
    bag = foreign_bag(tmp_path / 'bag')
    text = (bag / METADATA_FILE).read_text()
    (bag / METADATA_FILE).write_text(text.replace('bag.mcap', str(recorded)))
    with pytest.raises(RecordingError, match=r'run\.mcap is missing'):
        Recording(bag)


def test_a_directory_without_description_is_called_that_with_what_mends_it(tmp_path: Path):
    bag = foreign_bag(tmp_path / "it's a bag")
    (bag / METADATA_FILE).unlink()
    with pytest.raises(RecordingError, match=f'a directory without {METADATA_FILE}') as refused:
        Recording(bag)
    *_, recovery = shlex.split(str(refused.value).partition('part with "')[2][:-1])
    assert recover(Path(recovery))[1] == bag / METADATA_FILE
    assert Recording(bag).series('position').value.tolist() == [0.0, 1.0, 2.0]


PROFILES = ['5', '[5]', '{depth: 1}', '[' * 5000, '&a [*a]', '"', '!!float ""', '!!map [1]']


@pytest.mark.parametrize('quality', [*PROFILES, '2001-99-99', '[{history: !!set {a}}]'])
def test_a_quality_of_service_of_a_wrong_kind_is_left_out(tmp_path: Path, quality: str):
    bag = tmp_path / 'bag'
    bag.mkdir()
    writer = foreign(bag / 'bag.mcap')
    schema = writer.register_schema(FLOAT64, 'ros2msg', b'float64 data')
    number = writer.register_channel('/u', 'cdr', schema, {'offered_qos_profiles': quality})
    writer.add_message(number, 1, cdr.pack_float64(1.5), 1)
    writer.finish()
    _, written = recover(bag)
    assert written == bag / METADATA_FILE
    [content] = yaml.safe_load(written.read_text()).values()
    [topic] = content['topics_with_message_count']
    assert topic['topic_metadata']['offered_qos_profiles'] == [] or '!!set' in quality
    assert Recording(bag).series('u').value == [1.5]
