"""
The contact spring by spring, as the paper steps it: slow, plain, and an independent reference.

Springs stand at the places x_i of the one-dimensional foundation. Each has the tangential
stiffness G* dx and slips at mu times its normal force E* dx (d - g(x_i)).

"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.validation.histories import History


@dataclass(frozen=True)
class Springs:
    """
    A row of springs.

    Attributes
    ----------
    stiffness_n_per_m : float
        Of each spring.
    thresholds_n : array
        Force at which each one slips, N.

    """

    stiffness_n_per_m: float
    thresholds_n: Array


def plant_springs(
    height: Callable[[Array], Array],
    moduli_pa: tuple[float, float],
    friction: float,
    radius_m: float,
    count: int,
) -> Springs:
    """
    Return the springs under an indenter.

    Parameters
    ----------
    height : callable
        Profile g(x), m.
    moduli_pa : tuple of float
        E* and G*, Pa.
    friction : float
        mu.
    radius_m : float
        Contact radius a, m; the indentation is g(a).
    count : int
        Number of springs from -a to a.

    """
    spacing_m = 2.0 * radius_m / count
    places_m = -radius_m + spacing_m * (np.arange(count) + 0.5)
    pressed_m = height(np.array([radius_m]))[0] - height(np.abs(places_m))
    normal_pa, shear_pa = moduli_pa
    return Springs(shear_pa * spacing_m, friction * normal_pa * spacing_m * pressed_m)


def pull(springs: Springs, displacements_m: Array) -> History:
    """
    Return the answer of the springs to a history of displacements, from rest at 0.

    Notes
    -----
    A spring is stretched by its stiffness times the step and cut back to its threshold; what is
    cut off is slip, at the force of the threshold.

    """
    forces_n = np.zeros_like(springs.thresholds_n)
    before_m = lost_j = 0.0
    rows = []
    for place_m in displacements_m:
        wanted_n = forces_n + springs.stiffness_n_per_m * (place_m - before_m)
        forces_n = np.clip(wanted_n, -springs.thresholds_n, springs.thresholds_n)
        lost_j += float(np.sum((wanted_n - forces_n) * forces_n)) / springs.stiffness_n_per_m
        stored_j = float(np.sum(forces_n**2)) / (2.0 * springs.stiffness_n_per_m)
        rows.append((float(np.sum(forces_n)), stored_j, lost_j))
        before_m = float(place_m)
    total_n, stored, lost = np.array(rows).T
    return History(displacements_m, total_n, stored, lost)
