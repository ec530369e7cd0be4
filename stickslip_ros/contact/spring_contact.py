# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""One hemisphere under any history of force and displacement, for scripts."""

from stickslip_ros.contact.hemisphere import elasticity_of, profile_of
from stickslip_ros.contact.springs import (
    Group,
    drag_springs,
    move_springs,
    spring_bank,
    springs_kind,
)
from stickslip_ros.errors import OutOfRange
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.kernels.record import record
from stickslip_ros.parameters import Parameters, checked_arguments

_move, _drag = entry_point(move_springs), entry_point(drag_springs)
CONTACT_SPRINGS = 1024
"""Springs of a contact: the force is that of the continuum to 1e-5 of the largest."""


@checked_arguments
class SpringContact:
    """
    One hemisphere under any history of normal force and displacement, by its springs.

    Parameters
    ----------
    parameters : Parameters
        The stand; only ``contact`` is used.
    normal_force_max_n : float
        Largest normal force, N, for which the 1024 springs are chosen.
    rig_n_per_m : float
        Stiffness between the measured displacement and the contact, N/m; 0: rigid.

    Raises
    ------
    OutOfRange
        If the largest force or the stiffness is impossible, or the profile too short.

    Examples
    --------
    >>> contact = SpringContact(Parameters(), normal_force_max_n=0.2)
    >>> [f'{1e3 * contact.move(5e-9, 0.1):.2f} mN' for _ in range(3)]
    ['5.76 mN', '10.97 mN', '15.62 mN']

    """

    def __init__(
        self, parameters: Parameters, normal_force_max_n: float, *, rig_n_per_m: float = 0.0
    ) -> None:
        if not 0.0 < normal_force_max_n < float('inf'):
            hint = 'give a positive number'
            raise OutOfRange('largest normal force', normal_force_max_n, 'N', 'not above 0', hint)
        if not 0.0 <= rig_n_per_m < float('inf'):
            hint = 'give that of the rig, or 0 if it is rigid'
            raise OutOfRange('stiffness of the rig', rig_n_per_m, 'N/m', 'below 0', hint)
        contact = parameters.contact
        self._bank = spring_bank(
            [Group(profile_of(contact), elasticity_of(contact), contact.friction, 1, 1.0)],
            normal_force_max_n,
            CONTACT_SPRINGS,
        )
        self._springs, self._rig_n_per_m = record(springs_kind(CONTACT_SPRINGS)), rig_n_per_m
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
        given = self._bank, self._springs, change_m, before_n, normal_force_n
        return float(_drag(*given, self._rig_n_per_m) if self._rig_n_per_m else _move(*given)[0])
