# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What a JointState asks of the runner, which is the joint of the drive."""

import math
from typing import NamedTuple

from stickslip_ros.errors import OutOfRange, UnknownName, WrongKind
from stickslip_ros.instrument.checks import check_position, check_velocity
from stickslip_ros.instrument.closed_loop import Goal
from stickslip_ros.parameters import Parameters


class Joints(NamedTuple):
    """
    What is asked of joints, as a JointState says it; empty or not a number is not asked.

    Attributes
    ----------
    names : tuple of str
        Names of the joints; empty for the one that the drive has.
    positions, velocities, efforts : tuple of float
        One number per joint, m, m/s, N; or none.

    """

    names: tuple[str, ...] = ()
    positions: tuple[float, ...] = ()
    velocities: tuple[float, ...] = ()
    efforts: tuple[float, ...] = ()


NOTHING = Joints()
"""What a command other than that of joints asks of them."""


def check_joints(parameters: Parameters, joints: Joints) -> Goal | None:
    """Return what the runner shall do: go to a position, else move with a velocity; or nothing."""
    own = parameters.sim.joint_name
    names = joints.names or (own,)
    if own not in names:
        raise UnknownName(
            'joint', ', '.join(names), f'that of this drive is {own}, sim.joint_name'
        )
    position_m, velocity_m_per_s, effort_n = (
        _number_of(f'joint {label}', numbers, names, own)
        for label, numbers in zip(('position', 'velocity', 'effort'), joints[1:], strict=True)
    )
    if effort_n is not None:
        hint = 'command a position or a velocity'
        raise OutOfRange('joint effort', effort_n, 'N', 'not what the drive can follow', hint)
    if position_m is not None:
        return Goal(check_position(parameters, position_m))
    if velocity_m_per_s is not None:
        return Goal(None, check_velocity(parameters, 'joint velocity', velocity_m_per_s))
    return None


def _number_of(
    label: str, numbers: tuple[float, ...], names: tuple[str, ...], own: str
) -> float | None:
    """Return the number of a joint; None where none is given."""
    if len(numbers) not in (0, len(names)):
        hint = 'give one to each name, or none at all; .nan is not commanded'
        raise WrongKind(label, list(numbers[:8]), f'a list of {len(names)} numbers', hint)
    number = numbers[names.index(own)] if numbers else math.nan
    if math.isinf(number):
        raise WrongKind(label, number, 'a finite number', 'send a number; .nan is not commanded')
    return None if math.isnan(number) else number
