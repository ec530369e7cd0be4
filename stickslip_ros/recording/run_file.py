# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The file of a run: its name and its metadata."""

import json
import pickle
import platform
from collections.abc import Callable, Mapping
from datetime import datetime, timezone
from functools import lru_cache, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numba
import numpy as np
import yaml

import stickslip_ros
from stickslip_ros.budget import load_json
from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.extras import load_extra
from stickslip_ros.files import read_bytes
from stickslip_ros.instrument.reports import Status, trace_columns
from stickslip_ros.interface.channels import Channel, name_in_file
from stickslip_ros.interface.requests import NOTES
from stickslip_ros.interface.topics import TOPICS
from stickslip_ros.parameters import Parameters, dump_yaml, specs
from stickslip_ros.recording.layout import SUFFIX, TIME_MAX_NS, FileForm
from stickslip_ros.sources import sources_digest

if TYPE_CHECKING:
    from stickslip_ros.recording.recorder import Recorder

SOURCES = 'sources'  # entry of the metadata of a run: digest of the sources that computed it
TIME_ORIGIN = 'time_origin_ns'
"""Entry of the metadata of a run and of ``~/info``: the time origin, ns; stamps and log times are
this plus simulated time."""
RUN_RECORD = 'stickslip_run'
"""Name of the metadata record of a run; it alone holds wall-clock time."""
TOPICS_RECORD = 'stickslip_topics'
"""Name of the metadata record with the recorded name and quality of service of each topic of
docs/reference/interface.md, as JSON by its name in files; only in a run with its requests."""
PARAMETERS_FILE = 'parameters.yaml'  # name of the attachment with every parameter
CHECKPOINT_FILE = 'checkpoint.bin'
"""Name of the attachment with the initial state of a recording, unless it is rest."""
EXPERIMENT_FILE = 'experiment.csv'
"""Name of the attachment with the experiment of a recording."""
NAME_MAX_BYTES = 200
"""Leaves room for the number of a part, ``.recovered`` and the suffix within the usual 255."""
_Function = TypeVar('_Function', bound=Callable[..., Any])
STANDS_KEPT = 8  # stands whose texts at the start of a recording are cached
WALL_TIME = '%Y-%m-%dT%H:%M:%S.%fZ'


def _kept_per_stand(function: _Function) -> _Function:
    """Cache a function of a stand; tell -0.0 from 0.0, which are equal but print differently."""

    @lru_cache(maxsize=STANDS_KEPT)
    def kept(parameters: Parameters, _exactly: bytes, *rest: Any) -> Any:
        return function(parameters, *rest)

    @wraps(function)
    def call(parameters: Parameters, *rest: Any) -> Any:
        return kept(parameters, pickle.dumps(tuple(parameters.flat().values())), *rest)

    return cast('_Function', call)


@_kept_per_stand
def info_json(parameters: Parameters, time_origin_ns: int) -> str:
    """Return the text of ``~/info``: parameters, units, versions, time origin."""
    return json.dumps(
        {
            'versions': versions(),
            TIME_ORIGIN: time_origin_ns,
            'parameters': parameters.flat(),
            'units': {name: spec.unit for name, spec in specs().items() if spec.unit},
            'trace_columns': trace_columns(parameters),
            'status_bits': {f'0x{bit:08x}': bit.text for bit in Status},
        }
    )


def to_time_ns(value: object) -> int:
    """Return a time from a file, a whole number of ns; ValueError for anything else."""
    time_ns = int(str(value))
    if not 0 <= time_ns <= TIME_MAX_NS:
        raise ValueError(f'{value} ns is outside of 0 to {TIME_MAX_NS} ns')
    return time_ns


Records = dict[str, dict[str, str]]


def run_from_info(topic: str, text: str) -> tuple[Records, dict[str, tuple[str, bytes]]] | None:
    """Return metadata and parameters from ``~/info``; None for other programs' topics."""
    try:
        info = load_json(text)
        flat = dict(info['parameters'])
        run = {name: str(each) for name, each in info['versions'].items()}
        run |= {'seed': str(flat['sim.seed']), 'dt_s': repr(flat['sim.dt'])}
        run |= {TIME_ORIGIN: str(to_time_ns(info[TIME_ORIGIN]))}
        written = yaml.safe_dump({'/**': {'ros__parameters': flat}}).encode()
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None  # another program's topic
    namespace, _, node = topic.removesuffix('/info').rpartition('/')
    topics = {
        name_in_file(each.key): json.dumps(
            {'topic': each.full_name(namespace or '/', node), **vars(each.qos)}
        )
        for each in TOPICS
        if each.recorded
    }
    attachments = {PARAMETERS_FILE: ('application/yaml', written)}
    return {RUN_RECORD: run, TOPICS_RECORD: topics}, attachments


def versions() -> dict[str, str]:
    """Return the versions of the packages on which the numbers of a run depend."""
    return {
        'stickslip_ros': stickslip_ros.__version__,
        'python': platform.python_version(),
        'machine': platform.machine(),
        **{each.__name__: each.__version__ for each in (np, numba)},
    }


def run_path(parameters: Parameters, namespace: str = '') -> Path:
    """Return the path of a new recording, named as requested or by date, time and namespace."""
    name = parameters.record.name
    if not name:
        drive = namespace.rstrip('/').replace('/', '_')
        name = f'run_{datetime.now(timezone.utc):%Y%m%dT%H%M%S_%f}{drive}'
    problems = {
        'it contains a separator of folders': '/' in name or '\\' in name,
        'it contains a character that cannot be printed': not name.isprintable(),
        'it begins with a dot, a dash or a space': name[:1] in '.- ',
        'it ends with a dot or a space': name[-1:] in '. ',
        f'it is longer than {NAME_MAX_BYTES} bytes': (
            len(name.encode(errors='surrogatepass')) > NAME_MAX_BYTES
        ),
    }
    for problem, applies in problems.items():
        if applies:
            limit = f'not a plain file name: {problem}'
            raise OutOfRange('record.name', name, '', limit, 'give a name such as run_7')
    return Path(parameters.record.directory) / f'{name.removesuffix(SUFFIX)}{SUFFIX}'


def save_checkpoint(checkpoint: bytes, parameters: Parameters) -> Path:
    """Write a checkpoint, named by date and time, to the recordings' folder; return its path."""
    folder = Path(parameters.record.directory)
    path = folder / f'checkpoint_{datetime.now(timezone.utc):%Y%m%dT%H%M%S_%f}.bin'
    try:
        folder.mkdir(parents=True, exist_ok=True)
        path.write_bytes(checkpoint)
    except OSError as error:
        problem = f'cannot be written ({error.strerror})'
        raise RecordingError(path, problem, 'change record.directory') from None
    return path


@_kept_per_stand
def _parameters_file(parameters: Parameters) -> bytes:
    return dump_yaml(parameters, 'Parameters of the recorded run; SI units.').encode()


@lru_cache(maxsize=STANDS_KEPT)
def _topics_record(channels: tuple[tuple[str, Channel], ...]) -> dict[str, str]:
    """Return name and quality of service of each topic, as in the file; cached: do not change."""
    return {
        name_in_file(key): json.dumps({'topic': channel.topic, **vars(channel.qos)})
        for key, channel in channels
    }


def open_recorder(
    path: Path,
    parameters: Parameters,
    channels: Mapping[str, Channel],
    time_origin_ns: int = 0,
    *,
    synced: bool = True,
) -> 'Recorder':
    """Start the recording of a run with its parameters and channels."""
    mcap = load_extra('a recording', 'mcap')
    from stickslip_ros.recording.recorder import Recorder  # noqa: PLC0415 - it needs mcap

    run = {
        **versions(),
        'mcap': mcap.__version__,
        SOURCES: sources_digest(),
        'seed': str(parameters.sim.seed),
        'dt_s': repr(parameters.sim.dt),
        TIME_ORIGIN: str(time_origin_ns),
        'wall_start': datetime.now(timezone.utc).strftime(WALL_TIME),
    }
    experiment = {}
    if parameters.record.experiment:
        content = read_bytes(Path(parameters.record.experiment), 'check record.experiment')
        experiment[EXPERIMENT_FILE] = ('text/csv', content)
    record = parameters.record
    for name, value, unit, least_name, least in (
        ('split_size', record.split_size, 'B', 'chunk_size', record.chunk_size),
        ('split_duration', record.split_duration, 's', 'flush_period', record.flush_period),
    ):
        if 0 < value < least:
            limit = f'below record.{least_name} {least:g} {unit}'
            hint = f'raise it, lower record.{least_name}, or give 0 to never split'
            raise OutOfRange(f'record.{name}', value, unit, limit, hint)
    topics = {TOPICS_RECORD: _topics_record(tuple(channels.items()))} if NOTES in channels else {}
    in_parts = record.split_size > 0 or record.split_duration > 0.0
    if record.keep_parts and not in_parts:
        limit = 'not possible for a run in one part'
        hint = 'give record.split_size or record.split_duration, or 0 to keep all'
        raise OutOfRange('record.keep_parts', record.keep_parts, '', limit, hint)
    return Recorder(
        path,
        channels,
        metadata={RUN_RECORD: run, **topics},
        attachments={
            PARAMETERS_FILE: ('application/yaml', _parameters_file(parameters)),
            **experiment,
        },
        form=FileForm(
            compression=record.compression,
            chunk_size_bytes=record.chunk_size,
            flush_period_s=record.flush_period,
            in_parts=in_parts,
            keep_parts=record.keep_parts,
            bag=record.format == 'bag',
            synced=synced,
        ),
        queue_length=parameters.record.queue_length,
        kept={topic.key for topic in TOPICS if not topic.pace},
    )
