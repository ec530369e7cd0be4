# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip replay``: run a recording or a measured voltage on the virtual stand."""

import argparse
import dataclasses
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from stickslip_ros.errors import WrongKind, printable
from stickslip_ros.files import prepare_output
from stickslip_ros.lab.cli.chosen import chosen_values
from stickslip_ros.lab.cli.experiment import chosen_reading
from stickslip_ros.lab.cli.printing import CHECK_FAILED, Answer
from stickslip_ros.lab.runs.replay import Replay, read_drive_input, replay, replay_input
from stickslip_ros.parameters import Parameters
from stickslip_ros.progress import shown_progress
from stickslip_ros.recording.integrity import is_recording
from stickslip_ros.sections import Section, as_json
from stickslip_ros.units import MN, NM


def replay_verb(arguments: argparse.Namespace) -> Answer:
    """Replay into the output, or into a temporary file."""
    kept = arguments.output
    if kept:
        prepare_output(kept, is_new=True)
        result = _replay(arguments, kept)
    else:
        with tempfile.TemporaryDirectory() as folder:
            result = _replay(arguments, Path(folder) / 'replay.mcap')
    content = {**as_json(result), 'output': str(kept or '')}
    is_same_run = not result.changed and not arguments.from_rest
    status = CHECK_FAILED if is_same_run and result.identical is False else 0
    return Answer(content, _parts(result, str(kept or 'not kept')), status)


def _replay(arguments: argparse.Namespace, output: Path) -> Replay:
    changes = chosen_values(arguments)
    with shown_progress('simulated ms', quiet=arguments.json) as progress:

        def show(now_ns: int, end_ns: int) -> None:
            progress(now_ns // 1_000_000, end_ns // 1_000_000)

        reading = chosen_reading(arguments, [arguments.file])
        if not reading.headers and is_recording(arguments.file):
            return replay(
                arguments.file, output, changes, from_rest=arguments.from_rest, progress=show
            )
        if arguments.output is None:
            raise WrongKind('--output', 'nothing', 'a file', 'name the recording to write with -o')
        stand = Parameters().updated(changes)
        given = read_drive_input(arguments.file, stand, reading)
        from stickslip_ros.lab.experiments.reading import played  # noqa: PLC0415 - needs scipy

        voltage = played(given, stand)
        for line in voltage.notes:
            print(printable(f'drive   {line}'), file=sys.stderr)
        time_s, voltage_v = voltage.rows.T
        as_played = dataclasses.replace(given, time_s=time_s, voltage_v=voltage_v)
        return replay_input(as_played, output, stand, progress=show)


def _parts(result: Replay, output: str) -> Iterator[Section | str]:
    rows = [
        ('requests carried out again', result.requests),
        ('simulated time', f'{result.simulated_s:g} s'),
        ('position at the end', f'{result.position_m * NM:.3f} nm'),
        ('force at the end', f'{result.force_n * MN:.4f} mN'),
        ('SHA-256 of the data', result.digest[:16] + '...'),
        ('recording', output),
        *((f'changed {name}', value) for name, value in result.changed.items()),
    ]
    yield Section(f'replay of {result.source}', rows)
    if result.apart_m is not None:
        text = 'the bag holds no state, so the run began at rest; its position readings differ by '
        yield text + f'{result.apart_m * NM:.3g} nm RMS'
    if result.identical:
        yield 'every message is identical, byte for byte'
    elif result.changed:
        yield f'compare them with: stickslip compare {result.source} {output}'
    elif result.difference is not None:
        where = result.difference
        yield (
            f'the data differ from message {where.message} on: {where.what} of {where.topic} '
            f'at {where.time_s:g} s'
        )
        if result.other_sources:
            yield 'the recording was computed by other sources, which may round differently'
