# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Sensors of the stand: their parameters, and a table with a row for each sensor.

Faults, topics, columns of traces, recordings, panel, tables, pictures and documentation follow
from the row. The module of the sensor's name in ``instrument/sensors`` computes its readings.

"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters.declaration import (
    Checked,
    choice,
    opposing,
    quantity,
    switch,
)

TRUTH = ('t', 'voltage', 'foot', 'position', 'force')
"""True values at each sample, in the order of their columns; a trace begins with these columns."""


@dataclass(frozen=True)
class Sensor:
    """A row of the table of sensors."""

    group: type[Checked]  # Parameters; at least noise_density, resolution and bandwidth
    sees: str  # Measured quantity: a column of TRUTH
    reading: str  # Name of its topic, and of its column in a trace
    unit: str  # SI unit of the reading; m: messages are points, N: wrenches
    frame: str  # Parameter of frame_id.* for its messages
    text: str  # Description of the sensor, for the documentation
    label: str  # Description of the reading
    largest: float  # Largest reading and largest offset, in its unit

    @cached_property
    def name(self) -> str:
        """Name of its parameters, its faults, and its module: ``load_cell``."""
        return self.group.group()

    @property
    def switch(self) -> str:
        """Name of the parameter that installs the sensor; empty if it is always installed."""
        return f'{self.name}.enabled' if hasattr(self.group, 'enabled') else ''

    @property
    def words(self) -> str:
        """Name of the reading with spaces."""
        return self.reading.replace('_', ' ')

    @property
    def quantity(self) -> str:
        """Name of the column of its readings in tables: ``position_m``."""
        return f'{self.reading}_{self.unit.lower()}'


# fmt: off


@dataclass(frozen=True)
class LoadCellParameters(Checked):
    """The load cell that the runner presses on."""

    contact: str = choice(
        'attached', ('attached', 'one_sided', 'absent'),
        'runner fixed to the load cell, pressing on it from one side, or free', 'Eq. 20')
    stiffness: float = opposing(
        1e5, 'N/m', 'stiffness k of the load cell, Eq. 20; the paper gives none', (1.0, 1e9))
    noise_density: float = quantity(
        1e-6, 'N/sqrt(Hz)', 'one-sided density of the white noise, added after the mechanics',
        (0.0, 1.0))
    resolution: float = quantity(1e-5, 'N', 'quantisation; 0: none', (0.0, 1.0))
    bandwidth: float = quantity(
        2e3, 'Hz', 'first-order low-pass of force and noise; 0: none', (0.0, 1e7))
    gap: float = quantity(
        0.0, 'm', 'one_sided: distance of the runner from the load cell', (0.0, 1.0))
    resonance: float = quantity(
        0.0, 'Hz', 'resonance of its moving mass on its stiffness; 0: no mass', (0.0, 1e5),
        least=1.0)
    damping_ratio: float = quantity(0.1, '', 'damping ratio of that resonance', (0.001, 10.0))
    restitution: float = quantity(
        0.0, '', 'one_sided with a mass: coefficient of restitution of an impact; 0: no bounce',
        (0.0, 1.0))
    hysteresis: float = quantity(
        0.0, '',
        'width of the loop over the whole range, at mid-range, as a share of the range; 0: none',
        (0.0, 0.4))
    drift: float = quantity(0.0, 'N/s', 'steady drift of the zero', (-1e3, 1e3))
    range: float = quantity(
        0.0, 'N',
        'signal of either sign at which the load cell saturates, before the tare; 0: no limit',
        (0.0, 1e6))

    def check_together(self) -> None:
        """Refuse a hysteresis without a range."""
        if self.hysteresis and not self.range:
            hint = 'set load_cell.range: the loop is a share of it'
            raise OutOfRange('load_cell.hysteresis', self.hysteresis, '', 'without a range', hint)


@dataclass(frozen=True)
class InterferometerParameters(Checked):
    """The laser interferometer that looks at the runner."""

    reference: str = choice(
        'table', ('table', 'frame'),
        'reference of the measurement: the table, or the frame of frame.mass')
    noise_density: float = quantity(
        1e-12, 'm/sqrt(Hz)', 'one-sided density of the white noise', (0.0, 1e-3))
    resolution: float = quantity(1e-10, 'm', 'quantisation; 0: none', (0.0, 1e-3))
    bandwidth: float = quantity(
        2e4, 'Hz', 'first-order low-pass of the reading; 0: none', (0.0, 1e7))
    sample_rate: float = quantity(
        0.0, 'Hz', 'sample rate; a reading is held until the next sample; 0: trace.sample_rate',
        (0.0, 1e7))
    latency: float = quantity(0.0, 's', 'delay of a reading', (0.0, 0.05))
    cyclic_error: float = quantity(
        0.0, 'm', 'amplitude of the error that repeats every half wavelength', (0.0, 1e-07))
    wavelength: float = quantity(
        6.328e-07, 'm', 'wavelength of the laser; helium-neon', (1e-07, 1e-05))
    drift: float = quantity(0.0, 'm/s', 'steady drift of the zero', (-0.001, 0.001))
    random_walk: float = quantity(
        0.0, 'm/sqrt(s)', 'drift of the zero as a random walk: rms after 1 s', (0.0, 0.001))
    velocity_max: float = quantity(
        0.0, 'm/s', 'velocity above which the beam is lost; 0: no limit', (0.0, 1e3))


@dataclass(frozen=True)
class CapacitiveProbeParameters(Checked):
    """The capacitive probe that looks at the feet."""

    enabled: bool = switch(
        False, 'install the probe, with topic foot_position and a column in the trace')
    noise_density: float = quantity(
        5e-12, 'm/sqrt(Hz)', 'one-sided density of the white noise', (0.0, 1e-3))
    resolution: float = quantity(1e-10, 'm', 'quantisation; 0: none', (0.0, 1e-3))
    bandwidth: float = quantity(
        1e4, 'Hz', 'first-order low-pass of the reading; 0: none', (0.0, 1e7))


SENSORS: tuple[Sensor, ...] = (
    Sensor(InterferometerParameters, 'position', 'position', 'm', 'stage',
           'interferometer', 'position of the runner', 1.0),
    Sensor(LoadCellParameters, 'force', 'force', 'N', 'load_cell',
           'load cell, positive when the runner presses', 'force on the load cell', 1e3),
    Sensor(CapacitiveProbeParameters, 'foot', 'foot_position', 'm', 'stage',
           'capacitive probe', 'position of the feet', 1.0),
)
# fmt: on
"""Every sensor, in the order of the columns of a trace; the row number seeds its noise."""


def _faults_of(sensor: Sensor) -> Mapping[str, tuple[type, Any]]:
    text = f'{sensor.words} reading: freeze holds it, dropout makes it NaN'
    bounds = (-sensor.largest, sensor.largest)
    offset = quantity(
        0.0, sensor.unit, f'offset of the {sensor.words} reading', bounds=bounds, live=True
    )
    condition = choice('none', ('none', 'freeze', 'dropout'), text, live=True)
    return {sensor.name: (str, condition), f'{sensor.name}_offset': (float, offset)}


SENSOR_FAULTS = {name: each for row in SENSORS for name, each in _faults_of(row).items()}
"""Types and declarations of the sensors' faults."""
