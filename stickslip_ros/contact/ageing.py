"""
Kernel: friction that remembers how long a contact has rested, and feels how fast it slides.

The rate-and-state law of Dieterich (1979) and Ruina (1983), cut off at low speeds:

    mu = mu0 + a ln((s + v_c)/(v0 + v_c)) + b ln(v0 theta/D_c),  theta' = 1 - |m| theta/D_c

m is the mean slip velocity of all springs, so a contact ages while most of it sticks. s is the
speed of the springs that slip. It is that of the runner, v, but for a lag: a spring whose limit
changes has to be stretched or relaxed first. Springs that all slip and are equal have

    s' = (s + v_c) (|v| - s)/l,  l = a F_n/K

with the stiffness K of the sticking contact. One age and one slip speed serve a whole contact.

Each spring then sticks or slips at mu f_z as it stands. A limit that rises leaves stuck springs as
they are; one that falls lets the springs above it slip until they meet it, and what they lose is
booked as friction. Turning points know one coefficient only: such a contact stays on its springs.

"""

import math

from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import FLAG, FLOAT, Record, kind

AGEING = kind(
    on=FLAG,  # Whether the coefficient changes at all
    # a/mu0 and b/mu0: growth of the coefficient per e-fold of velocity and of age, per mu0
    rate_share=FLOAT,
    age_share=FLOAT,
    distance_m=FLOAT,  # D_c, slip that renews the contact
    velocity_m_per_s=FLOAT,  # v0, at which steady sliding has mu0
    cutoff_m_per_s=FLOAT,  # v_c, below which velocities are not told apart
    rest_s=FLOAT,  # Age at the start
)
"""How the friction coefficient of a contact changes."""


@kernel
def friction_ratio(ageing: Record, age_s: float, slip_m_per_s: float) -> float:
    """Return mu/mu0 of a contact of an age whose springs slip with a speed + v_c."""
    v0 = ageing.velocity_m_per_s
    ratio = 1.0 + ageing.rate_share * math.log(slip_m_per_s / (v0 + ageing.cutoff_m_per_s))
    return max(ratio + ageing.age_share * math.log(v0 * age_s / ageing.distance_m), 0.0)


@kernel
def slip_speed(
    ageing: Record, slip_m_per_s: float, way_m: float, lag_m: float, dt_s: float
) -> float:
    """Return the slip speed + v_c after a time: that of the runner, behind which it lags."""
    end = abs(way_m) / dt_s + ageing.cutoff_m_per_s
    left = math.exp(-end * dt_s / lag_m)
    return slip_m_per_s * end / (slip_m_per_s + (end - slip_m_per_s) * left)


@kernel
def older(ageing: Record, age_s: float, slip_m: float, dt_s: float) -> float:
    """Return the age after a time in which the contact slipped steadily: exact, hence stable."""
    share = abs(slip_m) / ageing.distance_m
    renewed = -math.expm1(-share)
    return age_s * (1.0 - renewed) + dt_s * (renewed / share if share > 0.0 else 1.0)
