"""The drive alone and the whole stand are the same drive."""

import pytest

from stickslip_ros.parameters import Parameters
from stickslip_ros.study.drive_run import run_drive
from stickslip_ros.study.sawtooth_run import run_sawtooth, voltage_for

AMPLITUDE_M, FREQUENCY_HZ, STEPS = 160e-9, 1000.0, 220
# The stand cuts time at its samples, which moves steps by less than the error of the default step.
OTHER_STEPS = 2e-4


@pytest.mark.parametrize('end_n', [0.0, 0.3, 1.0])
def test_a_preload_ramp_is_the_same_with_and_without_sensors(end_n: float):
    ramp = {'stand.preload': 0.5, 'stand.preload_end': end_n, 'stand.preload_rate': 10.0}
    parameters = Parameters().updated(ramp)
    alone = run_drive(parameters, AMPLITUDE_M, FREQUENCY_HZ, STEPS)
    stand = run_sawtooth(parameters, voltage_for(parameters, AMPLITUDE_M), FREQUENCY_HZ, STEPS)
    assert alone.preload_n == pytest.approx(end_n or 0.5, rel=1e-12)
    assert alone.force_mean_n == pytest.approx(stand.force_mean_n, rel=OTHER_STEPS)
