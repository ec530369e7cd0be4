# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The feet of a drive: kinds of equal feet, their contacts, and how they move.

Feet are counted in the order of the groups of ``feet.*``.

"""

from dataclasses import replace
from functools import lru_cache
from itertools import groupby
from typing import NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.contact.hemisphere import elasticity_of, profile_of
from stickslip_ros.contact.mdr import Presliding, solve_presliding
from stickslip_ros.contact.springs import Group
from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters import ContactParameters, FeetParameters, FootGroup, Parameters

FEET_STREAM = 40
"""Number of the random stream of the gains; sensors have others."""
KINDS_KEPT = 64
"""Number of layouts, solved contacts, and contacts of another radius or material that are kept."""
STANDARD_GRAVITY_M_PER_S2 = 9.80665
NO_LAW_OF_SHARES = "refused under Coulomb's law, which does not define how bodies share a load"


class FeetMotion(NamedTuple):
    """How feet move: displacement per displacement of the nominal foot, and delay, s."""

    gain: float
    delay_s: float


COMMON_MOTION = FeetMotion(1.0, 0.0)
"""All feet move at once and equally, as in the paper."""


@lru_cache(maxsize=KINDS_KEPT)
def kinds_of(contact: ContactParameters, feet: FeetParameters) -> tuple[FootGroup, ...]:
    """Join equal neighbouring feet to one kind; on rough lines each foot is a kind."""
    if contact.profile == 'rough_line':
        return tuple(each._replace(feet=1) for each in feet.groups for _ in range(each.feet))
    kinds = groupby(feet.groups, key=lambda each: each._replace(feet=0))
    return tuple(kind._replace(feet=sum(each.feet for each in own)) for kind, own in kinds)


def driven_feet(parameters: Parameters) -> int:
    """Return the number of feet that are not guides."""
    kinds = kinds_of(parameters.contact, parameters.feet)
    return sum(each.feet for each in kinds if each.gain)


def motions_of(parameters: Parameters) -> dict[FeetMotion, list[int]]:
    """Return the distinct motions of feet, and the indices of their kinds in ``kinds_of``."""
    motions: dict[FeetMotion, list[int]] = {}
    for i, each in enumerate(kinds_of(parameters.contact, parameters.feet)):
        motions.setdefault(motion_of(each), []).append(i)
    if parameters.contact.law == 'coulomb' and list(motions) != [COMMON_MOTION]:
        hint = 'set it to 1, feet.delay and feet.guide_friction to 0, or take another contact.law'
        raise OutOfRange('feet.gain', list(parameters.feet.gain), '', NO_LAW_OF_SHARES, hint)
    return motions


def motion_of(each: FootGroup) -> FeetMotion:
    """Return the motion of a kind of foot; a guide has no delay."""
    return FeetMotion(each.gain, each.delay_s if each.gain else 0.0)


def ratios_of(parameters: Parameters) -> Array:
    """Return the displacement of each foot relative to the nominal foot, shape (feet,)."""
    kinds = kinds_of(parameters.contact, parameters.feet)
    gains = np.repeat([each.gain for each in kinds], [each.feet for each in kinds])
    tolerance = parameters.actuator.gain_tolerance
    return gains * gain_ratios(tolerance, parameters.sim.seed, len(gains)) if tolerance else gains


def gain_ratios(tolerance: float, seed: int, feet: int) -> Array:
    """Return random gains of the feet within a tolerance, relative to the mean, shape (feet,)."""
    deviations = np.random.default_rng((seed, FEET_STREAM)).uniform(-1.0, 1.0, feet)
    deviations -= deviations.mean()
    return 1.0 + tolerance * deviations / max(1.0, float(np.abs(deviations).max()))


def weight_of(parameters: Parameters) -> float:
    """Return the weight of the runner, N; 0 if neglected, as in the paper."""
    return parameters.runner.mass * STANDARD_GRAVITY_M_PER_S2 * parameters.stand.weight


def groups_of(
    contact: ContactParameters, feet: FeetParameters, weight_n: float = 0.0
) -> list[Group]:
    """Return the contacts of each kind of foot under the weight of the runner, N (Eq. 19)."""
    groups, each_contact = list[Group](), contacts_of_kinds(contact, feet)
    for i, (each, own) in enumerate(zip(kinds_of(contact, feet), each_contact, strict=True)):
        if contact.travel:
            profile = profile_of(contact, i, each_contact)
        else:
            profile = profile_of(own, i if contact.profile == 'rough_line' else 0)
        friction = each.friction or contact.friction
        fixed_n = each.weight * weight_n + each.friction_n / friction
        groups.append(Group(profile, elasticity_of(own), friction, each.feet, each.share, fixed_n))
    return groups


def contacts_of_kinds(
    contact: ContactParameters, feet: FeetParameters
) -> tuple[ContactParameters, ...]:
    """Return the contact of each kind of foot, with its own radius and modulus."""
    return tuple(_contact_of(contact, each) for each in kinds_of(contact, feet))


@lru_cache(maxsize=KINDS_KEPT)
def _contact_of(contact: ContactParameters, each: FootGroup) -> ContactParameters:
    if not (each.radius_m or each.young_pa):
        return contact
    radius_m, young_pa = each.radius_m or contact.radius, each.young_pa or contact.young_sphere
    return replace(contact, radius=radius_m, young_sphere=young_pa)


def contacts_of(parameters: Parameters) -> tuple[Presliding, ...]:
    """Return the contact of each foot, in the order of the groups, under its normal force."""
    weight_n = weight_of(parameters)
    return contacts_at(parameters.contact, parameters.feet, parameters.stand.preload, weight_n)


@lru_cache(maxsize=KINDS_KEPT)
def contacts_at(
    contact: ContactParameters, feet: FeetParameters, preload_n: float, weight_n: float
) -> tuple[Presliding, ...]:
    """Return the contact of each foot at a preload and a weight of the runner, N."""
    contacts: list[Presliding] = []
    for group in groups_of(contact, feet, weight_n):
        normal_n = group.share * preload_n + group.weight_n
        solved = solve_presliding(group.profile, group.elasticity, group.friction, normal_n)
        contacts += [solved] * group.contacts
    return tuple(contacts)


def stiffest_share(parameters: Parameters) -> float:
    """Return the largest share of a foot in the stiffness of all sticking contacts."""
    each = [contact.stick_stiffness_n_per_m for contact in contacts_of(parameters)]
    return max(each) / sum(each)
