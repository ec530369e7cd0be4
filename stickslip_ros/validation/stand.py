"""The contact of the paper: its numbers once more, and the package's answer to them."""

import math

import numpy as np

from stickslip_ros.contact.hemisphere import elasticity_of, profile_of
from stickslip_ros.contact.presliding import Presliding, presliding
from stickslip_ros.contact.profile import Array
from stickslip_ros.parameters import Parameters

# Table 1 and Section 4, written out again on purpose: a reference must not come from the code
# that it checks.
YOUNG_PA = (210e9, 370e9)
POISSON = 0.3
FRICTION = 0.3
RADIUS_M = 0.5e-3
HURST = 0.7
RMS_HEIGHT_M = 1.1221e-6
PREFACTOR = 4.4478e-4
"""Q_1D, m^(1-H)."""

E_STAR_PA = 1.0 / sum((1.0 - POISSON**2) / young for young in YOUNG_PA)
"""Eq. 5."""
G_STAR_PA = 1.0 / sum((2.0 - POISSON) * 2.0 * (1.0 + POISSON) / (4.0 * y) for y in YOUNG_PA)
"""Eq. 6."""
CATTANEO_MINDLIN = E_STAR_PA / G_STAR_PA
"""Eq. 23."""

PRELOADS_N = (0.1, 0.5, 1.0)
"""Preloads of Figs 2 and 7."""
LOWER_SHARE = math.sqrt(2.0) / 4.0
"""F_n2/F_p of Eq. 19."""

SMOOTH_TERMS = ((1.0 / RADIUS_M,), (2.0,))
ROUGH_TERMS = ((1.0 / RADIUS_M, PREFACTOR), (2.0, HURST))
"""Prefactors and exponents of Eq. 18."""
TERMS = {'smooth': SMOOTH_TERMS, 'rough': ROUGH_TERMS}


def lower_contact(profile: str, preload_n: float) -> Presliding:
    """Return a lower contact of the stand as the package solves it with its defaults."""
    parameters = Parameters().updated({'contact.profile': profile}).contact
    return presliding(
        profile_of(parameters),
        elasticity_of(parameters),
        parameters.friction,
        LOWER_SHARE * preload_n,
    )


def fractions(count: int) -> Array:
    """Return that many equal steps from above 0 to 1."""
    return np.linspace(0.0, 1.0, count + 1, dtype=np.float64)[1:]
