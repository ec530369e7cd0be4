# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Processor time and lateness of the node at 1 kHz, against bare loops that publish the same."""

from collections.abc import Sequence
from functools import lru_cache, partial

import numpy as np

from benchmarks.node.lateness import summary
from benchmarks.node.programs import BareLoop, Drive, Turn, run_in_turn
from benchmarks.outcome import Outcome, Row, spread
from benchmarks.sizes import Sizes
from stickslip_ros.arrays import Array

DRIVE, KEPT = 'the node', 'message objects, kept'


@lru_cache
def measured(sizes: Sizes) -> dict[str, list[Turn]]:
    """Run all programs in turn; both tables come from this one run."""
    return run_in_turn([partial(Drive, DRIVE), partial(BareLoop, KEPT)], sizes)


def run_cpu(sizes: Sizes) -> Outcome:
    """Compare processor time."""
    turns = measured(sizes)
    ours = np.array([turn.cpu for turn in turns[DRIVE]])
    rows: list[Row] = []
    for name, its in turns.items():
        cpu = np.array([turn.cpu for turn in its])
        rows.append(
            {
                'program': name,
                'messages_per_s': _median([turn.heard['messages_per_s'] for turn in its]),
                'MB_per_s': _median([turn.heard['bytes_per_s'] for turn in its]) * 1e-6,
                'cpu_percent': 100.0 * float(np.median(cpu)),
                **spread('node_over_this', ours / cpu),
            }
        )
    return Outcome(
        'Processor time of the node at 1 kHz, moving, against bare rclpy loops',
        rows,
        [
            (
                f'{sizes.node_rounds} turns of {sizes.turn_s:g} s; position and force at 1 kHz, '
                'joint_states, voltage and trace (50 kS/s) at 100 Hz; user and system time of '
                'the publishing process, 100 percent is one core; another process listens to all '
                'topics'
            ),
            'the bare loops compute nothing: their trace comes from tables made beforehand',
        ],
    )


def run_lateness(sizes: Sizes) -> Outcome:
    """Compare how late ticks begin."""
    turns = measured(sizes)
    by_turn = {name: [summary(turn.windows) for turn in its] for name, its in turns.items()}
    rows: list[Row] = []
    for name, its in by_turn.items():
        whole = summary([window for turn in turns[name] for window in turn.windows])
        ratios = {
            f'node_over_this_{key}': _median(_ratios(by_turn[DRIVE], its, f'{key}_us'))
            for key in ('mean', 'p99', 'max')
        }
        rows.append({'program': name, **whole, **ratios})
    return Outcome(
        'Lateness of ticks at 1 kHz: absolute deadlines and time.sleep in all of them',
        rows,
        [
            'from the same turns as node-cpu; of the node, its own diagnostics',
            'p99: median of those of a second each; overruns: ticks more than a period late',
        ],
    )


def _ratios(ours: Sequence[Row], others: Sequence[Row], key: str) -> list[float]:
    pairs = zip(ours, others, strict=True)
    return [float(our[key]) / float(other[key]) for our, other in pairs]


def _median(values: Sequence[float] | Array) -> float:
    return float(np.median(values))
