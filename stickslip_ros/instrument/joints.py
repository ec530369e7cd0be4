# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Set points of a JointState for the runner, the only joint of the drive."""

import math
from typing import NamedTuple

from stickslip_ros.errors import OutOfRange, UnknownName, WrongKind
from stickslip_ros.instrument.checks import check_position, check_velocity
from stickslip_ros.instrument.closed_loop import Goal
from stickslip_ros.parameters import Parameters


class Joints(NamedTuple):
    """Set points of joints, as in a JointState; an empty list or NaN is no set point."""

    names: tuple[str, ...] = ()  # names of the joints; empty: the joint of the drive
    # A number for each joint, m, m/s, N; or empty
    positions: tuple[float, ...] = ()
    velocities: tuple[float, ...] = ()
    efforts: tuple[float, ...] = ()


NO_JOINTS = Joints()
"""No set points, for other commands."""


def check_joints(parameters: Parameters, joints: Joints) -> Goal | None:
    """Return the goal of the runner, a position or else a velocity; None without either."""
    own = parameters.sim.joint_name
    names = joints.names or (own,)
    if len(set(names)) < len(names):
        raise WrongKind('joint names', names, 'a list of different names', 'name each joint once')
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
        raise OutOfRange('joint effort', effort_n, 'N', 'not supported', hint)
    if position_m is not None:
        return Goal(check_position(parameters, position_m))
    if velocity_m_per_s is not None:
        return Goal(None, check_velocity(parameters, 'joint velocity', velocity_m_per_s))
    return None


def _number_of(
    label: str, numbers: tuple[float, ...], names: tuple[str, ...], own: str
) -> float | None:
    """Return the number of the own joint; None if it is not given."""
    if len(numbers) not in (0, len(names)):
        hint = 'give a number for each name, or an empty list; .nan commands nothing'
        raise WrongKind(label, list(numbers[:8]), f'a list of {len(names)} numbers', hint)
    number = numbers[names.index(own)] if numbers else math.nan
    if math.isinf(number):
        raise WrongKind(label, number, 'a finite number', 'send a number; .nan commands nothing')
    return None if math.isnan(number) else number
