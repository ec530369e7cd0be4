"""From parameters to the records of six feet; what happens to them between two runs."""

from collections.abc import Sequence

import numpy as np

from stickslip_ros.contact.bank import Group
from stickslip_ros.contact.kernel import in_python
from stickslip_ros.contact.memory import CAPACITY
from stickslip_ros.contact.presliding import Presliding
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.reaction import ContactState, History, onto_springs
from stickslip_ros.contact.springs import SpringBank
from stickslip_ros.contact.virgin import tabulate_each
from stickslip_ros.drive.feet import OFFSET, keep_state, plain_contact_of, plain_state_of
from stickslip_ros.drive.records import Plant
from stickslip_ros.drive.stages import (
    ENERGY_MAX,
    FEET,
    FORCE_MAX,
    GROUP,
    PART,
    RATIO,
    SHARE,
    Feet,
    FeetHistory,
)
from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters import Parameters

FEET_STREAM = 40
"""Number of the random stream of the gains: sensors have others."""


def equal_feet(contacts: Sequence[Presliding], groups: Sequence[Group], bank: SpringBank) -> Feet:
    """
    Return six feet that move alike.

    Parameters
    ----------
    contacts : sequence of Presliding
        One contact per foot.
    groups : sequence of Group
        The groups of equal contacts, in the order of the feet.
    bank : SpringBank
        Springs of the groups.

    """
    group_of = np.repeat(np.arange(len(groups)), [group.contacts for group in groups])
    counts = np.array([[group.contacts] for group in groups], dtype=float)
    rows = (
        bank.heights_m * counts,
        bank.normal_n_per_m,
        bank.shear_n_per_m,
        bank.area_n,
        bank.slope_n_per_m,
    )
    springs = np.array([(row / counts)[group_of] for row in rows])[:, :, np.newaxis, :]
    numbers = np.zeros((FEET, ENERGY_MAX + 1))
    numbers[:, SHARE] = [groups[group].share for group in group_of]
    numbers[:, PART] = numbers[:, SHARE] / numbers[:, SHARE].sum()
    numbers[:, GROUP] = group_of
    numbers[:, RATIO] = 1.0
    feet = Feet(False, 0, np.empty((0, 0, 4)), np.ascontiguousarray(springs), numbers)
    return with_curves(feet, contacts)


def with_curves(feet: Feet, contacts: Sequence[Presliding]) -> Feet:
    """Return feet with the virgin curves of other contacts."""
    curves = tabulate_each(contacts)
    numbers = feet.numbers.copy()
    numbers[:, FORCE_MAX] = [curve.force_max_n for curve in curves]
    numbers[:, ENERGY_MAX] = [curve.energy_max_j for curve in curves]
    _, firsts = np.unique(numbers[:, GROUP], return_index=True)
    return feet._replace(cells=np.stack([curves[i].cells for i in firsts]), numbers=numbers)


def gain_ratios(tolerance: float, seed: int) -> Array:
    """
    Return the gain of each foot relative to the mean, shape (6,).

    Parameters
    ----------
    tolerance : float
        Largest deviation.
    seed : int
        Seed of the stand.

    """
    deviations = np.random.default_rng((seed, FEET_STREAM)).uniform(-1.0, 1.0, FEET)
    deviations -= deviations.mean()
    return 1.0 + tolerance * deviations / max(1.0, float(np.abs(deviations).max()))


def with_gains(feet: Feet, parameters: Parameters) -> Feet:
    """
    Return feet with the gains of a stand: separate where the gains differ.

    Raises
    ------
    OutOfRange
        If they differ under Coulomb's law.

    """
    tolerance = parameters.actuator.gain_tolerance
    if tolerance == 0.0:
        return feet
    if parameters.contact.law == 'coulomb':
        limit = 'not 0 under the rigid law of Coulomb, which does not say how feet share a load'
        mend = 'set it to 0, or take another contact.law'
        raise OutOfRange('actuator.gain_tolerance', tolerance, '', limit, mend)
    numbers = feet.numbers.copy()
    numbers[:, RATIO] = gain_ratios(tolerance, parameters.sim.seed)
    return feet._replace(separate=True, numbers=numbers)


def fresh_feet(feet: Feet) -> FeetHistory:
    """Return the arrays in which six feet remember."""
    return FeetHistory(
        stacks=np.zeros((FEET, CAPACITY, 3)),
        springs=np.zeros((FEET, 1, feet.springs.shape[-1])),
        states=np.zeros((FEET, OFFSET + 1)),
    )


def onto_springs_of_feet(plant: Plant, history: FeetHistory, whole: ContactState) -> ContactState:
    """Let the springs of every foot take over from its turning points; return all as one."""
    on_springs = whole.on_springs
    for foot in range(FEET):
        own = History(history.stacks[foot], history.springs[foot])
        state = plain_state_of(history.states, foot, whole.preload_n)
        state = onto_springs(plain_contact_of(plant, foot), own, state)
        in_python(keep_state)(history.states, foot, state)
        on_springs = on_springs or state.on_springs
    return whole._replace(on_springs=on_springs)
