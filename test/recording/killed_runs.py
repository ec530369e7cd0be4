# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Records runs of the bench in child processes and kills each at a random message.

Started by test_kill.py with a folder; prints one JSON line per run. Importing and compiling is
done once, before the children are forked.

"""

import json
import os
import random
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

from stickslip_ros.instrument.commands import Request
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.run import ReportingBench, RunWriter

FORMS: tuple[dict[str, object], ...] = (
    {},
    {'record.compression': 'none'},
    {'record.compression': 'lz4', 'record.format': 'bag'},
    {'record.format': 'bag', 'record.split_duration': 0.15},
)
PACES = ('real time', 'fast', 'pausing')
RUNS = len(FORMS) * len(PACES)
TICKS = 6000
SECURED_MAX = 3000  # messages on the disk after which a run is killed


def parameters_of(number: int) -> Parameters:
    """Return the stand of a run: the same number, the same bytes."""
    values = {'record.flush_period': 0.1, 'sim.seed': number}
    return Parameters().updated({**values, **FORMS[number % len(FORMS)]})


def record(
    path: Path, parameters: Parameters, pace: str, ticks: int, tell: Callable[[int], object]
) -> None:
    """Record a run, and tell after each tick how many messages are on the disk."""
    start_s = time.monotonic()
    with RunWriter(path, parameters, wait=True) as writer:
        run = ReportingBench(parameters, writer=writer)
        run.accept(Request('sawtooth', (200.0, 500.0, 0.0)))
        for tick in range(ticks):
            run.update(run.bench.time_ns + parameters.block_ns)
            tell(writer.recorder.secured)
            if pace == 'real time':
                time.sleep(max(0.0, start_s + tick * 1e-3 - time.monotonic()))
            while pace == 'pausing' and tick % 40 == 39 and writer.recorder.queued:
                time.sleep(0.01)


def killed(number: int, path: Path) -> dict[str, object]:
    """Record a run, kill it, and return how many messages were on the disk before."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        # What the system was handed survives a kill; a busy disk would only hold the writer up.
        os.fsync = lambda fd: None
        pace = PACES[number % len(PACES)]
        record(path, parameters_of(number), pace, TICKS, lambda n: os.write(writing, b'%d\n' % n))
        os._exit(0)
    os.close(writing)
    enough, secured = random.Random(number).randrange(1, SECURED_MAX), 0
    with os.fdopen(reading) as told:
        while secured < enough and (line := told.readline()):
            secured = int(line)
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    is_killed = os.WIFSIGNALED(status)
    return {'number': number, 'path': str(path), 'killed': is_killed, 'secured': secured}


if __name__ == '__main__':
    folder = Path(sys.argv[1])
    record(folder / 'warm.mcap', parameters_of(0), 'fast', 2, lambda _: None)
    for run in range(RUNS):
        sys.stdout.write(json.dumps(killed(run, folder / f'run{run}.mcap')) + '\n')
