"""Parameters of amplifier and piezo; all but gain and ranges are off in the ideal of the paper."""

from dataclasses import dataclass

from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters.fields import ASSUMED, Checked, Unchosen, count, quantity


@dataclass(frozen=True)
class AmplifierParameters(Checked):
    """The high-voltage amplifier between a command and the piezo."""

    voltage_min: float = quantity(0.0, 'V', -1e3, 999.0, 'Section 2', 'lowest output')
    voltage_max: float = quantity(300.0, 'V', -999.0, 1e3, 'Section 2', 'highest output')
    voltage_initial: float = quantity(
        Unchosen(0.0),
        'V',
        -1e3,
        1e3,
        ASSUMED,
        'output at the start, at which the contacts are relaxed',
    )
    slew_rate: float = quantity(
        150e6, 'V/s', 1e3, 1e12, 'Section 2', 'fastest change of the output'
    )
    frequency_max: float = quantity(
        20e3, 'Hz', 1.0, 1e6, ASSUMED, 'highest saw-tooth frequency that a command may ask for'
    )
    bandwidth: float = quantity(
        0.0, 'Hz', 0.0, 1e9, ASSUMED, 'first-order low-pass of the output; 0 is none'
    )
    resolution: float = quantity(
        0.0, 'V', 0.0, 10.0, ASSUMED, 'step of the digital-to-analogue converter; 0 is none'
    )
    current_max: float = quantity(
        0.0,
        'A',
        0.0,
        1e3,
        ASSUMED,
        'largest current into actuator.capacitance, which limits the slew rate; 0 is none',
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
    capacitance: float = quantity(
        5e-09,
        'F',
        1e-12,
        0.001,
        ASSUMED,
        'capacitance of all piezos together, which the amplifier loads',
    )
    hysteresis: float = quantity(
        0.0,
        '',
        0.0,
        0.4,
        ASSUMED,
        'opening of the loop of the whole voltage range, in the middle, per stroke; 0 is none',
    )
    plays: int = count(8, '', 1, 64, ASSUMED, 'play operators that make up the hysteresis')
    creep: float = quantity(
        0.0, '', 0.0, 0.2, ASSUMED, 'growth of a displacement per decade of time; 0 is none'
    )
    resonance: float = quantity(
        0.0,
        'Hz',
        0.0,
        1e7,
        ASSUMED,
        'first resonance of the piezo under its hemisphere; 0 is a massless piezo',
    )
    damping_ratio: float = quantity(
        0.05, '', 0.001, 10.0, ASSUMED, 'damping ratio of that resonance'
    )
    gain_tolerance: float = quantity(
        0.0,
        '',
        0.0,
        0.9,
        ASSUMED,
        'largest deviation of the gain of a foot from the mean; 0: six equal feet, moved as one',
    )
