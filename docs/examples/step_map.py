"""
Draw and print how fast a free runner steps, over amplitude, frequency and load.

``python docs/examples/step_map.py`` prints the onsets and writes ``runs/step_map.png``.

"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from stickslip_ros import Parameters, run_drive

FREE = Parameters().updated({'load_cell.contact': 'absent'})
AMPLITUDES_M = np.linspace(0.0, 160e-9, 17)
FREQUENCIES_HZ = (100.0, 1000.0, 5000.0)
LOADS_N = (-0.1, 0.0, 0.1)
STEPS = 120
"""The last ten count."""


def step_lengths_m(frequency_hz, load_n):
    """Return the step length at each amplitude, m."""
    run = [run_drive(FREE, each, frequency_hz, STEPS, load_n=load_n) for each in AMPLITUDES_M]
    return np.array([each.step_length_m for each in run])


def main(folder='runs'):
    """Draw a panel for each load; return the steps, m, by frequency, load and amplitude."""
    steps_m = np.array([[step_lengths_m(f, load) for load in LOADS_N] for f in FREQUENCIES_HZ])
    figure, panels = plt.subplots(1, 3, sharey=True, figsize=(12.0, 3.5), layout='constrained')
    for axes, load_n, at_load_m in zip(panels, LOADS_N, steps_m.swapaxes(0, 1), strict=True):
        axes.set(title=f'load {1e3 * load_n:g} mN', xlabel='stroke of the feet (nm)')
        for frequency_hz, step_m in zip(FREQUENCIES_HZ, at_load_m, strict=True):
            velocity_um_per_s = 1e6 * frequency_hz * step_m
            axes.plot(1e9 * AMPLITUDES_M, velocity_um_per_s, '.-', label=f'{frequency_hz:g} Hz')
    panels[0].set_ylabel('velocity (um/s)')
    panels[0].legend()
    Path(folder).mkdir(exist_ok=True)
    figure.savefig(Path(folder, 'step_map.png'))
    for frequency_hz, at_160_nm in zip(FREQUENCIES_HZ, steps_m[:, :, -1], strict=True):
        onsets = ' | '.join(f'{1e9 * onset:.1f} nm' for onset in AMPLITUDES_M[-1] - at_160_nm)
        print(f'| {frequency_hz:g} Hz | {onsets} |')
    return steps_m


if __name__ == '__main__':
    main()
