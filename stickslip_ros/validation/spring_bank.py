"""
Checks of the spring bank: at constant load, where turning points and springs hand over, on ramps.

At constant load the memory of turning points is exact, and the springs of the drive are compared
with it. While the preload changes the reference is Section 3.4 of the paper taken literally:
thousands of springs at equal distances under each hemisphere, in short steps. With a quarter of
the springs, or twice as many, it differs by at most 5e-6 of mu F_n; with a third of the step its
loss by 2e-5.

"""

from dataclasses import replace

import numpy as np

from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.memory import move
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.reaction import fresh_contact, react, switch_to_springs
from stickslip_ros.contact.springs import BANK_ERROR, SPRINGS, SPRINGS_IN_ALL, move_springs
from stickslip_ros.units import MN
from stickslip_ros.validation.checks import (
    Check,
    Curve,
    Family,
    Measured,
    Panel,
    Tolerance,
    measures,
    shared,
)
from stickslip_ros.validation.histories import (
    MU_FN,
    History,
    drag_along,
    model_at,
    power_profile,
    pressed,
    random_turns,
    remember_all,
    zigzag,
)
from stickslip_ros.validation.references import (
    E_STAR_PA,
    FRICTION,
    G_STAR_PA,
    LIMIT_PER_PRELOAD,
    LOWER_SHARE,
    TERMS,
    UPPER_SHARE,
    height,
)
from stickslip_ros.validation.springs import Springs, pull

move_springs = entry_point(move_springs)
move = entry_point(move)
react = entry_point(react)
switch_to_springs = entry_point(switch_to_springs)

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


def random_path(limit_m: float) -> Array:
    """Return the random history, m: nested loops, and full slip now and then."""
    return zigzag(tuple(turn * REACH * limit_m for turn in random_turns(SEED, TURNS)), STEPS)


def _constant_load(profile: str, tolerance: Tolerance) -> tuple[Check, ...]:
    text = f'memory of turning points, {TURNS} random turns'

    @measures((f'{profile}, F_p = {{:g}} N: force', text, 'N', tolerance, MU_FN), each=PRELOADS_N)
    def measured(preload_n: float) -> Measured:
        model = model_at(preload_n, profile)
        path_m = random_path(model.curve.limit_m)
        expected = remember_all(model.curve, path_m)
        found = drag_along(model.bank, path_m, np.full(len(path_m), preload_n))
        return ((expected.force_n, found.force_n, model.curve.force_max_n),)

    return measured


@measures(('{}: full slip, 0.1 to 2 N', 'mu 2 sqrt2 F_p', 'N', SUMS), each=('rough', 'smooth'))
def _full_slip(profile: str) -> Measured:
    preloads_n = np.linspace(PRELOADS_N[0], PRELOADS_N[-1], 39, dtype=np.float64)
    model = model_at(PRELOADS_N[-1], profile)
    there_m = np.array([0.0, FAR * model.curve.limit_m])
    slips = [drag_along(model.bank, there_m, np.full(2, f)).force_n[-1] for f in preloads_n]
    return ((LIMIT_PER_PRELOAD * preloads_n, slips),)


@measures(
    (
        'F_p = {:g} N: hand-over to the springs',
        f'force before it, {TURNS} turns',
        'N',
        SUMS,
        MU_FN,
    ),
    (
        'F_p = {:g} N: hand-over back in full slip',
        f'force of the springs, {TURNS} turns',
        'N',
        SUMS,
        MU_FN,
    ),
    each=PRELOADS_N,
)
def _hand_over(preload_n: float) -> Measured:
    """Compare forces before and after, at any turn of the history: none may jump."""
    before_n, after_n, slipping_n, back_n = np.array(_all_hand_overs(preload_n)).T
    limit_n = LIMIT_PER_PRELOAD * preload_n
    return (before_n, after_n, limit_n), (slipping_n, back_n, limit_n)


def _all_hand_overs(preload_n: float) -> list[tuple[float, float, float, float]]:
    """Return, per turn, forces before and after both hand-overs, N."""
    model = model_at(preload_n)
    contact = fresh_contact(preload_n)
    rows = []
    for place_m in random_path(model.curve.limit_m)[STEPS::STEPS]:
        move(model.curve, contact.memory, float(place_m))
        there = contact.copy()
        switch_to_springs(model, there)
        after_n, _ = move_springs(model.bank, there.springs, 0.0, preload_n, preload_n)
        far_m = float(place_m) - np.sign(place_m) * FAR * model.curve.limit_m
        springs = there.springs.copy()
        slipping_n, _ = move_springs(model.bank, springs, far_m - place_m, preload_n, preload_n)
        react(model, there, far_m, STEP_S, 0.0)
        back_n = np.nan if there.on_springs else there.memory.force_n
        rows.append((contact.memory.force_n, after_n, slipping_n, back_n))
    return rows


CONTACTS = ((2, UPPER_SHARE), (4, LOWER_SHARE))
"""How many upper and lower contacts, and the share of the preload of each (Eq. 19)."""
FINE_SPRINGS = 4000
"""From the middle to the edge under the largest preload, per contact."""
REFINEMENT = 5
"""Steps of the reference per step of the bank."""
EDGE = 1.01
"""The row of springs ends a little beyond the contact under the largest preload."""
RAMP_N = (2.0, 0.1, 1.5, 0.2, 1.0)
"""Corners of the preload, which starts at the last one."""
RAMP_SEED, RAMP_TURNS, RAMP_STEPS = 97, 25, 40
REACH_M = 120e-9
"""Largest turn: full slip at a light preload, stick under a heavy one."""
FINE = f'{len(CONTACTS)} x {FINE_SPRINGS} springs'
RAMP_ERROR = Tolerance(BANK_ERROR, f'{SPRINGS} springs per group instead of {FINE_SPRINGS}')
RAMP_LOSS = Tolerance(
    3e-4, f'{SPRINGS} springs per group; errors of single steps cancel in the sum'
)
BALANCE_STEPS = 4000
BALANCE = Tolerance(1e-5, f'trapezoidal rule of the work, {BALANCE_STEPS} steps')


def fine_springs(profile: str, displacements_m: Array, preloads_n: Array) -> History:
    """
    Return the answer of fine rows of springs to displacement and preload.

    Notes
    -----
    A spring stands for both sides of all equal contacts. What is lost is the work less what is
    stored: no formula for slip enters.

    """
    heaviest = pressed(power_profile(profile), UPPER_SHARE * max(RAMP_N))
    spacing_m = EDGE * heaviest.indentation.radius_m / FINE_SPRINGS
    numbers = np.arange(FINE_SPRINGS, dtype=np.float64)
    heights_m = height(TERMS[profile], spacing_m * (numbers + 0.5))
    force_n, stored_j = np.zeros((2, len(preloads_n)))
    for count, share in CONTACTS:
        width_m = 2.0 * count * spacing_m
        depths_m = _depths(heights_m, count * share * preloads_n / (E_STAR_PA * width_m))
        limits_n = (
            FRICTION * E_STAR_PA * width_m * np.maximum(depth_m - heights_m, 0.0)
            for depth_m in depths_m
        )
        springs = Springs(G_STAR_PA * width_m, np.zeros(FINE_SPRINGS))
        found = pull(springs, displacements_m, limits_n)
        force_n, stored_j = force_n + found.force_n, stored_j + found.stored_j
    history = History(displacements_m, force_n, stored_j, np.zeros_like(stored_j))
    return replace(history, lost_j=history.work_j - stored_j)


def _depths(heights_m: Array, pressed_m: Array) -> Array:
    """Return the depths in which rising springs are pressed by so much in all, m."""
    sums_m = np.cumsum(heights_m)
    numbers = np.arange(1, len(heights_m) + 1)
    count = np.searchsorted(numbers * heights_m - sums_m, pressed_m) - 1
    return np.asarray((pressed_m + sums_m[count]) / numbers[count])


@shared
def both_on_the_ramp(profile: str) -> tuple[History, History, Array]:
    """Return histories by fine springs and by the bank, and the friction limits meanwhile, N."""
    turns = tuple(REACH_M * turn for turn in random_turns(RAMP_SEED, RAMP_TURNS))
    displacements_m = zigzag(turns, RAMP_STEPS)
    coarse = np.arange(len(displacements_m), dtype=float)
    corners, times = (np.linspace(0.0, 1.0, n) for n in (len(RAMP_N) + 1, len(coarse)))
    preloads_n = np.interp(times, corners, (RAMP_N[-1], *RAMP_N))
    fine = np.linspace(0.0, coarse[-1], REFINEMENT * (len(coarse) - 1) + 1)
    slow = fine_springs(
        profile, np.interp(fine, coarse, displacements_m), np.interp(fine, coarse, preloads_n)
    )
    bank = model_at(max(RAMP_N), profile).bank
    found = drag_along(bank, displacements_m, preloads_n)
    return slow.part(slice(None, None, REFINEMENT)), found, LIMIT_PER_PRELOAD * preloads_n


@measures(
    ('{}, preload ramps: T/(mu F_n)', f'{FINE}, NumPy', '', RAMP_ERROR, 'mu F_n of that instant'),
    ('{}, preload ramps: friction loss', f'{FINE}, NumPy: work - stored', 'J', RAMP_LOSS),
    ('{}, preload changes: stored + lost', 'work int T du', 'J', BALANCE, 'the whole work'),
    each=('rough', 'smooth'),
)
def _changing_load(profile: str) -> Measured:
    """Compare force, loss and energy balance while the preload changes."""
    slow, bank, limits_n = both_on_the_ramp(profile)
    smooth = _smooth_path(profile)
    kept_j = smooth.stored_j + smooth.lost_j
    return (
        (slow.force_n / limits_n, bank.force_n / limits_n, 1.0),
        (slow.lost_j[-1], bank.lost_j[-1]),
        (smooth.work_j, kept_j, smooth.work_j[-1]),
    )


def _smooth_path(profile: str) -> History:
    """Return the answer of the bank to a smooth path of displacement and preload."""
    angles = np.linspace(0.0, 4.0 * np.pi, BALANCE_STEPS + 1, dtype=np.float64)
    preloads_n = 0.6 + 0.4 * np.cos(0.7 * angles)
    bank = model_at(max(RAMP_N), profile).bank
    return drag_along(bank, REACH_M * np.sin(angles), preloads_n)


def _ramp_panel() -> Panel:
    """Return force and friction limit along the ramps."""
    slow, bank, limits_n = both_on_the_ramp('rough')
    steps, some = np.arange(len(limits_n), dtype=float), slice(None, None, 8)
    curves = (
        Curve('bank', steps, bank.force_n * MN),
        Curve(FINE, steps[some], slow.force_n[some] * MN, 'points', 1),
        Curve('friction limit', steps, limits_n * MN, 'dashed', 2),
        Curve('', steps, -limits_n * MN, 'dashed', 2),
    )
    title = 'Preload ramps, 0.1 to 2 N: bank and fine springs'
    return Panel(title, 'step of the history', 'force T (mN)', curves)


SPRING_BANK = Family(
    'Spring bank',
    (
        _constant_load('rough', FEW),
        _constant_load('smooth', FEW),
        _constant_load('rough_line', FEWER),
        _full_slip,
        _hand_over,
        _changing_load,
    ),
    (_ramp_panel,),
)
