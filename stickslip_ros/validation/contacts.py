"""What the package answers for one contact: pressed, pulled, along histories of displacement."""

from functools import lru_cache
from math import pi

import numpy as np
from scipy.optimize import bisect

from stickslip_ros.contact.hemisphere import elasticity_of, profile_of
from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.mdr import (
    Presliding,
    effective_elasticity,
    normal_force,
    presliding,
)
from stickslip_ros.contact.memory import fresh_memory, lost_energy, move, stored_energy
from stickslip_ros.contact.profile import Array, PowerProfile, Profile, smooth_profile
from stickslip_ros.contact.record import Record
from stickslip_ros.contact.virgin import tabulate
from stickslip_ros.drive.build import contacts_of
from stickslip_ros.parameters import Parameters

CONE_SLOPE = 0.01  # of the profile 'cone', which is no parameter
WANDERING = (0.7, -0.3, 0.5, -0.1, 0.35, 0.05, 0.6, -0.5, 0.9, -1.2, 1.4, 0.2)
"""Turning points, as shares of a reach, with nested, closing and fully slipping loops."""
WANDERING_STEPS = 30
BALANCE_STEPS = 2000
SLOPE_STEP = 1e-4
PULL_POINTS, PULL_WEIGHTS = np.polynomial.legendre.leggauss(200)
"""Of Gauss and Legendre, on (-1, 1)."""


@entry_point
def follow(curve: Record, memory: Record, places_m: Array, log: Array) -> None:
    """Move from place to place; rows of the log receive force, bound of its error, depth."""
    for i in range(len(places_m)):
        move(curve, memory, places_m[i])
        log[i, 0] = memory.force_n
        log[i, 1] = memory.error_n
        log[i, 2] = memory.depth


@entry_point
def follow_energies(curve: Record, memory: Record, places_m: Array, log: Array) -> None:
    """Move from place to place; rows of the log receive force, stored and lost energy."""
    for i in range(len(places_m)):
        move(curve, memory, places_m[i])
        log[i, 0] = memory.force_n
        log[i, 1] = stored_energy(curve, memory)
        log[i, 2] = lost_energy(curve, memory)


@lru_cache(maxsize=64)
def contact(profile: str, force_n: float) -> Presliding:
    """Return the contact of the default materials under a normal force."""
    if profile == 'cone':
        parameters = Parameters().contact
        shape: Profile = PowerProfile((0.5 * pi * CONE_SLOPE,), (1.0,))
    else:
        parameters = Parameters().updated({'contact.profile': profile}).contact
        shape = profile_of(parameters)
    return presliding(shape, elasticity_of(parameters), parameters.friction, force_n)


def normal_modulus_pa() -> float:
    """E* of the default materials."""
    return elasticity_of(Parameters().contact).normal_pa


def shear_modulus_pa() -> float:
    """G* of the default materials."""
    return elasticity_of(Parameters().contact).shear_pa


def cattaneo_mindlin() -> float:
    """C_M = E*/G*."""
    return elasticity_of(Parameters().contact).cattaneo_mindlin


def depth_m(profile: str, force_n: float) -> float:
    """Return the indentation."""
    return contact(profile, force_n).indentation.depth_m


def radius_m(profile: str, force_n: float) -> float:
    """Return the contact radius of a force."""
    return contact(profile, force_n).indentation.radius_m


def radius_at_depth_m(profile: str, depth_m: float) -> float:
    """Return the contact radius of a depth."""
    return float(contact(profile, 0.1).profile.half_width(depth_m))


def normal_force_n(profile: str, depth_m: float) -> float:
    """Return the normal force of a depth."""
    one = contact(profile, 0.1)
    return float(normal_force(one.profile, one.elasticity, depth_m))


def normal_stiffness_n_per_m(profile: str, force_n: float) -> float:
    """Return dF_n/dd by a central difference."""
    one = contact(profile, force_n)
    step_m = SLOPE_STEP * one.indentation.depth_m
    near_m = one.indentation.depth_m + np.array([-step_m, step_m])
    low_n, high_n = normal_force(one.profile, one.elasticity, near_m)
    return float((high_n - low_n) / (2.0 * step_m))


def max_displacement_m(profile: str, force_n: float) -> float:
    """Return u_max, at which everything slips."""
    return contact(profile, force_n).max_displacement_m


def drive_max_displacement_m(profile: str, preload_n: float) -> float:
    """Return u_max of the lower contacts that the drive builds."""
    stand = Parameters().updated({'contact.profile': profile, 'stand.preload': preload_n})
    return contacts_of(stand)[-1].max_displacement_m


def max_force_n(profile: str, force_n: float) -> float:
    """Return mu F_n."""
    return contact(profile, force_n).max_force_n


def stick_stiffness_n_per_m(profile: str, force_n: float) -> float:
    """Return 2 G* a."""
    return contact(profile, force_n).stick_stiffness_n_per_m


def stick_radius_m(profile: str, force_n: float, displacement_m: float) -> float:
    """Return the radius c of what sticks on the virgin curve."""
    return float(contact(profile, force_n).stick_radius(displacement_m))


def pull_n(profile: str, force_n: float, displacement_m: float) -> float:
    """Return the tangential force on the virgin curve, in closed form."""
    return float(contact(profile, force_n).tangential_force(displacement_m))


def pull_ratio(profile: str, force_n: float, share: float) -> float:
    """Return T/(mu F_n) at u/u_max on the virgin curve, in closed form."""
    one = contact(profile, force_n)
    return float(one.tangential_force(share * one.max_displacement_m)) / one.max_force_n


@lru_cache(maxsize=64)
def remember(profile: str, force_n: float, places_m: tuple[float, ...]) -> Array:
    """Return force, stored and lost energy by the memory kernel at each place, from rest at 0."""
    log = np.zeros((len(places_m), 3))
    curve = tabulate([contact(profile, force_n)])
    follow_energies(curve, fresh_memory(), np.array(places_m), log)
    return log


def _turns(turns_m: float | str) -> tuple[float, ...]:
    return tuple(float(turn) for turn in str(turns_m).split('/'))


def kernel_force_n(profile: str, force_n: float, turns_m: float | str) -> float:
    """Return the force of the memory kernel at the last of some turning points."""
    return float(remember(profile, force_n, _turns(turns_m))[-1, 0])


def kernel_loss_j(profile: str, force_n: float, turns_m: float | str) -> float:
    """Return the friction loss of the memory kernel on the way to the last turning point."""
    return float(remember(profile, force_n, _turns(turns_m))[-1, 2])


def cycle_loss_j(profile: str, force_n: float, amplitude_m: float) -> float:
    """Return the friction loss of the memory kernel in a steady cycle."""
    lost_j = remember(profile, force_n, (amplitude_m, -amplitude_m, amplitude_m))[:, 2]
    return float(lost_j[2] - lost_j[0])


def zigzag(turning_points_m: tuple[float, ...], steps: int) -> Array:
    """Return a history from 0 through turning points, each leg in equal steps."""
    corners = np.arange(len(turning_points_m) + 1) * steps
    return np.interp(np.arange(corners[-1] + 1.0), corners, (0.0, *turning_points_m))


def wandering(reach_m: float, steps: int) -> Array:
    """Return the history WANDERING, m."""
    return zigzag(tuple(turn * reach_m for turn in WANDERING), steps)


def _wandering_row(profile: str, force_n: float, reach_m: float, legs: float) -> Array:
    """Return force, stored and lost energy after some legs of WANDERING."""
    path_m = tuple(wandering(reach_m, WANDERING_STEPS).tolist())
    log = remember(profile, force_n, path_m)
    return np.asarray(log[round(legs * WANDERING_STEPS)])


def wandering_force_n(profile: str, force_n: float, reach_m: float, legs: float) -> float:
    """Return the force of the memory kernel after some legs of WANDERING."""
    return float(_wandering_row(profile, force_n, reach_m, legs)[0])


def wandering_stored_j(profile: str, force_n: float, reach_m: float, legs: float) -> float:
    """Return the elastic energy in the memory kernel after some legs of WANDERING."""
    return float(_wandering_row(profile, force_n, reach_m, legs)[1])


def wandering_loss_j(profile: str, force_n: float, reach_m: float, legs: float) -> float:
    """Return the friction loss of the memory kernel after some legs of WANDERING."""
    return float(_wandering_row(profile, force_n, reach_m, legs)[2])


def missing_share(history: Array, force_n: Array, energies_j: Array) -> float:
    """Return the largest difference of work and energies along a history, of the whole work."""
    means_n = 0.5 * (force_n[1:] + force_n[:-1])
    work_j = np.concatenate(([0.0], np.cumsum(means_n * np.diff(history))))
    return float(np.max(np.abs(work_j - energies_j)) / work_j[-1])


def wandering_missing(profile: str, force_n: float, reach_m: float) -> float:
    """Return which share of the work along WANDERING is neither stored nor lost."""
    path_m = wandering(reach_m, BALANCE_STEPS)
    log = remember(profile, force_n, tuple(path_m.tolist()))
    return missing_share(path_m, log[:, 0], log[:, 1] + log[:, 2])


@lru_cache(maxsize=4)
def _ring_down(
    profile: str, force_n: float, reach_m: float, reversals: int
) -> tuple[Array, Record, Record]:
    """Return force after each of the reversals of a linear ring-down, curve and memory then."""
    curve, memory = tabulate([contact(profile, force_n)]), fresh_memory()
    log = np.zeros((reversals, 3))
    turns_m = reach_m * (1.0 - np.arange(reversals) / reversals)
    turns_m[1::2] *= -1.0
    follow(curve, memory, turns_m, log)
    return log[:, 0].copy(), curve, memory


def ring_down_n(
    profile: str, force_n: float, reach_m: float, reversals: float, after: float
) -> float:
    """Return the force after some of the reversals of a linear ring-down to 0."""
    return float(_ring_down(profile, force_n, reach_m, round(reversals))[0][round(after) - 1])


def after_ring_down_n(
    profile: str, force_n: float, reach_m: float, reversals: float, displacement_m: float
) -> float:
    """Return the force at a displacement on the way out after such a ring-down."""
    _, curve, memory = _ring_down(profile, force_n, reach_m, round(reversals))
    memory, log = memory.copy(), np.zeros((1, 3))
    follow(curve, memory, np.array([displacement_m]), log)
    return float(log[0, 0])


@lru_cache(maxsize=1)
def _ball(
    ball_m: float, shear_pa: float, poisson: float, friction: float, force_n: float
) -> Presliding:
    """Return a sphere on a plane of its own material."""
    young_pa = 2.0 * shear_pa * (1.0 + poisson)
    elasticity = effective_elasticity(young_pa, poisson, young_pa, poisson)
    return presliding(smooth_profile(ball_m), elasticity, friction, force_n)


def ball_depth_m(**ball: float) -> float:
    """Return the approach of a sphere and a plane."""
    return _ball(**ball).indentation.depth_m


def ball_normal_j(**ball: float) -> float:
    """Return the work of pressing them, by quadrature."""
    one = _ball(**ball)
    deep_m = one.indentation.depth_m
    forces_n = normal_force(one.profile, one.elasticity, 0.5 * deep_m * (1.0 + PULL_POINTS))
    return float(np.sum(0.5 * PULL_WEIGHTS * forces_n)) * deep_m


def ball_shift_m(pull: float, **ball: float) -> float:
    """Return the shift at which the force is a share of mu F_n."""
    one = _ball(**ball)

    def missing_n(shift_m: float) -> float:
        return float(one.tangential_force(shift_m)) - pull * one.max_force_n

    return float(bisect(missing_n, 0.0, one.max_displacement_m, xtol=1e-18))


def ball_stick_share(pull: float, **ball: float) -> float:
    """Return which share of the contact area sticks then."""
    one = _ball(**ball)
    return float(one.stick_radius(ball_shift_m(pull, **ball)) / one.indentation.radius_m) ** 2


def _ball_energies(pull: float, **ball: float) -> Array:
    log = np.zeros((1, 3))
    shift_m = np.array([ball_shift_m(pull, **ball)])
    follow_energies(tabulate([_ball(**ball)]), fresh_memory(), shift_m, log)
    return np.asarray(log[0])


def ball_stored_j(pull: float, **ball: float) -> float:
    """Return the elastic energy of the pull, by the memory kernel."""
    return float(_ball_energies(pull, **ball)[1])


def ball_loss_j(pull: float, **ball: float) -> float:
    """Return the friction loss of the pull, by the memory kernel."""
    return float(_ball_energies(pull, **ball)[2])
