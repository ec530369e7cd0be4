"""Steps of the Gymnasium environment, against the bench that it steps."""

from functools import partial

import gymnasium
import numpy as np

from benchmarks.clock import Program, in_turn
from benchmarks.outcome import Outcome, Row
from benchmarks.sizes import Sizes
from stickslip_ros.gym import STEPS, VOLTAGE, StickSlipEnv
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request

BLOCKS = 200
NAME = 'stickslip_ros.gym:StickSlip-v0'
REQUESTS = {VOLTAGE: Request('voltage', (150.0,)), STEPS: Request('steps', (1.0,))}


def run(sizes: Sizes) -> Outcome:
    """Blocks per second of the bench alone, and of the environment around it."""
    rows: list[Row] = []
    for actions, action in ((VOLTAGE, np.array([0.5])), (STEPS, 2)):
        env = gymnasium.make(NAME, actions=actions, disable_env_checker=True)
        programs = [
            Program(partial(_update, Bench(StickSlipEnv().parameters), REQUESTS[actions]), BLOCKS),
            Program(partial(_step, env, action), BLOCKS),
        ]
        env.reset(seed=1)
        times = in_turn(programs, sizes)
        rows += [
            {
                'actions': actions,
                'program': program,
                'steps_per_s': 1.0 / times.median(i),
                **times.ratio(i),
            }
            for i, program in enumerate(('Bench.update', 'gymnasium.Env.step'))
        ]
    return Outcome(
        'Steps of the Gymnasium environment: the bench alone',
        rows,
        notes=[f'{BLOCKS} blocks of 1 ms at a time, a command in each'],
    )


def _update(bench: Bench, request: Request) -> None:
    for _ in range(BLOCKS):
        bench.update(bench.time_ns + bench.parameters.block_ns, [request])


def _step(env: 'gymnasium.Env[object, object]', action: object) -> None:
    for _ in range(BLOCKS):
        if env.step(action)[3]:
            env.reset()
