# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What a wave is worth, by runs of the drive that are made one by one."""

import numpy as np
import pytest

from stickslip_ros.drive.build import friction_limit_n
from stickslip_ros.lab.design.objectives import WaveGoal, assess
from stickslip_ros.lab.runs.courses import run_course
from stickslip_ros.lab.runs.sawtooth_run import run_drive
from stickslip_ros.parameters import Parameters

pytestmark = pytest.mark.usefixtures('compiled_kernels')

STAND = Parameters()
SAWTOOTH = np.array([(0.0, 0.0), (1e-3, 300.0), (1e-3, 0.0)])


@pytest.mark.parametrize('load_n', [0.0, 0.05])
def test_flatness_is_that_of_four_speeds_from_no_load_to_the_whole_load(load_n):
    free = STAND.updated({'load_cell.contact': 'absent'})
    whole_n = load_n or 0.25 * friction_limit_n(STAND)
    steps_m = [
        run_drive(free, 160e-9, 1000.0, load_n=-share * whole_n / 3.0).step_length_m
        for share in range(4)
    ]
    flatness = (max(steps_m) - min(steps_m)) / float(np.mean(steps_m))
    worth = run_course(assess(WaveGoal('flatness', load_n), STAND, SAWTOOTH))
    assert worth.value == pytest.approx(flatness, rel=1e-4, abs=0.0)
