"""Checks of the memory of turning points: branches after a reversal, energies, a bounded stack."""

from typing import NamedTuple

import numpy as np

from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.mdr import Presliding
from stickslip_ros.contact.memory import CAPACITY, fresh_memory, move
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import Record
from stickslip_ros.contact.virgin import CELLS, tabulate
from stickslip_ros.units import MN, NM
from stickslip_ros.validation.checks import (
    ROUNDING,
    Check,
    Curve,
    Family,
    Measured,
    Panel,
    Tolerance,
    bounded,
    measures,
    printed,
    shared,
)
from stickslip_ros.validation.histories import (
    MU_FN,
    ROUGH_TABLE,
    SPHERE_TABLE,
    TABLE,
    closed_form_of,
    fractions,
    lower_contact,
    remember,
    wandering,
    zigzag,
)
from stickslip_ros.validation.references import cattaneo_ratio, sphere_loss_ratio

AMPLITUDE = 0.8
"""Amplitude of the sphere's loop, u*/u_max."""
CORE = 0.4
"""Stick radius c/a that a loop of the rough contact leaves at its turning points."""
STEPS = 400
CLOSING = Tolerance(1e-12, 'rounding: a closed loop leaves no trace')
MINDLIN, MASING = 'Mindlin, Deresiewicz', 'Masing on the closed form'


@measures(
    ('sphere: unloading branch', MINDLIN, '', TABLE, MU_FN),
    ('sphere: reloading branch', MINDLIN, '', TABLE, MU_FN),
    ('sphere: force where the loop closes', 'force at the first turn', 'N', CLOSING),
)
def _sphere_branches() -> Measured:
    contact = lower_contact('smooth', 0.5)
    turn_m = AMPLITUDE * contact.max_displacement_m
    whole = remember(contact, zigzag((turn_m, -turn_m, turn_m), STEPS))
    back_n, forth_n = whole.force_n[STEPS : 2 * STEPS + 1], whole.force_n[2 * STEPS :]
    places = whole.displacement_m[STEPS : 2 * STEPS + 1] / contact.max_displacement_m
    expected = _mindlin(places)
    return (
        (expected, back_n / contact.max_force_n, 1.0),
        (-expected, forth_n / contact.max_force_n, 1.0),
        (back_n[0], forth_n[-1]),
    )


def _mindlin(places: Array) -> Array:
    """Return T/(mu F_n) of a sphere that comes back from AMPLITUDE."""
    return np.asarray(cattaneo_ratio(AMPLITUDE) - 2.0 * cattaneo_ratio(0.5 * (AMPLITUDE - places)))


@measures(
    ('rough: unloading branch', MASING, 'N', ROUGH_TABLE, MU_FN),
    ('rough: reloading branch', MASING, 'N', ROUGH_TABLE, MU_FN),
)
def _rough_branches() -> Measured:
    contact = lower_contact('rough', 0.5)
    turn_m, places_m, forces_n = _masing()
    there = np.concatenate((np.array([turn_m]), places_m, np.array([-turn_m]), -places_m))
    kernel_n, count = remember(contact, there).force_n, len(places_m)
    return (
        (forces_n, kernel_n[1 : count + 1], contact.max_force_n),
        (-forces_n, kernel_n[count + 2 :], contact.max_force_n),
    )


def _masing() -> tuple[float, Array, Array]:
    """Return a turn, and displacement and force of the rough unloading branch in closed form."""
    form = closed_form_of(lower_contact('rough', 0.5), 'rough')
    core_m = CORE * form.radius_m
    inner_m = form.radius_m - fractions(STEPS)[:-1] * (form.radius_m - core_m)
    turn_m = float(form.displacement(core_m))
    places_m = turn_m - 2.0 * form.displacement(inner_m)
    return turn_m, places_m, form.force(core_m) - 2.0 * form.force(inner_m)


def _loop_panel() -> Panel:
    smooth, rough = lower_contact('smooth', 0.5), lower_contact('rough', 0.5)
    turn_m, *branch = _masing()
    smooth_turn_m = AMPLITUDE * smooth.max_displacement_m
    loops = ((smooth, 'smooth', smooth_turn_m), (rough, 'rough', turn_m))
    curves = []
    for colour, (contact, name, end_m) in enumerate(loops):
        history = remember(contact, zigzag((end_m, -end_m, end_m), 100))
        x, y = history.displacement_m * NM, history.force_n * MN
        curves.append(Curve(f'{name}, kernel', x, y, 'line', colour))
    places = np.linspace(-AMPLITUDE, AMPLITUDE, 17, dtype=np.float64)
    mindlin = (places * smooth.max_displacement_m, _mindlin(places) * smooth.max_force_n)
    masing = (branch[0][::25], branch[1][::25])
    points = ((MINDLIN, mindlin), ("Masing's rule, closed form", masing))
    for colour, (label, (places_m, forces_n)) in enumerate(points):
        x, y = places_m * NM, forces_n * MN
        # The reloading branch is the unloading one mirrored.
        curves.append(Curve(label, x, y, 'points', colour))
        curves.append(Curve('', -x, -y, 'points', colour))
    title = 'Unloading and reloading, F_p = 0.5 N'
    return Panel(title, 'displacement u (nm)', 'force T (mN)', curves)


HYSTERESIS = Family('Hysteresis', (_sphere_branches, _rough_branches), (_loop_panel,))


LOSS_TABLE = Tolerance(
    8.0 * SPHERE_TABLE, f'{CELLS} cells under the root of the stiffness; W has eight such areas'
)
ROUGH_LOSS = Tolerance(1e-6, 'table under a smooth stiffness, over a loop of a lesser area')
BALANCE_STEPS = 2000
BALANCE = Tolerance(1e-6, f'trapezoidal rule of the work, {BALANCE_STEPS} steps per leg')
UNIT_LOSS = 'closed form; unit mu F_n u_max'


def cycle_loss(contact: Presliding, amplitude_m: float) -> tuple[float, float]:
    """Return the kernel's loss on the virgin leg and in the steady cycle after it, J."""
    turns = np.array([amplitude_m, -amplitude_m, amplitude_m])
    lost_j = remember(contact, turns).lost_j
    return float(lost_j[0]), float(lost_j[2] - lost_j[0])


@measures(
    ('sphere: loss per cycle at u_max', UNIT_LOSS, '', LOSS_TABLE),
    ('sphere: virgin loss to u_max', 'a quarter of the cycle, 0.2', '', LOSS_TABLE),
    ('sphere: loss per cycle at u_max/2', UNIT_LOSS, '', printed('0.07279')),
    ('sphere: loss per cycle, 0.1 to 1.2 u_max', UNIT_LOSS, '', LOSS_TABLE, 'mu F_n u_max'),
)
def _sphere_loss() -> Measured:
    contact = lower_contact('smooth', 0.5)
    limit_m = contact.max_displacement_m
    unit_j = contact.max_force_n * limit_m
    places = np.linspace(0.1, 1.2, 12, dtype=np.float64)
    expected = sphere_loss_ratio(np.minimum(places, 1.0)) + 4.0 * np.maximum(places - 1.0, 0.0)
    ours = [cycle_loss(contact, place * limit_m)[1] / unit_j for place in places]
    virgin_j, full_j = cycle_loss(contact, limit_m)
    half_j = cycle_loss(contact, 0.5 * limit_m)[1]
    return (0.8, full_j / unit_j), (0.2, virgin_j / unit_j), half_j / unit_j, (expected, ours, 1.0)


@measures(
    ('rough: loss per cycle {1}', 'closed form, sums of powers', 'J', ROUGH_LOSS),
    ('rough: virgin loss {1}', 'a quarter of the cycle', 'J', ROUGH_LOSS),
    each=((0.0, 'at u_max'), (CORE, 'at c = 0.4 a')),
)
def _rough_loss(core: float, _where: str) -> Measured:
    contact = lower_contact('rough', 0.5)
    form = closed_form_of(contact, 'rough')
    core_m = core * form.radius_m
    expected_j = form.loss_per_cycle(core_m)
    virgin_j, cycle_j = cycle_loss(contact, float(form.displacement(core_m)))
    return (expected_j, cycle_j), (expected_j / 4.0, virgin_j)


@measures(
    ('{}: stored + lost, 12 turns', 'work int T du', 'J', BALANCE, 'the whole work'),
    each=('smooth', 'rough'),
)
def _balance(profile: str) -> Measured:
    """Compare over a history with nested loops and full slip."""
    contact = lower_contact(profile, 0.5)
    found = remember(contact, wandering(contact, BALANCE_STEPS))
    return ((found.work_j, found.stored_j + found.lost_j, found.work_j[-1]),)


def _loss_panel() -> Panel:
    places = np.logspace(-1.5, 0.0, 40, dtype=np.float64)
    form = closed_form_of(lower_contact('rough', 0.5), 'rough')
    cores_m = form.radius_m * (1.0 - np.logspace(-1.7, 0.0, 40, dtype=np.float64))
    limit_m, force_n = float(form.displacement(0.0)), float(form.force(0.0))
    losses = np.array([form.loss_per_cycle(core_m) for core_m in cores_m])
    along = form.displacement(cores_m) / limit_m
    curves = [
        Curve('smooth, closed form', places, sphere_loss_ratio(places), 'line', 0),
        Curve('rough, closed form', along, losses / (force_n * limit_m), 'line', 1),
    ]
    some = places[::3]
    for colour, profile in enumerate(('smooth', 'rough')):
        contact = lower_contact(profile, 0.5)
        unit_j = contact.max_force_n * contact.max_displacement_m
        ours = [cycle_loss(contact, p * contact.max_displacement_m)[1] / unit_j for p in some]
        curves.append(Curve(f'{profile}, kernel', some, np.array(ours), 'points', colour))
    x_label, y_label = 'amplitude u*/u_max', 'loss W/(mu F_n u_max)'
    return Panel('Friction loss per cycle', x_label, y_label, curves, log_x=True, log_y=True)


ENERGY = Family('Energy', (_sphere_loss, _rough_loss, _balance), (_loss_panel,))


REVERSALS = 1_000_000
WAY_OUT = 2000
"""Places on the way back out."""
LARGEST_ERROR = 2e-5
"""Force error after a million reversals, of the maximal force: what decision 1 states."""
LARGEST_BOUND = 2e-4
"""Ceiling for error_n then, above what is seen: 1.3e-4. The allowance behind error_n is quadrupled
whenever it does not do, and errors of forgotten pairs partly cancel: it exceeds the error."""
TABLES = {'smooth': TABLE, 'rough': ROUGH_TABLE}


@entry_point
def follow(curve: Record, memory: Record, places_m: Array, log: Array) -> None:
    """Move from place to place; rows of the log receive force, bound of its error, depth."""
    for i in range(len(places_m)):
        move(curve, memory, places_m[i])
        log[i, 0] = memory.force_n
        log[i, 1] = memory.error_n
        log[i, 2] = memory.depth


class RingDown(NamedTuple):
    """
    A ring-down from u_max to nothing with linearly decreasing amplitude, and the way back out.

    Errors (of the force) and their bounds (error_n) are of the drive's stack, relative to mu F_n.
    Logs of ``follow`` are those of the drive's stack and of one that forgets nothing.

    """

    contact: Presliding
    turns_m: Array
    errors: Array
    bounds: Array
    bounded: Array
    endless: Array


@shared
def run_ring_down(profile: str) -> RingDown:
    """Ring down with both stacks."""
    contact = lower_contact(profile, 0.5)
    curve, limit_m = tabulate([contact]), contact.max_displacement_m
    amplitudes_m = limit_m * (1.0 - np.arange(REVERSALS) / REVERSALS)
    turns_m = np.where(np.arange(REVERSALS) % 2, -amplitudes_m, amplitudes_m)
    places_m = np.concatenate((turns_m, np.linspace(0.0, limit_m, WAY_OUT, dtype=np.float64)))
    bounded, endless = np.zeros((2, len(places_m), 3))
    follow(curve, fresh_memory(), places_m, bounded)
    follow(curve, fresh_memory(capacity=len(places_m) + 1), places_m, endless)
    errors = np.abs(bounded[:, 0] - endless[:, 0]) / contact.max_force_n
    bounds = bounded[:, 1] / contact.max_force_n
    return RingDown(contact, turns_m, errors, bounds, bounded, endless)


def _ring_down_checks(profile: str, table: Tolerance) -> tuple[Check, ...]:
    return measures(
        (
            '{}: force of an unbounded stack',
            'alternating sum of the closed form',
            'N',
            table,
            MU_FN,
        ),
        bounded('{}: rows of the stack in use', 'CAPACITY, a million reversals'),
        bounded('{}: error/(mu F_n) where nearest to its bound', 'error_n/(mu F_n) at that turn'),
        bounded('{}: largest error/(mu F_n)', 'decision 1'),
        bounded('{}: error_n/(mu F_n) at the end', 'ceiling above what is seen'),
        bounded('{}, back out: largest error/(mu F_n)', 'error_n/(mu F_n)'),
        ('{}, back at the first turn: force', 'mu F_n', 'N', ROUNDING),
        each=(profile,),
    )(_compare_stacks)


def _compare_stacks(profile: str) -> Measured:
    run = run_ring_down(profile)
    limit_n, errors = run.contact.max_force_n, run.errors[:REVERSALS]
    # Nothing closes on the way in, so the force of an unbounded stack is a plain sum.
    swings_n = 2.0 * run.contact.tangential_force(0.5 * np.abs(np.diff(run.turns_m)))
    swings_n[::2] *= -1.0
    first_n = run.contact.tangential_force(run.turns_m[:1])
    sums_n = np.cumsum(np.concatenate((first_n, swings_n)))
    # Before anything is forgotten error and bound are zero, up to rounding.
    bounds = np.maximum(run.bounds[:REVERSALS], ROUNDING.value)
    nearest = int(np.argmax(errors / bounds))
    rows = np.max(run.bounded[:, 2]) + 1.0  # the virgin origin has one too
    return (
        (sums_n, run.endless[:REVERSALS, 0], limit_n),
        (CAPACITY, rows),
        (bounds[nearest], errors[nearest]),
        (LARGEST_ERROR, np.max(errors)),
        (LARGEST_BOUND, run.bounds[REVERSALS - 1]),
        (run.bounds[-1], np.max(run.errors[REVERSALS:])),
        (limit_n, run.bounded[-1, 0]),
    )


def _ring_down_panel() -> Panel:
    """Return largest error so far and its bound, over the reversals."""
    places = np.logspace(np.log10(CAPACITY), np.log10(REVERSALS), 300, dtype=np.float64)
    numbers = np.unique(places.astype(int))[1:]
    curves = []
    for colour, profile in enumerate(TABLES):
        run, x = run_ring_down(profile), numbers.astype(float)
        reached = np.maximum.accumulate(run.errors)[numbers - 1]
        curves += [
            Curve(f'{profile}, error_n', x, run.bounds[numbers - 1], 'dashed', colour),
            Curve(f'{profile}, largest error so far', x, reached, 'line', colour),
        ]
    title = f'Ring-down: stack of {CAPACITY} against an unbounded one'
    return Panel(title, 'reversals', 'force error/(mu F_n)', curves, log_x=True, log_y=True)


RING_DOWN = Family(
    'Ring-down', [_ring_down_checks(*each) for each in TABLES.items()], (_ring_down_panel,)
)
