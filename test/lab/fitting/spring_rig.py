# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A made-up rig: rows of springs under six feet, small time steps, a sensor that is not ours.

Its springs are those of ``stage_rig``, and it shares no code with the package. What fits do not
know may be there: feet of unequal gain, a piezo that remembers and rings, a slow sensor, a zero,
a drift, a late clock, noise.

"""

from collections import Counter
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from scipy import signal
from stage_rig import row_of, run, waves, with_memory

E_STAR_PA, G_STAR_PA = 147.21485e9, 121.23576e9
RADIUS_M = 0.5e-3
SHARES = (2**0.5 / 2, 2**0.5 / 2, *(2**0.5 / 4,) * 4)
"""Normal force of each foot per preload."""
SPRINGS = 160  # under half a contact
STEP_S = 1e-7
SLEW_V_PER_S = 150e6
MOVES = (
    *('preload_n', 'friction', 'prefactor', 'mass_kg', 'damping_n_s_per_m'),
    *('gain_m_per_v', 'gains', 'hysteresis', 'resonance_hz', 'load_n'),
)
"""Fields of a rig that move its runner; the others belong to the sensor."""


@dataclass(frozen=True)
class Rig:
    """What is true of a rig."""

    preload_n: float = 0.5
    friction: float = 0.3
    prefactor: float = 4.4478e-4
    mass_kg: float = 3e-3
    damping_n_s_per_m: float = 20.0
    gain_m_per_v: float = 160e-9 / 300.0
    gains: tuple[float, ...] = field(default=(1.0,) * 6)  # of each foot, per mean gain
    hysteresis: float = 0.0  # share of the voltage that eight plays pass on
    resonance_hz: float = 0.0  # of the piezo, whose damping ratio is 0.07; 0 is none
    load_n: float = 0.0  # constant force on the runner
    noise_m: float = 1.5e-9
    zero_m: float = 1.3e-6
    drift_m_per_s: float = 2e-8
    late_s: float = 0.0  # of the sensor's clock
    low_pass_hz: float = 0.0  # of the sensor, first order; 0 is none
    filters_readings: bool = True  # one by one, as software does; else the motion, as a circuit
    is_noise_behind: bool = True  # of the low-pass, where it is white; else before it

    def positions(self, rows: np.ndarray, rate_hz: float, seed: int) -> tuple[np.ndarray, ...]:
        """Give times and readings of the sensor under a voltage, corners of shape (n, 2)."""
        every = round(1.0 / (rate_hz * STEP_S))
        fine = every if self.filters_readings else 10
        of_motion = {name: getattr(self, name) for name in MOVES}
        out = _motion(Rig(**of_motion), rows.tobytes(), fine)
        if self.low_pass_hz and not self.filters_readings:
            kept = np.exp(-2.0 * np.pi * self.low_pass_hz * fine * STEP_S)
            out = signal.lfilter((1.0 - kept,), (1.0, -kept), out)
        out = out[:: every // fine].copy()
        time_s = every * STEP_S * np.arange(len(out))
        noise = np.random.default_rng(seed).normal(0.0, self.noise_m, len(out))
        if not self.is_noise_behind:
            out, noise = out + noise, np.zeros_like(out)
        if self.low_pass_hz and self.filters_readings:
            share = 1.0 - np.exp(-2.0 * np.pi * self.low_pass_hz / rate_hz)
            for k in range(1, len(out)):
                out[k] = out[k - 1] + share * (out[k] - out[k - 1])
        readings = out + self.zero_m + self.drift_m_per_s * time_s + noise
        return time_s + self.late_s, readings


@lru_cache(maxsize=16)
def _motion(rig: Rig, rows: bytes, every: int) -> np.ndarray:
    """Give every so many steps the place of the runner; the values stay as they are."""
    corners = np.frombuffer(rows).reshape(-1, 2)
    alike = Counter(zip(SHARES, rig.gains, strict=True))
    stiff, limits = [], []
    for (share, _), number in alike.items():
        half_m, press_n = contact(share * rig.preload_n, rig.prefactor)
        stiff.append(number * 2.0 * G_STAR_PA * half_m / SPRINGS)
        limits.append(number * rig.friction * press_n)
    steps = round(corners[-1, 0] / STEP_S)
    voltage_v = np.interp(STEP_S * np.arange(steps + 1), corners[:, 0], corners[:, 1])
    foot_m = rig.gain_m_per_v * with_memory(voltage_v, rig.hysteresis, 300.0)
    if rig.resonance_hz:
        omega = 2.0 * np.pi * rig.resonance_hz
        rings = signal.TransferFunction([omega**2], [1.0, 0.14 * omega, omega**2])
        even = rings.to_discrete(STEP_S, 'tustin')
        foot_m = signal.lfilter(even.num, even.den, foot_m)
    feet_m = np.outer([gain for _, gain in alike], foot_m)
    mechanics = rig.mass_kg, rig.damping_n_s_per_m, rig.load_n, 0.0
    out = run(feet_m, np.array(stiff), np.array(limits), *mechanics, STEP_S, every)
    out.flags.writeable = False
    return out


def contact(normal_n: float, prefactor: float) -> tuple[float, np.ndarray]:
    """Give half the width of a contact and the normal forces of its springs, both halves."""
    return row_of(normal_n, RADIUS_M, prefactor, E_STAR_PA, SPRINGS)


def voltage(*parts: tuple[float, float, int], rest_s: float = 3e-3) -> np.ndarray:
    """Give the corners of waves one after the other, from 0 V, with rests between them."""
    return waves(*parts, slew_v_per_s=SLEW_V_PER_S, low_v=0.0, rest_s=rest_s)
