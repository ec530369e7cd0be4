"""From parameters to the records of amplifier, piezo and walls."""

import math

from stickslip_ros.contact.record import Record, record
from stickslip_ros.drive.records import AMPLIFIER, PIEZO, WALLS
from stickslip_ros.parameters import Parameters


def amplifier_of(parameters: Parameters) -> Record:
    """Return what is not ideal about the amplifier."""
    setting = parameters.amplifier
    tau_s = 1.0 / (2.0 * math.pi * setting.bandwidth) if setting.bandwidth else 0.0
    return record(AMPLIFIER, on=True, resolution_v=setting.resolution, tau_s=tau_s)


def slew_of(parameters: Parameters) -> float:
    """Return the slew rate, V/s: the current into the piezos may allow less than the amplifier."""
    setting = parameters.amplifier
    if not setting.current_max:
        return setting.slew_rate
    return min(setting.slew_rate, setting.current_max / parameters.actuator.capacitance)


def piezo_of(parameters: Parameters) -> Record:
    """
    Return what is not ideal about the piezo.

    Notes
    -----
    n plays have the half widths r_j = (R/2) j/(n+1), R the range of the voltage. Over the whole
    range play j makes the stroke R - 2 r_j, and in mid-stroke its branches lie 2 min(r_j,
    R/2 - r_j) apart. That the opening is h R and the stroke R gives the weight
    w = h (n+1)/floor((n+1)^2/4) of each and the linear part 1 - w n/2.

    """
    setting, amplifier = parameters.actuator, parameters.amplifier
    plays = setting.plays if setting.hysteresis else 0
    weight = setting.hysteresis * (plays + 1) / ((plays + 1) ** 2 // 4) if plays else 0.0
    return record(
        PIEZO,
        linear=1.0 - 0.5 * weight * plays,
        weight=weight,
        plays=plays,
        play_v=0.5 * (amplifier.voltage_max - amplifier.voltage_min) / (plays + 1),
        creep=setting.creep,
        omega_per_s=2.0 * math.pi * setting.resonance,
        damping_ratio=setting.damping_ratio,
    )


def is_linear(piezo: Record) -> bool:
    """Tell whether the displacement is proportional to the voltage at every instant."""
    return not (piezo['plays'] or piezo['creep'] or piezo['omega_per_s'])


def walls_of(parameters: Parameters) -> Record:
    """Return the one-sided springs that the runner may run into."""
    stand, cell = parameters.stand, parameters.load_cell
    presses, stops = cell.contact == 'one_sided', stand.stop_stiffness > 0.0
    return record(
        WALLS,
        exist=presses or stops,
        cell_n_per_m=cell.stiffness if presses else 0.0,
        gap_m=cell.gap,
        stop_n_per_m=stand.stop_stiffness,
        low_m=stand.travel_min,
        high_m=stand.travel_max,
        nearest_low_m=stand.travel_min if stops else -math.inf,
        nearest_high_m=min(
            cell.gap if presses else math.inf, stand.travel_max if stops else math.inf
        ),
    )
