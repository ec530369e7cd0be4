# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The table at the top of the README: a row per wish of a user, from the kept results."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

from benchmarks.memory import VERBS

Row = Mapping[str, Any]


class Wish(NamedTuple):
    """What a user wants, the rows of a benchmark that answer, and how they are compared."""

    what: str
    benchmark: str
    ours: Row  # cells that tell our row
    column: str  # what is shown of both rows
    unit: str
    rival: Row
    said: str
    ratio: Callable[[Row, Row], float]  # of the two rows: time or cost of ours over the other's


def longer(us: Row, it: Row) -> float:
    """Return how much more processor time ours takes."""
    return float(us['processor_seconds'] / it['processor_seconds'])


def slower(us: Row, it: Row) -> float:
    """Return the same of rows that tell speeds."""
    return float(it['times_real_time'] / us['times_real_time'])


X_REAL, OURS = 'times real time', {'program': 'ours'}
COMPILED, SIMD = {'program': 'numba'}, {'program': 'numba, SIMD'}
NODE, KEPT = {'program': 'the node'}, {'program': 'message objects, kept'}
IMPORTS, ROS_IMPORTS = ({'process': f'import {name} and numba'} for name in ('numpy', 'rclpy'))
FIT = {'program': 'stickslip_ros.fit'}
IN_NUMPY, IN_NUMBA = ({'program': f'scipy, springs {how}'} for how in ('in numpy', 'compiled'))
AS_DRIVE = {'program': 'drive.advance', 'longest_step': '5 us'}
WISHES = (
    Wish('simulate the drive', 'paper', OURS, 'times_real_time', X_REAL, COMPILED,
         "the paper's algorithm, compiled", lambda _, it: 1.0 / it['ratio']),
    Wish('the same', 'paper', OURS, 'times_real_time', X_REAL, SIMD,
         'its shortest form, eight springs an instruction', lambda _, it: 1.0 / it['ratio']),
    Wish('six rough lines', 'paper-line', OURS, 'times_real_time', X_REAL, SIMD,
         "the paper's algorithm, eight springs an instruction", lambda _, it: 1.0 / it['ratio']),
    Wish('simulate with sensors', 'speed', {'program': 'simulate, no file'}, 'times_real_time',
         X_REAL, AS_DRIVE, 'the drive alone', slower),
    Wish('simulate and record', 'speed', {'program': 'simulate'}, 'times_real_time', X_REAL,
         AS_DRIVE, 'the drive alone', slower),
    Wish('record', 'node-recording', {'program': 'the node, recording'}, 'cpu_percent',
         '% of a core', NODE, 'the node without', lambda _, it: it['recording_over_this']),
    Wish('sweep, preloads shared by 8', 'sweeps', {'sweep': 'one for every 8 cases'},
         'cpu_ms_per_case', 'ms a case', {}, 'the drive alone', lambda us, _: us['ratio']),
    Wish('sweep, a preload each', 'sweeps', {'sweep': 'a new preload for every case'},
         'cpu_ms_per_case', 'ms a case', {}, 'the drive alone', lambda us, _: us['ratio']),
    Wish('run the node', 'node-cpu', NODE, 'cpu_percent', '% of a core', KEPT,
         'a bare loop that publishes the same', lambda _, it: it['node_over_this']),
    Wish('ticks on time', 'node-lateness', NODE, 'mean_us', 'us late', KEPT, 'the same loop',
         lambda _, it: it['node_over_this_mean']),
    Wish('three axes, `sim.wake` 20 ms', 'node-axes', {'wake_ms': 20}, 'cpu_percent',
         '% of a core', {'wake_ms': 0}, 'a block a wake-up', lambda us, _: us['over_one_block']),
    Wish('lockstep', 'node-lockstep', {'program': 'the node and its LockstepClient'},
         'round_trips_per_s', 'round trips a second',
         {'program': 'bare ping-pong, with all messages of the node'}, 'a bare ping-pong',
         lambda _, it: 1.0 / it['node_over_this']),
    Wish('start, `simulate`', 'start', {'process': 'stickslip simulate, kernels cached'},
         'processor_seconds', 's', IMPORTS, 'import of numpy and numba',
         longer),
    Wish('start, the node', 'start', {'process': 'node until active, kernels cached'},
         'processor_seconds', 's', ROS_IMPORTS, 'import of rclpy and numba',
         longer),
    Wish('first start, the node', 'start', {'process': 'node until active, empty cache'},
         'processor_seconds', 's', {'process': 'node until active, kernels cached'},
         'a later start', longer),
    Wish('fit a trace', 'fit', FIT, 'seconds', 's', IN_NUMPY,
         'scipy on springs in numpy', lambda _, it: 1.0 / it['ratio_to_ours']),
    Wish('the same', 'fit', FIT, 'seconds', 's', IN_NUMBA,
         'scipy on springs compiled by numba, a bare minimum',
         lambda _, it: 1.0 / it['ratio_to_ours']),
    Wish('show a twin', 'twin', {'program': 'Twin.look'}, 'cpu_s_per_s',
         'processor seconds a second', {'program': 'Bench.update'},
         'the bench of a drive', lambda us, _: us['ratio']),
    Wish('fit it each 10 s', 'twin', {'program': 'Twin.fit'}, 'cpu_s_per_s',
         'processor seconds a second', {'program': 'Bench.update'},
         'the bench of a drive', lambda us, _: us['ratio']),
    *(Wish(f'memory of `{verb}`, 60 s', 'memory', {'verb': verb, 'recorded_s': 60.0}, 'peak_mb',
           'MB', {'verb': verb, 'recorded_s': 20.0}, 'that of 20 s', lambda us, _: us['ratio'])
      for verb in VERBS),
)  # fmt: skip


def wishes_of(results: Mapping[str, Any]) -> Iterator[dict[str, str | float]]:
    """Give the rows of the table; a wish whose benchmark was left out is left out."""
    for wish in WISHES:
        rows = results['benchmarks'].get(wish.benchmark, {'rows': []})['rows']
        ours, other = (
            next((row for row in rows if wanted.items() <= row.items()), None)
            for wanted in (wish.ours, wish.rival)
        )
        if ours and other:
            limit: str | float = other[wish.column] if wish.rival else '-'
            yield {
                'wish': wish.what,
                'benchmark': wish.benchmark,
                'ours': ours[wish.column],
                'the other': limit,
                'unit': wish.unit,
                'the other is': wish.said,
                'ours over the other': wish.ratio(ours, other),
            }
