"""
The one place where a parameter of the drive is declared.

Every number is SI. ``source`` says where a default comes from: a place in the paper
(Nguyen, Teidelt, Popov, Fatikow, Physical Mesomechanics 2014) or ``assumed``.

"""

import math
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

GIGA = 1e9
PAPER_RMS_HEIGHT = 1.1221e-6
PAPER_PREFACTOR = 4.4478e-4


@dataclass(frozen=True)
class SimParameters(Checked):
    """How time runs: the step inside, the block outside, the pace."""

    dt: float = quantity(
        5e-6,
        's',
        1e-8,
        2e-5,
        ASSUMED,
        'longest step; falls of the saw-tooth, springs and rival laws get finer ones',
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
class ContactParameters(Checked):
    """One ruby hemisphere on the runner."""

    profile: str = choice(
        'rough',
        ('rough', 'smooth', 'rough_line'),
        'Eq. 18',
        'equivalent rough profile, the bare sphere, or a random rough line (Eq. 14)',
    )
    law: str = choice(
        'mdr',
        ('mdr', 'coulomb', 'dahl', 'lugre', 'epm'),
        'Section 3',
        'contact model of the paper, or a rival friction law',
    )
    radius: float = quantity(0.5e-3, 'm', 1e-6, 1.0, TABLE_1, 'radius R of a hemisphere')
    hurst: float = quantity(0.7, '', 0.01, 1.0, 'Section 4', 'Hurst exponent H of the roughness')
    rms_height: float = quantity(
        PAPER_RMS_HEIGHT,
        'm',
        0.0,
        1e-3,
        'Section 4',
        'rms roughness h; used by a rough line, and where prefactor is 0',
    )
    prefactor: float = quantity(
        PAPER_PREFACTOR,
        'm^(1-H)',
        0.0,
        1.0,
        'Section 4',
        'Q_1D of Eq. 17; 0 takes it from rms_height',
    )
    line_length: float = quantity(
        1e-3, 'm', 1e-6, 1.0, ASSUMED, 'rough line: length; 2 R, the system length of Eq. 16'
    )
    line_points: int = count(
        1 << 17, '', 16, 1 << 21, ASSUMED, 'rough line: number of springs along it'
    )
    cutoff_lower: float = quantity(
        2.0 * math.pi / 1e-3,
        'rad/m',
        1e-2,
        1e10,
        ASSUMED,
        'rough line: least wave number; one wave in line_length',
    )
    cutoff_upper: float = quantity(
        1e8,
        'rad/m',
        1e-2,
        1e10,
        ASSUMED,
        'rough line: largest wave number; waves of 63 nm, eight springs long',
    )
    line_seed: int = count(
        1, '', 0, 2**31 - 1, ASSUMED, 'rough line: seed of the first of the six; the next add 1'
    )
    friction: float = quantity(0.3, '', 1e-3, 10.0, TABLE_1, 'friction coefficient mu')
    young_runner: float = quantity(
        210 * GIGA, 'Pa', 1e3, 1e13, TABLE_1, "Young's modulus E1 of the runner, steel X90CrMoV18"
    )
    young_sphere: float = quantity(
        370 * GIGA, 'Pa', 1e3, 1e13, TABLE_1, "Young's modulus E2 of a hemisphere, ruby"
    )
    poisson_runner: float = quantity(0.3, '', 0.0, 0.5, TABLE_1, "Poisson's ratio of the runner")
    poisson_sphere: float = quantity(0.3, '', 0.0, 0.5, TABLE_1, "Poisson's ratio of a hemisphere")

    def check_together(self) -> None:
        """Refuse a roughness that would have no effect."""
        if self.profile == 'rough_line':
            if self.prefactor not in {0.0, PAPER_PREFACTOR}:
                limit = 'without effect on a rough line, which is made from contact.rms_height'
                mend = 'leave it out, and set contact.rms_height'
                raise OutOfRange('contact.prefactor', self.prefactor, 'm^(1-H)', limit, mend)
        elif self.prefactor and self.rms_height != PAPER_RMS_HEIGHT:
            limit = f'without effect while contact.prefactor is {self.prefactor:g} m^(1-H)'
            raise OutOfRange(
                'contact.rms_height', self.rms_height, 'm', limit, 'set contact.prefactor to 0 too'
            )


@dataclass(frozen=True)
class FrictionLawParameters(Checked):
    """Constants of the rival friction laws; zeros are derived from the contact model."""

    bristle_stiffness: float = quantity(
        0.0, 'N/m', 0.0, 1e12, ASSUMED, 'sigma0; 0 takes the full-stick stiffness of all contacts'
    )
    bristle_damping: float = quantity(0.0, 'N s/m', 0.0, 1e6, ASSUMED, 'sigma1 of LuGre and EPM')
    viscous: float = quantity(0.0, 'N s/m', 0.0, 1e6, ASSUMED, 'sigma2, viscous friction')
    static_ratio: float = quantity(
        1.0, '', 1.0, 10.0, ASSUMED, 'static over Coulomb friction, Fs/Fc; Fc is mu F_n'
    )
    stribeck_velocity: float = quantity(1e-3, 'm/s', 1e-9, 10.0, ASSUMED, 'Stribeck velocity vs')
    breakaway_ratio: float = quantity(
        0.7, '', 0.0, 0.99, ASSUMED, 'z_ba/z_ss of EPM: bristles deflected less are elastic'
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
