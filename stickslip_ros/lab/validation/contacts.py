# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Answers for one contact: pressed, pulled, along histories of displacement."""

from collections.abc import Callable, Mapping
from functools import lru_cache
from math import pi
from typing import Any

import numpy as np
from scipy.optimize import bisect

from stickslip_ros.arrays import Array
from stickslip_ros.contact.hemisphere import elasticity_of, profile_of
from stickslip_ros.contact.mdr import (
    Presliding,
    effective_elasticity,
    normal_force,
    solve_presliding,
)
from stickslip_ros.contact.memory import fresh_memory, lost_energy, move, stored_energy
from stickslip_ros.contact.profile import PowerProfile, Profile, smooth_profile
from stickslip_ros.contact.virgin import tabulate
from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.kernels.record import Record
from stickslip_ros.parameters import Parameters

_FORCE, _STORED, _LOST = range(3)  # columns of a log
CONE_SLOPE = 0.01  # of the test profile 'cone'
WANDERING = (0.7, -0.3, 0.5, -0.1, 0.35, 0.05, 0.6, -0.5, 0.9, -1.2, 1.4, 0.2)
"""Turning points, as shares of a reach: nested, closing and slipping loops."""
WANDERING_STEPS = 30
_BALANCE_STEPS = 2000
SLOPE_STEP = 1e-4
PULL_POINTS, PULL_WEIGHTS = np.polynomial.legendre.leggauss(200)  # Gauss-Legendre rule on (-1, 1)


@entry_point
def follow_curve(curve: Record, memory: Record, places_m: Array, log: Array) -> None:
    """Move along places; each row of the log receives force, its error bound, depth."""
    for i in range(len(places_m)):
        move(curve, memory, places_m[i])
        log[i, 0] = memory.force_n
        log[i, 1] = memory.error_n
        log[i, 2] = memory.depth


@entry_point
def follow_energies(curve: Record, memory: Record, places_m: Array, log: Array) -> None:
    """Move along places; each row of the log receives force, stored and lost energy."""
    for i in range(len(places_m)):
        move(curve, memory, places_m[i])
        log[i, 0] = memory.force_n
        log[i, 1] = stored_energy(curve, memory)
        log[i, 2] = lost_energy(curve, memory)


@lru_cache(maxsize=64)
def contact(profile: str, force_n: float) -> Presliding:
    """Return a contact of the default materials under a normal force."""
    if profile == 'cone':
        parameters = Parameters().contact
        shape: Profile = PowerProfile((0.5 * pi * CONE_SLOPE,), (1.0,))
    else:
        parameters = Parameters().updated({'contact.profile': profile}).contact
        shape = profile_of(parameters)
    return solve_presliding(shape, elasticity_of(parameters), parameters.friction, force_n)


def depth_m(profile: str, force_n: float) -> float:
    """Return the indentation."""
    return contact(profile, force_n).indentation.depth_m


def normal_stiffness_n_per_m(profile: str, force_n: float) -> float:
    """Return dF_n/dd by a central difference."""
    one = contact(profile, force_n)
    step_m = SLOPE_STEP * one.indentation.depth_m
    near_m = one.indentation.depth_m + np.array([-step_m, step_m])
    low_n, high_n = normal_force(one.profile, one.elasticity, near_m)
    return float((high_n - low_n) / (2.0 * step_m))


def pull_ratio(profile: str, force_n: float, share: float) -> float:
    """Return T/(mu F_n) at u/u_max on the virgin curve, in closed form."""
    one = contact(profile, force_n)
    return float(one.tangential_force(share * one.max_displacement_m)) / one.max_force_n


@lru_cache(maxsize=64)
def remember(profile: str, force_n: float, places_m: tuple[float, ...]) -> Array:
    """Return force, stored and lost energy of the memory kernel at each place, from 0."""
    log = np.zeros((len(places_m), 3))
    curve = tabulate([contact(profile, force_n)])
    follow_energies(curve, fresh_memory(), np.array(places_m), log)
    return log


def drive_max_displacement_m(profile: str, preload_n: float) -> float:
    """Return u_max of the lower contacts of the drive of the paper, the last ones."""
    stand = Parameters().updated({'contact.profile': profile, 'stand.preload': preload_n})
    return contacts_of(stand)[-1].max_displacement_m


def normal_force_n(profile: str, depth_m: float) -> float:
    """Return the normal force at a depth."""
    one = contact(profile, 0.1)
    return float(normal_force(one.profile, one.elasticity, depth_m))


def after_turns(turns_m: float | str, **at: Any) -> Array:
    """Return force, stored and lost energy of the memory kernel after turning points."""
    log = remember(**at, places_m=tuple(float(turn) for turn in str(turns_m).split('/')))
    return np.asarray(log[-1])


def cycle_loss_j(profile: str, force_n: float, amplitude_m: float) -> float:
    """Return the friction loss of the memory kernel in a steady cycle."""
    lost_j = remember(profile, force_n, (amplitude_m, -amplitude_m, amplitude_m))[:, _LOST]
    return float(lost_j[2] - lost_j[0])


def zigzag(turning_points_m: tuple[float, ...], steps: int) -> Array:
    """Return a history from 0 through turning points, in equal steps per leg."""
    corners = np.arange(len(turning_points_m) + 1) * steps
    return np.interp(np.arange(corners[-1] + 1.0), corners, (0.0, *turning_points_m))


def wandering(reach_m: float, steps: int) -> Array:
    """Return the history of WANDERING, m."""
    return zigzag(tuple(turn * reach_m for turn in WANDERING), steps)


def after_legs(profile: str, force_n: float, reach_m: float, legs: float) -> Array:
    """Return force, stored and lost energy after legs of WANDERING."""
    path_m = tuple(wandering(reach_m, WANDERING_STEPS).tolist())
    log = remember(profile, force_n, path_m)
    return np.asarray(log[round(legs * WANDERING_STEPS)])


def missing_share(history: Array, force_n: Array, energies_j: Array) -> float:
    """Return the largest difference between work and energies, per total work."""
    means_n = 0.5 * (force_n[1:] + force_n[:-1])
    work_j = np.concatenate(([0.0], np.cumsum(means_n * np.diff(history))))
    return float(np.max(np.abs(work_j - energies_j)) / work_j[-1])


def wandering_missing(profile: str, force_n: float, reach_m: float) -> float:
    """Return the share of work along WANDERING that is neither stored nor lost."""
    path_m = wandering(reach_m, _BALANCE_STEPS)
    log = remember(profile, force_n, tuple(path_m.tolist()))
    return missing_share(path_m, log[:, 0], log[:, 1] + log[:, 2])


@lru_cache(maxsize=4)
def ring_down_log(
    profile: str, force_n: float, reach_m: float, reversals: float
) -> tuple[Array, Record, Record]:
    """Return the force at each reversal of a linear ring-down, with final curve and memory."""
    curve, memory = tabulate([contact(profile, force_n)]), fresh_memory()
    count = round(reversals)
    log = np.zeros((count, 3))
    turns_m = reach_m * (1.0 - np.arange(count) / count)
    turns_m[1::2] *= -1.0
    follow_curve(curve, memory, turns_m, log)
    return log[:, 0].copy(), curve, memory


def after_ring_down_n(
    profile: str, force_n: float, reach_m: float, reversals: float, displacement_m: float
) -> float:
    """Return the force at a displacement after a ring-down."""
    _, curve, memory = ring_down_log(profile, force_n, reach_m, reversals)
    memory, log = memory.copy(), np.zeros((1, 3))
    follow_curve(curve, memory, np.array([displacement_m]), log)
    return float(log[0, 0])


@lru_cache(maxsize=1)
def sphere(
    ball_m: float, shear_pa: float, poisson: float, friction: float, force_n: float
) -> Presliding:
    """Return a sphere on a plane of its own material."""
    young_pa = 2.0 * shear_pa * (1.0 + poisson)
    elasticity = effective_elasticity(young_pa, poisson, young_pa, poisson)
    return solve_presliding(smooth_profile(ball_m), elasticity, friction, force_n)


def ball_normal_j(**ball: float) -> float:
    """Return the work of pressing a sphere, by quadrature."""
    one = sphere(**ball)
    deep_m = one.indentation.depth_m
    forces_n = normal_force(one.profile, one.elasticity, 0.5 * deep_m * (1.0 + PULL_POINTS))
    return float(np.sum(0.5 * PULL_WEIGHTS * forces_n)) * deep_m


def ball_shift_m(pull: float, **ball: float) -> float:
    """Return the displacement at which the force is a share ``pull`` of mu F_n."""
    one = sphere(**ball)

    def difference_n(shift_m: float) -> float:
        return float(one.tangential_force(shift_m)) - pull * one.max_force_n

    return float(bisect(difference_n, 0.0, one.max_displacement_m, xtol=1e-18))


def ball_stick_share(pull: float, **ball: float) -> float:
    """Return the sticking share of the contact area at the displacement of a pull."""
    one = sphere(**ball)
    return float(one.stick_radius(ball_shift_m(pull, **ball)) / one.indentation.radius_m) ** 2


def ball_energies(pull: float, **ball: float) -> Array:
    """Return force, stored and lost energy of the pull, by the memory kernel."""
    log = np.zeros((1, 3))
    shift_m = np.array([ball_shift_m(pull, **ball)])
    follow_energies(tabulate([sphere(**ball)]), fresh_memory(), shift_m, log)
    return np.asarray(log[0])


ANSWERS: Mapping[str, Callable[..., Any]] = {
    'normal_modulus_pa': lambda: elasticity_of(Parameters().contact).normal_pa,  # E*
    'shear_modulus_pa': lambda: elasticity_of(Parameters().contact).shear_pa,  # G*
    'cattaneo_mindlin': lambda: elasticity_of(Parameters().contact).cattaneo_mindlin,  # E*/G*
    'depth_m': depth_m,
    'radius_m': lambda **at: contact(**at).indentation.radius_m,
    'radius_at_depth_m': lambda profile, depth_m: contact(profile, 0.1).profile.half_width(
        depth_m
    ),
    'normal_force_n': normal_force_n,
    'normal_stiffness_n_per_m': normal_stiffness_n_per_m,
    'max_displacement_m': lambda **at: contact(**at).max_displacement_m,  # u_max: all slips
    'drive_max_displacement_m': drive_max_displacement_m,
    'max_force_n': lambda **at: contact(**at).max_force_n,  # mu F_n
    'stick_stiffness_n_per_m': lambda **at: contact(**at).stick_stiffness_n_per_m,  # 2 G* a
    'stick_radius_m': lambda displacement_m, **at: contact(**at).stick_radius(displacement_m),
    'pull_n': lambda displacement_m, **at: contact(**at).tangential_force(displacement_m),
    'pull_ratio': pull_ratio,
    'kernel_force_n': lambda turns_m, **at: after_turns(turns_m, **at)[_FORCE],
    'kernel_loss_j': lambda turns_m, **at: after_turns(turns_m, **at)[_LOST],
    'cycle_loss_j': cycle_loss_j,
    'wandering_force_n': lambda **at: after_legs(**at)[_FORCE],
    'wandering_stored_j': lambda **at: after_legs(**at)[_STORED],
    'wandering_loss_j': lambda **at: after_legs(**at)[_LOST],
    'wandering_missing': wandering_missing,
    'ring_down_n': lambda after, **at: ring_down_log(**at)[0][round(after) - 1],
    'after_ring_down_n': after_ring_down_n,
    'ball_depth_m': lambda **ball: sphere(**ball).indentation.depth_m,
    'ball_normal_j': ball_normal_j,
    'ball_shift_m': ball_shift_m,
    'ball_stick_share': ball_stick_share,
    'ball_stored_j': lambda **ball: ball_energies(**ball)[_STORED],
    'ball_loss_j': lambda **ball: ball_energies(**ball)[_LOST],
}
"""Functions by quantity; the name ends with the unit."""
