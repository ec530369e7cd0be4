"""Checks of the memory kernel: Masing's branches after a reversal."""

import numpy as np

from stickslip_ros.contact.presliding import Presliding
from stickslip_ros.contact.profile import Array
from stickslip_ros.validation.checks import (
    Check,
    Scale,
    Tolerance,
    compare,
    compare_worst,
)
from stickslip_ros.validation.closed_forms import cattaneo_ratio
from stickslip_ros.validation.findings import Curve, Findings, Panel
from stickslip_ros.validation.histories import (
    ROUGH_TABLE,
    TABLE,
    History,
    remember,
    zigzag,
)
from stickslip_ros.validation.stand import fractions, lower_contact
from stickslip_ros.validation.tangential import MU_FN, closed_form_of

AMPLITUDE = 0.8
"""Amplitude of the sphere's loop, u*/u_max."""
CORE = 0.4
"""Stick radius c/a that the rough contact's loop leaves at its turning points."""
STEPS = 400
CLOSING = Tolerance(1e-12, 'rounding: a closed loop leaves no trace')


def hysteresis() -> Findings:
    """Check unloading, reloading and the closing of loops."""
    checks = (*_sphere_branches(), *_rough_branches())
    return Findings('Hysteresis', checks, (_loop_panel(),))


def _cycle(contact: Presliding, amplitude_m: float) -> tuple[History, History, History]:
    """Return the virgin leg, the unloading and the reloading of one cycle."""
    turns = (amplitude_m, -amplitude_m, amplitude_m)
    whole = remember(contact, zigzag(turns, STEPS))
    legs = []
    for start, end in ((0, STEPS), (STEPS, 2 * STEPS), (2 * STEPS, 3 * STEPS)):
        part = slice(start, end + 1)
        values = (whole.displacement_m, whole.force_n, whole.stored_j, whole.lost_j)
        legs.append(History(*(value[part] for value in values)))
    return legs[0], legs[1], legs[2]


def _sphere_branches() -> list[Check]:
    contact = lower_contact('smooth', 0.5)
    limit_m, force_n = contact.max_displacement_m, contact.max_force_n
    _, back, forth = _cycle(contact, AMPLITUDE * limit_m)
    peak = cattaneo_ratio(np.array(AMPLITUDE))
    branch = 2.0 * cattaneo_ratio(0.5 * (AMPLITUDE - back.displacement_m / limit_m))
    text = 'Mindlin, Deresiewicz'
    scale = Scale(1.0, MU_FN)
    return [
        compare_worst(
            'sphere: unloading branch',
            text,
            peak - branch,
            back.force_n / force_n,
            '',
            TABLE,
            scale,
        ),
        compare_worst(
            'sphere: reloading branch',
            text,
            branch - peak,
            forth.force_n / force_n,
            '',
            TABLE,
            scale,
        ),
        compare(
            'sphere: force where the loop closes',
            'force at the first turn',
            float(back.force_n[0]),
            float(forth.force_n[-1]),
            'N',
            CLOSING,
        ),
    ]


def _rough_cycle() -> tuple[Array, Array]:
    """Return displacement and force of the rough unloading branch in closed form."""
    form = closed_form_of(lower_contact('rough', 0.5), 'rough')
    turn_m = CORE * form.radius_m
    inner = form.radius_m - fractions(STEPS)[:-1] * (form.radius_m - turn_m)
    places_m = form.displacement(turn_m) - 2.0 * form.displacement(inner)
    return places_m, form.force(turn_m) - 2.0 * form.force(inner)


def _rough_branches() -> list[Check]:
    contact = lower_contact('rough', 0.5)
    form = closed_form_of(contact, 'rough')
    turn_m = float(form.displacement(CORE * form.radius_m))
    places_m, forces_n = _rough_cycle()
    there = np.concatenate((np.array([turn_m]), places_m, np.array([-turn_m]), -places_m))
    kernel = remember(contact, there).force_n
    count = len(places_m)
    scale = Scale(contact.max_force_n, MU_FN)
    text = 'Masing on the closed form'
    return [
        compare_worst(
            'rough: unloading branch',
            text,
            forces_n,
            kernel[1 : count + 1],
            'N',
            ROUGH_TABLE,
            scale,
        ),
        compare_worst(
            'rough: reloading branch',
            text,
            -forces_n,
            kernel[count + 2 :],
            'N',
            ROUGH_TABLE,
            scale,
        ),
    ]


def _loop_panel() -> Panel:
    smooth, rough = lower_contact('smooth', 0.5), lower_contact('rough', 0.5)
    form = closed_form_of(rough, 'rough')
    turns = (
        (smooth, 'smooth', AMPLITUDE * smooth.max_displacement_m),
        (rough, 'rough', float(form.displacement(CORE * form.radius_m))),
    )
    curves = []
    for colour, (contact, name, turn_m) in enumerate(turns):
        history = remember(contact, zigzag((turn_m, -turn_m, turn_m), 100))
        places_nm, forces_mn = history.displacement_m * 1e9, history.force_n * 1e3
        curves.append(Curve(f'{name}, kernel', places_nm, forces_mn, 'line', colour))
    places = np.linspace(-AMPLITUDE, AMPLITUDE, 17, dtype=np.float64)
    branch = 2.0 * cattaneo_ratio(0.5 * (AMPLITUDE - places))
    forces_mn = (cattaneo_ratio(np.array(AMPLITUDE)) - branch) * smooth.max_force_n * 1e3
    curves += _both_branches(
        'Mindlin, Deresiewicz', places * turns[0][2] / AMPLITUDE * 1e9, forces_mn, 0
    )
    places_m, forces_n = (each[::25] for each in _rough_cycle())
    curves += _both_branches("Masing's rule, closed form", places_m * 1e9, forces_n * 1e3, 1)
    return Panel(
        'Unloading and reloading, F_p = 0.5 N',
        'displacement u (nm)',
        'force T (mN)',
        tuple(curves),
    )


def _both_branches(label: str, x: Array, y: Array, colour: int) -> list[Curve]:
    """Return points of the unloading branch and, mirrored, of the reloading one."""
    return [Curve(label, x, y, 'points', colour), Curve('', -x, -y, 'points', colour)]
