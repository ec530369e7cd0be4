"""Parameters of the position controller, a node of its own: read once, at its start."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters.declaration import (
    Checked,
    declare,
    declared_by,
    find,
    quantity,
    switch,
)
from stickslip_ros.parameters.tree import spec_of


def known(name: str, text: str, **bounds: Any) -> Any:
    """Declare what the controller shall know of its drive, by its name there."""
    source = f"the drive's {name}"
    return declare(replace(spec_of(name), text=text, source=source, fixed=True, **bounds))


@dataclass(frozen=True)
class ControllerParameters(Checked):
    """What the position controller knows of its drive, and how it goes about its work."""

    gain: float = known('actuator.gain', 'displacement of the feet per volt')
    voltage_min: float = known('amplifier.voltage_min', 'lower end of the scan', maximum=1e3)
    voltage_max: float = known('amplifier.voltage_max', 'upper end of the scan', minimum=-1e3)
    step_amplitude: float = known('step.amplitude', 'voltage of a step')
    step_frequency: float = known('step.frequency', 'steps per second')
    share: float = quantity(
        0.05,
        '',
        'share of the error that each reading takes back while scanning',
        bounds=(1e-4, 1.0),
        fixed=True,
    )
    tolerance: float = quantity(
        2e-9,
        'm',
        'distance from the target that counts as in position',
        bounds=(1e-12, 1e-3),
        fixed=True,
    )
    response_time: float = quantity(
        0.015,
        's',
        'time from a command until its effect has settled; raise it for slow links',
        bounds=(0.0, 10.0),
        fixed=True,
    )
    lockstep: bool = switch(False, 'grant every block to a drive with sim.lockstep', fixed=True)
    block: float = known('sim.block', 'simulated time of a block in lockstep')
    target_frame: str = known('frame_id.stage', 'frame of ~/target')

    @classmethod
    def group(cls) -> str:
        """Name no group: these are the parameters of the controller's root."""
        return ''

    def check_together(self) -> None:
        """Refuse an empty voltage range."""
        if self.voltage_min >= self.voltage_max:
            limit = f'not below voltage_max, {self.voltage_max:g} V'
            hint = 'lower it or raise the other'
            raise OutOfRange('voltage_min', self.voltage_min, 'V', limit, hint)


def controller_parameters(given: Mapping[str, object]) -> ControllerParameters:
    """Return the parameters with values given at the start; refuses unknown names and values."""
    declared = declared_by(ControllerParameters)
    for name in given:
        find(declared, name, f'known are {", ".join(declared)}')
    return ControllerParameters(**given)  # type: ignore[arg-type]
