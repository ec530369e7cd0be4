"""A saw-tooth run of the drive alone, without sensors: as fast as the kernels go."""

from dataclasses import dataclass

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.drive.advance import advance
from stickslip_ros.drive.build import change_preload, plant_of, start_clock, state_at_rest
from stickslip_ros.drive.ledger import energies_of_contacts, take_ledger
from stickslip_ros.drive.records import Wave
from stickslip_ros.errors import OutOfRange
from stickslip_ros.instrument.commands import Request, check_request
from stickslip_ros.parameters import Parameters
from stickslip_ros.stopping import heed_stop
from stickslip_ros.study.ramps import (
    STEADY_STEPS_MAX,
    STEADY_STEPS_MIN,
    STEADY_WINDOW,
    is_steady,
    mean_force_n,
    start_force_n,
    step_length_m,
)
from stickslip_ros.study.sawtooth_run import relative_residual, start_on_wave, voltage_for

ROUNDING_S = 1e-12
"""Time by which many periods may miss the last corner through rounding."""


@dataclass(frozen=True)
class DriveRun:
    """
    What a saw-tooth run of the drive comes to.

    Attributes
    ----------
    preload_n, amplitude_m, frequency_hz : float
        What was asked for.
    force_mean_n : float
        Generated force k x, mean over the last cycle; of a one-sided load cell k (x - gap) at
        the mean position.
    force_ramp_start_n : float
        Generated force at the start of the last cycle's ramp, when the fall before it is over.
    step_length_m : float
        Net motion per cycle, mean of the last 10 cycles.
    energy_loss_j : float
        Friction loss per cycle, mean of the last 20 cycles.
    steady : bool
        Whether force (of a free runner: step length) changed by less than 0.1 % over the last
        20 cycles, after at least 200.
    steps : int
        Cycles made.
    energy_residual : float
        What the energy balance misses, relative to the work of the feet.

    """

    preload_n: float
    amplitude_m: float
    frequency_hz: float
    force_mean_n: float
    force_ramp_start_n: float
    step_length_m: float
    energy_loss_j: float
    steady: bool
    steps: int
    energy_residual: float


def run_drive(
    parameters: Parameters, amplitude_m: float, frequency_hz: float, steps: int = 0
) -> DriveRun:
    """
    Drive the runner with a saw-tooth, from rest.

    Parameters
    ----------
    parameters : Parameters
        The stand.
    amplitude_m : float
        Stroke of the feet, m; 0 is a drive at rest.
    frequency_hz : float
        Steps per second; negative ones go backwards.
    steps : int
        Number of steps; 0 goes on until the steady state, at most 5000.

    Raises
    ------
    StickSlipError
        If amplitude, frequency or steps are refused, or the integration has failed.

    """
    if amplitude_m == 0.0:
        preload_n = parameters.stand.preload
        return DriveRun(preload_n, 0.0, frequency_hz, 0.0, 0.0, 0.0, 0.0, True, 0, 0.0)
    voltage_v = voltage_for(parameters, amplitude_m)
    request = Request('sawtooth', (voltage_v, frequency_hz, 0.0))
    parameters = start_on_wave(parameters, request)
    wave = check_request(request, parameters)
    if steps < 0:
        raise OutOfRange('steps', steps, '', 'below 0', 'give a number, or 0 for the steady state')
    return _Run(parameters, wave).go(amplitude_m, frequency_hz, steps)


class _Run:
    """A drive under one wave, advanced by whole windows of cycles."""

    def __init__(self, parameters: Parameters, wave: Wave) -> None:
        self._wave = wave
        self._plants = plant_of(parameters)
        self._states = state_at_rest(self._plants, parameters.stand.preload)
        if parameters.stand.preload_end:
            change_preload(self._plants, self._states, parameters, parameters.stand.preload_end)
        start_clock(self._states)
        self._logs: list[Array] = []

    @property
    def _cycle(self) -> int:
        return int(self._states['clock']['cycle'].item())

    def go(self, amplitude_m: float, frequency_hz: float, steps: int) -> DriveRun:
        plant, most = self._plants[0], steps or STEADY_STEPS_MAX
        loss_j = 0.0
        while (done := self._cycle) < most:
            heed_stop()
            enough = not steps and done >= STEADY_STEPS_MIN
            if enough and is_steady(plant, np.concatenate(self._logs)):
                break
            cycles = min(STEADY_WINDOW, most - done)
            loss_j = self._advance(cycles) / cycles
        ramps = np.concatenate(self._logs)
        return DriveRun(
            preload_n=float(self._states['preload_n'].item()),
            amplitude_m=amplitude_m,
            frequency_hz=frequency_hz,
            force_mean_n=mean_force_n(plant, ramps),
            force_ramp_start_n=start_force_n(plant, ramps),
            step_length_m=step_length_m(ramps),
            energy_loss_j=loss_j,
            steady=is_steady(plant, ramps),
            steps=len(ramps),
            energy_residual=relative_residual(take_ledger(self._plants, self._states)),
        )

    def _advance(self, cycles: int) -> float:
        """Advance by some cycles; return the friction loss in them, J."""
        log = np.empty((cycles, 3))
        first = self._cycle
        _, before_j = energies_of_contacts(self._plants, self._states)
        ramp_s = float(self._states['clock']['ramp_s'].item())
        time_s = cycles * self._wave.period_s - ramp_s
        while self._cycle < first + cycles:
            advance(self._plants, self._states, self._wave, 0.0, time_s, log)
            time_s = ROUNDING_S
        self._logs.append(np.roll(log, -(first % cycles), axis=0))
        _, after_j = energies_of_contacts(self._plants, self._states)
        return float(after_j - before_j)
