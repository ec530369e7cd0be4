"""
Checks of the spring bank: at constant load, where turning points and springs hand over, on ramps.

At constant load the memory of turning points is exact, and the springs of the drive are compared
with it. What happens while the preload changes is in ``preload_ramp``.

"""

import numpy as np

from stickslip_ros.contact.bank import BANK_ERROR, SPRINGS
from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.memory import move
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.reaction import fresh_contact, onto_springs, react
from stickslip_ros.contact.springs import SPRINGS_IN_ALL, drag
from stickslip_ros.validation.bank_history import (
    LIMIT_PER_PRELOAD,
    drag_along,
    model_at,
    random_turns,
)
from stickslip_ros.validation.checks import Check, Scale, Tolerance, compare_worst
from stickslip_ros.validation.findings import Findings
from stickslip_ros.validation.histories import remember_all, zigzag
from stickslip_ros.validation.preload_ramp import preload_ramp, ramp_panel
from stickslip_ros.validation.tangential import MU_FN

move = entry_point(move)
drag = entry_point(drag)
react = entry_point(react)
onto_springs = entry_point(onto_springs)

PRELOADS_N = (0.1, 0.5, 1.0, 2.0)
SEED, TURNS, STEPS = 20140, 60, 8
REACH = 1.2
"""Largest turn of the random history, in units of the displacement of full slip."""
FAR = 5.0
"""Displacement, in the same units, after which everything has slipped."""
STEP_S = 1e-6
FEW = Tolerance(BANK_ERROR, f'{SPRINGS} springs per group instead of infinitely many')
FEWER = Tolerance(
    6.0 * BANK_ERROR,
    f'{SPRINGS_IN_ALL // 6} springs per contact of six different lines: seen 1.0e-2 at 0.1 N',
)
SUMS = Tolerance(1e-11, 'rounding of sums over the springs')


def spring_bank() -> Findings:
    """Check the bank of the drive at constant preloads and while the preload changes."""
    checks = (*_constant_load(), *_full_slip(), *_hand_over(), *preload_ramp())
    return Findings('Spring bank', checks, (ramp_panel(),))


def random_path(limit_m: float) -> Array:
    """Return the random history, m: nested loops, and full slip now and then."""
    return zigzag(tuple(turn * REACH * limit_m for turn in random_turns(SEED, TURNS)), STEPS)


def _constant_load() -> list[Check]:
    text = f'memory of turning points, {TURNS} random turns'
    checks = []
    for profile, tolerance in (('rough', FEW), ('smooth', FEW), ('rough_line', FEWER)):
        for preload_n in PRELOADS_N:
            model = model_at(preload_n, profile)
            path_m = random_path(model.curve.limit_m)
            expected = remember_all(model.curve, path_m)
            found = drag_along(model.bank, path_m, np.full(len(path_m), preload_n))
            scale = Scale(model.curve.force_max_n, MU_FN)
            name = f'{profile}, F_p = {preload_n:g} N: force'
            checks.append(
                compare_worst(name, text, expected.force_n, found.force_n, 'N', tolerance, scale)
            )
    return checks


def _full_slip() -> list[Check]:
    preloads_n = np.linspace(PRELOADS_N[0], PRELOADS_N[-1], 39, dtype=np.float64)
    checks = []
    for profile in ('rough', 'smooth'):
        model = model_at(PRELOADS_N[-1], profile)
        there_m = np.array([0.0, FAR * model.curve.limit_m])
        ours_n = [
            drag_along(model.bank, there_m, np.full(2, preload_n)).force_n[-1]
            for preload_n in preloads_n
        ]
        name, text = f'{profile}: full slip, 0.1 to 2 N', 'mu 2 sqrt2 F_p'
        expected_n = LIMIT_PER_PRELOAD * preloads_n
        checks.append(compare_worst(name, text, expected_n, ours_n, 'N', SUMS))
    return checks


def _hand_over() -> list[Check]:
    """Check that no force jumps at any turn of the history, to the springs and back."""
    checks = []
    for preload_n in PRELOADS_N:
        before_n, after_n, slipping_n, back_n = np.array(_all_hand_overs(preload_n)).T
        scale = Scale(LIMIT_PER_PRELOAD * preload_n, MU_FN)
        name, turns = f'F_p = {preload_n:g} N', f'{TURNS} turns'
        checks += [
            compare_worst(
                f'{name}: hand-over to the springs',
                f'force before it, {turns}',
                before_n,
                after_n,
                'N',
                SUMS,
                scale,
            ),
            compare_worst(
                f'{name}: hand-over back in full slip',
                f'force of the springs, {turns}',
                slipping_n,
                back_n,
                'N',
                SUMS,
                scale,
            ),
        ]
    return checks


def _all_hand_overs(preload_n: float) -> list[tuple[float, float, float, float]]:
    """Return, per turn, forces before and after both hand-overs, N."""
    model = model_at(preload_n)
    contact = fresh_contact(preload_n)
    rows = []
    for place_m in random_path(model.curve.limit_m)[STEPS::STEPS]:
        move(model.curve, contact.memory, float(place_m))
        there = contact.copy()
        onto_springs(model, there)
        after_n, _ = drag(model.bank, there.springs, 0.0, preload_n, preload_n)
        far_m = float(place_m) - np.sign(place_m) * FAR * model.curve.limit_m
        springs = there.springs.copy()
        slipping_n, _ = drag(model.bank, springs, far_m - place_m, preload_n, preload_n)
        react(model, there, far_m, STEP_S, 0.0)
        back_n = np.nan if there.on_springs else there.memory.force_n
        rows.append((contact.memory.force_n, after_n, slipping_n, back_n))
    return rows
