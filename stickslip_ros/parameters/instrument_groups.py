# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Parameters of the instrument: time, moves, limits, recordings, faults; SI."""

from dataclasses import dataclass

from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.parameters.declaration import (
    Checked,
    choice,
    count,
    quantity,
    switch,
    with_fields,
    words,
)
from stickslip_ros.parameters.physics_groups import FEET_MAX
from stickslip_ros.parameters.sensors import SENSOR_FAULTS

# A parameter is a row: default, unit, description, bounds, source; the rest by name.
# fmt: off


@dataclass(frozen=True)
class SimParameters(Checked, resumable=True):
    """Simulation: time step, block, pace, clock and start."""

    dt: float = quantity(
        5e-6, 's', 'longest time step; fast resonances, steep voltages, contact springs and '
        'rival laws shorten it', (1e-8, 2e-5), resumable=False)
    block: float = quantity(
        1e-3, 's', 'period of updates: of position, force and commands', (1e-4, 0.1),
        resumable=False)
    wake: float = quantity(
        0.0, 's',
        'time per wake-up, a multiple of sim.block; its blocks run in a row; 0: one block',
        (0.0, 0.1))
    seed: int = count(1, 'seed of all random numbers', (0, 2**31 - 1), resumable=False)
    real_time_factor: float = quantity(
        1.0, '', 'simulated seconds per wall-clock second; 0: as fast as possible', (0.0, 1000.0))
    lag_max: float = quantity(
        60.0, 's', 'largest lag that is caught up by running faster; a longer lag is dropped',
        (0.0, 3600.0), resumable=False)
    publish_clock: bool = switch(
        False, 'publish simulated time on /clock; not together with use_sim_time')
    publish_truth: bool = switch(
        False, 'publish the true values, without sensor errors, on truth/...')
    lockstep: bool = switch(
        False, 'advance only as far as command/grant allows: same bytes at any speed')
    time_origin: str = choice(
        'auto', ('auto', 'system', 'zero'),
        'origin of time stamps; auto: system time in real time without /clock, otherwise zero')
    joint_states_rate: float = quantity(
        100.0, 'Hz', 'rate of joint_states in simulated time; 0: none', (0.0, 1e4))
    joint_name: str = words('runner_joint', 'name of the runner in joint_states and command/joint')
    checkpoint: str = words(
        '', 'file of ~/save_checkpoint from which the node starts; empty: start at rest')

    def check_together(self) -> None:
        """Refuse a joint name that is empty or not printable."""
        if not self.joint_name or not self.joint_name.isprintable():
            hint = 'write one such as runner_joint'
            raise WrongKind('sim.joint_name', self.joint_name, 'a name of a joint', hint)


@dataclass(frozen=True)
class StepParameters(Checked, resumable=True):
    """The saw-tooth of single steps, of jogging and of coarse positioning."""

    amplitude: float = quantity(
        300.0, 'V', 'peak to peak voltage of a step', (0.001, 2000.0), live=True)
    frequency: float = quantity(
        1e3, 'Hz', 'steps per second; jogging has its own', (0.001, 1e6), live=True)


@dataclass(frozen=True)
class JogParameters(Checked, resumable=True):
    """Jogging: steps that continue while commands arrive."""

    timeout: float = quantity(
        0.5, 's', 'watchdog: the drive stops this long after the last command/jog or velocity of '
        'command/joint', (0.001, 60.0))


@dataclass(frozen=True)
class ClosedLoopParameters(Checked, resumable=True):
    """The built-in position control: coarse steps, fine scan, hold."""

    tolerance: float = quantity(
        2e-09, 'm', 'distance from the target that counts as in position', (1e-12, 0.001))
    settle_time: float = quantity(
        0.01, 's', 'time in position after which a move is done', (0.0, 60.0))
    timeout: float = quantity(30.0, 's', 'time after which an unfinished move fails', (0.001, 1e5))
    velocity: float = quantity(
        0.0, 'm/s', 'velocity of the set point towards the target; 0: as fast as the steps allow',
        (0.0, 1.0), live=True)
    gain: float = quantity(
        100.0, '1/s', 'integral gain of the fine scan: share of the error corrected per second',
        (0.1, 1e4))
    hold: bool = switch(True, 'hold the target after a move, until the next one')


@dataclass(frozen=True)
class LimitsParameters(Checked, resumable=True):
    """Limits of a move; a direct voltage ignores them."""

    soft_min: float = quantity(
        0.0, 'm', 'lowest position reading of a move; no soft limits if both are 0', (-1.0, 1.0),
        live=True)
    soft_max: float = quantity(
        0.0, 'm', 'highest position reading of a move', (-1.0, 1.0), live=True)
    following_error: float = quantity(
        0.0, 'm', 'largest distance from the set point in closed loop; 0: no limit', (0.0, 1.0))
    blocked_time: float = quantity(
        0.05, 's', 'time without progress in closed loop that counts as an end stop',
        (0.001, 60.0))

    @property
    def has_soft_limits(self) -> bool:
        """Whether a move is stopped at ``soft_min`` and ``soft_max``."""
        return self.soft_min != 0.0 or self.soft_max != 0.0

    def check_together(self) -> None:
        """Refuse a lower soft limit above the upper one."""
        if self.soft_min > self.soft_max:
            limit = f'above limits.soft_max, {self.soft_max:g} m'
            raise OutOfRange('limits.soft_min', self.soft_min, 'm', limit, 'lower it')


@dataclass(frozen=True)
class TraceParameters(Checked):
    """The oscilloscope: blocks of samples on one topic."""

    sample_rate: float = quantity(
        50e3, 'Hz', 'sampling of voltage, foot, position and force', (1e3, 1e6))
    period: float = quantity(0.01, 's', 'time per message of trace and of voltage', (1e-4, 1.0))


@dataclass(frozen=True)
class FrameIdParameters(Checked, resumable=True):
    """Frames of readings and commands."""

    stage: str = words('stage_base', 'frame of position, truth/position, command/position')
    runner: str = words('runner', 'frame of command/load')
    load_cell: str = words('load_cell', 'frame of force, truth/force')

    def check_together(self) -> None:
        """Refuse names that tf2 does not accept."""
        for name, frame_id in vars(self).items():
            if not frame_id.isprintable() or frame_id[:1] in ('', '/') or '#' in frame_id:
                hint = 'write one such as left/stage_base, without a slash in front, without #'
                raise WrongKind(f'frame_id.{name}', frame_id, 'a name of a frame', hint)


@dataclass(frozen=True)
class RecordParameters(Checked, resumable=True):
    """Recordings: their files, format and content."""

    on_start: bool = switch(False, 'record from the activation on')
    directory: str = words('runs', 'folder of the recordings')
    name: str = words('', 'file name; empty: date, time and namespace')
    format: str = choice(
        'file', ('file', 'bag'),
        'one MCAP file, or a directory with metadata.yaml as ros2 bag makes it')
    compression: str = choice('zstd', ('zstd', 'lz4', 'none'), 'compression of the chunks')
    chunk_size: int = count(1 << 20, 'size of a chunk', (1 << 10, 1 << 28), unit='B')
    queue_length: int = count(
        20_000, 'largest number of messages that wait for the disk; readings beyond are dropped',
        (10, 10_000_000))
    flush_period: float = quantity(
        1.0, 's', 'wall-clock time until a message is on the disk', (0.01, 60.0))
    split_size: int = count(
        0, 'uncompressed size of messages after which the run continues in a new file; 0: never',
        (0, 1 << 40), unit='B')
    split_duration: float = quantity(
        0.0, 's', 'simulated time after which the run continues in a new file; 0: never',
        (0.0, 1e9))
    keep_parts: int = count(
        0, 'number of latest parts of a run to keep; older parts are deleted; 0: keep all',
        (0, 1_000_000))
    trace: bool = switch(True, 'record the trace, which takes most of the size')
    experiment: str = words(
        '', 'CSV of an experiment, attached to each recording for a comparison')


@dataclass(frozen=True)
@with_fields(SENSOR_FAULTS, before='amplifier_off')
class FaultParameters(Checked):
    """Present faults; ``~/clear_faults`` ends them."""

    amplifier_off: bool = switch(
        False, 'amplifier without power: the piezo goes to the lowest voltage', live=True)
    dead_foot: int = count(
        0, 'foot that does not move, in the order of feet.count; 0: none', (0, FEET_MAX),
        live=True)
    runner_stuck: bool = switch(False, 'runner that does not move', live=True)
    missed_steps: float = quantity(
        0.0, '', 'share of the steps that the amplifier skips', (0.0, 1.0), live=True)
    command_delay: float = quantity(0.0, 's', 'delay of commands', (0.0, 10.0), live=True)
    schedule: str = words('', 'YAML file of faults and their times; empty: none')

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the present faults, in the order of declaration."""
        return tuple(
            name
            for name, field in self.__dataclass_fields__.items()
            if field.metadata['spec'].live and getattr(self, name) != field.default
        )
