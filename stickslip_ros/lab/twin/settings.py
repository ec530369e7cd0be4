# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What is said of a twin beside its stand: its input, its windows, how often it is fitted anew."""

from dataclasses import dataclass

from stickslip_ros.parameters.declaration import Checked, quantity, words


@dataclass(frozen=True)
class TwinParameters(Checked):
    """Settings of a twin; ``TwinParameters()`` hears the trace of a drive of this package."""

    map: str = words(
        '',
        'which topic of the rig is what, as in "voltage_v=/rig/amplifier.data, '
        'position_m=/rig/encoder.point.x (nm)"; empty: the topic trace of a drive',
    )
    free: str = words(
        'contact.friction, runner.mass, runner.damping, actuator.gain',
        'parameters that are fitted anew',
    )
    period: float = quantity(
        10.0, 's', 'time of the rig from one fit to the next', bounds=(0.1, 86400.0)
    )
    window: float = quantity(
        0.2, 's', 'what is run and anchored at a time: five cycles or more', bounds=(0.02, 2.0)
    )
    lag: float = quantity(
        0.05, 's', 'how long messages that come late are waited for', bounds=(0.0, 10.0)
    )
    alarms_per_day: float = quantity(
        1.0, '', 'false alarms a day that are allowed, at most', bounds=(1e-3, 1e3)
    )
    drift: float = quantity(
        1e-7, 'm/s', 'what the zero of a sensor may drift by', bounds=(0.0, 1e-3)
    )
    prior: float = quantity(
        0.5,
        '',
        'relative standard error of the free parameters of the stand before anything was seen',
        bounds=(1e-3, 10.0),
    )

    @property
    def topics(self) -> dict[str, str]:
        """Topic, field and unit of each quantity, as ``compare --map`` takes them."""
        pairs = (each.partition('=') for each in self.map.split(',') if each.strip())
        return {name.strip(): text.strip() for name, _, text in pairs}

    @property
    def free_names(self) -> list[str]:
        """Names of the free parameters."""
        return [each.strip() for each in self.free.split(',') if each.strip()]
