# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Steps of the Gymnasium environment of docs/examples/learn.py, against the bench in it."""

import sys
from functools import partial
from pathlib import Path

import gymnasium
import numpy as np

from benchmarks.clock import Program, in_turn
from benchmarks.outcome import Outcome, Row
from benchmarks.sizes import Sizes
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request

BLOCKS = 200
EXAMPLES = Path(__file__).parents[1] / 'docs' / 'examples'
ACTION, COMMAND = np.array([0.5]), Request('voltage', (150.0,))


def run(sizes: Sizes) -> Outcome:
    """Blocks per second of the bench alone, and of the environment around it."""
    sys.path.append(str(EXAMPLES))
    env = gymnasium.make('learn:StickSlip-v0', disable_env_checker=True)
    programs = [
        Program(partial(_update, Bench(env.get_wrapper_attr('parameters'))), BLOCKS),
        Program(partial(_step, env), BLOCKS),
    ]
    env.reset(seed=1)
    times = in_turn(programs, sizes)
    rows: list[Row] = [
        {'program': program, 'steps_per_s': 1.0 / times.median(i), **times.ratio(i)}
        for i, program in enumerate(('Bench.update', 'gymnasium.Env.step'))
    ]
    return Outcome(
        'Steps of the Gymnasium environment: the bench alone',
        rows,
        notes=[f'{BLOCKS} blocks of 1 ms at a time, a command in each'],
    )


def _update(bench: Bench) -> None:
    for _ in range(BLOCKS):
        bench.update(bench.time_ns + bench.parameters.block_ns, [COMMAND])


def _step(env: 'gymnasium.Env[object, object]') -> None:
    for _ in range(BLOCKS):
        if env.step(ACTION)[3]:
            env.reset()
