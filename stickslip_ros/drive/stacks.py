# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Kernel: feet with a mass on elastic stacks, which the contacts bend; guides have neither.

m z'' = -k (z - d) - 2 D w m z' + F - m y'', k = m w^2: z is the displacement of the foot against
the frame, d its displacement without load, F the force of the contact on it, y the displacement of
the frame. A load acts like a change of d by F/k; for a linear change of both the oscillator is
solved exactly.

"""

from stickslip_ros.drive.feet import (
    active_contacts,
    bends,
    in_mean,
    is_guide,
    nominal_place,
    nominal_way,
    ratio_of,
    wanted_place,
)
from stickslip_ros.drive.frame import frame_place, holding_force
from stickslip_ros.drive.oscillator import SIXTH
from stickslip_ros.drive.piezo import free_ring, swing_along
from stickslip_ros.drive.stride import way_after, way_in
from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import Record


@kernel
def feel(plant: Record, state: Record, stride: Record) -> None:
    """Move the feet under constant loads, as a first estimate for the contacts."""
    if not bends(plant):
        return
    for k in active_contacts(plant):
        state.feet[k].stiffness = 0.0
    stride.frame_m = frame_place(plant, state)
    stride.recoil = frame_recoil(plant, state, stride, 0.0)
    swing(plant, state, stride)


@kernel
def look_ahead(plant: Record, state: Record, stride: Record) -> None:
    """Compute the rates of the force of all feet on the runner, N/s and N/s^2."""
    if not bends(plant):
        return
    stride.driven, stride.pulled.speed, stride.pulled.speeding = 1.0, 0.0, 0.0
    for k in active_contacts(plant):
        foot = state.feet[k]
        stride.pulled.speed += foot.stiffness * foot.speed
        stride.pulled.speeding += foot.stiffness * foot.speeding


@kernel
def swing(plant: Record, state: Record, stride: Record) -> None:
    """Move the feet under loads that grow with the stiffness ahead."""
    if not bends(plant):
        return
    piezo, h_s, half_s = plant.piezo, stride.lasts_s, 0.5 * stride.lasts_s
    ring = free_ring(piezo.omega_per_s, piezo.damping_ratio, half_s)
    stride.ring_m, stride.ring_m_per_s = ring.m_per_m_per_s, ring.m_per_s_per_m_per_s
    inert_m = stride.recoil / (piezo.omega_per_s * piezo.omega_per_s)
    past_speed = stride.runner.speed - stride.sway.speed
    for k in active_contacts(plant):
        if is_guide(plant, k):
            continue
        foot, start_m, ratio = state.feet[k], state.places_m[k], ratio_of(plant, k)
        foot.n_per_s = foot.stiffness * (past_speed - foot.speed)
        foot.before_n = state.contacts[k].memory.force_n + plant.loss_s * foot.n_per_s
        bent_m, grows_m = foot.before_n / piezo.stack_n_per_m, foot.n_per_s / piezo.stack_n_per_m
        speed, speeding = nominal_way(plant, state, stride, k)
        drive_0 = wanted_place(plant, state, k) + (bent_m - inert_m)
        drive_1 = drive_0 + ratio * way_in(speed, speeding, half_s) + grows_m * half_s
        drive_2 = drive_0 + ratio * way_in(speed, speeding, h_s) + grows_m * h_s
        foot.middle_m, foot.middle_m_per_s = swing_along(
            piezo, start_m, foot.m_per_s, drive_0, drive_1, ring, half_s
        )
        foot.end_m, foot.end_m_per_s = swing_along(
            piezo, foot.middle_m, foot.middle_m_per_s, drive_1, drive_2, ring, half_s
        )
        bow_m = (foot.end_m - foot.middle_m) - (foot.middle_m - start_m)
        foot.speeding = bow_m / (half_s * half_s)
        foot.speed = (foot.end_m - start_m) / h_s - half_s * foot.speeding
    look_ahead(plant, state, stride)


@kernel
def frame_recoil(plant: Record, state: Record, stride: Record, time_s: float) -> float:
    """
    Return the acceleration of the frame at the start, in the middle or at the end, m/s^2.

    Frame and feet accelerate each other; one equation gives both.

    """
    piezo, frame, pull, mean_speed = plant.piezo, plant.frame, 0.0, 0.0
    foot_m = state.foot_m + way_after(stride.path, time_s)
    starts, ends = time_s == 0.0, time_s == stride.lasts_s
    for k in active_contacts(plant):
        if is_guide(plant, k):
            continue
        foot = state.feet[k]
        speed = foot.end_m_per_s if ends else foot.middle_m_per_s
        speed = foot.m_per_s if starts else speed
        nominal_m = foot_m
        if plant.lates[k]:
            own_speed, own_speeding = nominal_way(plant, state, stride, k)
            nominal_m = nominal_place(plant, state, k) + way_in(own_speed, own_speeding, time_s)
        bent_m = state.places_m[k] - state.offsets_m[k] - ratio_of(plant, k) * nominal_m
        force_n = foot.load_n - piezo.stack_n_per_m * bent_m
        pull += force_n / piezo.foot_kg - 2.0 * piezo.damping_ratio * piezo.omega_per_s * speed
        mean_speed += in_mean(plant, k, speed)
    frame_m, centre_w = stride.frame_middle_m, stride.centre.middle_m_per_s
    if starts:
        frame_m, centre_w = stride.frame_m, state.centre_m_per_s
    elif ends:
        frame_m, centre_w = stride.frame_end_m, stride.centre.end_m_per_s
    share = frame.feet_share
    held_n = holding_force(frame, frame_m, centre_w - share * mean_speed)
    own = (state.contact_n + stride.lag_n - held_n) * frame.per_kg
    return (own - share * pull / plant.driven) / (1.0 - share)


@kernel
def pass_middle(plant: Record, state: Record, stride: Record) -> None:
    """Correct the end of the feet by loads and recoil in the middle."""
    if not bends(plant):
        return
    h_s = stride.lasts_s
    recoil = frame_recoil(plant, state, stride, 0.5 * h_s) - stride.recoil
    for k in active_contacts(plant):
        if is_guide(plant, k):
            continue
        foot = state.feet[k]
        missed = foot.load_n - foot.before_n - 0.5 * h_s * foot.n_per_s
        foot.missed = missed / plant.piezo.foot_kg - recoil
        foot.middle_m_per_s += SIXTH * h_s * foot.missed
        foot.end_m += 4.0 * SIXTH * h_s * stride.ring_m * foot.missed


@kernel
def arrive(plant: Record, state: Record, stride: Record) -> None:
    """Correct the velocities by loads and recoil at the end, and add the damping loss."""
    if not bends(plant):
        return
    piezo, h_s, square = plant.piezo, stride.lasts_s, 0.0
    recoil = frame_recoil(plant, state, stride, h_s) - stride.recoil
    for k in active_contacts(plant):
        if is_guide(plant, k):
            continue
        foot = state.feet[k]
        missed = foot.load_n - foot.before_n - h_s * foot.n_per_s
        kick = 4.0 * stride.ring_m_per_s * foot.missed + missed / piezo.foot_kg - recoil
        speed = foot.end_m_per_s + SIXTH * h_s * kick
        square += foot.m_per_s * foot.m_per_s + speed * speed
        square += 4.0 * foot.middle_m_per_s * foot.middle_m_per_s
        foot.m_per_s = speed
    lost_w = 2.0 * piezo.damping_ratio * piezo.omega_per_s * piezo.foot_kg * square
    state.sums.stand_lost_j += SIXTH * h_s * lost_w


@kernel
def note_ringing(plant: Record, state: Record) -> None:
    """Store the largest ringing of all feet in the piezo, which limits the length of steps."""
    if not bends(plant):
        return
    ring_m = ring_m_per_s = 0.0
    for k in active_contacts(plant):
        if is_guide(plant, k):
            continue
        wanted_m = wanted_place(plant, state, k)
        bent_m = state.contacts[k].memory.force_n / plant.piezo.stack_n_per_m
        ring_m = max(ring_m, abs(state.places_m[k] - wanted_m - bent_m))
        ring_m_per_s = max(ring_m_per_s, abs(state.feet[k].m_per_s))
    state.piezo.ring_m = state.piezo.driving_m + ring_m
    state.piezo.ring_m_per_s = ring_m_per_s
    for j in range(plant.delayed):
        state.late[j].piezo.ring_m = state.late[j].piezo.driving_m


@kernel
def stacks_energy(plant: Record, state: Record) -> float:
    """Return the energy of bent stacks and of feet that move against the centre of mass, J."""
    if not bends(plant):
        return 0.0
    doubled_j, momentum = 0.0, 0.0
    for k in active_contacts(plant):
        speed = state.feet[k].m_per_s
        wanted_m = wanted_place(plant, state, k)
        bent_m = state.places_m[k] - wanted_m
        doubled_j += plant.piezo.foot_kg * speed * speed
        doubled_j += plant.piezo.stack_n_per_m * bent_m * bent_m
        momentum += plant.piezo.foot_kg * speed
    return 0.5 * (doubled_j - momentum * momentum * plant.frame.per_kg)
