# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""One hemisphere under any history of force and displacement, for scripts."""

from stickslip_ros.contact.hemisphere import elasticity_of, profile_of
from stickslip_ros.contact.springs import (
    SPRINGS_IN_ALL,
    SPRINGS_STATE,
    Group,
    move_springs,
    spring_bank,
)
from stickslip_ros.errors import OutOfRange
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.kernels.record import record
from stickslip_ros.parameters import Parameters, checked_arguments

_move = entry_point(move_springs)


@checked_arguments
class SpringContact:
    """
    One hemisphere under any history of normal force and displacement, by its springs.

    Parameters
    ----------
    parameters : Parameters
        The stand; only ``contact`` is used.
    normal_force_max_n : float
        Largest normal force, N, for which the 128 springs are chosen.

    Raises
    ------
    OutOfRange
        If the largest force is not positive, or the profile is too short for it.

    Examples
    --------
    >>> contact = SpringContact(Parameters(), normal_force_max_n=0.2)
    >>> [f'{1e3 * contact.move(5e-9, 0.1):.2f} mN' for _ in range(3)]
    ['5.76 mN', '10.97 mN', '15.62 mN']

    """

    def __init__(self, parameters: Parameters, normal_force_max_n: float) -> None:
        if not 0.0 < normal_force_max_n < float('inf'):
            hint = 'give a positive number'
            raise OutOfRange('largest normal force', normal_force_max_n, 'N', 'not above 0', hint)
        contact = parameters.contact
        self._bank = spring_bank(
            [Group(profile_of(contact), 1, 1.0)],
            elasticity_of(contact),
            contact.friction,
            normal_force_max_n,
            SPRINGS_IN_ALL,
        )
        self._springs = record(SPRINGS_STATE)
        self._largest_n = normal_force_max_n
        self._normal_n = 0.0

    def move(self, change_m: float, normal_force_n: float) -> float:
        """
        Slide by ``change_m`` while the normal force changes; return the tangential force, N.

        Springs that lose contact forget their force; springs that come into contact have none.

        Raises OutOfRange if the normal force is below 0 or above the largest.

        """
        if not 0.0 <= normal_force_n <= self._largest_n:
            limit, hint = f'not from 0 to {self._largest_n:g}', 'give the contact a larger maximum'
            raise OutOfRange('normal force', normal_force_n, 'N', limit, hint)
        before_n, self._normal_n = self._normal_n, normal_force_n
        force_n, _ = _move(self._bank, self._springs, change_m, before_n, normal_force_n)
        return float(force_n)
