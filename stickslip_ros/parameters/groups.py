"""
The one place where a parameter of the drive is declared, but for those of the contact.

Every number is SI. ``source`` says where a default comes from: a place in the paper
(Nguyen, Teidelt, Popov, Fatikow, Physical Mesomechanics 2014) or ``assumed``.

"""

from dataclasses import dataclass

from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters.fields import (
    ASSUMED,
    TABLE_1,
    Checked,
    choice,
    count,
    quantity,
    switch,
    words,
)


@dataclass(frozen=True)
class SimParameters(Checked):
    """How time runs: the step inside, the block outside, the pace."""

    dt: float = quantity(
        5e-6,
        's',
        1e-8,
        2e-5,
        ASSUMED,
        'longest step; shorter if the runner swings fast, in falls, on springs, for rival laws',
    )
    block: float = quantity(
        1e-3,
        's',
        1e-4,
        0.1,
        ASSUMED,
        'time per update: period of position and force, and of commands',
    )
    seed: int = count(1, '', 0, 2**31 - 1, ASSUMED, 'seed of every random number')
    real_time_factor: float = quantity(
        1.0,
        '',
        0.0,
        1000.0,
        ASSUMED,
        'simulated seconds per wall-clock second; 0 is as fast as possible',
    )


@dataclass(frozen=True)
class StandParameters(Checked):
    """The frame that holds the six hemispheres."""

    preload: float = quantity(
        0.5,
        'N',
        1e-3,
        100.0,
        'Section 2',
        'preload F_p of the external spring; 0.1 to 1 N in the paper',
    )
    preload_end: float = quantity(
        0.0, 'N', 0.0, 100.0, ASSUMED, 'preload to ramp to from the start on; 0 keeps the preload'
    )
    preload_rate: float = quantity(
        1.0, 'N/s', 1e-6, 1e6, ASSUMED, 'rate at which the preload changes when asked to'
    )
    preload_limit: float = quantity(
        2.0, 'N', 1e-3, 100.0, ASSUMED, 'largest preload that a command may ask for'
    )
    load_limit: float = quantity(
        10.0, 'N', 0.0, 1000.0, ASSUMED, 'largest external force that a command may ask for'
    )


@dataclass(frozen=True)
class RunnerParameters(Checked):
    """The moving body."""

    mass: float = quantity(3e-3, 'kg', 1e-6, 10.0, TABLE_1, 'mass m of the runner')
    damping: float = quantity(
        0.0, 'N s/m', 0.0, 1e4, ASSUMED, 'viscous damping c of the runner; the paper names none'
    )


@dataclass(frozen=True)
class AmplifierParameters(Checked):
    """The high-voltage amplifier between a command and the piezo."""

    voltage_min: float = quantity(0.0, 'V', -1000.0, 999.0, 'Section 2', 'lowest output')
    voltage_max: float = quantity(300.0, 'V', -999.0, 1000.0, 'Section 2', 'highest output')
    voltage_initial: float = quantity(
        0.0,
        'V',
        -1000.0,
        1000.0,
        ASSUMED,
        'output at the start, at which the contacts are relaxed',
    )
    slew_rate: float = quantity(
        150e6, 'V/s', 1e3, 1e12, 'Section 2', 'fastest change of the output'
    )
    frequency_max: float = quantity(
        20e3, 'Hz', 1.0, 1e6, ASSUMED, 'highest saw-tooth frequency that a command may ask for'
    )

    def check_together(self) -> None:
        """Refuse an empty voltage range and a start outside it."""
        if self.voltage_min >= self.voltage_max:
            limit = f'not below amplifier.voltage_max, {self.voltage_max:g} V'
            raise OutOfRange(
                'amplifier.voltage_min',
                self.voltage_min,
                'V',
                limit,
                'lower it or raise the other',
            )
        if not self.voltage_min <= self.voltage_initial <= self.voltage_max:
            limit = f'outside {self.voltage_min:g} to {self.voltage_max:g} V'
            raise OutOfRange(
                'amplifier.voltage_initial',
                self.voltage_initial,
                'V',
                limit,
                'move it inside amplifier.voltage_min and amplifier.voltage_max',
            )


@dataclass(frozen=True)
class ActuatorParameters(Checked):
    """The piezo with its hemisphere."""

    gain: float = quantity(
        160e-9 / 300.0,
        'm/V',
        1e-13,
        1e-6,
        'Section 2',
        'foot displacement per volt: 160 nm at 300 V',
    )


@dataclass(frozen=True)
class LoadCellParameters(Checked):
    """The load cell that the runner presses on."""

    contact: str = choice(
        'attached', ('attached', 'absent'), 'Eq. 20', 'runner on the load cell, or a free runner'
    )
    stiffness: float = quantity(
        1e5, 'N/m', 1.0, 1e9, ASSUMED, 'stiffness k of the load cell, Eq. 20; the paper gives none'
    )
    noise_density: float = quantity(
        1e-6, 'N/sqrt(Hz)', 0.0, 1.0, ASSUMED, 'one-sided density of the white noise'
    )
    resolution: float = quantity(1e-5, 'N', 0.0, 1.0, ASSUMED, 'quantisation; 0 is none')
    bandwidth: float = quantity(
        2e3, 'Hz', 0.0, 1e7, ASSUMED, 'first-order low-pass of the reading; 0 is none'
    )


@dataclass(frozen=True)
class InterferometerParameters(Checked):
    """The laser interferometer that looks at the runner."""

    noise_density: float = quantity(
        1e-12, 'm/sqrt(Hz)', 0.0, 1e-3, ASSUMED, 'one-sided density of the white noise'
    )
    resolution: float = quantity(1e-10, 'm', 0.0, 1e-3, ASSUMED, 'quantisation; 0 is none')
    bandwidth: float = quantity(
        2e4, 'Hz', 0.0, 1e7, ASSUMED, 'first-order low-pass of the reading; 0 is none'
    )


@dataclass(frozen=True)
class TraceParameters(Checked):
    """The oscilloscope: blocks of samples on one topic."""

    sample_rate: float = quantity(
        50e3, 'Hz', 1e3, 1e6, ASSUMED, 'sampling of voltage, foot, position and force'
    )
    period: float = quantity(
        0.01, 's', 1e-4, 1.0, ASSUMED, 'time per message of trace and of voltage'
    )


@dataclass(frozen=True)
class RecordParameters(Checked):
    """Where and how runs are kept."""

    on_start: bool = switch(False, ASSUMED, 'record from the activation on')
    directory: str = words('runs', ASSUMED, 'folder of the recordings')
    name: str = words('', ASSUMED, 'file name; empty names it after date and time')
    compression: str = choice(
        'zstd', ('zstd', 'lz4', 'none'), ASSUMED, 'compression of the chunks'
    )
    chunk_size: int = count(1 << 20, 'B', 1 << 10, 1 << 28, ASSUMED, 'size of a chunk')
    queue_length: int = count(
        20_000,
        '',
        10,
        10_000_000,
        ASSUMED,
        'messages that may wait for the disk before one is dropped',
    )
