"""Stand-ins until the drive and the sensors have them."""

import math

from stickslip_ros.drive.amplifier import SETTLED_V


def has_arrived(plant, wave, state):
    return state.clock.cycle >= wave.cycles and abs(state.voltage_v - wave.start_v) <= SETTLED_V


def missing(wave, share, seed):
    return wave


def apply_faults(plant, history, state, *, dead_foot, runner_stuck, amplifier_on):
    return plant, state


