"""A bag directory: its ``metadata.yaml``, as rosbag2 of Jazzy and later writes it, and read."""

import os
from collections.abc import Sequence
from pathlib import Path, PurePath
from typing import Any, Final, NamedTuple

import yaml
from mcap.records import Channel, Schema, Statistics

from stickslip_ros.errors import RecordingError
from stickslip_ros.recording.integrity import (
    convert_hint,
    open_whole,
    recover_hint,
    sqlite_refusal,
)
from stickslip_ros.recording.layout import SUFFIX

METADATA_FILE: Final = 'metadata.yaml'
ROOT: Final = 'rosbag2_bagfile_information'
VERSION: Final = 9
"""Of the form of the file; Jazzy and Kilted write this one, and read all earlier ones."""

_STORAGE: Final = 'mcap'
#: Words of ``rmw/qos_string_conversions.h``, in the order of the numbers of ``rmw/types.h``.
_WORDS: Final = {
    'history': 'system_default keep_last keep_all unknown',
    'reliability': 'system_default reliable best_effort unknown best_available',
    'durability': 'system_default transient_local volatile unknown best_available',
    'liveliness': (
        'system_default automatic manual_by_node manual_by_topic unknown best_available'
    ),
}


class _Part(NamedTuple):
    """What a file says of itself in its summary."""

    name: str
    statistics: Statistics
    channels: dict[int, Channel]
    schemas: dict[int, Schema]


def write_metadata(folder: Path, parts: Sequence[Path]) -> Path:
    """
    Describe a bag for rosbag2.

    Parameters
    ----------
    folder : Path
        The bag; it has no ``metadata.yaml`` yet.
    parts : sequence of Path
        Its files, all finished, in the order in which they are played.

    Raises
    ------
    RecordingError
        If a file is not whole, or there is a description already.

    """
    content = yaml.safe_dump({ROOT: _describe(parts)}, sort_keys=False)
    path = folder / METADATA_FILE
    try:
        with path.open('x', encoding='utf-8') as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
    except FileExistsError as error:
        raise RecordingError(path, 'it exists and is not overwritten', 'move it away') from error
    return path


def _describe(paths: Sequence[Path]) -> dict[str, Any]:
    parts = [_read_summary(path) for path in paths]
    filled = [part.statistics for part in parts if part.statistics.message_count]
    start_ns = min((each.message_start_time for each in filled), default=0)
    end_ns = max((each.message_end_time for each in filled), default=0)
    return {
        'version': VERSION,
        'storage_identifier': _STORAGE,
        'duration': {'nanoseconds': end_ns - start_ns},
        'starting_time': {'nanoseconds_since_epoch': start_ns},
        'message_count': sum(each.message_count for each in filled),
        'topics_with_message_count': _topics(parts),
        'compression_format': '',
        'compression_mode': '',
        'relative_file_paths': [part.name for part in parts],
        'files': [_file(part) for part in parts],
        'custom_data': None,
        'ros_distro': os.environ.get('ROS_DISTRO', ''),
    }


def _read_summary(path: Path) -> _Part:
    with open_whole(path) as reader:
        summary = reader.get_summary()
        if summary is None or summary.statistics is None:
            raise RecordingError(path, 'it has no statistics', 'record it anew')
        return _Part(path.name, summary.statistics, summary.channels, summary.schemas)


def _file(part: _Part) -> dict[str, Any]:
    said = part.statistics
    return {
        'path': part.name,
        'starting_time': {'nanoseconds_since_epoch': said.message_start_time},
        'duration': {'nanoseconds': said.message_end_time - said.message_start_time},
        'message_count': said.message_count,
    }


def _topics(parts: Sequence[_Part]) -> list[dict[str, Any]]:
    """List the topics, each once, with what all files hold of it."""
    topics: dict[str, dict[str, Any]] = {}
    for part in parts:
        for key, channel in part.channels.items():
            schema = part.schemas.get(channel.schema_id)
            entry = topics.setdefault(channel.topic, _topic(channel, schema))
            entry['message_count'] += part.statistics.channel_message_counts.get(key, 0)
    return list(topics.values())


def _topic(channel: Channel, schema: Schema | None) -> dict[str, Any]:
    profiles = yaml.safe_load(channel.metadata.get('offered_qos_profiles', '')) or []
    return {
        'topic_metadata': {
            'name': channel.topic,
            'type': schema.name if schema else '',
            'serialization_format': channel.message_encoding,
            'offered_qos_profiles': [
                {key: _word(key, value) for key, value in profile.items()} for profile in profiles
            ],
            'type_description_hash': channel.metadata.get('topic_type_hash', ''),
        },
        'message_count': 0,
    }


def _word(key: str, value: Any) -> Any:
    """Give an entry of a profile the word that this version of the file asks for."""
    words = _WORDS.get(key, '').split()
    is_number = isinstance(value, int) and 0 <= value < len(words)
    return words[value] if is_number else value


def bag_parts(path: Path) -> list[Path]:
    """
    Return the files that the description of a bag lists; they stand beside it, whatever it says.

    Raises
    ------
    RecordingError
        If the bag is not finished, not one that opens here, or a file is missing.

    """
    if not (path / METADATA_FILE).is_file():
        raise _undescribed(path)
    description = _read_description(path)
    try:
        storage = description['storage_identifier']
        names = [PurePath(name).name for name in description['relative_file_paths']]
        mode = str(description.get('compression_mode') or 'none').lower()
    except (KeyError, TypeError) as error:
        raise _unreadable(path, f'{error} is missing or wrong') from error
    if storage != _STORAGE:
        raise RecordingError(path, f'it is a bag of storage {storage}', convert_hint(path))
    if mode != 'none':
        raise RecordingError(path, f'rosbag2 has compressed each {mode} of it', convert_hint(path))
    missing = [name for name in names if not (path / name).is_file()]
    if missing or not names:
        raise RecordingError(
            path, f'{missing[0] if missing else "its list of files"} is missing', 'put it back'
        )
    return [path / name for name in names]


def refuse_sqlite(path: Path) -> None:
    """
    Make sure that a directory is not a bag of rosbag2's other storage.

    Raises
    ------
    RecordingError
        If it is one.

    """
    if list(path.glob('*.db3*')):
        raise sqlite_refusal(path)


def _undescribed(path: Path) -> RecordingError:
    """Return the refusal of a directory without description."""
    refuse_sqlite(path)
    if list(path.glob(f'*{SUFFIX}')):
        problem = f'it has no {METADATA_FILE}: the recording was cut off'
        return RecordingError(path, problem, recover_hint(path))
    problem = 'it is a directory without a recording'
    return RecordingError(path, problem, 'name a file or a bag directory')


def _read_description(path: Path) -> dict[str, Any]:
    try:
        text = (path / METADATA_FILE).read_text(encoding='utf-8')
        description = yaml.safe_load(text)[ROOT]
    except (OSError, ValueError, KeyError, TypeError, yaml.YAMLError) as error:
        raise _unreadable(path, type(error).__name__) from error
    if not isinstance(description, dict):
        raise _unreadable(path, 'it is no table')
    return description


def _unreadable(path: Path, problem: str) -> RecordingError:
    return RecordingError(
        path, f'its {METADATA_FILE} cannot be read ({problem})', recover_hint(path)
    )
