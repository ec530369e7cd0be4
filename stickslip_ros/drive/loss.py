# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Kernel: loss in sticking contacts, in short steps.

A contact of elastic force T acts with F = T + tau T'. T' is the stiffness that sticks times the
velocity of the runner against the feet, and 0 in full slip. In a stride T is a tangent plus a rest
M, which begins as the square of time. tau M' has the momentum tau M, so M in the middle and at the
end gives its values for Simpson's rule.

"""

from stickslip_ros.drive import frame, stacks
from stickslip_ros.drive.feet import active_contacts, bends, sliding_motion, way_of
from stickslip_ros.drive.oscillator import SIXTH
from stickslip_ros.kernels.kernel import kernel, noinline_kernel
from stickslip_ros.kernels.record import Record


@kernel
def look_ahead(plant: Record, state: Record, stride: Record) -> None:
    """Add the viscous forces at the start to the loads of feet and frame."""
    if plant.loss_s > 0.0:
        stride.lag_n = 0.0
        for k in active_contacts(plant):
            foot, (speed, _, _) = state.feet[k], sliding_motion(plant, state, stride, k)
            state.starts_n[k], foot.n_per_s = (
                state.contacts[k].memory.force_n,
                foot.stiffness * speed,
            )
            foot.load_n = state.starts_n[k] + plant.loss_s * foot.n_per_s
            stride.lag_n += plant.loss_s * foot.n_per_s
        stride.start_lag_n = stride.lag_n
        frame.feel(plant, state, stride)
        if bends(plant):
            stride.recoil = stacks.frame_recoil(plant, state, stride, 0.0)


@kernel
def follow_stick(plant: Record, state: Record, stride: Record, time_s: float) -> None:
    """Add the viscous forces in the middle or at the end to the loads of feet and frame."""
    if plant.loss_s > 0.0:
        stride.lag_n = 0.0
        for k in active_contacts(plant):
            foot, start_n = state.feet[k], state.starts_n[k]
            missed_n = foot.load_n - start_n - time_s * foot.n_per_s
            if time_s < stride.lasts_s:
                state.middles_n[k] = foot.load_n
                rate_n = 4.0 * missed_n
            else:
                middle_n = state.middles_n[k] - start_n - 0.5 * time_s * foot.n_per_s
                rate_n = 6.0 * missed_n - 16.0 * middle_n
            lag_n = plant.loss_s * (foot.n_per_s + rate_n / stride.lasts_s)
            foot.load_n += lag_n
            stride.lag_n += lag_n


@noinline_kernel
def book_loss(plant: Record, state: Record, stride: Record) -> None:
    """
    Add the energy lost, and the work of the feet against the viscous forces.

    A parabola through the elastic forces gives their rates, for Simpson's rule.

    """
    h_s, runner, centre, sums = stride.lasts_s, stride.runner, stride.centre, state.sums
    speeds = runner.speed, runner.middle_m_per_s, runner.end_m_per_s
    centres = centre.speed, centre.middle_m_per_s, centre.end_m_per_s
    for k in active_contacts(plant):
        start_n, middle_n = state.starts_n[k], state.middles_n[k]
        end_n = state.contacts[k].memory.force_n
        grow_n = (
            4.0 * middle_n - 3.0 * start_n - end_n,
            4.0 * (end_n - start_n),
            start_n - 4.0 * middle_n + 3.0 * end_n,
        )
        speed, speeding = way_of(plant, state, stride, k)
        for i in range(3):
            time_s, impulse = 0.5 * i * h_s, SIXTH * plant.loss_s * grow_n[i]
            past_speed = speeds[i] - frame.frame_speed(plant, stride, centres[i], time_s)
            foot_speed = speed + time_s * speeding
            sums.sticking_lost_j += impulse * (past_speed - foot_speed)
            if not bends(plant):
                sums.feet_work_j -= impulse * foot_speed
