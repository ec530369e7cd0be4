"""The ``metadata.yaml`` of a bag directory, as rosbag2 of Jazzy and later writes it."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import yaml
from mcap.records import Channel, Schema, Statistics

from stickslip_ros.errors import RecordingError
from stickslip_ros.recording.integrity import open_whole

METADATA_FILE: Final = 'metadata.yaml'
ROOT: Final = 'rosbag2_bagfile_information'
VERSION: Final = 9
"""Of the form of the file; Jazzy and Kilted write this one, and read all earlier ones."""

#: Words of ``rmw/qos_string_conversions.h``, in the order of the numbers of ``rmw/types.h``.
_WORDS: Final = {
    'history': ('system_default', 'keep_last', 'keep_all', 'unknown'),
    'reliability': ('system_default', 'reliable', 'best_effort', 'unknown', 'best_available'),
    'durability': (
        'system_default',
        'transient_local',
        'volatile',
        'unknown',
        'best_available',
    ),
    'liveliness': (
        'system_default',
        'automatic',
        'manual_by_node',
        'manual_by_topic',
        'unknown',
        'best_available',
    ),
}


@dataclass(frozen=True)
class _Part:
    """What a file says of itself in its summary."""

    name: str
    statistics: Statistics
    channels: dict[int, Channel]
    schemas: dict[int, Schema]

    @property
    def start_ns(self) -> int:
        return int(self.statistics.message_start_time)

    @property
    def end_ns(self) -> int:
        return int(self.statistics.message_end_time)

    @property
    def messages(self) -> int:
        return int(self.statistics.message_count)


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
    parts = [_read(path) for path in paths]
    filled = [part for part in parts if part.messages]
    start_ns = min((part.start_ns for part in filled), default=0)
    end_ns = max((part.end_ns for part in filled), default=0)
    return {
        'version': VERSION,
        'storage_identifier': 'mcap',
        'duration': {'nanoseconds': end_ns - start_ns},
        'starting_time': {'nanoseconds_since_epoch': start_ns},
        'message_count': sum(part.messages for part in parts),
        'topics_with_message_count': _topics(parts),
        'compression_format': '',
        'compression_mode': '',
        'relative_file_paths': [part.name for part in parts],
        'files': [_file(part) for part in parts],
        'custom_data': None,
        'ros_distro': os.environ.get('ROS_DISTRO', ''),
    }


def _read(path: Path) -> _Part:
    with open_whole(path) as reader:
        summary = reader.get_summary()
        if summary is None or summary.statistics is None:
            raise RecordingError(path, 'it has no statistics', 'record it anew')
        return _Part(path.name, summary.statistics, summary.channels, summary.schemas)


def _file(part: _Part) -> dict[str, Any]:
    return {
        'path': part.name,
        'starting_time': {'nanoseconds_since_epoch': part.start_ns},
        'duration': {'nanoseconds': part.end_ns - part.start_ns},
        'message_count': part.messages,
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
            'offered_qos_profiles': [_in_words(profile) for profile in profiles],
            'type_description_hash': channel.metadata.get('topic_type_hash', ''),
        },
        'message_count': 0,
    }


def _in_words(profile: dict[str, Any]) -> dict[str, Any]:
    """Give a profile the words that this version of the file asks for."""
    return {key: _word(key, value) for key, value in profile.items()}


def _word(key: str, value: Any) -> Any:
    words = _WORDS.get(key, ())
    is_number = isinstance(value, int) and 0 <= value < len(words)
    return words[value] if is_number else value
