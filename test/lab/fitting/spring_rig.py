# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A made-up rig: rows of springs under six feet, small time steps, a sensor that is not ours.

It shares no code with the package. The profile is that of Eq. 18, the springs stick or slip one by
one (Section 3.4 of the paper), the runner moves by the leapfrog method, the voltage falls with the
slew rate of its corners. What fits do not know may be there: feet of unequal gain, a piezo that
remembers and rings, a slow sensor, a zero, a drift, a late clock, noise.

"""

from dataclasses import dataclass, field
from functools import lru_cache

import numba
import numpy as np
from scipy import signal

E_STAR_PA, G_STAR_PA = 147.21485e9, 121.23576e9
RADIUS_M, HURST = 0.5e-3, 0.7
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
    stiff, pressed = [], []
    for share in SHARES:
        half_m, press_n = _row(share * rig.preload_n, rig.prefactor)
        stiff.append(np.full(SPRINGS, 2.0 * G_STAR_PA * half_m / SPRINGS))
        pressed.append(rig.friction * press_n)
    steps = round(corners[-1, 0] / STEP_S)
    voltage_v = np.interp(STEP_S * np.arange(steps + 1), corners[:, 0], corners[:, 1])
    foot_m = rig.gain_m_per_v * _with_memory(voltage_v, rig.hysteresis)
    if rig.resonance_hz:
        omega = 2.0 * np.pi * rig.resonance_hz
        rings = signal.TransferFunction([omega**2], [1.0, 0.14 * omega, omega**2])
        even = rings.to_discrete(STEP_S, 'tustin')
        foot_m = signal.lfilter(even.num, even.den, foot_m)
    out = _run(
        foot_m,
        np.array(rig.gains),
        np.array(stiff),
        np.array(pressed),
        rig.mass_kg,
        rig.damping_n_s_per_m,
        rig.load_n,
        every,
    )
    out.flags.writeable = False
    return out


def _row(normal_n: float, prefactor: float) -> tuple[float, np.ndarray]:
    """Give half the width of a contact and the normal forces of its springs, both halves."""

    def height(x: np.ndarray) -> np.ndarray:
        return x**2 / RADIUS_M + prefactor * x**HURST

    low, high = 1e-9, 1e-4
    for _ in range(200):
        half_m = 0.5 * (low + high)
        x = (np.arange(SPRINGS) + 0.5) * half_m / SPRINGS
        forces = 2.0 * E_STAR_PA * half_m / SPRINGS * (height(np.array(half_m)) - height(x))
        low, high = (half_m, high) if forces.sum() < normal_n else (low, half_m)
    return half_m, forces


def _with_memory(voltage_v: np.ndarray, share: float) -> np.ndarray:
    """Give the voltage that a piezo follows with eight plays of widths up to 300 V."""
    if not share:
        return voltage_v
    followed = (1.0 - share) * voltage_v
    for k in range(8):
        followed = followed + share / 8.0 * _play(voltage_v, 150.0 * (k + 0.5) / 8.0)
    return followed


@numba.njit(cache=False)
def _play(voltage_v, half_width_v):
    out, place = np.empty_like(voltage_v), voltage_v[0]
    for k in range(len(voltage_v)):
        place = min(max(place, voltage_v[k] - half_width_v), voltage_v[k] + half_width_v)
        out[k] = place
    return out


@numba.njit(cache=False, fastmath=True)
def _run(foot_m, gains, stiff, limits, mass_kg, damping, load_n, every):
    pulls = np.zeros(stiff.shape)
    x, v = 0.0, 0.0
    out = np.empty((len(foot_m) - 1) // every + 1)
    out[0] = 0.0
    before = foot_m[0]
    for k in range(1, len(foot_m)):
        moved = foot_m[k] - before
        before = foot_m[k]
        dx = v * STEP_S
        x += dx
        force = load_n
        for i in range(len(gains)):
            du = dx - gains[i] * moved
            for j in range(pulls.shape[1]):
                q = pulls[i, j] + stiff[i, j] * du
                q = min(max(q, -limits[i, j]), limits[i, j])
                pulls[i, j] = q
                force -= q
        v = (v * (1.0 - 0.5 * damping * STEP_S / mass_kg) + force * STEP_S / mass_kg) / (
            1.0 + 0.5 * damping * STEP_S / mass_kg
        )
        if k % every == 0:
            out[k // every] = x
    return out


def voltage(*waves: tuple[float, float, int], rest_s: float = 3e-3) -> np.ndarray:
    """
    Give the corners of waves one after the other, with rests between them.

    Each is volts, hertz and number of cycles; of negative volts a triangle.

    """
    rows, now_s = [(0.0, 0.0), (rest_s, 0.0)], rest_s
    for volts, hertz, count in waves:
        for _ in range(count):
            if volts < 0.0:
                rows += [(now_s + 0.5 / hertz, -volts), (now_s + 1.0 / hertz, 0.0)]
            else:
                fall_s = volts / SLEW_V_PER_S
                rows += [(now_s + 1.0 / hertz - fall_s, volts), (now_s + 1.0 / hertz, 0.0)]
            now_s += 1.0 / hertz
        now_s += rest_s
        rows.append((now_s, 0.0))
    return np.array(rows)
