"""Checks of the energies of the memory kernel: friction loss, and where the work goes."""

import numpy as np

from stickslip_ros.contact.presliding import Presliding
from stickslip_ros.validation.checks import (
    Check,
    Scale,
    Tolerance,
    compare,
    compare_printed,
    compare_worst,
)
from stickslip_ros.validation.closed_forms import sphere_loss_ratio
from stickslip_ros.validation.findings import Curve, Findings, Panel
from stickslip_ros.validation.histories import LOSS_TABLE, WANDERING, remember, zigzag
from stickslip_ros.validation.stand import lower_contact
from stickslip_ros.validation.tangential import closed_form_of

CORE = 0.4
"""Stick radius c/a that a lesser cycle of the rough contact leaves."""
ROUGH_LOSS = Tolerance(1e-6, 'table under a smooth stiffness, over a loop of a lesser area')
BALANCE_STEPS = 2000
BALANCE = Tolerance(1e-6, f'trapezoidal rule of the work, {BALANCE_STEPS} steps per leg')


def energy() -> Findings:
    """Check the loss per cycle, of the virgin leg, and the balance over a history."""
    checks = (*_sphere_loss(), *_rough_loss(), *_balance())
    return Findings('Energy', checks, (_loss_panel(),))


def cycle_loss(contact: Presliding, amplitude_m: float) -> tuple[float, float]:
    """Return the kernel's loss on the virgin leg and in the steady cycle after it, J."""
    turns = np.array([amplitude_m, -amplitude_m, amplitude_m])
    lost_j = remember(contact, turns).lost_j
    return float(lost_j[0]), float(lost_j[2] - lost_j[0])


def _sphere_loss() -> list[Check]:
    contact = lower_contact('smooth', 0.5)
    limit_m = contact.max_displacement_m
    unit_j = contact.max_force_n * limit_m
    places = np.linspace(0.1, 1.2, 12, dtype=np.float64)
    expected = sphere_loss_ratio(np.minimum(places, 1.0)) + 4.0 * np.maximum(places - 1.0, 0.0)
    ours = [cycle_loss(contact, place * limit_m)[1] / unit_j for place in places]
    virgin_j, full_j = cycle_loss(contact, limit_m)
    _, half_j = cycle_loss(contact, 0.5 * limit_m)
    text = 'closed form; unit mu F_n u_max'
    return [
        compare('sphere: loss per cycle at u_max', text, 0.8, full_j / unit_j, '', LOSS_TABLE),
        compare(
            'sphere: virgin loss to u_max',
            'a quarter of the cycle, 0.2',
            0.2,
            virgin_j / unit_j,
            '',
            LOSS_TABLE,
        ),
        compare_printed('sphere: loss per cycle at u_max/2', text, '0.07279', half_j / unit_j, ''),
        compare_worst(
            'sphere: loss per cycle, 0.1 to 1.2 u_max',
            text,
            expected,
            ours,
            '',
            LOSS_TABLE,
            scale=Scale(1.0, 'mu F_n u_max'),
        ),
    ]


def _rough_loss() -> list[Check]:
    contact = lower_contact('rough', 0.5)
    form = closed_form_of(contact, 'rough')
    checks = []
    for core, words in ((0.0, 'at u_max'), (CORE, 'at c = 0.4 a')):
        core_m = core * form.radius_m
        expected_j = form.loss_per_cycle(core_m)
        virgin_j, cycle_j = cycle_loss(contact, float(form.displacement(core_m)))
        name = f'rough: loss per cycle {words}'
        checks += [
            compare(name, 'closed form, sums of powers', expected_j, cycle_j, 'J', ROUGH_LOSS),
            compare(
                f'rough: virgin loss {words}',
                'a quarter of the cycle',
                expected_j / 4.0,
                virgin_j,
                'J',
                ROUGH_LOSS,
            ),
        ]
    return checks


def _balance() -> list[Check]:
    """Check work = stored + lost over a history with nested loops and full slip."""
    checks = []
    for profile in ('smooth', 'rough'):
        contact = lower_contact(profile, 0.5)
        turns = tuple(turn * contact.max_displacement_m for turn in WANDERING)
        history = remember(contact, zigzag(turns, BALANCE_STEPS))
        steps_m = np.diff(history.displacement_m)
        means_n = 0.5 * (history.force_n[1:] + history.force_n[:-1])
        work_j = np.cumsum(means_n * steps_m)
        found_j = history.stored_j[1:] + history.lost_j[1:]
        checks.append(
            compare_worst(
                f'{profile}: stored + lost, 12 turns',
                'work int T du',
                work_j,
                found_j,
                'J',
                BALANCE,
                scale=Scale(float(work_j[-1]), 'the whole work'),
            )
        )
    return checks


def _loss_panel() -> Panel:
    places = np.logspace(-1.5, 0.0, 40, dtype=np.float64)
    some = places[::3]
    curves = [Curve('smooth, closed form', places, sphere_loss_ratio(places), 'line', 0)]
    form = closed_form_of(lower_contact('rough', 0.5), 'rough')
    cores_m = form.radius_m * (1.0 - np.logspace(-1.7, 0.0, 40, dtype=np.float64))
    limit_m, force_n = float(form.displacement(0.0)), float(form.force(0.0))
    losses = np.array([form.loss_per_cycle(float(core_m)) for core_m in cores_m])
    curves.append(
        Curve(
            'rough, closed form',
            form.displacement(cores_m) / limit_m,
            losses / (force_n * limit_m),
            'line',
            1,
        )
    )
    for colour, profile in enumerate(('smooth', 'rough')):
        contact = lower_contact(profile, 0.5)
        unit_j = contact.max_force_n * contact.max_displacement_m
        ours = [cycle_loss(contact, p * contact.max_displacement_m)[1] / unit_j for p in some]
        curves.append(Curve(f'{profile}, kernel', some, np.array(ours), 'points', colour))
    return Panel(
        'Friction loss per cycle',
        'amplitude u*/u_max',
        'loss W/(mu F_n u_max)',
        tuple(curves),
        log_x=True,
        log_y=True,
    )
