"""A run of the drive under a rounded saw-tooth, until the force is steady."""

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.drive.build import plant_of, state_at_rest
from stickslip_ros.drive.passes import check_motion
from stickslip_ros.paper.rounded_wave import (
    PIECES,
    RoundedWave,
    ride_pieces,
    time_constant_s,
)
from stickslip_ros.parameters import Parameters
from stickslip_ros.stopping import heed_stop
from stickslip_ros.study.ramps import (
    STEADY_STEPS_MAX,
    STEADY_WINDOW,
    is_steady,
    mean_force_n,
    step_length_m,
)
from stickslip_ros.study.sawtooth_run import voltage_for


def run_rounded(
    parameters: Parameters,
    amplitude_m: float,
    frequency_hz: float,
    bandwidth_hz: float,
    pieces: int = PIECES,
) -> tuple[float, float, bool]:
    """
    Drive the runner with a rounded saw-tooth, from rest, until the steady state.

    Parameters
    ----------
    parameters : Parameters
        The stand; amplifier.slew_rate is the slope of the fall before the low-pass.
    amplitude_m : float
        Stroke of the saw-tooth before the low-pass, m.
    frequency_hz : float
        Steps per second.
    bandwidth_hz : float
        Corner of the first-order low-pass behind the amplifier; infinity is none.
    pieces : int
        Straight pieces of the fall.

    Returns
    -------
    tuple of float, float, bool
        Generated force k x, mean of the last period, N; net motion per step, mean of the last
        10 periods, m; whether the run became steady.

    """
    slew = parameters.amplifier.slew_rate
    voltage_v = voltage_for(parameters, amplitude_m)
    wave = RoundedWave(voltage_v, 1.0 / frequency_hz, slew, time_constant_s(bandwidth_hz))
    voltages_v, spans_s = wave.table(pieces)
    voltages_v += parameters.amplifier.voltage_min
    parameters = parameters.updated({'amplifier.voltage_initial': float(voltages_v[0])})
    plants = plant_of(parameters)
    plant, states = plants[0], state_at_rest(plants, parameters.stand.preload)
    log: Array = np.empty((0, 3))
    while len(log) < STEADY_STEPS_MAX and not is_steady(plant, log):
        heed_stop()
        window = np.empty((STEADY_WINDOW, 3))
        ride_pieces(plants, states, voltages_v, spans_s, window)
        check_motion(states, 0.0)
        log = np.concatenate((log, window))
    return mean_force_n(plant, log), step_length_m(log), is_steady(plant, log)
