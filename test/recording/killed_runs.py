# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Records runs of the bench in child processes and kills each at a random moment.

Started by test_kill.py with a folder, a seed and a number of runs; prints one JSON line per run.
Importing and compiling is done once, before the children are forked.

"""

import json
import os
import random
import signal
import sys
import time
from pathlib import Path

from stickslip_ros.instrument.commands import Request
from stickslip_ros.interface.feed import Packed
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.run import ReportingBench, RunWriter
from stickslip_ros.units import NS_PER_S

FLUSH_PERIOD_S = 0.1
FORMS: tuple[dict[str, object], ...] = (
    {},
    {'record.compression': 'none'},
    {'record.compression': 'lz4', 'record.format': 'bag'},
    {'record.format': 'bag', 'record.split_duration': 0.15},
)
PACES = ('real time', 'fast', 'pausing')
TICKS = 6000
FIRST = 3
"""Messages that are not published: what is latched, and the command."""
LATEST_S = 1.4
"""After this time each run has been killed; what it waits for a processor does not count."""
PATIENCE_S = 15.0
"""After this time it is killed even if it had none: a full pipe stops it much earlier."""


def parameters_of(number: int) -> Parameters:
    """Return the stand of a run: the same number, the same bytes."""
    values = {'record.flush_period': FLUSH_PERIOD_S, 'sim.seed': number}
    return Parameters().updated({**values, **FORMS[number % len(FORMS)]})


def record(path: Path, parameters: Parameters, pace: str, ticks: int, tell) -> None:
    """Record a run, and tell after each tick how many messages were put and are on the disk."""
    told: list[Packed] = []
    start_s = time.monotonic()
    with RunWriter(path, parameters, wait=True) as writer:
        run = ReportingBench(parameters, told.append, writer)
        run.accept(Request('sawtooth', (200.0, 500.0, 0.0)))
        for tick in range(ticks):
            run.update(run.bench.time_ns + parameters.block_ns)
            put = FIRST + len(told)
            tell(put, writer.recorder.secured)
            if pace == 'real time':
                time.sleep(max(0.0, start_s + tick * 1e-3 - time.monotonic()))
            elif pace == 'pausing' and tick % 40 == 39:
                while writer.recorder.secured < put:
                    time.sleep(0.01)
                    tell(put, writer.recorder.secured)


def waited_ns(pid: int) -> int:
    """Give how long the threads of a process could have run, and had no processor."""
    files = Path(f'/proc/{pid}/task').glob('*/schedstat')
    return sum(int(file.read_text().split()[1]) for file in files)


def _run_child(path: Path, number: int, pace: str, pipe: int) -> None:
    # What the system was handed survives a kill; a busy disk would only hold the writer up.
    os.fsync = lambda fd: None

    def tell(put: int, secured: int) -> None:
        numbers = time.monotonic_ns(), put, secured, waited_ns(os.getpid())
        os.write(pipe, b'%d %d %d %d\n' % numbers)

    record(path, parameters_of(number), pace, TICKS, tell)


def _sleep(child: int, moment_s: float) -> None:
    """Sleep until a child had as much time, without what it waited for a processor."""
    start_ns, before_ns = time.monotonic_ns(), waited_ns(child)
    had_ns = passed_ns = 0
    while had_ns < moment_s * NS_PER_S and passed_ns < PATIENCE_S * NS_PER_S:
        time.sleep(0.001)
        passed_ns = time.monotonic_ns() - start_ns
        had_ns = passed_ns - (waited_ns(child) - before_ns)


def _kill(number: int, path: Path, moment_s: float) -> dict:
    pace = PACES[number % len(PACES)]
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        _run_child(path, number, pace, writing)
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, 'rb') as told:
        lines = [told.readline()]
        _sleep(child, moment_s)
        killed_ns, all_waited_ns = time.monotonic_ns(), waited_ns(child)
        os.kill(child, signal.SIGKILL)
        lines += told.readlines()
    _, status = os.waitpid(child, 0)
    rows = [tuple(map(int, line.split())) for line in lines if line.endswith(b'\n')]
    return {
        'number': number,
        'path': str(path),
        'pace': pace,
        'killed': os.WIFSIGNALED(status),
        'killed_ns': killed_ns,
        'waited_ns': all_waited_ns,
        'rows': rows,
    }


def main(folder: str, seed: str, runs: str) -> None:
    """Kill as many runs as asked for."""
    record(Path(folder) / f'warm_{seed}.mcap', parameters_of(0), 'fast', 2, lambda *_: None)
    moments = random.Random(int(seed))
    for run in range(int(runs)):
        number = int(seed) * int(runs) + run
        path = Path(folder) / f'run{number}.mcap'
        killed = _kill(number, path, moments.uniform(0.02, LATEST_S))
        sys.stdout.write(json.dumps(killed) + '\n')


if __name__ == '__main__':
    main(*sys.argv[1:])
