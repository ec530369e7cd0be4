"""
The drive: a voltage in, a runner motion out. One short step of it, whatever its parts are like.

The voltage moves the feet, the feet drag the contacts, and the contacts pull the runner.

Short steps do what long ones do, of fourth order too, for feet that go any way and differ: their
way in a step is a parabola through three places, and the contacts are really moved to its middle
and to its end. The runner turns against each foot at a time of its own; a step is cut where the
first of them turns, where a loop closes, and where a wall is met.

"""

import math
from typing import NamedTuple

from stickslip_ros.contact.kernel import kernel, kernel_apart
from stickslip_ros.contact.laws import COULOMB
from stickslip_ros.contact.memory import branch_towards, stiffness_on
from stickslip_ros.contact.reaction import answer_towards, remembers_turns
from stickslip_ros.contact.record import Record
from stickslip_ros.contact.springs import friction_limit
from stickslip_ros.drive.amplifier import low_pass
from stickslip_ros.drive.button import Body, body_of, meet_button, move_button, time_to_meet
from stickslip_ros.drive.feet import (
    Path,
    arrest,
    bends,
    mean_path,
    move_contacts,
    moving,
    ratio_of,
    way_of,
    way_on,
)
from stickslip_ros.drive.frame import (
    Sway,
    centre_ahead,
    frame_after,
    frame_place,
    holding_force,
    move_frame,
    sway_of,
)
from stickslip_ros.drive.ledger import book
from stickslip_ros.drive.long_step import (
    RESTING,
    holding_stiffness,
    missed_by_walls,
    time_to_close,
    time_to_turn,
    time_to_wall,
)
from stickslip_ros.drive.oscillator import (
    SIXTH,
    corrected,
    end_speed,
    propagator,
    swing_twice,
)
from stickslip_ros.drive.piezo import Ring, displace, prepare_piezo
from stickslip_ros.drive.records import ALL
from stickslip_ros.drive.runner import force_on_runner
from stickslip_ros.drive.stacks import (
    end_of_feet,
    feet_ahead,
    note_ringing,
    place_at_end,
    pulled_by_feet,
    recoil_of,
)

TURN_SLACK_S = 1.1e-4
"""A foot against which the runner goes on by (sim.dt/TURN_SLACK_S)^3 of the presliding range at
most, before it turns, turns at once: 1e-4 of it at the default of 5 us. With a hundredth of that
the errors of realistic stands are the same, at 9 % more steps."""


class Pace(NamedTuple):
    """What all steps of one length share."""

    half_s: float  # Half their length
    slack_m: float  # Way by which a turn may come late
    settling: float  # Share of its way that the low-pass of the amplifier goes in half a step
    ring: Ring  # What the resonance of the piezo does in half a step


@kernel
def pace_of(plant: Record, state: Record, dt_s: float) -> Pace:
    """Prepare steps of one length."""
    half_s, tau_s = 0.5 * dt_s, plant.amplifier.tau_s
    settling = -math.expm1(-half_s / tau_s) if tau_s > 0.0 else 1.0
    slack_m = (plant.dt_s / TURN_SLACK_S) ** 3 * plant.contacts[ALL].curve.limit_m
    return Pace(half_s, slack_m, settling, prepare_piezo(plant, state.piezo, half_s))


@kernel
def may_pass(state: Record) -> bool:
    """Count a pass of a loop over time; tell whether it may be made."""
    state.passes_left -= 1
    state.passes_made += 1
    return bool(state.passes_left >= 0)


@kernel
def step(
    plant: Record, state: Record, from_v: float, to_v: float, load_n: float, pace: Pace
) -> None:
    """Advance by one short step, along a straight voltage before the amplifier's low-pass."""
    half_s, half_v, start_m = pace.half_s, 0.5 * (from_v + to_v), state.foot_m

    # Amplifier and feet.
    voltage_v = low_pass(plant, state.voltage_v, from_v, half_v, half_s, pace.settling)
    middle_m = displace(plant, state.piezo, voltage_v, pace.ring, half_s)
    voltage_v = low_pass(plant, voltage_v, half_v, to_v, half_s, pace.settling)
    foot_m = displace(plant, state.piezo, voltage_v, pace.ring, half_s)
    speeding = ((foot_m - middle_m) - (middle_m - start_m)) / (half_s * half_s)
    speed = (foot_m - start_m) / (2.0 * half_s) - half_s * speeding

    # Contacts and runner.
    left_s = 2.0 * half_s
    while left_s > 0.0 and may_pass(state):
        path = Path(speed, speeding)
        if plant.contacts[ALL].law.number == COULOMB:
            done_s = _go_rigidly(plant, state, path, load_n, left_s)
        else:
            done_s = _go(plant, state, path, load_n, left_s, pace.slack_m)
        left_s = left_s - done_s if done_s < left_s else 0.0
        speed += done_s * speeding
    state.voltage_v, state.foot_m = voltage_v, foot_m
    if bends(plant):
        note_ringing(plant, state)


class Ahead(NamedTuple):
    """What holds and drags the runner in the next step."""

    tangent: float  # Stiffness of all contacts against the runner, N/m
    driven: float  # The same against the mean foot
    drag_n: float  # Force with which the contacts drag the mean foot back now
    held_n_per_m: float  # Stiffness of load cell and walls
    lasts_s: float  # Time for which all of it lasts


@kernel
def _look_ahead(
    plant: Record,
    state: Record,
    path: Path,
    sway: Sway,
    body: Body,
    speeding: float,
    slack_m: float,
    longest_s: float,
) -> Ahead:
    """Return the stiffness that lies ahead of a runner with an acceleration, m/s^2."""
    speed, lasts_s, may_turn = state.velocity_m_per_s, longest_s, False
    past, past_rate = speed - sway.speed, speeding - sway.speeding
    tangent, driven, drag_n = 0.0, 0.0, 0.0
    for k in moving(plant):
        contact, own, foot = plant.contacts[k], state.contacts[k], state.feet[k]
        ratio = ratio_of(plant, k)
        way = way_of(plant, state, path, k)
        against, against_rate = past - way.speed, past_rate - way.speeding
        turns_now = against * against < 2.0 * slack_m * abs(against_rate)
        may_turn |= abs(against) <= 2.0 * longest_s * abs(against_rate)
        direction = against_rate if turns_now else against
        if plant.track.on:
            arrest(plant, state, k, direction)
        if remembers_turns(contact, own):
            branch = branch_towards(contact.curve, own.memory, direction)
            stiffness = stiffness_on(contact.curve, branch, own.memory.u_m)
            foot.origin_m, foot.base_n = branch.origin_m, branch.force_n
            foot.fold, foot.unfold = branch.sense * branch.fold, branch.sense * branch.unfold
            foot.room_m = min(branch.unfold * branch.reach_m, contact.curve.limit_m)
            lasts_s = time_to_close(branch, own.memory.u_m, against, against_rate, lasts_s)
        else:
            stiffness, foot.room_m = answer_towards(contact, own, direction), 0.0
        tangent += stiffness
        driven += ratio * stiffness
        if bends(plant):
            foot.stiffness = stiffness
            bent_m = state.places_m[k] - state.offsets_m[k] - ratio * state.foot_m
            drag_n += ratio * plant.piezo.stack_n_per_m * bent_m
        else:
            drag_n += ratio * own.memory.force_n
    pulled = path
    if bends(plant):
        driven, pulled = 1.0, pulled_by_feet(plant, state)
    held_n_per_m = holding_stiffness(plant, state, speeding, longest_s)
    per_kg, gamma = body.per_kg, body.damping_n_s_per_m * body.per_kg
    omega_squared = (held_n_per_m + body.button_n_per_m + tangent) * per_kg
    drive = driven * pulled.speed + tangent * sway.speed
    jerk = drive * per_kg - omega_squared * speed - gamma * speeding
    if may_turn:
        drive_rate = driven * pulled.speeding + tangent * sway.speeding
        snap = drive_rate * per_kg - omega_squared * speeding - gamma * jerk
        crackle = -omega_squared * jerk - gamma * snap
        frame_n_per_s = tangent * speed - drive
        frame_n_per_s -= holding_force(plant.frame, sway.speed, sway.speeding)
        past_jerk = jerk - frame_n_per_s * plant.frame.per_kg
        for k in moving(plant):
            way = way_of(plant, state, path, k)
            against, against_rate = past - way.speed, past_rate - way.speeding
            turns_now = against * against < 2.0 * slack_m * abs(against_rate)
            if against * against_rate < 0.0 and not turns_now:
                turn_s = time_to_turn(against, against_rate, past_jerk, snap, crackle, longest_s)
                lasts_s = min(lasts_s, turn_s)
    if plant.walls.exist:
        lasts_s = time_to_wall(plant, state.position_m, speed, speeding, jerk, lasts_s)
    if plant.button.exists:
        lasts_s = time_to_meet(plant, state, speeding, jerk, lasts_s)
    return Ahead(tangent, driven, drag_n, held_n_per_m, lasts_s)


@kernel
def _go(
    plant: Record, state: Record, path: Path, load_n: float, longest_s: float, slack_m: float
) -> float:
    """Let the runner go until a stiffness jumps, at most for a given time; return the time, s."""
    force_n = force_on_runner(plant, state.position_m, state.contact_n, load_n)
    if plant.button.exists:
        meet_button(plant, state, force_n, longest_s)
    body, ring, pulled, recoil = body_of(plant, state), Ring(0.0, 0.0, 0.0, 0.0), path, 0.0
    if bends(plant):
        for k in moving(plant):
            state.feet[k].stiffness = 0.0
        place_m, centre_w = frame_place(plant, state), state.centre_m_per_s
        recoil = recoil_of(plant, state, 0, state.foot_m, place_m, centre_w)
        feet_ahead(plant, state, path, recoil, 0.0, longest_s)
    mean = mean_path(plant, state, path)
    sway = sway_of(plant, state, mean)
    pull = (force_n - body.button_n_per_m * state.button_m) * body.per_kg
    gamma = body.damping_n_s_per_m * body.per_kg
    speeding = pull - gamma * state.velocity_m_per_s
    ahead = _look_ahead(plant, state, path, sway, body, speeding, slack_m, longest_s)
    if bends(plant):
        past_speed = state.velocity_m_per_s - sway.speed
        ring = feet_ahead(plant, state, path, recoil, past_speed, ahead.lasts_s)
        mean, pulled = mean_path(plant, state, path), pulled_by_feet(plant, state)
        sway = sway_of(plant, state, mean)
        for k in moving(plant):
            state.places_m[k] = state.feet[k].middle_m
    _swing(plant, state, path, pulled, mean, sway, body, ahead, ring, recoil, pull, load_n)
    return ahead.lasts_s


@kernel
def _swing(
    plant: Record,
    state: Record,
    path: Path,
    pulled: Path,
    mean: Path,
    sway: Sway,
    body: Body,
    ahead: Ahead,
    ring: Ring,
    recoil: float,
    pull: float,
    load_n: float,
) -> None:
    """Move all for the time ahead, the runner by what is ``driven`` along the way ``pulled``."""
    frame, start_m, before_n = plant.frame, state.position_m, state.contact_n
    tangent, driven, h_s, half_s = ahead.tangent, ahead.driven, ahead.lasts_s, 0.5 * ahead.lasts_s
    speed, per_kg = state.velocity_m_per_s, body.per_kg
    gamma = body.damping_n_s_per_m * per_kg

    # The exact motion on that stiffness, in two halves.
    drive = driven * pulled.speed + tangent * sway.speed
    pull_jerk = (driven * pulled.speeding + tangent * sway.speeding) * per_kg
    omega_squared = (ahead.held_n_per_m + body.button_n_per_m + tangent) * per_kg
    run = swing_twice(omega_squared, gamma, half_s, speed, pull, drive * per_kg, pull_jerk)
    grows_n_per_s = tangent * speed - drive
    centre = centre_ahead(plant, state, mean, sway, grows_n_per_s, half_s)

    # What it misses: the contacts tell, moved to the middle and to the end.
    foot_m = state.foot_m + way_on(path, half_s)
    middle_m = start_m + run.middle_m
    frame_m = frame_after(plant, sway, mean, centre.middle_m, half_s)
    middle_drag_n = move_contacts(plant, state, middle_m - frame_m, foot_m, half_s, 0.0, True)
    middle_n = state.contact_n
    missed_n = middle_n - before_n - tangent * run.middle_m + driven * way_on(pulled, half_s)
    missed_1 = (missed_n + tangent * way_on(sway, half_s)) * per_kg
    if plant.walls.exist:
        missed_1 += missed_by_walls(plant, ahead.held_n_per_m, start_m, middle_m)
    run = corrected(run, -missed_1, h_s)
    centre_1 = (middle_n - before_n - half_s * grows_n_per_s) * frame.per_kg
    centre = corrected(centre, centre_1, h_s)
    if bends(plant):
        now = recoil_of(plant, state, 1, foot_m, frame_m, centre.middle_m_per_s)
        place_at_end(plant, state, ring, now - recoil, h_s)

    foot_m, position_m = state.foot_m + way_on(path, h_s), start_m + run.end_m
    frame_m = frame_after(plant, sway, mean, centre.end_m, h_s)
    end_drag_n = move_contacts(plant, state, position_m - frame_m, foot_m, half_s, 0.0, False)
    missed_n = state.contact_n - before_n - tangent * run.end_m + driven * way_on(pulled, h_s)
    missed_2 = (missed_n + tangent * way_on(sway, h_s)) * per_kg
    if plant.walls.exist:
        missed_2 += missed_by_walls(plant, ahead.held_n_per_m, start_m, position_m)
    velocity_m_per_s = end_speed(run, -missed_1, -missed_2, h_s)

    last = path.speed + h_s * path.speeding
    work_w = ahead.drag_n * path.speed + 4.0 * middle_drag_n * 0.5 * (path.speed + last)
    state.sums.feet_work_j -= SIXTH * h_s * (work_w + end_drag_n * last)
    if bends(plant):
        now = recoil_of(plant, state, 2, foot_m, frame_m, centre.end_m_per_s)
        end_of_feet(plant, state, ring, now - recoil, h_s)
    if frame.exists:
        centre_2 = (state.contact_n - before_n - h_s * grows_n_per_s) * frame.per_kg
        centre_w = end_speed(centre, centre_1, centre_2, h_s)
        move_frame(plant, state, mean, sway, centre, centre_w, h_s, before_n, middle_n)
    if plant.button.exists:
        move_button(plant, state, h_s, position_m, velocity_m_per_s, run.middle_m_per_s)
    book(plant, state, h_s, load_n, position_m, velocity_m_per_s, middle_m, run.middle_m_per_s)
    state.foot_m = foot_m
    state.position_m, state.velocity_m_per_s = position_m, velocity_m_per_s


@kernel_apart
def _go_rigidly(
    plant: Record, state: Record, path: Path, load_n: float, longest_s: float
) -> float:
    """Do what ``_go`` does under the law of Coulomb: with the feet, or sliding at the limit."""
    per_kg = 0.0 if plant.stuck else plant.per_kg
    damping, start_m, speed = plant.damping_n_s_per_m, state.position_m, state.velocity_m_per_s
    limit_n = friction_limit(plant.contacts[ALL].bank, state.preload_n)
    others_n = force_on_runner(plant, start_m, 0.0, load_n)
    holding_n = others_n - damping * path.speed - plant.mass_kg * path.speeding
    against = speed - path.speed
    rests = abs(against) <= RESTING * limit_n * per_kg * longest_s and not plant.stuck
    h_s = longest_s
    foot_m = h_s * (path.speed + 0.5 * h_s * path.speeding)
    if rests and abs(holding_n) <= limit_n:
        pull_n = holding_n
        way_m, end_speed = foot_m, path.speed + h_s * path.speeding
        held_n_per_m = holding_stiffness(plant, state, path.speeding, h_s)
        end_n = holding_n - held_n_per_m * foot_m - damping * (end_speed - path.speed)
    else:
        pull_n = end_n = math.copysign(limit_n, holding_n if rests else against)
        gamma = damping * per_kg
        pull = force_on_runner(plant, start_m, pull_n, load_n) * per_kg
        speeding = pull - gamma * speed
        omega_squared = holding_stiffness(plant, state, speeding, h_s) * per_kg
        against_rate = speeding - path.speeding
        jerk = -omega_squared * speed - gamma * speeding
        snap = -omega_squared * speeding - gamma * jerk
        if against * against_rate < 0.0 and not rests:
            h_s = time_to_turn(against, against_rate, jerk, snap, 0.0, longest_s)
        if plant.walls.exist:
            h_s = time_to_wall(plant, start_m, speed, speeding, jerk, h_s)
        foot_m = h_s * (path.speed + 0.5 * h_s * path.speeding)
        whole = propagator(omega_squared, gamma, h_s)
        way_m = speed * whole.impulse + pull * whole.step
        end_speed = speed * whole.velocity + pull * whole.impulse
    position_m = start_m + way_m
    move_contacts(plant, state, position_m, state.foot_m + foot_m, h_s, end_n, False)
    state.sums.feet_work_j -= 0.5 * (pull_n + state.contact_n) * foot_m
    middle_m = start_m + 0.5 * way_m - 0.125 * h_s * (end_speed - speed)
    middle_speed = 1.5 * way_m / h_s - 0.25 * (speed + end_speed)
    book(plant, state, h_s, load_n, position_m, end_speed, middle_m, middle_speed)
    state.foot_m += foot_m
    state.position_m, state.velocity_m_per_s = position_m, end_speed
    return h_s
