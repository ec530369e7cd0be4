# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Three drives in one process: their share of a core, by ``sim.wake``."""

import gc
import time
from contextlib import closing
from types import SimpleNamespace

import numpy as np

from benchmarks.node.process import Helper, Lane, serve
from benchmarks.node.programs import MOVE
from benchmarks.node.spinning import ros, spinning
from benchmarks.outcome import Outcome, Row, spread
from benchmarks.sizes import Sizes
from stickslip_ros.instrument.commands import Request
from stickslip_ros.ros.node import StickSlipDrive
from stickslip_ros.runtime.pacing import wake_in_time

AXES = 'x', 'y', 'z'
WAKES_MS = 0, 5, 20


def run(sizes: Sizes) -> Outcome:
    """Compare wake-ups of one block with longer ones."""
    turns = range(sizes.node_rounds)
    shares = np.array([[_share(wake_ms, sizes) for wake_ms in WAKES_MS] for _ in turns]).T
    rows: list[Row] = [
        {
            'wake_ms': wake_ms,
            'cpu_percent': 100.0 * float(np.median(its)),
            'drives_per_core': len(AXES) / float(np.median(its)),
            **spread('over_one_block', its / shares[0]),
        }
        for wake_ms, its in zip(WAKES_MS, shares, strict=True)
    ]
    return Outcome(
        f'{len(AXES)} ideal drives in one process, stepping, blocks of 1 ms: share of a core',
        rows,
        [f'{len(turns)} turns of {sizes.turn_s:g} s; nobody listens; 0: a block a wake-up'],
    )


def _share(wake_ms: float, sizes: Sizes) -> float:
    """Return the processor seconds per second of a process with the drives."""
    words = ['-m', 'benchmarks.node.axes', '--ros-args', '-p', f'sim.wake:={wake_ms / 1e3}']
    with closing(Helper(words, Lane())) as stage:
        time.sleep(sizes.settle_s)
        begin_s, cpu_s = stage.ask('times')
        time.sleep(sizes.turn_s)
        end_s, end_cpu_s = stage.ask('times')
    return float((end_cpu_s - cpu_s) / (end_s - begin_s))


def main() -> None:
    """Drive until nobody asks any more."""
    wake_in_time()
    with ros():
        drives = [StickSlipDrive(namespace=axis) for axis in AXES]
        for drive in drives:
            drive.session.submit(Request('sawtooth', MOVE))
        gc.freeze()
        with spinning(*drives):
            serve(SimpleNamespace(times=lambda: (time.monotonic(), time.process_time())))


if __name__ == '__main__':
    main()
