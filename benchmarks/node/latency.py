# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""From a command to its effect on the position, against a bare loop that echoes it."""

from contextlib import ExitStack
from typing import Any

import numpy as np

from benchmarks.node.commander import MOVED_M
from benchmarks.node.process import Helper
from benchmarks.node.programs import BareLoop, Drive, Program, opened
from benchmarks.outcome import Outcome, Row
from benchmarks.sizes import Sizes
from stickslip_ros.arrays import Array
from stickslip_ros.units import MILLI, NANO

MODULE = 'benchmarks.node.commander'


def run(sizes: Sizes) -> Outcome:
    """Compare the delays."""
    with ExitStack() as stack:
        makers = [lambda: Drive('the node', moves=False), lambda: BareLoop('bare echo')]
        programs = opened(stack, makers)
        commanders = [_commander(stack, program) for program in programs]
        answers: list[list[dict[str, Any]]] = [[] for _ in programs]
        for number in range(sizes.node_rounds):
            for program, commander, its in zip(programs, commanders, answers, strict=True):
                program.start()
                commands = sizes.commands // sizes.node_rounds
                its.append(commander.ask('measure', commands=commands, seed=number))
                program.stop()
    return Outcome(
        'From command/voltage to the first position message that shows it, blocks of 1 ms',
        [
            _row(program.name, its, answers[0])
            for program, its in zip(programs, answers, strict=True)
        ],
        [],
        [
            (
                'wall-clock time in the process of the operator, from before the publishing to '
                f'the callback of the first position that is {MOVED_M / NANO:g} nm away'
            ),
            (
                'commands come at random phases of the tick: the wait for it is half a block on '
                'average; the bare loop publishes the commanded value at its next tick'
            ),
        ],
    )


def _row(name: str, answers: list[dict[str, Any]], ours: list[dict[str, Any]]) -> Row:
    delays_ms, ours_ms = _delays_ms(answers), _delays_ms(ours)
    median_ms, p99_ms = (float(np.quantile(delays_ms, share)) for share in (0.5, 0.99))
    return {
        'program': name,
        'commands': int(np.count_nonzero(np.isfinite(delays_ms))),
        'without_effect': sum(answer['lost'] for answer in answers),
        'lowest_ms': float(np.min(delays_ms)),
        'median_ms': median_ms,
        'mean_ms': float(np.mean(delays_ms)),
        'p99_ms': p99_ms,
        'highest_ms': float(np.max(delays_ms)),
        'node_over_this_median': float(np.median(ours_ms)) / median_ms,
        'node_over_this_p99': float(np.quantile(ours_ms, 0.99)) / p99_ms,
    }


def _delays_ms(answers: list[dict[str, Any]]) -> Array:
    """Return the delays of all turns; a single nan if no command had an effect."""
    delays_s = np.concatenate([answer['delays_s'] for answer in answers])
    return np.asarray(delays_s if len(delays_s) else [np.nan]) / MILLI


def _commander(stack: ExitStack, program: Program) -> Helper:
    commander = Helper(['-m', MODULE, *program.lane.ros_arguments], program.lane)
    stack.callback(commander.close)
    return commander
