# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Checkpoints of which one value is wrong, their SHA-256 right: each is refused in a line, or runs.

As a program it tries those that are left of one drive, each in a line before and after: a process
of its own, so that a kernel that reads beyond its arrays ends that one only.

"""

import base64
import hashlib
import json
import signal
import sys
import zlib
from array import array
from collections.abc import Callable, Iterator, Mapping
from copy import copy
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from processes import run_process

from stickslip_ros.drive.records import FOOT, STATE, TIME
from stickslip_ros.errors import StickSlipError
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.joints import Joints
from stickslip_ros.instrument.sensing import CLASSES
from stickslip_ros.instrument.state_tree import COUNTS, LARGEST, WHOLE, without_gaps
from stickslip_ros.kernels.record import FLOAT
from stickslip_ros.parameters import Parameters, load_yaml
from stickslip_ros.recording.run import ReportingBench

HANGS_S = 60.0
"""Processor time after which a case ends the process."""
BLOCKS = 3
CONFIG = Path(__file__).parents[1] / 'config'
WAVEFORM = array('d', (0.0, 20.0, 1.37e-3, 113.76725643485543, 7.7e-3, 20.0))
DEAD_FOOT = Request('fault', settings=(('fault.dead_foot', 2), ('fault.missed_steps', 0.3)))
DELAY = Request('fault', settings=(('fault.command_delay', 5e-3),))
DRIVES: Mapping[str, tuple[Mapping[str, Any] | None, tuple[Request, ...]]] = {
    'sawtooth': ({}, (Request('sawtooth', (113.8, 1153.4, 0.0)),)),
    'closed loop': (None, (Request('position', (9e-6, 0.0, 0.0)),)),
    'feet apart': (None, (DEAD_FOOT, Request('joint', joints=Joints((), (), (5e-5,))))),
    'springs': ({}, (Request('preload', (0.31415,)), Request('steps', (7.0,)))),
    'travelling': (
        {'contact.profile': 'rough_line', 'contact.travel': 1.0},
        (Request('sawtooth', (280.0, 1153.4, 0.0)),),
    ),
    'ageing': ({'contact.friction_ageing': 0.01}, (Request('steps', (7.0,)),)),
    'walker': (
        {'feet.count': (3, 3), 'feet.share': 0.5, 'feet.delay': (0.0, 3.1e-4)},
        (Request('sawtooth', (113.8, 1153.4, 0.0)),),
    ),
    'table': ({'contact.law': 'lugre'}, (Request('waveform', WAVEFORM, cycles=0),)),
    'delayed': (
        {'interferometer.random_walk': 1e-9, 'interferometer.latency': 2.3e-3},
        (DELAY, Request('waveform', WAVEFORM), Request('joint', joints=Joints((), (1e-6,)))),
    ),
}
"""Parameters, None for those of the realistic stand, and commands under way when it is saved."""
LATER = (
    (),
    (Request('preload', (0.25,)),),
    (Request('fault', settings=(('fault.dead_foot', 3),)), Request('steps', (5.0,))),
    (Request('zero_position'), Request('reset')),
)
"""What is asked of a drive that has not been refused."""
TINY = 5e-324
SINGLES: tuple[Any, ...] = (
    0, 1, -1, 2**31, WHOLE[-1], WHOLE[-1] + 1, 2**63 - 1, 10**17, 10**17 + 1, 10**400, 0.0,
    TINY, LARGEST, -LARGEST, 1e300, float('nan'), float('inf'), -float('inf'),
    None, True, '', 'x', [], {}, [[]],
)  # fmt: skip
FLOATS = (0.0, -1.0, TINY, LARGEST, -LARGEST, 1e300, float('nan'), float('inf'))
ARRAYS = {
    **dict.fromkeys(('past_m', 'rows', 'pending'), FLOAT),
    'states': STATE,
    **{f'{name}.memory': each.KIND['memory'] for name, each in CLASSES.items()},
}
"""Kinds of the arrays by the ends of their places."""

Content = dict[str, Any]
Make = Callable[[], Any]


def checkpoint_of(drive: str) -> bytes:
    """Return a checkpoint of a drive."""
    values, requests = DRIVES[drive]
    realistic = load_yaml(CONFIG / 'realistic.yaml')
    run = ReportingBench(realistic if values is None else Parameters().updated(values))
    run.update(run.bench.parameters.block_ns)
    for request in requests:
        run.accept(request)
    for _ in range(BLOCKS):
        run.update(run.bench.time_ns + run.bench.parameters.block_ns)
    run.accept(Request('tare_force'))
    return run.save()


def content_of(data: bytes) -> Content:
    """Return what a checkpoint says."""
    content: Content = json.loads(zlib.decompress(data.partition(b'\n')[2]))
    return content


def with_content(data: bytes, content: object) -> bytes:
    """Return a checkpoint with another content, which a text may be, and its SHA-256."""
    text = content if isinstance(content, bytes) else json.dumps(content).encode()
    body = zlib.compress(text, 1)
    head = json.loads(data.partition(b'\n')[0])
    head['sha256'] = hashlib.sha256(body).hexdigest()
    return json.dumps(head).encode() + b'\n' + body


def wrong_contents(content: Content) -> Iterator[tuple[str, Make]]:
    """Yield what one other value changes, and a function that makes the content with it."""
    for part in ('state', 'attached', 'parameters'):
        for name, make in _changed(part, content[part]):
            yield f'{part}{name}', partial(_replaced, content, part, make)


def _replaced(tree: Any, key: Any, make: Make) -> Any:
    changed = tree.copy()
    changed[key] = make()
    return changed


def with_value(data: bytes, place: str, value: Any) -> bytes:
    """Return a checkpoint with another value at a place: names, and the number of an element."""
    end = next((end for end in ARRAYS if f'.{end}' in place), None)
    before, _, field = place.partition(f'.{end}') if end else (place, '', '')
    *names, last = (before + (f'.{end}' if end else '')).split('.')
    content = tree = content_of(data)
    for name in names:
        tree = tree[name]
    for told, offset, form, _ in (
        _fields('', without_gaps(np.dtype(ARRAYS[end])), 0) if end else ()
    ):
        if told == field:
            value = _with_field(tree[last], offset, form, value)
    tree[last] = value
    return with_content(data, content)


def _with_field(text: str, offset: int, form: Any, value: Any) -> str:
    changed = bytearray(base64.b64decode(text))
    field = np.array(value, 'u1' if form == np.bool_ else form).tobytes()
    changed[offset : offset + len(field)] = field
    return base64.b64encode(changed).decode()


def _changed(place: str, tree: Any) -> Iterator[tuple[str, Make]]:
    for end, kind in ARRAYS.items():
        if isinstance(tree, str) and f'.{place}'.endswith(f'.{end}'):
            yield from _changed_array(tree, without_gaps(np.dtype(kind)))
    for value in SINGLES:
        yield f' = {value!r:.20}', partial(copy, value)
    if isinstance(tree, dict):
        yield ' + one', partial(dict, tree, one=0)
        for name, each in tree.items():
            yield f'.{name} left out', partial(_without, tree, name)
            for told, make in _changed(f'{place}.{name}', each):
                yield f'.{name}{told}', partial(_replaced, tree, name, make)
    elif isinstance(tree, list):
        for i, each in enumerate(tree):
            for told, make in _changed(place, each):
                yield f'[{i}]{told}', partial(_replaced, tree, i, make)


def _without(tree: Content, name: str) -> Content:
    return {key: value for key, value in tree.items() if key != name}


def _changed_array(text: str, kind: Any) -> Iterator[tuple[str, Make]]:
    data = base64.b64decode(text)
    yield ' is cut', lambda: base64.b64encode(data[:-8]).decode()
    yield ' is longer', lambda: base64.b64encode(data + bytes(8)).decode()
    for told, offset, form, limit in _fields('', kind, 0):
        values: tuple[Any, ...] = FLOATS
        if form == np.bool_:
            values = (0, 1, 2, 255)
        elif form == np.int64:
            values = (0, -1, limit, limit + 1, 2**31, 2**63 - 1)
        for value in values if offset < len(data) else ():
            yield f'{told} = {value!r}', partial(_with_field, text, offset, form, value)


def _fields(name: str, kind: Any, offset: int) -> Iterator[tuple[str, int, Any, int]]:
    """Yield every field of a record, of an array the first and the last: name, place, kind."""
    if kind.subdtype is not None:
        base, shape = kind.subdtype
        count = int(np.prod(shape))
        for i in {0, count - 1}:
            yield from _fields(f'{name}[{i}]', base, offset + i * base.itemsize)
    elif kind.names is None:
        yield name, offset, kind, COUNTS.get(name.rpartition('.')[2].partition('[')[0], 0)
    else:
        for each in kind.names:
            form, place = kind.fields[each][:2]
            yield from _fields(f'{name}.{each}', form, offset + place)


def outcome_of(data: bytes) -> str:
    """Return 'ran', or the line with which a checkpoint, or the run from it, was refused."""
    try:
        run = ReportingBench(Parameters(), bench=Bench.restore(data))
        for requests in LATER:
            for request in requests:
                run.accept(request)
            for _ in range(BLOCKS):
                output = run.update(run.bench.time_ns + run.bench.parameters.block_ns)
                readings = output.readings
                truth = readings.truth_position_m, readings.truth_force_n, readings.voltage_v
                assert np.isfinite(readings.trace[:, TIME : FOOT + 1]).all(), 'trace not finite'
                assert np.isfinite(truth).all(), 'truth not finite'
                assert not np.isinf(readings.trace).any(), 'infinite readings'
                assert run.bench.ledger
        Bench.restore(run.save())
    except StickSlipError as error:
        line = str(error)
        assert '\n' not in line, line
        return f'refused: {line}'
    return 'ran'


def failures_of(drive: str, first: int, every: int) -> Iterator[str]:
    """Try wrong checkpoints of a drive, of so many one; yield what each that fails came to."""
    following: int | None = first
    while following is not None:
        command = [sys.executable, __file__, drive, str(following), str(every)]
        process = run_process(command)
        lines = [line for line in process.stdout.splitlines() if not line.startswith(' ')]
        yield from (line for line in lines if 'FAILED' in line)
        last, following = lines[-1] if lines else 'nothing', None
        if last != 'done':
            yield f'{last} ENDED with {process.returncode} {process.stderr[-500:]}'
            following = int(last.split()[0]) + every if last[0].isdigit() else None


def main() -> None:
    """Try the wrong checkpoints of a drive from a number on, of so many one."""
    drive, first, every = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    data = checkpoint_of(drive)
    assert outcome_of(data) == 'ran'
    content = content_of(data)
    for number, (told, make) in enumerate(wrong_contents(content)):
        if number < first or (number - first) % every:
            continue
        print(number, drive, told, flush=True)
        signal.setitimer(signal.ITIMER_PROF, HANGS_S)
        try:
            print(f'  {outcome_of(with_content(data, make()))}', flush=True)
        except Exception as error:  # noqa: BLE001 - what a file must not cause
            print(f'{number} {drive} {told} FAILED: {error!r}', flush=True)
    print('done')


if __name__ == '__main__':
    main()
