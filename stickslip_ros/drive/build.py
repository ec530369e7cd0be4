# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Build the records of the drive from parameters."""

import math
from collections import deque
from collections.abc import Sequence
from functools import lru_cache
from weakref import finalize

import numpy as np

from stickslip_ros.contact.ageing import AGEING
from stickslip_ros.contact.hemisphere import lines_of
from stickslip_ros.contact.laws import COULOMB, EPM, LAW, MDR, plastic_bents
from stickslip_ros.contact.mdr import Presliding
from stickslip_ros.contact.reaction import CONTACT, CONTACT_STATE, relax
from stickslip_ros.contact.springs import SPRINGS_IN_ALL, Group, bank_of_rows, spring_bank
from stickslip_ros.contact.travel import NO_PLACE
from stickslip_ros.contact.virgin import tabulate, tabulate_each
from stickslip_ros.drive import layout
from stickslip_ros.drive.advance import PASSES_MIN
from stickslip_ros.drive.amplifier import is_direct
from stickslip_ros.drive.delay import rest_late
from stickslip_ros.drive.division import (
    divide_among_feet,
    lost_before_division,
    switch_all_to_springs,
)
from stickslip_ros.drive.long_step import LANES
from stickslip_ros.drive.piezo import rest_piezo
from stickslip_ros.drive.records import (
    ALL,
    AMPLIFIER,
    BUTTON,
    FRAME,
    PIEZO,
    PLANT,
    STATE,
    WALLS,
)
from stickslip_ros.errors import OutOfRange
from stickslip_ros.kernels.kernel import in_python
from stickslip_ros.kernels.record import Record, record, records
from stickslip_ros.parameters import (
    LAWS,
    ContactParameters,
    FeetParameters,
    FrictionLawParameters,
    Parameters,
    StandParameters,
    spec_of,
)

PHASE_MAX = 1.1
"""Largest product of step and angular frequency, or damping rate. The steps are series in both;
up to this limit the energy balances to a few 1e-3."""
TRAVEL_MARGIN = 0.7
"""Factor on the longest step for travelling roughness: it allows for twice the stiffness."""
TREAD_CYCLES = 0.75
"""Cycles of the piezo's resonance in which a level of the converter still excites it."""
LOW_TREAD = 4e-3
"""Largest motion of the feet per level, as a share of the presliding range, for which levels
shorter than a step become a straight line; the error is about that share."""
TREADS_PER_STEP = 8
"""Most levels in the longest step, for any level and any resonance."""
RANGES_SPREAD = 2.0
"""Largest presliding range that limits the steps, relative to the smallest range of feet that move
as one; 1.6 for the smooth contacts of the paper."""
LAW_REFINEMENT = 4
"""Factor by which steps are shorter under a rival law that depends on velocity."""
LITTLE_FRICTION = 0.1
"""Friction limit of feet of equal motion, relative to the mean over all motions; feet below it
allow proportionally longer steps, since their errors count less."""
FALLS_APART = 2.0
"""With more falls in a cycle the steps are longer. Each of n falls moves an n-th of the friction,
so its errors count less: with 12 delays the position errs by 6e-6 (4e-6 with short steps; two
delays: 4e-6), near the 0-amplitude by 3e-5 (2e-5; 2e-5)."""
TREADS_KEPT = 8
MODELS_KEPT = 64
"""Contact models kept for the next drive; a sweep over amplitudes needs one for each preload."""
_ended = deque[Record](maxlen=LANES)  # memory of plants: fresh pages take 0.1 ms


def plant_of(parameters: Parameters) -> Record:
    """
    Return the constants of a drive, an array of one record of PLANT.

    Raises OutOfRange if frame, load button, stacks or feet that move differently are set under
    Coulomb's law, which does not define how contacts share a load; if the frame is not heavier
    than its feet; if travelling roughness has feet of equal motion that are not neighbours.

    """
    _refuse_under_coulomb(parameters)
    attached = parameters.load_cell.contact == 'attached'
    plants = records(
        PLANT,
        _empty_plant(parameters),
        mass_kg=parameters.runner.mass,
        per_kg=1.0 / parameters.runner.mass,
        damping_n_s_per_m=parameters.runner.damping,
        cell_n_per_m=parameters.load_cell.stiffness if attached else 0.0,
        gain_m_per_v=parameters.actuator.gain,
        rest_v=parameters.amplifier.voltage_initial,
        voltage_min_v=parameters.amplifier.voltage_min,
        voltage_max_v=parameters.amplifier.voltage_max,
        slew_v_per_s=slew_of(parameters),
        amplifier=amplifier_of(parameters),
        piezo=piezo_of(parameters),
        walls=walls_of(parameters),
        button=button_of(parameters),
        frame=frame_of(parameters),
        load_n=parameters.stand.load,
    )
    plant = plants[0]
    if attached:
        plant.mass_kg += plant.button.mass_kg
        plant.per_kg = 1.0 / plant.mass_kg
        plant.damping_n_s_per_m += plant.button.damping_n_s_per_m
    plant.contacts[ALL] = all_contacts(parameters)
    plant.ratios[ALL], plant.counts[ALL] = 1.0, parameters.feet.total
    plant.driven = max(layout.driven_feet(parameters), 1)
    plant.presliding_m = _range_of(layout.contacts_of(parameters))
    if parameters.contact.travel:
        each = layout.contacts_of_kinds(parameters.contact, parameters.feet)
        plant.track = lines_of(parameters.contact, each)
    motions = layout.motions_of(parameters)
    if list(motions) != [layout.COMMON_MOTION]:
        _separate_motions(plant, parameters, motions)
    if parameters.actuator.gain_tolerance or plant.piezo.stack_n_per_m:
        separate_feet(plants, parameters)
    _set_longest_step(plant, parameters)
    set_ideal(plant)
    return plants


def _empty_plant(parameters: Parameters) -> Record:
    """Return a plant whose fields are 0 or follow; its memory is taken again when it is gone."""
    try:  # another thread may take the last one
        plants = _ended.pop()
    except IndexError:
        plants = records(PLANT)
    if not parameters.contact.travel:  # the track is then untouched
        memory = np.frombuffer(plants.base, PLANT)
        finalize(plants, _keep_memory, memory).atexit = False
    return plants


def _keep_memory(memory: Record) -> None:
    """Keep the memory of a plant that is gone, unless its feet were separate contacts."""
    if not memory['separate'].item():
        track, track_at = PLANT.fields['track'][:2]
        used = memory.view(np.uint8)
        used[: PLANT.fields['contacts'][1]] = used[track_at + track.itemsize :] = 0
        _ended.append(memory)


def _refuse_under_coulomb(parameters: Parameters) -> None:
    """Refuse bodies and feet whose loads or forces at rest Coulomb's law does not define."""
    names = ['actuator.gain_tolerance', 'actuator.stiffness', 'frame.mass']
    names += ['load_cell.resonance'] * (parameters.load_cell.contact == 'one_sided')
    for name in names if parameters.contact.law == 'coulomb' else ():
        if value := parameters.value(name):
            hint = 'set it to 0, or take another contact.law'
            raise OutOfRange(name, value, spec_of(name).unit, layout.NO_LAW_OF_SHARES, hint)


@lru_cache(maxsize=TREADS_KEPT)
def tread_s(parameters: Parameters) -> float:
    """Return the shortest time between levels of the converter at the first preload, s."""
    return float(plant_of(parameters)['tread_s'].item())


def set_ideal(plant: Record) -> None:
    """Set ``ideal``, ``only_long_steps`` and ``plain`` of a plant."""
    piezo = plant['piezo']
    is_linear = not (piezo['plays'] or piezo['creep'] or piezo['omega_per_s'])
    feet_are_one = is_linear and not plant['separate']
    ideal = feet_are_one and in_python(is_direct)(plant) and not plant['stuck']
    ideal = ideal and not (plant['frame']['exists'] or plant['button']['exists'])
    plant['ideal'] = ideal
    law = plant['contacts'][ALL]['law']['number']
    plant['only_long_steps'] = ideal and law != COULOMB
    plant['plain'] = law == MDR and not plant['loss_s']


def _set_longest_step(plant: Record, parameters: Parameters) -> None:
    walls = plant['walls']
    cell_n_per_m = plant['cell_n_per_m'] + walls['cell_n_per_m'] + walls['stop_n_per_m']
    longest_s = longest_step_s(parameters, plant['contacts'][ALL], float(cell_n_per_m))
    if parameters.contact.travel:  # the contact may be stiffer elsewhere
        longest_s *= TRAVEL_MARGIN
    plant['dt_s'] = min(parameters.sim.dt, longest_s)
    law = plant.contacts[ALL].law
    if law.number > COULOMB and law.depends_on_rate:
        plant['dt_s'] /= LAW_REFINEMENT
    plant['loss_s'] = loss_of(parameters, plant)
    rise_m = plant['gain_m_per_v'] * plant['amplifier']['resolution_v']
    resonance_hz = parameters.actuator.resonance
    if rise_m > LOW_TREAD * plant['presliding_m']:
        unseen_s = 0.0
    else:
        unseen_s = TREAD_CYCLES / resonance_hz if resonance_hz else math.inf
    plant['tread_s'] = min(max(unseen_s, plant['dt_s'] / TREADS_PER_STEP), plant['dt_s'])


def longest_step_s(parameters: Parameters, contact: Record, cell_n_per_m: float) -> float:
    """
    Return the longest step that resolves the fastest motion, s.

    The contacts are stiffest in full stick; ``cell_n_per_m`` is the stiffness of load cell and end
    stops.

    """
    law, mass_kg = contact['law'], parameters.runner.mass
    contact_n_per_m = max(float(contact['curve']['cells'][0, 1]), float(law['bristle_n_per_m']))
    omega_per_s = math.sqrt((cell_n_per_m + contact_n_per_m) / mass_kg)
    law_n_s_per_m = float(law['bristle_n_s_per_m'] + law['viscous_n_s_per_m'])
    gamma_per_s = (parameters.runner.damping + law_n_s_per_m) / mass_kg
    lost_s = parameters.contact.loss_factor / omega_per_s
    fastest_per_s = max(omega_per_s, gamma_per_s + lost_s * omega_per_s**2)
    if parameters.frame.mass:
        frame_kg, frame_per_s = parameters.frame.mass, 2.0 * math.pi * parameters.frame.resonance
        between_per_s = math.sqrt(omega_per_s**2 + contact_n_per_m / frame_kg)
        loss_per_s = 2.0 * parameters.frame.damping_ratio * frame_per_s
        loss_per_s += lost_s * between_per_s**2
        fastest_per_s = max(fastest_per_s, between_per_s, frame_per_s, loss_per_s)
    if parameters.actuator.stiffness:
        # A foot of the paper has at most a quarter of the stiffness of all feet.
        share = max(0.25, layout.stiffest_share(parameters))
        foot_per_s = math.sqrt(share * contact_n_per_m / parameters.actuator.foot_mass)
        fastest_per_s = max(fastest_per_s, foot_per_s, lost_s * foot_per_s**2)
    cell, button_per_s = parameters.load_cell, 2.0 * math.pi * parameters.load_cell.resonance
    if cell.contact == 'one_sided':
        fastest_per_s = max(fastest_per_s, button_per_s * max(1.0, 2.0 * cell.damping_ratio))
    return PHASE_MAX / fastest_per_s


def loss_of(parameters: Parameters, plant: Record) -> float:
    """
    Return the viscous force of sticking contacts per rate of their elastic force, s.

    Notes
    -----
    Contacts of stiffness K that stick have the viscous damping tau K; a mass m on them and on a
    cell of stiffness k then has the damping ratio tau K/(2 sqrt(m (K + k))), half the loss factor.

    """
    contact, loss_factor = parameters.contact, parameters.contact.loss_factor
    if not loss_factor:
        return 0.0
    # Not from the tabulated curve: in its first cell a foot of little friction already slips.
    preload_n, weight_n = float(plant.contacts[ALL].preload_n), layout.weight_of(parameters)
    contacts = layout.contacts_at(contact, parameters.feet, preload_n, weight_n)
    contact_n_per_m = sum(each.stick_stiffness_n_per_m for each in contacts)
    held_n_per_m = contact_n_per_m + plant['cell_n_per_m']
    return float(loss_factor * math.sqrt(held_n_per_m * plant['mass_kg']) / contact_n_per_m)


def amplifier_of(parameters: Parameters) -> Record:
    """Return the optional parts of the amplifier."""
    setting = parameters.amplifier
    tau_s = 1.0 / (2.0 * math.pi * setting.bandwidth) if setting.bandwidth else 0.0
    return record(AMPLIFIER, on=True, resolution_v=setting.resolution, tau_s=tau_s)


def slew_of(parameters: Parameters) -> float:
    """Return the slew rate, V/s, which the current into the piezos may limit further."""
    setting = parameters.amplifier
    if not setting.current_max:
        return setting.slew_rate
    return min(setting.slew_rate, setting.current_max / parameters.actuator.capacitance)


def piezo_of(parameters: Parameters) -> Record:
    """
    Return the optional parts of the piezo.

    Notes
    -----
    n plays have the half widths r_j = (R/2) j/(n+1), R the range of the voltage. Over the whole
    range play j has the stroke R - 2 r_j, and its branches are 2 min(r_j, R/2 - r_j) apart at
    mid-stroke. An opening of h R and a stroke of R give each play the weight
    w = h (n+1)/floor((n+1)^2/4), and the linear part 1 - w n/2.

    """
    setting, amplifier = parameters.actuator, parameters.amplifier
    plays = setting.plays if setting.hysteresis else 0
    weight = setting.hysteresis * (plays + 1) / ((plays + 1) ** 2 // 4) if plays else 0.0
    omega_per_s = 2.0 * math.pi * setting.resonance
    return record(
        PIEZO,
        linear=1.0 - 0.5 * weight * plays,
        weight=weight,
        plays=plays,
        play_v=0.5 * amplifier.range_v / (plays + 1),
        creep=setting.creep,
        omega_per_s=omega_per_s,
        damping_ratio=setting.damping_ratio,
        foot_kg=setting.foot_mass,
        stack_n_per_m=setting.stiffness,
    )


def button_of(parameters: Parameters) -> Record:
    """Return the moving mass of the load cell, a separate body if the cell is one-sided."""
    cell, omega_per_s = parameters.load_cell, 2.0 * math.pi * parameters.load_cell.resonance
    if not omega_per_s or cell.contact == 'absent':
        return record(BUTTON)
    return record(
        BUTTON,
        exists=cell.contact == 'one_sided',
        mass_kg=cell.stiffness / omega_per_s**2,
        n_per_m=cell.stiffness,
        damping_n_s_per_m=2.0 * cell.damping_ratio * cell.stiffness / omega_per_s,
        gap_m=cell.gap,
        restitution=cell.restitution,
    )


def frame_of(parameters: Parameters) -> Record:
    """Return the frame."""
    setting, feet = parameters.frame, layout.driven_feet(parameters)
    feet_kg = feet * parameters.actuator.foot_mass
    if not setting.mass:
        return record(FRAME)
    if feet_kg >= setting.mass:
        limit = f'not above the mass of its {feet} driven feet, {feet_kg:g} kg'
        hint = 'raise it, or make the feet lighter'
        raise OutOfRange('frame.mass', setting.mass, 'kg', limit, hint)
    omega_per_s = 2.0 * math.pi * setting.resonance
    return record(
        FRAME,
        exists=True,
        mass_kg=setting.mass,
        per_kg=1.0 / setting.mass,
        held_n_per_m=setting.mass * omega_per_s**2,
        damping_n_s_per_m=2.0 * setting.damping_ratio * omega_per_s * setting.mass,
        feet_share=feet_kg / setting.mass,
        is_reference=parameters.interferometer.reference == 'frame',
    )


def walls_of(parameters: Parameters) -> Record:
    """Return the one-sided springs that the runner may touch."""
    stand, cell = parameters.stand, parameters.load_cell
    presses = cell.contact == 'one_sided' and not cell.resonance
    stops = stand.stop_stiffness > 0.0
    return record(
        WALLS,
        exist=presses or stops,
        cell_n_per_m=cell.stiffness if presses else 0.0,
        gap_m=cell.gap if presses else math.inf,
        stop_n_per_m=stand.stop_stiffness,
        low_m=stand.travel_min if stops else -math.inf,
        high_m=stand.travel_max if stops else math.inf,
    )


def all_contacts(parameters: Parameters) -> Record:
    """Return the constants of all contacts as one, a record of CONTACT, read-only."""
    stand, weight_n = parameters.stand, layout.weight_of(parameters)
    return _kept_contact(
        parameters.contact, parameters.feet, parameters.friction_law, stand, weight_n
    )


@lru_cache(maxsize=MODELS_KEPT)
def _kept_contact(
    contact: ContactParameters,
    feet: FeetParameters,
    law: FrictionLawParameters,
    stand: StandParameters,
    weight_n: float,
) -> Record:
    """Return the constants of ``all_contacts``; the last few are kept."""
    contacts = layout.contacts_at(contact, feet, stand.preload, weight_n)
    largest_n = max(stand.preload_limit, stand.preload, stand.preload_end)
    kept = records(
        CONTACT,
        bank=_kept_bank(contact, feet, weight_n, largest_n, None),
        law=_law_of(LAWS.index(contact.law), law, contacts),
        ageing=ageing_of(contact),
        preload_n=stand.preload,
        preload_n_per_s=stand.preload_rate,
    )
    tabulate(contacts, kept['curve'])
    return kept[0]


@lru_cache(maxsize=MODELS_KEPT)
def _kept_bank(
    contact: ContactParameters,
    feet: FeetParameters,
    weight_n: float,
    preload_max_n: float,
    motion: layout.FeetMotion | None,
) -> Record:
    """Return the springs of the contacts with a motion, or of all if None: a read-only BANK."""
    kinds, groups = layout.kinds_of(contact, feet), layout.groups_of(contact, feet, weight_n)
    own = [
        g
        for each, g in zip(kinds, groups, strict=True)
        if motion in (None, layout.motion_of(each))
    ]
    springs = SPRINGS_IN_ALL // len(own)
    return spring_bank(own, preload_max_n, springs)


def ageing_of(contact: ContactParameters) -> Record:
    """Return the dependence of the friction coefficient on velocity and age."""
    return record(
        AGEING,
        on=contact.friction_rate > 0.0 or contact.friction_ageing > 0.0,
        rate_share=contact.friction_rate / contact.friction,
        age_share=contact.friction_ageing / contact.friction,
        distance_m=contact.friction_distance,
        velocity_m_per_s=contact.friction_velocity,
        cutoff_m_per_s=contact.friction_cutoff,
        rest_s=contact.rest_time,
    )


def friction_limit_n(parameters: Parameters) -> float:
    """Return mu0 times the sum of all normal forces, N; only ageing can exceed it."""
    return float(all_contacts(parameters)['curve']['force_max_n'])


def _law_of(number: int, law: FrictionLawParameters, contacts: Sequence[Presliding]) -> Record:
    """Return the friction law; bristles of stiffness 0 get that of the sticking contacts."""
    stick_n_per_m = sum(contact.stick_stiffness_n_per_m for contact in contacts)
    return record(
        LAW,
        number=number,
        bristle_n_per_m=law.bristle_stiffness or stick_n_per_m,
        depends_on_rate=law.static_ratio > 1.0 or law.bristle_damping + law.viscous > 0.0,
        bristle_n_s_per_m=law.bristle_damping,
        viscous_n_s_per_m=law.viscous,
        static_ratio=law.static_ratio,
        stribeck_m_per_s=law.stribeck_velocity,
        breakaway_ratio=law.breakaway_ratio,
        bents=plastic_bents(law.breakaway_ratio) if number == EPM else 0.0,
    )


def _separate_motions(
    plant: Record, parameters: Parameters, motions: dict[layout.FeetMotion, list[int]]
) -> None:
    """Give each group of feet of equal motion a joint contact, and each delay an actuator."""
    contact, feet, weight_n = parameters.contact, parameters.feet, layout.weight_of(parameters)
    order = [kind for own in motions.values() for kind in own]
    if contact.travel and order != sorted(order):
        limit, hint = 'of equal motion, but apart', 'put groups of equal motion side by side'
        raise OutOfRange('feet.gain', list(feet.gain), '', limit, hint)
    groups, stand = layout.groups_of(contact, feet, weight_n), parameters.stand
    each_n = [_limit_of(group, stand.preload, contact.friction) for group in groups]
    limits_n = [group.contacts * each for group, each in zip(groups, each_n, strict=True)]
    delays_s = sorted({motion.delay_s for motion in motions} - {0.0})
    plant.delayed, plant.delays_s[: len(delays_s)] = len(delays_s), delays_s
    plant.separate, plant.moved = True, len(motions)
    largest_n = max(stand.preload_limit, stand.preload, stand.preload_end)
    for k, (motion, own) in enumerate(motions.items(), start=1):
        plant.ratios[k] = motion.gain
        plant.lates[k] = 1 + delays_s.index(motion.delay_s) if motion.delay_s else 0
        plant.counts[k] = sum(groups[i].contacts for i in own)
        plant.parts[k] = sum(limits_n[i] for i in own) / sum(limits_n)
        plant.contacts[k].bank = _kept_bank(contact, feet, weight_n, largest_n, motion)
        _share_law(plant, k)
    _set_curves(plant, parameters)


def _limit_of(group: Group, preload_n: float, friction: float) -> float:
    """Return the friction limit of a foot at a preload, divided by ``friction``, N."""
    return group.friction / friction * (group.share * preload_n + group.weight_n)


def separate_feet(plants: Record, parameters: Parameters) -> None:
    """Give each foot of a plant its own contact, so the feet move separately."""
    plant, feet = plants[0], parameters.feet
    before, motions = plant.copy() if plant.separate else plant, layout.motions_of(parameters)
    groups = layout.groups_of(parameters.contact, feet, layout.weight_of(parameters))
    each = [i for i, group in enumerate(groups) for _ in range(group.contacts)]
    preload_n, friction = parameters.stand.preload, parameters.contact.friction
    limits_n = np.array([_limit_of(groups[i], preload_n, friction) for i in each])
    is_one = not plant.separate
    plant.separate, plant.divided, plant.moved = True, True, len(each)
    plant.parts[1 : len(each) + 1] = limits_n / limits_n.sum()
    plant.counts[1 : len(each) + 1] = 1.0
    plant.ratios[1 : len(each) + 1] = layout.ratios_of(parameters)
    for k, i in enumerate(each, start=1):
        parent, own = next((p, own) for p, own in enumerate(motions.values(), start=1) if i in own)
        plant.parents[k] = parent = ALL if is_one else parent
        plant.groups[k] = i if is_one else own.index(i)
        plant.lates[k] = before.lates[parent]
        _set_contact_of_foot(plant, k, groups[i], before.contacts[parent].bank)
    _set_curves(plant, parameters)


def divide_feet(plants: Record, states: Record, parameters: Parameters) -> None:
    """Give each foot its own contact from the present state on."""
    lost_j, before, state = lost_before_division(plants, states), states.copy(), states[0]
    separate_feet(plants, parameters)
    state.contacts[1:] = 0
    relax(state.contacts[1:], state.preload_n)
    divide_among_feet(plants, states, before, lost_j)


def _set_contact_of_foot(plant: Record, k: int, group: Group, bank: Record) -> None:
    """Give a foot its share of a bank's springs, and of the law of all contacts."""
    own = plant.groups[k]
    row = slice(bank.first[own], bank.first[own + 1])
    plant.contacts[k].bank = bank_of_rows(
        bank.heights_m[np.newaxis, row],
        *(
            bank[name][np.newaxis, row] / group.contacts
            for name in ('limit_n_per_m', 'shear_n_per_m', 'area_n', 'slope_n_per_m')
        ),
        shares=[group.share],
        weights_n=[group.weight_n],
        slips=(bank.friction[[own]], bank.compliance[[own]]),
    )
    _share_law(plant, k)


def _share_law(plant: Record, k: int) -> None:
    """Give a contact its part of the law of all contacts."""
    whole, own, part = plant.contacts[ALL], plant.contacts[k], plant.parts[k]
    own.law, own.ageing = whole.law, whole.ageing
    for name in ('bristle_n_per_m', 'bristle_n_s_per_m', 'viscous_n_s_per_m'):
        own.law[name] *= part
    own.preload_n, own.preload_n_per_s = whole.preload_n, whole.preload_n_per_s


def _set_curves(plant: Record, parameters: Parameters) -> None:
    """Tabulate the virgin curves of all contacts at the wanted preload."""
    preload_n, weight_n = float(plant.contacts[ALL].preload_n), layout.weight_of(parameters)
    contacts = layout.contacts_at(parameters.contact, parameters.feet, preload_n, weight_n)
    tabulate(contacts, plant['contacts'][:1]['curve'])
    plant.presliding_m = _range_of(contacts)
    if parameters.contact.travel:
        plant.track.laid = NO_PLACE
    if not plant.separate:
        return
    motions = layout.motions_of(parameters)
    kinds = layout.kinds_of(parameters.contact, parameters.feet)
    kind = [i for i, each in enumerate(kinds) for _ in range(each.feet)]
    moved = [[c for i, c in zip(kind, contacts, strict=True) if i in m] for m in motions.values()]
    curves = tabulate_each(contacts) if plant.divided else [tabulate(own) for own in moved]
    for k, curve in enumerate(curves, start=1):
        plant.contacts[k].curve = curve
    if len(motions) > 1:
        fastest = max(1.0, *(abs(motion.gain) for motion in motions))
        limits_n = [sum(contact.max_force_n for contact in own) for own in moved]
        little_n = LITTLE_FRICTION * sum(limits_n) / len(limits_n)
        # A guide is not driven: only the runner slides on it, more slowly than feet in a fall.
        ranges_m = [
            _range_of(own) / min(1.0, limit_n / little_n)
            for motion, own, limit_n in zip(motions, moved, limits_n, strict=True)
            if motion.gain
        ]
        falls = len({motion.delay_s for motion in motions if motion.gain})
        apart = max(1.0, math.sqrt(falls / FALLS_APART))
        plant.presliding_m = apart * min(ranges_m, default=plant.presliding_m) / fastest


def _range_of(contacts: Sequence[Presliding]) -> float:
    """Return the presliding range of contacts that limits the steps, m."""
    ranges_m = [contact.max_displacement_m for contact in contacts]
    return min(max(ranges_m), RANGES_SPREAD * min(ranges_m))


def change_preload(
    plants: Record, states: Record, parameters: Parameters, preload_n: float
) -> None:
    """Start a change of the preload; the springs take over the memory of the contacts."""
    switch_all_to_springs(plants, states)
    set_preload(plants, parameters, preload_n)


def set_preload(plants: Record, parameters: Parameters, preload_n: float) -> None:
    """Set the wanted preload of a plant, without a change of the contacts' memory."""
    plant = plants[0]
    plant.contacts['preload_n'][: 1 + plant.moved] = preload_n
    _set_curves(plant, parameters)
    _set_longest_step(plant, parameters)


def state_at_rest(plants: Record, preload_n: float, ended: Record = None) -> Record:
    """Return the state of a drive at rest with relaxed contacts, an array of one STATE."""
    if ended is not None:  # of a drive whose feet moved as one: the fields of others are untouched
        content, at = ended.view(np.uint8), STATE.fields
        content[: at['history'][1]] = 0
        content[at['late'][1] : at['contacts'][1] + CONTACT_STATE.itemsize] = 0
        content[at['starts_n'][1] :] = 0
    rest_v = plants['rest_v'].item()
    states = records(STATE, ended, passes_left=PASSES_MIN, preload_n=preload_n, voltage_v=rest_v)
    relax(states['contacts'], preload_n)
    ageing = plants[0].contacts[ALL].ageing
    if ageing.on:
        states['contacts']['springs']['ages_s'] = ageing.rest_s
        states['contacts']['on_springs'] = True
    plant, state = plants[0], states[0]
    if plant.divided:
        divide_among_feet(plants, states, states.copy(), 0.0)
    rest_piezo(plant, state['piezo'])
    if plant.delayed:
        rest_late(plant, state)
    return states


def start_clock(states: Record) -> None:
    """Reset the clock for the start of a wave."""
    clocks = states['clock']
    clocks['ramp_s'], clocks['cycle'] = 0.0, 0
    clocks['start_m'] = states['position_m']
    clocks['start_m_s'] = states['sums']['position_m_s']
