# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The sensors of the stand: their parameters, and one row per sensor in the table at the end.

Faults, topics, columns of traces, recordings, panel, tables, pictures and documentation follow
from the row. What the sensor computes stands in the module of its name in ``instrument/sensors``.

"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters.declaration import (
    Checked,
    choice,
    quantity,
    refuse_below_unless_zero,
    switch,
)

SLOWEST_CELL_HZ = 1.0
"""Lowest resonance of a load cell that has a mass."""
TRUTH = ('t', 'voltage', 'foot', 'position', 'force')
"""What the drive tells at each sample, in the order of its columns; a trace begins like it."""


@dataclass(frozen=True)
class Sensor:
    """A row of the table of sensors."""

    group: type[Checked]  # Its parameters, noise_density, resolution and bandwidth at least
    sees: str  # What it looks at: one of TRUTH
    reading: str  # Name of its topic, and of its column in a trace
    unit: str  # SI unit of the reading: m is a point, N is a wrench
    frame: str  # Which of frame_id.* its messages have
    text: str  # What it is, for the documentation
    label: str  # The reading in words
    largest: float  # No reading and no jump is larger, in its unit

    @cached_property
    def name(self) -> str:
        """Name of its parameters, its faults, and its module: ``load_cell``."""
        return self.group.group()

    @property
    def switch(self) -> str:
        """Parameter that says whether it is there; empty of a sensor that always is."""
        return f'{self.name}.enabled' if hasattr(self.group, 'enabled') else ''

    @property
    def words(self) -> str:
        """The reading in short."""
        return self.reading.replace('_', ' ')

    @property
    def quantity(self) -> str:
        """Column of its readings in tables: ``position_m``."""
        return f'{self.reading}_{self.unit.lower()}'


@dataclass(frozen=True)
class LoadCellParameters(Checked):
    """The load cell that the runner presses on."""

    contact: str = choice(
        'attached',
        ('attached', 'one_sided', 'absent'),
        'runner fixed to the load cell, pressing on it from one side, or free',
        source='Eq. 20',
    )
    stiffness: float = quantity(
        1e5, 'N/m', 'stiffness k of the load cell, Eq. 20; the paper gives none', bounds=(1.0, 1e9)
    )
    noise_density: float = quantity(
        1e-6,
        'N/sqrt(Hz)',
        'one-sided density of the white noise, after the mechanics',
        bounds=(0.0, 1.0),
    )
    resolution: float = quantity(1e-5, 'N', 'quantisation; 0 is none', bounds=(0.0, 1.0))
    bandwidth: float = quantity(
        2e3, 'Hz', 'first-order low-pass of force and noise; 0 is none', bounds=(0.0, 1e7)
    )
    gap: float = quantity(
        0.0, 'm', 'one_sided: distance of the runner from the load cell', bounds=(0.0, 1.0)
    )
    resonance: float = quantity(
        0.0,
        'Hz',
        'resonance of its moving mass on its stiffness; 0 is a cell without mass',
        bounds=(0.0, 1e5),
    )
    damping_ratio: float = quantity(
        0.1, '', 'damping ratio of that resonance', bounds=(0.001, 10.0)
    )
    restitution: float = quantity(
        0.0,
        '',
        'one_sided with a mass: velocity after an impact per velocity before; 0: no bounce',
        bounds=(0.0, 1.0),
    )
    hysteresis: float = quantity(
        0.0,
        '',
        'width of the loop over the whole range, in its middle, per range; 0 is none',
        bounds=(0.0, 0.4),
    )
    drift: float = quantity(0.0, 'N/s', 'steady drift of the zero', bounds=(-1e3, 1e3))
    range: float = quantity(
        0.0,
        'N',
        'signal at which the load cell saturates, both ways, before the tare; 0 is none',
        bounds=(0.0, 1e6),
    )

    def check_together(self) -> None:
        """Refuse a hysteresis without its range, and a moving mass that no runner could move."""
        refuse_below_unless_zero('load_cell.resonance', self.resonance, SLOWEST_CELL_HZ, 'Hz')
        if self.hysteresis and not self.range:
            hint = 'set load_cell.range: the loop is a share of it'
            raise OutOfRange('load_cell.hysteresis', self.hysteresis, '', 'without a range', hint)


@dataclass(frozen=True)
class InterferometerParameters(Checked):
    """The laser interferometer that looks at the runner."""

    reference: str = choice(
        'table',
        ('table', 'frame'),
        'what it measures against: the table, or the frame of frame.mass',
    )
    noise_density: float = quantity(
        1e-12, 'm/sqrt(Hz)', 'one-sided density of the white noise', bounds=(0.0, 1e-3)
    )
    resolution: float = quantity(1e-10, 'm', 'quantisation; 0 is none', bounds=(0.0, 1e-3))
    bandwidth: float = quantity(
        2e4, 'Hz', 'first-order low-pass of the reading; 0 is none', bounds=(0.0, 1e7)
    )
    sample_rate: float = quantity(
        0.0,
        'Hz',
        'rate of its own samples, held in between; 0 is trace.sample_rate',
        bounds=(0.0, 1e7),
    )
    latency: float = quantity(0.0, 's', 'age of a reading', bounds=(0.0, 0.05))
    cyclic_error: float = quantity(
        0.0, 'm', 'amplitude of the error that repeats every half wavelength', bounds=(0.0, 1e-07)
    )
    wavelength: float = quantity(
        6.328e-07, 'm', 'wavelength of the laser; helium-neon', bounds=(1e-07, 1e-05)
    )
    drift: float = quantity(0.0, 'm/s', 'steady drift of the zero', bounds=(-0.001, 0.001))
    random_walk: float = quantity(
        0.0, 'm/sqrt(s)', 'drift of the zero as a random walk: rms after 1 s', bounds=(0.0, 0.001)
    )
    velocity_max: float = quantity(
        0.0, 'm/s', 'velocity above which the beam is lost; 0 is none', bounds=(0.0, 1e3)
    )


@dataclass(frozen=True)
class CapacitiveProbeParameters(Checked):
    """The capacitive probe that looks at the feet."""

    enabled: bool = switch(
        False, 'whether it is there, with foot_position and its column in the trace'
    )
    noise_density: float = quantity(
        5e-12, 'm/sqrt(Hz)', 'one-sided density of the white noise', bounds=(0.0, 1e-3)
    )
    resolution: float = quantity(1e-10, 'm', 'quantisation; 0 is none', bounds=(0.0, 1e-3))
    bandwidth: float = quantity(
        1e4, 'Hz', 'first-order low-pass of the reading; 0 is none', bounds=(0.0, 1e7)
    )


# fmt: off
SENSORS: tuple[Sensor, ...] = (
    Sensor(InterferometerParameters, 'position', 'position', 'm', 'stage',
           'interferometer', 'position of the runner', 1.0),
    Sensor(LoadCellParameters, 'force', 'force', 'N', 'load_cell',
           'load cell, positive when the runner presses', 'force on the load cell', 1e3),
    Sensor(CapacitiveProbeParameters, 'foot', 'foot_position', 'm', 'stage',
           'capacitive probe', 'position of the feet', 1.0),
)
# fmt: on
"""Every sensor, in the order of the columns of a trace; its place numbers its random stream."""


def _faults_of(sensor: Sensor) -> Mapping[str, tuple[type, Any]]:
    stands_still = f'{sensor.words} reading that stands still, or is not a number'
    bounds = (-sensor.largest, sensor.largest)
    jump = quantity(
        0.0, sensor.unit, f'jump of the {sensor.words} reading', bounds=bounds, live=True
    )
    condition = choice('none', ('none', 'freeze', 'dropout'), stands_still, live=True)
    return {sensor.name: (str, condition), f'{sensor.name}_offset': (float, jump)}


SENSOR_FAULTS = {name: each for row in SENSORS for name, each in _faults_of(row).items()}
"""Types and declarations of the faults that every sensor has."""
