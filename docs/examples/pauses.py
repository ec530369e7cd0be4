"""Print 0-amplitude and first step after pauses of 1 to 1000 s, and without ageing."""

from functools import partial

import numpy as np

from stickslip_ros import Parameters, simulate

STAND = Parameters().updated({'load_cell.contact': 'absent', 'runner.damping': 20.0})
LAW = {'contact.friction_rate': 0.01, 'contact.friction_ageing': 0.01}
AMPLITUDES_M = np.linspace(120e-9, 160e-9, 5)


def first_step_m(stand: Parameters, amplitude_m: float) -> float:
    """Return the way from the end of the first ramp to that of the second."""
    drive = partial(simulate, stand, amplitude_m=amplitude_m, frequency_hz=200.0)
    ends_m = [steps * drive(steps=steps).step_length_m for steps in (1, 2)]
    return ends_m[1] - ends_m[0]


print('| pause | 0-amplitude, nm | first step at 160 nm, nm |')
print('|---|---|---|')
for rest_s in (None, 1.0, 10.0, 100.0, 1000.0):
    stand = STAND.updated(LAW | {'contact.rest_time': rest_s}) if rest_s else STAND
    steps_m = [first_step_m(stand, amplitude_m) for amplitude_m in AMPLITUDES_M]
    slope, offset_m = np.polyfit(AMPLITUDES_M, steps_m, 1)
    pause = f'{rest_s:g} s' if rest_s else 'no ageing'
    print(f'| {pause} | {-offset_m / slope * 1e9:.1f} | {steps_m[-1] * 1e9:.1f} |')
