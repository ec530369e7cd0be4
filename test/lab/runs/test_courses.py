# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Cycles of a course."""

import numpy as np

from stickslip_ros.drive.build import start_clock
from stickslip_ros.drive.waveform import sawtooth
from stickslip_ros.lab.runs.courses import cycles_of, drive_at_rest, run_course
from stickslip_ros.parameters import Parameters

ROUNDING = 1e-9
"""A run in two parts has other last digits, since its steps end elsewhere."""


def test_cycles_come_in_the_order_of_time_whatever_number_went_before():
    stand, wave = Parameters(), sawtooth(0.0, 250.0, 1000.0, 5)
    parts = []
    for counts in ([5], [3, 2]):
        plants, states = drive_at_rest(stand)
        start_clock(states)
        each = [run_course(cycles_of(plants, states, wave, cycles)) for cycles in counts]
        parts.append(np.concatenate(each))
    whole, joined = parts
    np.testing.assert_allclose(joined, whole, rtol=ROUNDING)
