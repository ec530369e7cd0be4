# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Kernel: the contacts of all feet in a stride.

The rest of the drive sees one contact against the nominal foot, with the sum of the forces.

"""

from stickslip_ros.contact.memory import branch_towards, stiffness_on
from stickslip_ros.contact.reaction import answer_towards, react, remembers_turns
from stickslip_ros.contact.virgin import virgin_force
from stickslip_ros.drive.feet import (
    active_contacts,
    bends,
    nominal_way,
    ratio_of,
    sliding_motion,
    wanted_place,
)
from stickslip_ros.drive.frame import jerk_of_frame
from stickslip_ros.drive.long_step import time_to_close, time_to_turn
from stickslip_ros.drive.oscillator import SIXTH
from stickslip_ros.drive.stride import way_after, way_in
from stickslip_ros.kernels.kernel import kernel, noinline_kernel
from stickslip_ros.kernels.record import Record


@kernel
def look_ahead(plant: Record, state: Record, stride: Record) -> None:
    """Compute the stiffness of the contacts ahead; shorten the stride to the closing of a loop."""
    tangent, driven, drag_n, lasts_s, may_turn = 0.0, 0.0, 0.0, stride.longest_s, False
    for k in active_contacts(plant):
        contact, own, foot = plant.contacts[k], state.contacts[k], state.feet[k]
        speed, speeding, direction = sliding_motion(plant, state, stride, k)
        may_turn |= abs(speed) <= 2.0 * stride.longest_s * abs(speeding)
        if remembers_turns(contact, own):
            branch = branch_towards(contact.curve, own.memory, direction)
            foot.stiffness = stiffness_on(contact.curve, branch, own.memory.u_m)
            foot.origin_m, foot.base_n = branch.origin_m, branch.force_n
            foot.fold, foot.unfold = branch.sense * branch.fold, branch.sense * branch.unfold
            foot.room_m = min(branch.unfold * branch.reach_m, contact.curve.limit_m)
            lasts_s = time_to_close(branch, own.memory.u_m, speed, speeding, lasts_s)
        else:
            foot.stiffness, foot.room_m = answer_towards(contact, own, direction), 0.0
        ratio = ratio_of(plant, k)
        tangent += foot.stiffness
        driven += ratio * foot.stiffness
        stack_n = plant.piezo.stack_n_per_m * (state.places_m[k] - wanted_place(plant, state, k))
        drag_n += ratio * (stack_n if bends(plant) else own.memory.force_n)
    stride.tangent, stride.driven, stride.drag_n = tangent, driven, drag_n
    stride.pulled.speed, stride.pulled.speeding = stride.path.speed, stride.path.speeding
    if plant.delayed:
        _look_at_delayed(plant, state, stride)
    stride.before_n, stride.may_turn, stride.lasts_s = state.contact_n, may_turn, lasts_s


@noinline_kernel
def _look_at_delayed(plant: Record, state: Record, stride: Record) -> None:
    """Separate the force and the pull of delayed feet from those of the other feet."""
    pulled = stride.pulled
    stride.driven, stride.before_w = 1.0, 0.0
    pulled.speed = pulled.speeding = 0.0
    for k in active_contacts(plant):
        ratio, (speed, speeding) = ratio_of(plant, k), nominal_way(plant, state, stride, k)
        pulled.speed += ratio * state.feet[k].stiffness * speed
        pulled.speeding += ratio * state.feet[k].stiffness * speeding
        if plant.lates[k]:
            stack_m = state.places_m[k] - wanted_place(plant, state, k)
            stack_n = plant.piezo.stack_n_per_m * stack_m
            own_n = ratio * (stack_n if bends(plant) else state.contacts[k].memory.force_n)
            stride.drag_n -= own_n
            stride.before_w += own_n * speed


@kernel
def cut(plant: Record, state: Record, stride: Record) -> None:
    """Shorten the stride to the time at which the runner turns against a foot."""
    if not stride.may_turn:
        return
    runner, drive, longest_s = stride.runner, stride.drive, stride.longest_s
    past_jerk = runner.jerk - jerk_of_frame(plant, stride)
    snap = drive.speeding * stride.per_kg - runner.omega_squared * runner.speeding
    snap = snap - runner.gamma * runner.jerk
    crackle = -runner.omega_squared * runner.jerk - runner.gamma * snap
    for k in active_contacts(plant):
        speed, speeding, direction = sliding_motion(plant, state, stride, k)
        if direction * speeding < 0.0:
            turn_s = time_to_turn(speed, speeding, past_jerk, snap, crackle, longest_s)
            stride.lasts_s = min(stride.lasts_s, turn_s)


@kernel
def pass_middle(plant: Record, state: Record, stride: Record) -> None:
    """Evaluate the forces of the contacts in the middle."""
    middle_m, frame_m = stride.runner.middle_m, stride.frame_middle_m
    stride.middle_drag_n = move_contacts(
        plant, state, stride, middle_m, frame_m, 0.5 * stride.lasts_s
    )
    stride.middle_n, stride.middle_w = state.contact_n, stride.late_w


@kernel
def arrive(plant: Record, state: Record, stride: Record) -> None:
    """Move the contacts to the end, and add the work of the feet by Simpson's rule."""
    h_s, path, end_m = stride.lasts_s, stride.path, stride.runner.end_m
    end_drag_n = move_contacts(plant, state, stride, end_m, stride.frame_end_m, h_s)
    last = path.speed + h_s * path.speeding
    work_w = stride.drag_n * path.speed + 4.0 * stride.middle_drag_n * 0.5 * (path.speed + last)
    work_w += end_drag_n * last + (stride.before_w + 4.0 * stride.middle_w + stride.late_w)
    state.sums.feet_work_j -= SIXTH * h_s * work_w


@kernel
def move_contacts(
    plant: Record, state: Record, stride: Record, way_m: float, frame_m: float, time_s: float
) -> float:
    """
    Evaluate all contacts after a time of the stride; return their force on the nominal foot, N.

    ``way_m`` is the way of the runner, ``frame_m`` the position of the frame. Turning points
    change only at the end of the stride. The work of the feet is the returned force times the way
    of the nominal foot, and ``late_w`` for delayed feet; if stacks bend, it is that of the stacks.

    """
    drag_n, total_n, is_end = 0.0, 0.0, time_s >= stride.lasts_s
    position_m = state.position_m + way_m - frame_m
    foot_m = state.foot_m + way_after(stride.path, time_s)
    stride.late_w = 0.0
    for k in active_contacts(plant):
        contact, foot, ratio = state.contacts[k], state.feet[k], ratio_of(plant, k)
        wanted_m = state.offsets_m[k] + ratio * foot_m
        if plant.lates[k]:
            late = state.late[plant.lates[k] - 1]
            late_m = late.foot_m + way_in(late.speed, late.speeding, time_s)
            wanted_m = state.offsets_m[k] + ratio * late_m
        place_m = wanted_m
        if bends(plant):
            place_m = foot.end_m if is_end else foot.middle_m
        u_m = position_m - place_m
        travel_m = foot.unfold * (u_m - foot.origin_m)
        is_on_branch = 0.0 <= travel_m < foot.room_m
        if is_on_branch and (not is_end or foot.fold * contact.memory.sense > 0.0):
            foot.load_n = foot.base_n + foot.fold * virgin_force(plant.contacts[k].curve, travel_m)
            if is_end:
                contact.memory.u_m, contact.memory.force_n = u_m, foot.load_n
        else:
            dt_s = time_s - stride.passed_s
            react(plant.contacts[k], contact, u_m, dt_s, stride.holding_n)
            foot.load_n, foot.room_m = contact.memory.force_n, 0.0
        state.places_m[k] = place_m
        stack_n = plant.piezo.stack_n_per_m * (place_m - wanted_m)
        own_n = ratio * (stack_n if bends(plant) else foot.load_n)
        if plant.lates[k]:
            late = state.late[plant.lates[k] - 1]
            stride.late_w += own_n * (late.speed + time_s * late.speeding)
        else:
            drag_n += own_n
        total_n += foot.load_n
        state.preload_n = contact.preload_n
    state.contact_n, stride.passed_s = total_n, time_s
    return drag_n
