"""Round trips per second in lockstep, against a bare ping-pong of two rclpy nodes."""

from contextlib import ExitStack
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np

from benchmarks.clock import Array
from benchmarks.node.cpu import spread
from benchmarks.node.process import Helper, Lane, Process
from benchmarks.outcome import Outcome, Row
from benchmarks.sizes import Sizes

TWO, ONE = 'two', 'one'


@dataclass(frozen=True)
class Pairing:
    """
    Two nodes that answer each other.

    Attributes
    ----------
    name : str
        For the table.
    kind : str
        ``drive``, or what a bare loop publishes per round trip: ``all`` topics or ``position``.
    processes : str
        TWO or ONE.

    """

    name: str
    kind: str
    processes: str

    def open(self, stack: ExitStack) -> Helper:
        """Start both nodes; return the process of the controller."""
        lane = Lane()
        is_drive = self.kind == 'drive'
        words = ['-m', 'benchmarks.node.controller', '--of', 'drive' if is_drive else 'bare']
        if self.processes == ONE:
            words += ['--inside', self.kind]
        controller = Helper([*words, *lane.ros_arguments], lane)
        stack.callback(controller.close)
        if self.processes == TWO:
            other = _drive(lane) if is_drive else _bare(lane, self.kind)
            stack.callback(other.close)
        return controller


PAIRINGS = [
    Pairing(name, kind, processes)
    for processes in (TWO, ONE)
    for kind, name in (
        ('drive', 'the node and its LockstepClient'),
        ('all', 'bare ping-pong, with all messages of the node'),
        ('position', 'bare ping-pong, position and grant only'),
    )
]


def run(sizes: Sizes) -> Outcome:
    """Compare the round trips."""
    if find_spec('stickslip_ros.ros.client') is None:
        pairings = [each for each in PAIRINGS if each.kind != 'drive']
    else:
        pairings = PAIRINGS
    with ExitStack() as stack:
        controllers = [pairing.open(stack) for pairing in pairings]
        rates = np.array(
            [
                [controller.ask('rate', seconds=sizes.lockstep_s) for controller in controllers]
                for _ in range(sizes.node_rounds)
            ]
        ).T
    by_pairing = dict(zip(pairings, rates, strict=True))
    return Outcome(
        'Lockstep: round trips per second, one block of 1 ms each',
        [_row(pairing, by_pairing) for pairing in pairings],
        [],
        [
            (
                f'{sizes.node_rounds} turns of {sizes.lockstep_s:g} s; a round trip is a position '
                'one way and a grant the other; ratio: round trips per second of the node over '
                'those of this pair in as many processes'
            ),
            (
                'the node simulates a block and also publishes force, voltage and trace; 1000 '
                'round trips per second are real time'
            ),
        ],
    )


def _row(pairing: Pairing, rates: dict[Pairing, Array]) -> Row:
    ours = [its for each, its in rates.items() if _is_rival_of(each, pairing)]
    ratios = ours[0] / rates[pairing] if ours else np.array([np.nan])
    return {
        'program': pairing.name,
        'processes': pairing.processes,
        'round_trips_per_s': float(np.median(rates[pairing])),
        **spread('node_over_this', ratios),
    }


def _is_rival_of(ours: Pairing, pairing: Pairing) -> bool:
    return ours.kind == 'drive' and ours.processes == pairing.processes


def _drive(lane: Lane) -> Process:
    words = ['-m', 'stickslip_ros.ros.node', *lane.ros_arguments]
    return Process([*words, '-p', 'sim.lockstep:=true'], lane)


def _bare(lane: Lane, kind: str) -> Helper:
    words = ['-m', 'benchmarks.node.bare_loop', '--pace', 'grant']
    if kind == 'position':
        words += ['--topics', 'position']
    return Helper([*words, *lane.ros_arguments], lane)
