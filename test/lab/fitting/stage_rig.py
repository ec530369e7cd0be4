# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Rigs of other stages: feet of any load, gain and delay, and a guide, on rows of springs.

No code is shared with the package. The profile is that of Eq. 18, the springs stick or slip one by
one (Section 3.4 of the paper), the runner moves by the leapfrog method, the voltage falls with the
slew rate of its corners; feet that are alike are one with a count.
Piezo, guide, sensor and monitor may have what a stage file does not name.

"""

from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np

SPRINGS, STEP_S = 120, 2e-7
GRAVITY = 9.80665
HURST = 0.7
RUBY_PA, STEEL_PA, POISSON = 370e9, 210e9, 0.3


class Foot(NamedTuple):
    """Feet that are alike."""

    normal_n: float  # of each
    number: int = 1
    gain: float = 1.0  # 0: a guide at rest
    delay_s: float = 0.0
    friction: float = 0.0  # 0: that of the rig, as the modulus
    young_pa: float = 0.0


@dataclass(frozen=True)
class StageRig:
    """What is true of a rig."""

    feet: tuple[Foot, ...]
    radius_m: float
    friction: float = 0.3
    prefactor: float = 4.4478e-4
    mass_kg: float = 0.03
    damping_n_s_per_m: float = 20.0
    gain_m_per_v: float = 1e-8
    load_n: float = 0.0
    moduli_pa: tuple[float, float] = (RUBY_PA, STEEL_PA)
    slew_v_per_s: float = 150e6
    hysteresis: float = 0.0  # share of the voltage that eight plays pass on
    dry_n: float = 0.0  # Coulomb friction beside the feet
    noise_m: float = 1.5e-9
    zero_m: float = 1.3e-6
    drift_m_per_s: float = 2e-8
    cyclic_m: float = 0.0  # of an interferometer with fringes of 316.4 nm
    position_share: float = 0.0  # error of the sensor's scale
    monitor_share: float = 0.0  # error of the voltage monitor
    monitor_v: float = 0.02  # noise of the voltage monitor
    seed: int = 1

    def recorded(self, rows: np.ndarray, rate_hz: float) -> tuple[np.ndarray, ...]:
        """Give times, volts of the monitor and positions of the sensor, shapes (n,)."""
        every = round(1.0 / (rate_hz * STEP_S))
        place_m = self.motion(rows, every)
        time_s = every * STEP_S * np.arange(len(place_m))
        chance = np.random.default_rng(self.seed)
        read_m = (1.0 + self.position_share) * place_m + self.zero_m + self.drift_m_per_s * time_s
        read_m = read_m + self.cyclic_m * np.sin(2.0 * np.pi * place_m / 316.4e-9)
        read_m = read_m + chance.normal(0.0, self.noise_m, len(time_s))
        volts = (1.0 + self.monitor_share) * np.interp(time_s, *rows.T)
        return time_s, volts + chance.normal(0.0, self.monitor_v, len(time_s)), read_m

    def motion(self, rows: np.ndarray, every: int) -> np.ndarray:
        """Give every so many steps the place of the runner."""
        steps = round(rows[-1, 0] / STEP_S)
        at_s = STEP_S * np.arange(steps + 1)
        range_v = float(np.ptp(rows[:, 1]))
        stiff, limits, feet_m = [], [], []
        for foot in self.feet:
            moduli_pa = foot.young_pa or self.moduli_pa[0], self.moduli_pa[1]
            half_m, press_n = row_of(
                foot.normal_n, self.radius_m, self.prefactor, normal_pa(moduli_pa), SPRINGS
            )
            stiff.append(foot.number * 2.0 * shear_pa(moduli_pa) * half_m / SPRINGS)
            limits.append(foot.number * (foot.friction or self.friction) * press_n)
            volts = np.interp(at_s - foot.delay_s, *rows.T)
            followed = with_memory(volts, self.hysteresis, range_v)
            feet_m.append(foot.gain * self.gain_m_per_v * followed)
        mechanics = self.mass_kg, self.damping_n_s_per_m, self.load_n, self.dry_n
        springs = np.array(feet_m), np.array(stiff), np.array(limits)
        return run(*springs, *mechanics, STEP_S, every)


def row_of(
    normal_n: float, radius_m: float, prefactor: float, modulus_pa: float, springs: int
) -> tuple[float, np.ndarray]:
    """Give half the width of a contact and the normal forces of its springs, both halves."""

    def height(x: np.ndarray) -> np.ndarray:
        return x**2 / radius_m + prefactor * x**HURST

    share = (np.arange(springs) + 0.5) / springs
    low, high = 1e-9, 1e-3
    for _ in range(200):
        half_m = 0.5 * (low + high)
        gaps = height(np.array(half_m)) - height(share * half_m)
        forces = 2.0 * modulus_pa * half_m / springs * gaps
        low, high = (half_m, high) if forces.sum() < normal_n else (low, half_m)
    return half_m, forces


def normal_pa(moduli_pa: tuple[float, float]) -> float:
    """Give the modulus of two bodies that are pressed together."""
    return 1.0 / sum((1.0 - POISSON**2) / each for each in moduli_pa)


def shear_pa(moduli_pa: tuple[float, float]) -> float:
    """Give the modulus of two bodies against a tangential force."""
    shear = [each / (2.0 * (1.0 + POISSON)) for each in moduli_pa]
    return 1.0 / sum((2.0 - POISSON) / (4.0 * each) for each in shear)


def with_memory(volts: np.ndarray, share: float, range_v: float) -> np.ndarray:
    """Give the voltage that a piezo follows with eight plays of widths up to the range."""
    if not share:
        return volts
    plays = [play(volts, 0.5 * range_v * (k + 0.5) / 8.0) for k in range(8)]
    return (1.0 - share) * volts + share / 8.0 * np.sum(plays, axis=0)


@numba.njit(cache=False)
def play(volts, half_width):
    out, place = np.empty_like(volts), volts[0]
    for k in range(len(volts)):
        place = min(max(place, volts[k] - half_width), volts[k] + half_width)
        out[k] = place
    return out


@numba.njit(cache=False, fastmath=True)
def run(feet_m, stiff, limits, mass_kg, damping, load_n, dry_n, step_s, every):
    pulls = np.zeros(limits.shape)
    x, v, lost = 0.0, 0.0, 0.5 * damping * step_s / mass_kg
    out = np.empty((feet_m.shape[1] - 1) // every + 1)
    out[0] = 0.0
    for k in range(1, feet_m.shape[1]):
        dx = v * step_s
        x += dx
        force = load_n
        for i in range(limits.shape[0]):
            du = stiff[i] * (dx - (feet_m[i, k] - feet_m[i, k - 1]))
            for j in range(limits.shape[1]):
                q = min(max(pulls[i, j] + du, -limits[i, j]), limits[i, j])
                pulls[i, j] = q
                force -= q
        v = (v * (1.0 - lost) + force * step_s / mass_kg) / (1.0 + lost)
        stop = dry_n * step_s / mass_kg
        v = 0.0 if abs(v) <= stop else v - np.sign(v) * stop
        if k % every == 0:
            out[k // every] = x
    return out


def waves(
    *parts: tuple[float, float, int], slew_v_per_s: float, low_v: float, rest_s: float = 3e-3
) -> np.ndarray:
    """
    Give the corners of waves from the lowest voltage, with rests between them.

    Each is volts, hertz and number of cycles; of negative volts a triangle.

    """
    rows, now_s = [(0.0, low_v), (rest_s, low_v)], rest_s
    for volts, hertz, count in parts:
        for _ in range(count):
            end_s = now_s + 1.0 / hertz
            turn_s = now_s + 0.5 / hertz if volts < 0.0 else end_s - volts / slew_v_per_s
            rows += [(turn_s, low_v + abs(volts)), (end_s, low_v)]
            now_s = end_s
        now_s += rest_s
        rows.append((now_s, low_v))
    return np.array(rows)
