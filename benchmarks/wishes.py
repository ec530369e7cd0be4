"""The table at the top of the README: a row per wish of a user, from the kept results."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

Row = Mapping[str, Any]


class Wish(NamedTuple):
    """What a user wants, the rows of a benchmark that answer, and how they are compared."""

    what: str
    benchmark: str
    ours: dict[str, str]
    """Cells that tell our row."""
    column: str
    """What is shown of both rows, unless a number of its own stands for the limit."""
    unit: str
    rival: dict[str, str]
    said: str
    ratio: Callable[[Row, Row], float]
    """Time or cost of ours over that of the other: of the two rows."""


def told(column: str) -> Callable[[Row, Row], float]:
    """Take the ratio that stands in the row of the other."""
    return lambda _, other: other[column]


def inverse(column: str) -> Callable[[Row, Row], float]:
    """Take one over the ratio that stands in the row of the other."""
    return lambda _, other: 1.0 / other[column]


def over(column: str) -> Callable[[Row, Row], float]:
    """Divide what both rows have in a column."""
    return lambda ours, other: ours[column] / other[column]


def own(column: str) -> Callable[[Row, Row], float]:
    """Take the ratio that stands in our row."""
    return lambda ours, _: ours[column]


def slower(ours: Row, other: Row) -> float:
    """Return how much more time ours takes, of rows that tell speeds."""
    return float(other['times_real_time'] / ours['times_real_time'])


X_REAL, OURS = 'times real time', {'program': 'ours'}
COMPILED, SIMD = {'program': 'numba'}, {'program': 'numba, SIMD'}
NODE, KEPT = {'program': 'the node'}, {'program': 'message objects, kept'}
IMPORTS, ROS_IMPORTS = ({'process': f'import {name} and numba'} for name in ('numpy', 'rclpy'))
AS_DRIVE = {'program': 'drive.advance', 'longest_step': '5 us'}
WISHES = (
    Wish('simulate the drive', 'paper', OURS, 'times_real_time', X_REAL,
         COMPILED | {'springs_stepped': 'six contacts, 360'},
         "the paper's algorithm, compiled", inverse('ratio')),
    Wish('the same', 'paper', OURS, 'times_real_time', X_REAL,
         SIMD | {'springs_stepped': 'two groups, half of each, 60'},
         'its shortest form, eight springs an instruction', inverse('ratio')),
    Wish('six rough lines', 'paper-line', OURS, 'times_real_time', X_REAL, SIMD,
         "the paper's algorithm, eight springs an instruction", inverse('ratio')),
    Wish('simulate at the default step', 'c', OURS | {'longest_step': '5 us'}, 'times_real_time',
         X_REAL, {'program': 'C', 'longest_step': '5 us'}, 'our algorithm in C',
         told('ours_over_this')),
    Wish('simulate with sensors', 'speed', {'program': 'simulate, no file'}, 'times_real_time',
         X_REAL, AS_DRIVE, 'the drive alone', slower),
    Wish('simulate and record', 'speed', {'program': 'simulate'}, 'times_real_time', X_REAL,
         AS_DRIVE, 'the drive alone', slower),
    Wish('another friction law', 'lugre', OURS, 'times_real_time', X_REAL,
         {'program': 'scipy LSODA'}, 'LuGre by LSODA of scipy', inverse('ratio')),
    Wish('record', 'node-recording', {'program': 'the node, recording'}, 'cpu_percent',
         '% of a core', NODE, 'the node without', told('recording_over_this')),
    Wish('sweep, preloads shared by 8', 'sweeps', {'sweep': 'one for every 8 cases'},
         'cpu_ms_per_case', 'ms a case', {}, 'the drive alone', own('ratio')),
    Wish('sweep, a preload each', 'sweeps', {'sweep': 'a new preload for every case'},
         'cpu_ms_per_case', 'ms a case', {}, 'the drive alone', own('ratio')),
    Wish('run the node', 'node-cpu', NODE, 'cpu_percent', '% of a core', KEPT,
         'a bare loop that publishes the same', told('node_over_this')),
    Wish('ticks on time', 'node-lateness', NODE, 'mean_us', 'us late', KEPT, 'the same loop',
         told('node_over_this_mean')),
    Wish('command to effect', 'node-latency', NODE, 'median_ms', 'ms',
         {'program': 'bare echo'}, 'a bare echo', told('node_over_this_median')),
    Wish('lockstep', 'node-lockstep', {'program': 'the node and its LockstepClient'},
         'round_trips_per_s', 'round trips a second',
         {'program': 'bare ping-pong, with all messages of the node'}, 'a bare ping-pong',
         inverse('node_over_this')),
    Wish('start, `simulate`', 'start', {'process': 'stickslip simulate, kernels cached'},
         'processor_seconds', 's', IMPORTS, 'import of numpy and numba',
         over('processor_seconds')),
    Wish('start, the node', 'start', {'process': 'node until active, kernels cached'},
         'processor_seconds', 's', ROS_IMPORTS, 'import of rclpy and numba',
         over('processor_seconds')),
    Wish('first start, the node', 'start', {'process': 'node until active, empty cache'},
         'processor_seconds', 's', {'process': 'node until active, kernels cached'},
         'a later start', over('processor_seconds')),
    Wish('search a wave, two workers', 'optimise', {'objective': 'force'}, 'two_workers_per_s',
         'evaluations a second', {}, 'twice one worker',
         lambda ours, _: 1.0 / ours['efficiency']),
    Wish('learn, Gymnasium', 'gym', {'actions': 'voltage', 'program': 'gymnasium.Env.step'},
         'steps_per_s', 'steps a second', {'actions': 'voltage', 'program': 'Bench.update'},
         'the bench alone', own('ratio')),
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
