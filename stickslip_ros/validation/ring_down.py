"""Checks of the bounded stack: a ring-down of a million reversals, and the way back out."""

from typing import NamedTuple

import numpy as np

from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.memory import CAPACITY, fresh_memory, move
from stickslip_ros.contact.presliding import Presliding
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import Record
from stickslip_ros.contact.virgin import tabulate
from stickslip_ros.validation.checks import (
    ROUNDING,
    Check,
    Scale,
    compare,
    compare_bound,
    compare_worst,
)
from stickslip_ros.validation.findings import Curve, Findings, Panel
from stickslip_ros.validation.histories import ROUGH_TABLE, TABLE
from stickslip_ros.validation.stand import lower_contact
from stickslip_ros.validation.tangential import MU_FN

REVERSALS = 1_000_000
WAY_OUT = 2000
"""Places on the way back out."""
LARGEST_ERROR = 2e-5
"""Force error after a million reversals, of the maximal force: what decision 1 states."""
LARGEST_BOUND = 2e-4
"""Ceiling for error_n then, above what is seen: 1.3e-4. The allowance behind error_n is quadrupled
whenever it does not do, and errors of forgotten pairs partly cancel: it exceeds the error."""
FORCE, BOUND_N, DEPTH = range(3)
"""Columns of a log."""
TABLES = {'smooth': TABLE, 'rough': ROUGH_TABLE}


class RingDown(NamedTuple):
    """
    Logs of one ring-down: force (N), bound of its error (N) and depth of the stack.

    Attributes
    ----------
    contact : Presliding
        The contact.
    turns_m, out_m : array
        Turning points of shrinking amplitude, and places on the way back out.
    bounded, unbounded : array, shape (REVERSALS + WAY_OUT, 3)
        Log with the stack of the drive, and with one that forgets nothing.

    """

    contact: Presliding
    turns_m: Array
    out_m: Array
    bounded: Array
    unbounded: Array


@entry_point
def follow(curve: Record, memory: Record, places_m: Array, log: Array) -> None:
    """Move from place to place and log force, error bound and depth."""
    for i in range(len(places_m)):
        move(curve, memory, places_m[i])
        log[i, 0] = memory.force_n
        log[i, 1] = memory.error_n
        log[i, 2] = memory.depth


def run_ring_down(profile: str) -> RingDown:
    """Ring down from u_max to nothing with linearly decreasing amplitude, then go back out."""
    contact = lower_contact(profile, 0.5)
    curve, limit_m = tabulate([contact]), contact.max_displacement_m
    amplitudes_m = limit_m * (1.0 - np.arange(REVERSALS) / REVERSALS)
    turns_m = np.where(np.arange(REVERSALS) % 2, -amplitudes_m, amplitudes_m)
    out_m = np.linspace(0.0, limit_m, WAY_OUT, dtype=np.float64)
    places_m = np.concatenate((turns_m, out_m))
    logs = []
    for capacity in (CAPACITY, len(places_m) + 1):
        log = np.zeros((len(places_m), 3))
        follow(curve, fresh_memory(capacity=capacity), places_m, log)
        logs.append(log)
    return RingDown(contact, turns_m, out_m, *logs)


def ring_down() -> Findings:
    """Check depth, force error and its bound, in the ring-down and after it."""
    runs = {profile: run_ring_down(profile) for profile in TABLES}
    checks: list[Check] = []
    for profile, run in runs.items():
        checks += [_unbounded(profile, run), *_inwards(profile, run), *_outwards(profile, run)]
    return Findings('Ring-down', tuple(checks), (_panel(runs),))


def _unbounded(profile: str, run: RingDown) -> Check:
    """Check the reference itself: nothing closes on the way in, so the force is a plain sum."""
    swings_n = 2.0 * run.contact.tangential_force(0.5 * np.abs(np.diff(run.turns_m)))
    swings_n[::2] *= -1.0
    first_n = run.contact.tangential_force(run.turns_m[:1])
    return compare_worst(
        f'{profile}: force of an unbounded stack',
        'alternating sum of the closed form',
        np.cumsum(np.concatenate((first_n, swings_n))),
        run.unbounded[:REVERSALS, FORCE],
        'N',
        TABLES[profile],
        Scale(run.contact.max_force_n, MU_FN),
    )


def _errors(run: RingDown) -> Array:
    """Return the force errors of the bounded stack, of mu F_n."""
    errors_n = np.abs(run.bounded[:, FORCE] - run.unbounded[:, FORCE])
    return np.asarray(errors_n / run.contact.max_force_n)


def _inwards(profile: str, run: RingDown) -> list[Check]:
    errors = _errors(run)[:REVERSALS]
    bounds = run.bounded[:REVERSALS, BOUND_N] / run.contact.max_force_n
    rows = float(np.max(run.bounded[:, DEPTH])) + 1.0  # the virgin origin has one too
    # Before anything is forgotten both are zero, up to rounding.
    bounds_there = np.maximum(bounds, ROUNDING.value)
    worst = int(np.argmax(errors / bounds_there))
    table = (
        ('rows of the stack in use', 'CAPACITY, a million reversals', CAPACITY, rows),
        (
            'error/(mu F_n) where nearest to its bound',
            'error_n/(mu F_n) at that turn',
            bounds_there[worst],
            errors[worst],
        ),
        ('largest error/(mu F_n)', 'decision 1', LARGEST_ERROR, np.max(errors)),
        ('error_n/(mu F_n) at the end', 'ceiling above what is seen', LARGEST_BOUND, bounds[-1]),
    )
    return [
        compare_bound(f'{profile}: {name}', text, float(bound), float(ours), '')
        for name, text, bound, ours in table
    ]


def _outwards(profile: str, run: RingDown) -> list[Check]:
    return [
        compare_bound(
            f'{profile}, back out: largest error/(mu F_n)',
            'error_n/(mu F_n)',
            float(run.bounded[-1, BOUND_N]) / run.contact.max_force_n,
            float(np.max(_errors(run)[REVERSALS:])),
            '',
        ),
        compare(
            f'{profile}, back at the first turn: force',
            'mu F_n',
            run.contact.max_force_n,
            float(run.bounded[-1, FORCE]),
            'N',
            ROUNDING,
        ),
    ]


def _panel(runs: dict[str, RingDown]) -> Panel:
    """Return largest error so far and its bound, over the reversals."""
    places = np.logspace(np.log10(CAPACITY), np.log10(REVERSALS), 300, dtype=np.float64)
    numbers = np.unique(places.astype(int))[1:]
    curves = []
    for colour, (profile, run) in enumerate(runs.items()):
        reached = np.maximum.accumulate(_errors(run)[:REVERSALS])[numbers - 1]
        bounds = run.bounded[numbers - 1, BOUND_N] / run.contact.max_force_n
        x = numbers.astype(float)
        curves += [
            Curve(f'{profile}, error_n', x, bounds, 'dashed', colour),
            Curve(f'{profile}, largest error so far', x, reached, 'line', colour),
        ]
    return Panel(
        f'Ring-down: stack of {CAPACITY} against an unbounded one',
        'reversals',
        'force error/(mu F_n)',
        tuple(curves),
        log_x=True,
        log_y=True,
    )
