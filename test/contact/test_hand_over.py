# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The force is continuous where turning points and springs hand over."""

import math

import numpy as np
import pytest

from stickslip_ros.contact.memory import move
from stickslip_ros.contact.reaction import CONTACT_STATE, react, relax, switch_to_springs
from stickslip_ros.contact.springs import move_springs
from stickslip_ros.drive.build import all_contacts
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.kernels.record import record
from stickslip_ros.lab.validation.bank import random_turns
from stickslip_ros.parameters import Parameters

move_springs = entry_point(move_springs)
move = entry_point(move)
react = entry_point(react)
switch_to_springs = entry_point(switch_to_springs)

STEP_S = 1e-6
FAR = 5.0
"""Displacement, in units of that of full slip, after which everything has slipped."""
SUMS = 1e-11
"""Rounding of sums over the springs, of the full-slip force."""


@pytest.mark.parametrize('preload_n', [0.1, 0.5, 1.0, 2.0])
def test_no_force_jumps_at_a_hand_over(preload_n):
    model = all_contacts(Parameters().updated({'stand.preload': preload_n}))
    contact = relax(record(CONTACT_STATE), preload_n)
    limit_n = 0.3 * 2.0 * math.sqrt(2.0) * preload_n
    for turn in random_turns(20140, 60):
        place_m = 1.2 * turn * model.curve.limit_m
        move(model.curve, contact.memory, place_m)
        there = contact.copy()
        switch_to_springs(model, there)
        after_n, _ = move_springs(model.bank, there.springs, 0.0, preload_n, preload_n)
        assert after_n == pytest.approx(contact.memory.force_n, rel=0.0, abs=SUMS * limit_n)
        far_m = place_m - np.sign(place_m) * FAR * model.curve.limit_m
        springs = there.springs.copy()
        slipping_n, _ = move_springs(model.bank, springs, far_m - place_m, preload_n, preload_n)
        react(model, there, far_m, STEP_S, 0.0)
        assert not there.on_springs
        assert there.memory.force_n == pytest.approx(slipping_n, rel=0.0, abs=SUMS * limit_n)
