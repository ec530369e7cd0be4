"""How much work a benchmark does: enough to measure, or just enough to run."""

import os
from dataclasses import dataclass

from stickslip_ros.units import MICRO


@dataclass(frozen=True)
class Sizes:
    """
    How long and how often the programs run.

    Attributes
    ----------
    cycles : int
        Cycles of the standard case.
    numpy_cycles, scipy_cycles, octave_cycles : int
        Cycles of the slow rivals, whose times are then normalised per simulated second.
    rounds : int
        Turns A B A B ... over which medians are taken.
    least_s : float
        Least time of one turn of one program; quick ones are repeated. 0 repeats none.
    converged_s : float
        Longest step of the run that others are measured against.
    steps_s : tuple of float
        Longest steps of ours that are tried and shown.
    springs : tuple of int
        Springs per contact that the paper's algorithm is tried with.
    rival_steps_s : tuple of float
        Its time steps.
    fall_steps : tuple of int
        Its steps in one fall.
    tolerances : tuple of float
        Relative tolerances that scipy is tried with.
    scaling : tuple of int
        Numbers of cycles, reversals and springs.
    thread_cycles : int
        Cycles of one job of a thread.
    evaluations : int
        Evaluations of a search for a wave.
    cold : bool
        Whether to compile all kernels in a fresh process.
    node_rounds : int
        Turns of the node and of bare loops.
    settle_s, turn_s : float
        Time before such a turn is measured, and its length.
    others : int
        Processes that compute beside the node where the machine is to be busy.
    commands : int
        Commands whose latency is measured, all turns together.
    lockstep_s : float
        Length of a turn of round trips.
    drift_s, long_drift_s, soak_s : float
        Length of these runs; the last two are run only when asked for.
    sample_s : float
        Time from one reading of the memory to the next.
    real_time : tuple of str
        What gives a program a real-time policy, put before its command. Of `TINY`, words that set
        the ordinary policy: in a test suite, programs of real-time priority would starve the rest.

    """

    cycles: int = 200
    numpy_cycles: int = 10
    scipy_cycles: int = 20
    octave_cycles: int = 2
    rounds: int = 9
    least_s: float = 0.03
    converged_s: float = 0.25 * MICRO
    steps_s: tuple[float, ...] = tuple(x * MICRO for x in (1, 2.5, 5, 10, 12, 14, 16, 18, 20))
    springs: tuple[int, ...] = (30, 40, 50, 60, 70, 80, 100, 120)
    rival_steps_s: tuple[float, ...] = tuple(
        x * MICRO for x in (1, 1.2, 1.5, 1.75, 2, 2.25, 2.5, 3, 4)
    )
    fall_steps: tuple[int, ...] = (4, 8, 16)
    tolerances: tuple[float, ...] = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
    scaling: tuple[int, ...] = (10, 100, 1000, 10_000)
    thread_cycles: int = 20_000
    evaluations: int = 49
    cold: bool = True
    node_rounds: int = 3
    settle_s: float = 0.4
    turn_s: float = 2.0
    others: int = os.cpu_count() or 1
    commands: int = 201
    lockstep_s: float = 0.5
    drift_s: float = 10.0
    long_drift_s: float = 600.0
    soak_s: float = 600.0
    sample_s: float = 10.0
    real_time: tuple[str, ...] = ('chrt', '--fifo', '50')


FULL = Sizes()
TINY = Sizes(
    cycles=20,
    numpy_cycles=2,
    scipy_cycles=3,
    octave_cycles=1,
    rounds=1,
    least_s=0.0,
    converged_s=1.0 * MICRO,
    steps_s=(5 * MICRO, 16 * MICRO),
    springs=(80,),
    rival_steps_s=(1.5 * MICRO,),
    fall_steps=(8,),
    tolerances=(1e-4,),
    scaling=(10, 20),
    thread_cycles=20,
    evaluations=3,
    cold=False,
    node_rounds=1,
    settle_s=0.05,
    turn_s=0.2,
    others=1,
    commands=4,
    lockstep_s=0.1,
    drift_s=0.5,
    long_drift_s=0.5,
    soak_s=1.0,
    sample_s=0.2,
    real_time=('chrt', '--other', '0'),
)
