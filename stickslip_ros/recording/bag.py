# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A bag directory: reads and writes ``metadata.yaml`` as rosbag2 of Jazzy and later does."""

import os
import re
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path, PurePath
from typing import Any, Final

import yaml
from mcap.records import Channel, Schema

from stickslip_ros.errors import RecordingError, quoted
from stickslip_ros.files import read_text
from stickslip_ros.parameters import read_yaml
from stickslip_ros.recording.integrity import (
    convert_hint,
    open_whole,
    recover_hint,
    refuse_foreign,
)
from stickslip_ros.recording.layout import STORAGES, SUFFIX

METADATA_FILE: Final = 'metadata.yaml'
_NUMBER: Final = re.compile(r'_\d{1,4}$')  # number of a part; longer numbers are times of day
METADATA_ROOT: Final = 'rosbag2_bagfile_information'
_VERSION: Final = 9
"""Version of the format; Jazzy and Kilted write it, and read all earlier versions."""

#: Words of ``rmw/qos_string_conversions.h``, in the order of the numbers of ``rmw/types.h``.
_WORDS: Final = {
    'history': 'system_default keep_last keep_all unknown',
    'reliability': 'system_default reliable best_effort unknown best_available',
    'durability': 'system_default transient_local volatile unknown best_available',
    'liveliness': (
        'system_default automatic manual_by_node manual_by_topic unknown best_available'
    ),
}


def write_metadata(folder: Path, parts: Sequence[Path]) -> Path:
    """Write the description of a bag of finished files, listed in playing order."""
    content = yaml.safe_dump({METADATA_ROOT: _describe(parts)}, sort_keys=False)
    path = folder / METADATA_FILE
    try:
        with path.open('x', encoding='utf-8') as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
    except FileExistsError as error:
        raise RecordingError(path, 'it exists and is not overwritten', 'move it away') from error
    return path


def file_metadata() -> dict[str, dict[str, str]]:
    """
    Return the metadata record with the ROS distribution, for rosbag2.

    rosbag2_storage_mcap (``read_metadata``) decodes it like a ``metadata.yaml``, and counts topics
    and messages by itself. Empty if the distribution is unknown.

    """
    if not os.environ.get('ROS_DISTRO'):
        return {}
    return {'rosbag2': {'serialized_metadata': yaml.safe_dump(_describe([]), sort_keys=False)}}


def _describe(paths: Sequence[Path]) -> dict[str, Any]:
    """Describe files by their summaries, each topic once."""
    topics: dict[str, dict[str, Any]] = {}
    files: list[dict[str, Any]] = []
    times_ns: list[int] = []
    is_packed = False
    for path in paths:
        with open_whole(path) as reader:
            summary, is_packed = reader.get_summary(), reader.is_packed
        if summary.statistics is None:
            raise RecordingError(path, 'it has no statistics', 'record it anew')
        statistics = summary.statistics
        start_ns, end_ns = statistics.message_start_time, statistics.message_end_time
        times_ns += [start_ns, end_ns] if statistics.message_count else []
        files.append(
            {
                'path': path.name,
                'starting_time': {'nanoseconds_since_epoch': start_ns},
                'duration': {'nanoseconds': end_ns - start_ns},
                'message_count': statistics.message_count,
            }
        )
        for key, channel in summary.channels.items():
            entry = topics.setdefault(
                channel.topic, _topic(channel, summary.schemas.get(channel.schema_id))
            )
            entry['message_count'] += statistics.channel_message_counts.get(key, 0)
    start_ns = min(times_ns, default=0)
    return {
        'version': _VERSION,
        'storage_identifier': STORAGES[paths[0].suffix if paths else SUFFIX],
        'duration': {'nanoseconds': max(times_ns, default=0) - start_ns},
        'starting_time': {'nanoseconds_since_epoch': start_ns},
        'message_count': sum(each['message_count'] for each in files),
        'topics_with_message_count': list(topics.values()),
        'compression_format': 'zstd' if is_packed else '',
        'compression_mode': 'MESSAGE' if is_packed else '',
        'relative_file_paths': [path.name for path in paths],
        'files': files,
        'custom_data': None,
        'ros_distro': os.environ.get('ROS_DISTRO', ''),
    }


def _topic(channel: Channel, schema: Schema | None) -> dict[str, Any]:
    """Describe a topic with 0 messages."""
    profiles: Any = None
    with suppress(RecordingError):
        text = channel.metadata.get('offered_qos_profiles', '')
        profiles = read_yaml(text, channel.topic, 'record it anew')
    if not isinstance(profiles, list) or not all(isinstance(each, dict) for each in profiles):
        profiles = []  # rosbag2 then takes its default
    for profile in profiles:
        for key, words in _WORDS.items():
            value = profile.get(key)
            if isinstance(value, int) and 0 <= value < len(words.split()):
                profile[key] = words.split()[value]
    return {
        'topic_metadata': {
            'name': channel.topic,
            'type': schema.name if schema else '',
            'serialization_format': channel.message_encoding,
            'offered_qos_profiles': profiles,
            'type_description_hash': channel.metadata.get('topic_type_hash', ''),
        },
        'message_count': 0,
    }


def bag_parts(path: Path) -> list[Path]:
    """Return the files listed in the description of a bag, all in its folder."""
    if not (path / METADATA_FILE).is_file():
        raise _undescribed(path)
    storage, names, mode = _description_of(path)
    if storage not in STORAGES.values() and (
        storage or {PurePath(n).suffix for n in names} - STORAGES.keys()
    ):
        hint = 'record it with storage mcap or sqlite3'
        raise RecordingError(path, f'it is a bag of storage {quoted(storage)}', hint)
    if mode not in {'none', 'message'}:  # messages are unpacked as they are read
        raise RecordingError(path, f'it is compressed by {mode}', convert_hint(path))
    missing = [name for name in names if not (path / name).is_file()]
    if missing := missing + ['its list of files'] * (not names):
        raise RecordingError(path, f'{missing[0]} is missing', 'put it back')
    if twice := [each for each, count in Counter(names).items() if count > 1]:
        problem = f'its {METADATA_FILE} lists {twice[0]} {names.count(twice[0])} times'
        raise RecordingError(path, problem, 'list each file once')
    return [path / name for name in names]


def _undescribed(path: Path) -> RecordingError:
    """Return the refusal of a directory without a description."""
    problem, hint = 'it is a directory without a recording', 'name a file or a bag directory'
    if files := files_of_a_bag(path):
        problem = f'it is a directory without {METADATA_FILE}, which rosbag2 writes at the end'
        hint = f'name a file of it, as {files[0]}, or {recover_hint(path)}'
    elif packed := sorted(path.glob('*.zstd')):
        refuse_foreign(packed[0])
    return RecordingError(path, problem, hint)


def _description_of(path: Path) -> tuple[str, list[str], str]:
    """Return storage, file names and compression mode of a bag."""
    file, hint = path / METADATA_FILE, recover_hint(path)
    try:
        bag: Any = read_yaml(read_text(file, hint, hint), str(file), hint)
        bag = bag[METADATA_ROOT]
        names = [PurePath(name).name for name in bag['relative_file_paths']]
        mode = str(bag.get('compression_mode') or 'none').lower()
        return bag['storage_identifier'], names, mode
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        problem = f'its {METADATA_FILE} cannot be read ({type(error).__name__} {error})'
        raise RecordingError(path, ' '.join(problem.split()), hint) from error


def files_of_a_bag(path: Path) -> list[Path]:
    """Return the files of a directory without description; refuse files of several runs."""
    files = [each for suffix in STORAGES for each in path.glob(f'*{suffix}')]
    files.sort(key=lambda each: (len(each.name), each.name))
    names = {_NUMBER.sub('', each.stem) for each in files}
    if len(names) > 1 or (len(files) > 1 and not files[0].stem.endswith('_0')):
        problem = f'it holds {len(files)} recordings, which are not the parts of one'
        raise RecordingError(path, problem, f'name one, as {files[0]}')
    return files
