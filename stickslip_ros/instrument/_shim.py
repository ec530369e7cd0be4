"""Stand-ins until the drive and the sensors have them."""

import math

from stickslip_ros.drive.amplifier import SETTLED_V
from stickslip_ros.instrument.sensor import interferometer, load_cell


def has_arrived(plant, wave, state):
    return state.clock.cycle >= wave.cycles and abs(state.voltage_v - wave.start_v) <= SETTLED_V


def missing(wave, share, seed):
    return wave


def apply_faults(plant, history, state, *, dead_foot, runner_stuck, amplifier_on):
    return plant, state


class Interferometer:
    def __init__(self, p):
        self.s = interferometer(p)
        self.o = 0.0
        self.is_referenced = False
        self.beam_lost = False
        self.last = 0.0

    def reset(self):
        self.s.reset()
        self.o = 0.0
        self.is_referenced = False
        self.last = 0.0

    def zero(self):
        self.o += self.last
        self.is_referenced = True
        self.last = 0.0

    def read(self, truth, fault):
        r = self.s.read(truth) - self.o
        if fault.interferometer == 'dropout':
            r[:] = math.nan
        if fault.interferometer == 'freeze':
            r[:] = self.last
        self.last = r[-1]
        return r


class LoadCell(Interferometer):
    def __init__(self, p):
        self.s = load_cell(p)
        self.o = 0.0
        self.last = 0.0
        self.overrange = False

    tare = Interferometer.zero

    def read(self, truth, fault):
        r = self.s.read(truth) - self.o
        self.last = r[-1]
        return r
