# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What a saw-tooth run comes to, of the drive alone or of the whole stand."""

from dataclasses import dataclass

from stickslip_ros.sections import Section, Shown, rows_of, said


@dataclass(frozen=True, kw_only=True)
class RunResult(Shown):
    """What a saw-tooth run comes to."""

    # what was asked for; of a drive alone, the preload at the end of its ramp
    preload_n: float = said('preload', '.5g')
    amplitude_m: float = said('stroke of the feet', '.4g')
    frequency_hz: float = said('frequency', '.5g')
    # generated force k x, mean over the last cycle; of a one-sided load cell k (x - gap) at the
    # mean position
    force_mean_n: float = said('generated force, mean of the last cycle', '.4f', default=0.0)
    # the same without elastic following: force_mean_n less the mean force of a runner that sticks
    # to ideal feet, from where the wave begins: K A/2 of a saw-tooth, backwards -K A/2, with 1/K =
    # 1/k + 1/(stiffness of the sticking contacts). Near 0 below the 0-amplitude; 0 of a load cell
    # that nothing presses
    force_net_n: float = said('the same without elastic following', '.4f', default=0.0)
    # generated force at the start of the last cycle's ramp, when the fall before it is over. The
    # runner has hardly moved by then: it is near the largest of the cycle
    force_ramp_start_n: float = said('generated force, start of the ramp', '.4f', default=0.0)
    # net motion per cycle, mean of the last 10 cycles
    step_length_m: float = said('step length, last 10 cycles', '.4f', default=0.0)
    # standard deviation of single steps in the second half of the run, and the way over which
    # their correlation falls to 1/e; 0 of steps that are all equal
    step_scatter_m: float = said('standard deviation of a step', '.4f', default=0.0)
    step_correlation_m: float = said('correlation length of steps', '.4f', default=0.0)
    # whether at least 200 cycles were made, and force (of a free runner: step length) is within
    # 0.02 % of its limit, extrapolated from the last 40
    steady: bool = True
    steps: int = 0  # cycles made
    # what the energy balance misses, relative to the work of the feet
    energy_residual: float = said('energy residual / work of the feet', '.2e', default=0.0)

    def sections(self) -> list[Section]:
        """Return the numbers."""
        steps = 'steps', self.steps, 'steady' if self.steady else 'NOT steady'
        return [Section('run', [*rows_of(self), steps])]


@dataclass(frozen=True, kw_only=True)
class DriveRun(RunResult):
    """The same of the drive alone; its friction loss per cycle is a mean of the last 20."""

    energy_loss_per_step_j: float = said('friction loss of a step', '.4f', default=0.0)


@dataclass(frozen=True, kw_only=True)
class SawtoothRun(RunResult):
    """The same of the whole stand; ``recording`` is its file, empty if none was asked for."""

    voltage_v: float = said('voltage', '.4g')
    simulated_s: float = said('simulated time', '.4f')
    wall_s: float = said('wall time', '.4f')
    real_time_factor: float = said('real-time factor', '.1f')
    recording: str = ''

    def sections(self) -> list[Section]:
        """Return the numbers, and the file if there is one."""
        notes = [f'recording {self.recording}'] if self.recording else []
        return [each._replace(notes=notes) for each in super().sections()]
