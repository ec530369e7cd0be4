# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The standard case, ours, and what accuracy means: 0.7 N, 130 nm, 1 kHz, 200 steps, from rest."""

from collections.abc import Callable, Iterable, Mapping
from typing import TypeVar

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.advance import RAMP_MEAN, advance
from stickslip_ros.drive.build import plant_of, start_clock, state_at_rest
from stickslip_ros.drive.ledger import take_ledger
from stickslip_ros.drive.waveform import sawtooth
from stickslip_ros.lab.runs.sawtooth_run import relative_residual, voltage_for
from stickslip_ros.parameters import Parameters

PRELOAD_N = 0.7
AMPLITUDE_M = 130e-9
FREQUENCY_HZ = 1000.0
PERIOD_S = 1.0 / FREQUENCY_HZ
ACCURACY = 1e-3
"""Worst error of the mean force that counts as the same accuracy."""
ROUNDING_S = 1e-12

Setting = TypeVar('Setting')


def standard_case(changes: Mapping[str, object] | None = None) -> Parameters:
    """Return the parameters of the standard case, with some changed."""
    return Parameters().updated({'stand.preload': PRELOAD_N, **(changes or {})})


class Ours:
    """The drive alone: ``advance`` over some cycles of the saw-tooth, from rest."""

    def __init__(self, parameters: Parameters, cycles: int) -> None:
        self.plants = plant_of(parameters)
        self.work_s = cycles * PERIOD_S
        self._preload_n = parameters.stand.preload
        self.wave = sawtooth(0.0, voltage_for(parameters, AMPLITUDE_M), FREQUENCY_HZ, cycles)
        self._log = np.zeros((cycles, 3))
        self._states = state_at_rest(self.plants, self._preload_n)

    def __call__(self) -> Array:
        """Run, and return the mean force of every cycle, N."""
        states = state_at_rest(self.plants, self._preload_n)
        start_clock(states)
        time_s = self.work_s
        while states[0].clock.cycle < len(self._log):
            advance(self.plants, states, self.wave, 0.0, time_s, self._log)
            time_s = ROUNDING_S
        self._states = states
        return np.asarray(self.plants[0].cell_n_per_m * self._log[:, RAMP_MEAN])

    def energy_residual(self) -> float:
        """Return what the energy balance of the last run misses, relative to the feet's work."""
        return abs(relative_residual(take_ledger(self.plants, self._states)))


def worst_error(forces_n: Array, reference_n: Array) -> float:
    """
    Return the largest error of the mean force in any cycle, relative to the last of these forces.

    The error of a single cycle may be small by luck, when it changes its sign there.

    """
    compared_n = reference_n[: len(forces_n)]
    return float(np.max(np.abs(forces_n - compared_n)) / abs(compared_n[-1]))


def cheapest(
    settings: Iterable[Setting], forces_of: Callable[[Setting], Array], reference_n: Array
) -> Setting:
    """
    Return the first of some settings, cheapest first, that is as accurate as ACCURACY.

    If none is, the last one is returned: its error is in the table.

    """
    tried = list(settings)
    fine = (each for each in tried if worst_error(forces_of(each), reference_n) <= ACCURACY)
    return next(fine, tried[-1])


def ours_at(
    changes: Mapping[str, object], steps_s: Iterable[float], cycles: int, reference_n: Array
) -> tuple[Ours, float]:
    """Return our program with the longest accurate step of those given, and that step, s."""

    def with_step(step_s: float) -> Ours:
        return Ours(standard_case({**changes, 'sim.dt': step_s}), cycles)

    longest_first = sorted(steps_s, reverse=True)
    step_s = cheapest(longest_first, lambda s: with_step(s)(), reference_n)
    return with_step(step_s), step_s
