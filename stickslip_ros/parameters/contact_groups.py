"""
The one place where a parameter of the contact is declared; ``groups`` has all others.

Every number is SI; ``source`` is a place in the paper, or ``assumed``.

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
)
from stickslip_ros.units import GIGA

PAPER_RMS_HEIGHT = 1.1221e-6
PAPER_PREFACTOR = 4.4478e-4


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
