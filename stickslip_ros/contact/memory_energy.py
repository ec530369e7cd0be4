"""Kernel: the energy of a contact that remembers turning points, lost and stored."""

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.memory import U, branch_loss
from stickslip_ros.contact.record import Record
from stickslip_ros.contact.virgin import virgin_energy, virgin_force, virgin_stiffness


@kernel
def lost_energy(curve: Record, memory: Record) -> float:
    """Return the friction loss since the start, J."""
    travel_m = abs(memory.u_m - memory.turns[memory.depth, U])
    return memory.lost_j + branch_loss(curve, memory.depth, travel_m) - memory.base_j


@kernel
def stored_energy(curve: Record, memory: Record) -> float:
    """
    Return the elastic energy in the springs, J; O(depth).

    Notes
    -----
    An element that slips at w has the density p(w) = -T_v''(w) and the elongation e(w):
    the stack says that between two half loop widths e = +-w + (u - u_k), beyond the largest
    e = u - u_0. The energy is the integral of p e^2 / 2.

    """
    turns = memory.turns
    half_m = 0.5 * memory.sense * (memory.u_m - turns[memory.depth, U])
    if memory.depth == 0:
        half_m *= 2.0
    energy_j = _energy_between(curve, 0.0, half_m, 1.0, 0.0)
    sense = memory.sense
    for k in range(memory.depth, 0, -1):
        outer_m = 0.5 * abs(turns[k, U] - turns[k - 1, U])
        if k == 1:
            outer_m *= 2.0
        energy_j += _energy_between(curve, half_m, outer_m, -sense, memory.u_m - turns[k, U])
        sense = -sense
        half_m = outer_m
    return energy_j + _energy_between(curve, half_m, curve.limit_m, 0.0, memory.u_m - turns[0, U])


@kernel
def _energy_between(
    curve: Record, inner_m: float, outer_m: float, slope: float, shift_m: float
) -> float:
    """Return the energy of the elements inner < w < outer with elongation slope w + shift, J."""
    moments = _moments(curve, outer_m)
    inner = _moments(curve, inner_m)
    return 0.5 * (
        slope * slope * (moments[2] - inner[2])
        + 2.0 * slope * shift_m * (moments[1] - inner[1])
        + shift_m * shift_m * (moments[0] - inner[0])
    )


@kernel
def _moments(curve: Record, w_m: float) -> tuple[float, float, float]:
    """Return the integrals of p, p w and p w^2 from 0 to w, with p = -T_v''."""
    force_n = virgin_force(curve, w_m)
    stiffness = virgin_stiffness(curve, w_m)
    energy_j = virgin_energy(curve, w_m)
    return (
        curve.cells[0, 1] - stiffness,
        force_n - w_m * stiffness,
        2.0 * (w_m * force_n - energy_j) - w_m * w_m * stiffness,
    )
