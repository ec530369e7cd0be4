# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Round trips per second in lockstep, against a bare ping-pong of two rclpy nodes."""

from contextlib import ExitStack

import numpy as np

from benchmarks.node.process import Helper, Lane, Process
from benchmarks.outcome import Outcome, Row, spread
from benchmarks.sizes import Sizes

DRIVE = 'the node and its LockstepClient'
BARE = 'bare ping-pong, with all messages of the node'
OTHERS = {
    DRIVE: (Process, ('-m', 'stickslip_ros.ros.node'), ('-p', 'sim.lockstep:=true')),
    BARE: (Helper, ('-m', 'benchmarks.node.bare_loop', '--granted'), ()),
}
"""What is controlled: its kind of process, and its words before and behind those for ROS."""


def run(sizes: Sizes) -> Outcome:
    """Compare the round trips."""
    with ExitStack() as stack:
        controllers = [_controller(stack, name) for name in OTHERS]
        rates = np.array(
            [
                [controller.ask('rate', seconds=sizes.lockstep_s) for controller in controllers]
                for _ in range(sizes.node_rounds)
            ]
        ).T
    rows: list[Row] = [
        {
            'program': name,
            'round_trips_per_s': float(np.median(its)),
            **spread('node_over_this', rates[0] / its),
        }
        for name, its in zip(OTHERS, rates, strict=True)
    ]
    return Outcome(
        'Lockstep: round trips per second, one block of 1 ms each, between two processes',
        rows,
        [
            (
                f'{sizes.node_rounds} turns of {sizes.lockstep_s:g} s; a round trip is a position '
                'one way and a grant the other; ratio: round trips per second of the node over '
                'those of this pair'
            ),
            'the node also publishes force, voltage and trace; 1000 round trips/s are real time',
        ],
    )


def _controller(stack: ExitStack, name: str) -> Helper:
    """Start both processes, which end with the stack; return the one that controls."""
    lane = Lane()
    bare = ['--bare'] * (name == BARE)
    controller = Helper(['-m', 'benchmarks.node.controller', *bare, *lane.ros_arguments], lane)
    stack.callback(controller.close)
    kind, before, behind = OTHERS[name]
    other = kind([*before, *lane.ros_arguments, *behind], lane)
    stack.callback(other.close)
    return controller
