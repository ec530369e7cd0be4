# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The result of a saw-tooth run, of the drive alone or of the whole stand."""

from dataclasses import dataclass

from stickslip_ros.sections import NotebookView, Section, report_field, rows_of


@dataclass(frozen=True, kw_only=True)
class RunResult(NotebookView):
    """The result of a saw-tooth run."""

    # requested preload; for a drive alone, the preload at the end of its ramp
    preload_n: float = report_field('preload', '.5g')
    amplitude_m: float = report_field('stroke of the feet', '.4g')
    frequency_hz: float = report_field('frequency', '.5g')
    # generated force k x, mean of the last cycle; one-sided: k (x - gap) at the mean position
    force_mean_n: float = report_field(
        'generated force, mean of the last cycle', '.4f', default=0.0
    )
    # force_mean_n less the mean force of a runner that sticks to ideal feet: K A/2 (backwards
    # -K A/2), 1/K = 1/k + 1/(stiffness of the sticking contacts). Near 0 below the 0-amplitude
    force_net_n: float = report_field('the same without elastic following', '.4f', default=0.0)
    # generated force after the last fall, near the largest of the cycle
    force_ramp_start_n: float = report_field(
        'generated force, start of the ramp', '.4f', default=0.0
    )
    # net motion per cycle, mean of the last 10 cycles
    step_length_m: float = report_field('step length, last 10 cycles', '.4f', default=0.0)
    # standard deviation of steps in the second half, and distance of correlation 1/e; 0 if equal
    step_scatter_m: float = report_field('standard deviation of a step', '.4f', default=0.0)
    step_correlation_m: float = report_field('correlation length of steps', '.4f', default=0.0)
    # at least 200 cycles; force (free runner: step length) within 0.02 % of the limit extrapolated
    # from the last 40
    steady: bool = True
    steps: int = 0  # cycles made
    # error of the energy balance, relative to the work of the feet
    energy_residual: float = report_field('energy residual / work of the feet', '.2e', default=0.0)

    def sections(self) -> list[Section]:
        steps = 'steps', self.steps, 'steady' if self.steady else 'NOT steady'
        return [Section('run', [*rows_of(self), steps])]


@dataclass(frozen=True, kw_only=True)
class DriveRun(RunResult):
    """A result of the drive alone; the loss per step is the mean of the last 20 cycles."""

    energy_loss_per_step_j: float = report_field('friction loss of a step', '.4f', default=0.0)


@dataclass(frozen=True, kw_only=True)
class SawtoothRun(RunResult):
    """A result of the whole stand; ``recording`` is its file, if any."""

    voltage_v: float = report_field('voltage', '.4g')
    simulated_s: float = report_field('simulated time', '.4f')
    wall_s: float = report_field('wall time', '.4f')
    real_time_factor: float = report_field('real-time factor', '.1f')
    recording: str = ''

    def sections(self) -> list[Section]:
        notes = [f'recording {self.recording}'] if self.recording else []
        return [each._replace(notes=notes) for each in super().sections()]
