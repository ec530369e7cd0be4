"""Parameters of load cell and interferometer."""

from dataclasses import dataclass

from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters.fields import ASSUMED, Checked, choice, quantity


@dataclass(frozen=True)
class LoadCellParameters(Checked):
    """The load cell that the runner presses on."""

    contact: str = choice(
        'attached',
        ('attached', 'one_sided', 'absent'),
        'Eq. 20',
        'runner fixed to the load cell, pressing on it from one side, or free',
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
    gap: float = quantity(
        0.0, 'm', 0.0, 1.0, ASSUMED, 'one_sided: way of the runner until it touches the load cell'
    )
    resonance: float = quantity(
        0.0,
        'Hz',
        0.0,
        1e6,
        ASSUMED,
        'own resonance of the reading, in place of the low-pass; 0 is none',
    )
    damping_ratio: float = quantity(
        0.1, '', 0.001, 10.0, ASSUMED, 'damping ratio of that resonance'
    )
    hysteresis: float = quantity(
        0.0,
        '',
        0.0,
        0.4,
        ASSUMED,
        'opening of the loop of the whole range, in the middle, per range; 0 is none',
    )
    drift: float = quantity(0.0, 'N/s', -1e3, 1e3, ASSUMED, 'steady drift of the zero')
    range: float = quantity(
        0.0,
        'N',
        0.0,
        1e6,
        ASSUMED,
        'signal at which the load cell saturates, both ways, before the tare; 0 is none',
    )

    def check_together(self) -> None:
        """Refuse a hysteresis without the range that it belongs to."""
        if self.hysteresis and not self.range:
            mend = 'set load_cell.range: the loop is a share of it'
            raise OutOfRange('load_cell.hysteresis', self.hysteresis, '', 'without a range', mend)


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
    sample_rate: float = quantity(
        0.0,
        'Hz',
        0.0,
        1e7,
        ASSUMED,
        'rate of its own samples, held in between; 0 is trace.sample_rate',
    )
    latency: float = quantity(0.0, 's', 0.0, 0.05, ASSUMED, 'age of a reading')
    cyclic_error: float = quantity(
        0.0, 'm', 0.0, 1e-07, ASSUMED, 'amplitude of the error that repeats every half wavelength'
    )
    wavelength: float = quantity(
        6.328e-07, 'm', 1e-07, 1e-05, ASSUMED, 'wavelength of the laser; helium-neon'
    )
    drift: float = quantity(0.0, 'm/s', -0.001, 0.001, ASSUMED, 'steady drift of the zero')
    random_walk: float = quantity(
        0.0, 'm/sqrt(s)', 0.0, 0.001, ASSUMED, 'drift of the zero as a random walk: rms after 1 s'
    )
    velocity_max: float = quantity(
        0.0, 'm/s', 0.0, 1e3, ASSUMED, 'velocity above which the beam is lost; 0 is none'
    )
