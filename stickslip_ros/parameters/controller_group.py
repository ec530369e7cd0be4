"""Parameters of the position controller, a node of its own: read once, at its start."""

from collections.abc import Mapping
from dataclasses import dataclass

from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters.actuation_groups import ActuatorParameters, AmplifierParameters
from stickslip_ros.parameters.fields import ASSUMED, Checked, declared_by, find, quantity, switch
from stickslip_ros.parameters.motion_groups import StepParameters
from stickslip_ros.parameters.stand_groups import SimParameters

AMPLIFIER, STEP = AmplifierParameters(), StepParameters()


@dataclass(frozen=True)
class ControllerParameters(Checked):
    """What the position controller knows of its drive, and how it goes about its work."""

    gain: float = quantity(
        ActuatorParameters().gain,
        'm/V',
        1e-13,
        1e-6,
        "the drive's actuator.gain",
        'displacement of the feet per volt',
        fixed=True,
    )
    voltage_min: float = quantity(
        AMPLIFIER.voltage_min,
        'V',
        -1000.0,
        1000.0,
        "the drive's amplifier.voltage_min",
        'lower end of the scan',
        fixed=True,
    )
    voltage_max: float = quantity(
        AMPLIFIER.voltage_max,
        'V',
        -1000.0,
        1000.0,
        "the drive's amplifier.voltage_max",
        'upper end of the scan',
        fixed=True,
    )
    step_amplitude: float = quantity(
        STEP.amplitude,
        'V',
        1e-3,
        2000.0,
        "the drive's step.amplitude",
        'voltage of a step',
        fixed=True,
    )
    step_frequency: float = quantity(
        STEP.frequency,
        'Hz',
        1e-3,
        1e6,
        "the drive's step.frequency",
        'steps per second',
        fixed=True,
    )
    share: float = quantity(
        0.05,
        '',
        1e-4,
        1.0,
        ASSUMED,
        'share of the error that each reading takes back while scanning',
        fixed=True,
    )
    tolerance: float = quantity(
        2e-9,
        'm',
        1e-12,
        1e-3,
        ASSUMED,
        'distance from the target that counts as in position',
        fixed=True,
    )
    response_time: float = quantity(
        0.015,
        's',
        0.0,
        10.0,
        ASSUMED,
        'time from a command until its effect has settled; raise it for slow links',
        fixed=True,
    )
    lockstep: bool = switch(
        False, ASSUMED, 'grant every block to a drive with sim.lockstep', fixed=True
    )
    block: float = quantity(
        SimParameters().block,
        's',
        1e-4,
        0.1,
        "the drive's sim.block",
        'simulated time of a block in lockstep',
        fixed=True,
    )

    @classmethod
    def group(cls) -> str:
        """Name no group: these are the parameters of the controller's root."""
        return ''

    def check_together(self) -> None:
        """Refuse an empty voltage range."""
        if self.voltage_min >= self.voltage_max:
            limit = f'not below voltage_max, {self.voltage_max:g} V'
            mend = 'lower it or raise the other'
            raise OutOfRange('voltage_min', self.voltage_min, 'V', limit, mend)


def controller_parameters(given: Mapping[str, object]) -> ControllerParameters:
    """
    Return the parameters of the controller with some values that were given at its start.

    Raises
    ------
    UnknownName, WrongKind, OutOfRange
        If a name is not declared, or a value not allowed.

    """
    declared = declared_by(ControllerParameters)
    for name in given:
        find(declared, name, f'known are {", ".join(declared)}')
    return ControllerParameters(**given)  # type: ignore[arg-type]
