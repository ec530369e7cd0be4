"""Processor time and lateness of the node at 1 kHz, against bare loops that publish the same."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import lru_cache, partial

import numpy as np

from benchmarks.clock import Array
from benchmarks.node.lateness import summary
from benchmarks.node.programs import BareLoop, Drive, Program, Turn, in_turn, opened
from benchmarks.outcome import Outcome, Row, Verdict
from benchmarks.sizes import Sizes

DRIVE = 'the node'
OBJECTS, FRESH, PACKED = 'message objects, kept', 'message objects, new', 'bytes, packed once'
PLAIN = 'message objects, kept; untuned'
TIMER, SILENCE = 'message objects, kept; rclpy timer', 'no messages, no subscriber'
FORMS = {
    OBJECTS: (),
    FRESH: ('--messages', 'fresh'),
    PACKED: ('--messages', 'packed'),
    PLAIN: ('--plain',),
    TIMER: ('--pace', 'timer'),
    SILENCE: ('--messages', 'none'),
}
AIM = 1.5
ABOUT_LATENESS = (
    (
        'p99: median of the percentiles of about a second each; overruns: ticks more than a '
        'period late; ratios: medians of those of the turns'
    ),
    'untuned: without the short slices, exact sleeps and kept objects that the node asks for',
)

Turns = dict[str, list[Turn]]


@lru_cache
def measured(sizes: Sizes) -> Turns:
    """Run all programs in turn; both tables come from this one run."""
    makers: list[Callable[[], Program]] = [lambda: Drive(DRIVE)]
    makers += [partial(BareLoop, name, *FORMS[name]) for name in FORMS]
    with ExitStack() as stack:
        programs = opened(stack, makers)
        turns = in_turn(programs, sizes.node_rounds, sizes.settle_s, sizes.turn_s)
    return {program.name: its for program, its in zip(programs, turns, strict=True)}


def run_cpu(sizes: Sizes) -> Outcome:
    """Compare processor time."""
    turns = measured(sizes)
    ours = np.array([turn.cpu for turn in turns[DRIVE]])
    rows: list[Row] = []
    verdicts = []
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
        if name in {OBJECTS, FRESH}:
            what = f'processor time of the node over that of a bare loop, {name} (aim)'
            verdicts.append(Verdict(what, AIM, _median(ours / cpu), at_most=True))
    return Outcome(
        'Processor time of the node at 1 kHz, moving, against bare rclpy loops',
        rows,
        verdicts,
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
    turns = {name: its for name, its in measured(sizes).items() if name != TIMER}
    return Outcome(
        'Lateness of ticks at 1 kHz: absolute deadlines and time.sleep in all of them',
        lateness_rows(turns),
        [],
        ['from the same turns as node-cpu; of the node, its own diagnostics', *ABOUT_LATENESS],
    )


def lateness_rows(turns: Turns) -> list[Row]:
    """Return how late the ticks of programs began, and ratios of the node to each."""
    by_turn = {name: [summary(turn.windows) for turn in its] for name, its in turns.items()}
    rows: list[Row] = []
    for name, its in by_turn.items():
        whole = summary([window for turn in turns[name] for window in turn.windows])
        ratios = {
            f'node_over_this_{key}': _median(_ratios(by_turn[DRIVE], its, f'{key}_us'))
            for key in ('mean', 'p99', 'max')
        }
        rows.append({'program': name, **whole, **ratios})
    return rows


def spread(name: str, ratios: Array) -> Row:
    """Return median, least and largest of some ratios as entries of a row."""
    return {
        name: float(np.median(ratios)),
        'lowest': float(np.min(ratios)),
        'highest': float(np.max(ratios)),
    }


def _ratios(ours: Sequence[Row], others: Sequence[Row], key: str) -> list[float]:
    pairs = zip(ours, others, strict=True)
    return [float(our[key]) / float(other[key]) for our, other in pairs]


def _median(values: Sequence[float] | Array) -> float:
    return float(np.median(values))
