# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""How much work a benchmark does: enough to measure, or just enough to run."""

from dataclasses import dataclass

from stickslip_ros.units import MICRO


@dataclass(frozen=True)
class Sizes:
    """How long and how often the programs run."""

    cycles: int = 200  # of the standard case
    rounds: int = 9  # turns A B A B ... over which medians are taken
    least_s: float = 0.03  # of one turn of one program: quick ones are repeated; 0 repeats none
    converged_s: float = 0.25 * MICRO  # longest step of the run that others are measured against
    steps_s: tuple[float, ...] = tuple(x * MICRO for x in (1, 2.5, 5, 10, 12, 14, 16, 18, 20))
    # what the paper's algorithm is tried with: springs of a contact, time steps, steps in a fall
    springs: tuple[int, ...] = (30, 40, 50, 60, 70, 80, 100, 120)
    rival_steps_s: tuple[float, ...] = tuple(
        x * MICRO for x in (1, 1.2, 1.5, 1.75, 2, 2.25, 2.5, 3, 4)
    )
    fall_steps: tuple[int, ...] = (4, 8, 16)
    cold: bool = True  # whether kernels are compiled in a fresh process
    node_rounds: int = 3  # turns of the node and of bare loops
    settle_s: float = 0.4  # before such a turn is measured
    turn_s: float = 2.0
    lockstep_s: float = 0.5  # of a turn of round trips
    recorded_s: tuple[float, float] = (20.0, 60.0)  # recordings whose memory is measured
    stands: int = 60  # random ones of each kind, of which the errors are bounded


FULL = Sizes()
TINY = Sizes(
    cycles=20,
    rounds=1,
    least_s=0.0,
    converged_s=1.0 * MICRO,
    steps_s=(5 * MICRO, 16 * MICRO),
    springs=(80,),
    rival_steps_s=(1.5 * MICRO,),
    fall_steps=(8,),
    cold=False,
    node_rounds=1,
    settle_s=0.05,
    turn_s=0.2,
    lockstep_s=0.1,
    recorded_s=(0.1, 0.3),
    stands=2,
)
