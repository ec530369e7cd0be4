# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip info`` and ``recover``: describe and recover a recording."""

import argparse
from collections.abc import Iterator
from typing import Any

from stickslip_ros.lab.cli.printing import CHECK_FAILED, Answer
from stickslip_ros.lab.measurements.recorded import recorded_stand, sections_of
from stickslip_ros.recording.gaps import gaps_of
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recover import Recovery, recover
from stickslip_ros.recording.run_file import PARAMETERS_FILE, RUN_RECORD
from stickslip_ros.sections import Section, as_json


def info_verb(arguments: argparse.Namespace) -> Answer:
    """Describe a recording."""
    recording = Recording(arguments.file)
    return Answer(describe_recording(recording), sections_of(recording))


def describe_recording(recording: Recording) -> dict[str, Any]:
    """Return topics, changed parameters (None: unknown), metadata and attachments."""
    changed: dict[str, Any] | None = None
    if PARAMETERS_FILE in recording.attachments:
        changed = recorded_stand(recording).changed()
    return {
        'topics': [
            {**as_json(channel), 'rate_hz': channel.rate_hz} for channel in recording.channels
        ],
        'notes': [*recording.notes, *gaps_of(recording)],
        'changed_parameters': changed,
        'run': recording.metadata.get(RUN_RECORD, {}),
        'attachments': {name: len(data) for name, (_, data) in recording.attachments.items()},
    }


def recover_verb(arguments: argparse.Namespace) -> Answer:
    """Copy the readable part of a recording into a finished recording."""
    recoveries, written = recover(arguments.file, arguments.output)
    end = f'wrote {written}' if written else f'{arguments.file} is whole: nothing was written'
    parts = [part for each in recoveries for part in _recover_parts(each)]
    differ = any(each.counted not in {None, each.messages} for each in recoveries)
    content = {'written': str(written or ''), 'files': recoveries}
    return Answer(content, [*parts, end], CHECK_FAILED if differ else 0)


def _recover_parts(recovery: Recovery) -> Iterator[Section | str]:
    if recovery.is_whole:
        yield f'{recovery.source} is whole: {recovery.messages} messages'
        return
    yield f'read {recovery.messages} messages of {recovery.source}'
    if losses := [(each.offset, each.size_bytes, each.problem) for each in recovery.losses]:
        title = f'lost: {recovery.lost_bytes} of {recovery.size_bytes} bytes'
        yield Section(title, losses, ('at byte', 'bytes', 'problem'))
    if recovery.counted is not None:
        yield f'its statistics count {recovery.counted} messages'
