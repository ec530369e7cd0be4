# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Twin settings other than the stand's parameters: input, windows, fits."""

from dataclasses import dataclass

from stickslip_ros.parameters.declaration import Checked, quantity, words


@dataclass(frozen=True)
class TwinParameters(Checked):
    """Settings of a twin; the default reads the trace of a drive of this package."""

    map: str = words(
        '',
        'topics of the rig, as in "voltage_v=/rig/amplifier.data, '
        'position_m=/rig/encoder.point.x (nm)"; empty: the topic trace of a drive',
    )
    free: str = words(
        'contact.friction, runner.mass, runner.damping, actuator.gain', 'fitted parameters'
    )
    period: float = quantity(10.0, 's', 'time between two fits', bounds=(0.1, 86400.0))
    window: float = quantity(0.2, 's', 'window length: five cycles or more', bounds=(0.02, 2.0))
    lag: float = quantity(0.05, 's', 'waiting time for late messages', bounds=(0.0, 10.0))
    alarms_per_day: float = quantity(1.0, '', 'largest rate of false alarms', bounds=(1e-3, 1e3))
    drift: float = quantity(1e-7, 'm/s', 'largest drift of a sensor zero', bounds=(0.0, 1e-3))
    prior: float = quantity(0.5, '', 'prior relative error of parameters', bounds=(1e-3, 10.0))

    @property
    def topics(self) -> dict[str, str]:
        """Topic, field and unit of each quantity, in the form of ``compare --map``."""
        pairs = (each.partition('=') for each in self.map.split(',') if each.strip())
        return {name.strip(): text.strip() for name, _, text in pairs}

    @property
    def free_names(self) -> list[str]:
        return [each.strip() for each in self.free.split(',') if each.strip()]
