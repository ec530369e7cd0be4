# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip info``, ``recover`` and ``plot``: describe, recover and draw a recording."""

import argparse
from collections.abc import Iterator
from itertools import groupby
from typing import Any

from stickslip_ros.files import prepare_output
from stickslip_ros.lab.cli.chosen import chosen_look
from stickslip_ros.lab.cli.printing import CHECK_FAILED, Answer
from stickslip_ros.lab.measurements.recorded import recorded_stand, sections_of
from stickslip_ros.recording.gaps import gaps_of
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recover import Recovery, recover
from stickslip_ros.recording.run_file import PARAMETERS_FILE, RUN_RECORD
from stickslip_ros.sections import Section, as_json
from stickslip_ros.units import NS_PER_S, with_unit


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


def plot_verb(arguments: argparse.Namespace) -> Answer:
    """Draw a recording."""
    # Matplotlib and numba are slow, and the other verbs of this module do not need them.
    from stickslip_ros.lab.figures import plotting  # noqa: PLC0415
    from stickslip_ros.lab.measurements import recorded, run_figure  # noqa: PLC0415
    from stickslip_ros.lab.measurements.recorded_run import Run  # noqa: PLC0415

    picture = arguments.output or arguments.file.parent / f'{arguments.file.stem}.png'
    if arguments.output:
        prepare_output(picture)
    run = Run(arguments.file, topics=arguments.headers or {})
    series = run.series if run.topics else None
    with plotting.looking(**chosen_look(arguments)):
        plot = run_figure.plot_run(run.recording, picture, arguments.window_s, quantities=series)
    content = {'picture': str(picture), **as_json(plot), 'notes': run.recording.notes}
    rows = [
        (
            recorded.RUN_QUANTITIES[each.name],
            each.samples,
            '' if each.smallest is None else with_unit(each.smallest, each.unit),
            '' if each.largest is None else with_unit(each.largest, each.unit),
        )
        for each in plot.quantities
    ]
    title = f'{plot.start_s:.9g} s to {plot.end_s:.9g} s'
    header = 'quantity', 'samples', 'smallest', 'largest'
    parts = [Section(title, rows, header, run.recording.notes)]
    if plot.events:
        runs = (list(group) for _, group in groupby(plot.events, key=lambda each: each[1:]))
        events = [
            (f'{first.time_s:.6f} s', first.command, first.result, 1 + len(others))
            for first, *others in runs
        ]
        parts.append(Section('events', events, ('first at', 'command', 'result', 'in a row')))
    return Answer(content, [*parts, f'picture {picture}'])


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
    topics = [
        (each.topic, each.messages, *_seconds(each.first_ns, each.last_ns), each.gaps)
        for each in recovery.topics
    ]
    header = ('topic', 'messages', 'first (s)', 'last (s)', 'missing')
    yield Section(f'read of {recovery.source}', topics, header)
    losses = [
        (loss.offset, loss.size_bytes, *_seconds(loss.first_ns, loss.last_ns), loss.problem)
        for loss in recovery.losses
    ]
    if losses:
        header = ('at byte', 'bytes', 'first (s)', 'last (s)', 'problem')
        yield Section(
            f'lost: {recovery.lost_bytes} of {recovery.size_bytes} bytes', losses, header
        )
    if recovery.unchecked:
        yield f'{recovery.unchecked} messages are covered by no checksum'
    yield from recovery.notes


def _seconds(*times_ns: int | None) -> list[str]:
    return ['-' if each is None else f'{each / NS_PER_S:.6f}' for each in times_ns]
